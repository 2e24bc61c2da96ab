"""quern check: every installed plugin passes, and a plugin broken on purpose fails in the property that it breaks."""
import re
import tempfile

import workshop
from workshop import PLUGINS, compile, quern, source


def failures(text):
    return set(re.findall(r"^  FAILED  ([^:]+):", text, re.M))


def check_installed():
    paths = sorted(path for path in PLUGINS.glob("*.so") if not re.search(r"\.v[34]\.so$", path.name))
    assert len(paths) > 10
    for path in paths:
        done = workshop.subprocess.run([workshop.QUERN, "check", path], capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, f"{path.stem}: exit status {done.returncode}\n{done.stdout}"
    print(f"{len(paths)} installed plugins pass")


LINEAR, VERLET = "dem/contact.linear.c", "dem/integrator.velocity_verlet.c"
FORCE = "b->force[0][i] += f.x;"
ADD = "static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }"


def around(statement):
    """The law's 2-D function with a statement behind the call."""
    return (ADD, ADD.replace("force(2, self, b); }", "force(2, self, b); " + statement + " }"))


# source, change, the property that must fail
BROKEN = [
    ("adds nothing", LINEAR, [(FORCE, "b->force[0][i] = f.x;")], "laws add up"),
    ("pushes one body only", LINEAR, [(FORCE, "b->force[0][i] += f.x + 1e-6;")], "action and reaction"),
    ("pulls at a distance", LINEAR, [(FORCE, "b->force[0][i] += f.x + 1e-6;")], "silence when apart"),
    ("gains energy", LINEAR, [("law->loss = 2 * quern_damping_ratio(law->restitution)",
                               "law->loss = -0.2 * quern_damping_ratio(law->restitution)")], "impacts gain no energy"),
    ("depends on n", LINEAR, [(FORCE, "b->force[0][i] += f.x * (1 + 1e-15 * (b->n > 100));")], "batches"),
    ("writes beyond cap", LINEAR, [around("b->force[0][b->cap] = 1;")], "guards"),
    ("writes its input", LINEAR, [around("((quern_real *)b->overlap)[0] = 0;")], "inputs"),
    ("writes itself", LINEAR, [around("((linear *)self)->loss += 1e-3;")], "self"),
    ("rounds down", LINEAR, [around("__builtin_ia32_ldmxcsr(0x3f80);")], "arithmetic"),
    ("keeps a static", LINEAR, [around("static int calls; if (b->n) b->force[0][0] += 1e-3 * (++calls % 7);")],
     "threads"),
    ("is silent", LINEAR, [("return QUERN_OK;", "return law->friction > 1 ? QUERN_E_PARAM : QUERN_OK;")], "parameters"),
    ("divides by zero", LINEAR, [(FORCE, "b->force[0][i] += f.x / (law.friction > 0 ? 1 : 0);")], "finite"),
    ("says nothing", LINEAR, [('"Normal spring k_n."', '""')], "parameter rows"),
    ("has no unit", LINEAR, [('"N/m", "Normal', '"newtonn/m", "Normal')], "parameter rows"),
    ("starts outside", LINEAR, [(".def = 0.5, .max = 10", ".def = 11, .max = 10")], "parameter rows"),
    ("uses nobody's field", LINEAR, [('.field = "contact.slip"', '.field = "slip"')], "uses"),
    ("does not turn", "mpm_hypo/material.elastic.c", [
        ("const tensor l = TENSOR_AT(b->gradient, i, dim);",
         "tensor l = TENSOR_AT(b->gradient, i, dim); l.xy = l.yx = 0.5 * (l.xy + l.yx);")], "rotation"),
    ("never yields", "mpm_hypo/material.mu_i.c", [("symmetric_scale_shift(dim, flow / tau, s, -p), trial)",
                                                   "symmetric_scale_shift(dim, 1, s, -p), trial)")], "yield"),
    ("forgets", "mpm_hyper/material.drucker_prager.c", [
        ("SYMMETRIC_PUT(deviator, i, now, dim);\n\t\tstrain[i] = e;", "strain[i] = e;")], "assign and read back"),
    ("sums to more", "mpm/shape.gimp.c", [("w0[i] = folded ? 1 - hat : a0;", "w0[i] = folded ? 1 - hat : 1.001 * a0;")],
     "partition of unity"),
    ("ignores walls", "mpm/shape.gimp.c", [("folded = at_low | at_high", "folded = at_low & at_high")],
     "support and walls"),
    ("slows down", "transfers/transfer.picflip.c", [("(1 - keep) * pic[i]", "0.99 * (1 - keep) * pic[i]")],
     "uniform motion"),
    ("loses momentum", "transfers/transfer.mixed.c", [("quern_vec_add(quern_vec_sub(flip, r), back)",
                                                       "quern_vec_sub(flip, r)")], "momentum"),
    ("drives nodes", "hybrid/coupling.lumped.c", [("exchange(job);", "exchange(job); job->velocity[0][0] += 1e-3;")],
     "momentum node by node"),
    ("kicks", VERLET, [("nv[i] = v[i] + (a[i] == a[i] ? 0.5 * dt * (now - a[i]) : dt * now);\n\t\t\tnx",
                        "nv[i] = v[i] + (a[i] == a[i] ? 0.6 * dt * (now - a[i]) : 1.1 * dt * now);\n\t\t\tnx")],
     "constant force"),
    ("hides its damping", "dem/integrator.damped.c", [(".damps = 1, ", "")], "constant force"),
    ("damps upwards", "dem/integrator.damped.c", [("a * v > 0 ? -local : local", "a * v > 0 ? local : -local")],
     "a spring"),
    ("overlaps", "packers/packer.random.c", [(" && job->free(job, spot)", "")], "no overlap"),
    ("goes on", "packers/packer.random.c", [("&& job->place(job, &spot))",
                                                  "&& (job->place(job, &spot) || job->place(job, &spot)))")],
     "enough is enough"),
    ("misses pairs", "dem/neighbours.cells.c", [("if (c + 1 < count) out[n++] = c + 1;", "")],
     "the same pairs as by brute force"),
    ("bends normals", "bodies/body.plane.c", [("/ length;", "/ (1.001 * length);")], "unit normals"),
]


def broken_id(path):
    return path.rsplit("/", 1)[1][:-2]


def check_broken():
    for what, path, changes, wanted in BROKEN:
        with tempfile.TemporaryDirectory() as folder:
            object_file = compile(source(path, *changes), broken_id(path), folder, beside=path.rsplit("/", 1)[0])
            done = workshop.subprocess.run([workshop.QUERN, "check", object_file], capture_output=True, text=True)
            found = failures(done.stdout)
            assert wanted in found, f"a plugin that {what} passes '{wanted}'; it fails in {sorted(found)}"
            assert done.returncode == 2, f"a plugin that {what} ends with exit status {done.returncode}"
    print(f"{len(BROKEN)} plugins broken on purpose fail where they should")


def check_crashes():
    ends = [("if (b->n == 7) *(volatile int *)0 = 1;", "contact.linear: crashed (SIGSEGV) in linear.force, 2-D, while n = 7"),
            ("if (b->n == 7) __builtin_trap();", "contact.linear: crashed (SIGILL) in linear.force, 2-D, while n = 7"),
            ("while (b->n == 7) __asm__ volatile(\"\");",
             "contact.linear: did not come back within 2 s from linear.force, 2-D, while n = 7")]
    for statement, sentence in ends:
        with tempfile.TemporaryDirectory() as folder:
            object_file = compile(source(LINEAR, around(statement)), "contact.linear", folder)
            text = quern("check", object_file, "--seconds", 2, status=2)
            assert sentence in text, f"'{sentence}' is not in\n{text}"
            assert "properties FAILED" in text
    print("crashes and endless loops are one sentence each, and the other tests go on")


def check_options():
    elastic = PLUGINS / "material.elastic.so"
    assert "all ok" in quern("check", elastic, "--set", "poisson=0.2", status=0)
    assert "poisson is 0.7, must be" in quern("check", elastic, "--set", "poisson=0.7", status=2)
    assert "a plugin is missing" in quern("check", status=1)
    assert "No such file" in quern("check", "nowhere.so", status=2)
    print("options of check")


if __name__ == "__main__":
    check_installed()
    check_broken()
    check_crashes()
    check_options()
