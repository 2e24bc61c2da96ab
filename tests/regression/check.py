# SPDX-License-Identifier: MIT
"""quern check: every installed plugin passes, and every property that it states is seen to fail on a plugin that breaks it
on purpose."""
import concurrent.futures
import re
import tempfile

import workshop
from workshop import PLUGINS, compile, quern, source


def failures(text):
    return set(re.findall(r"^  FAILED  ([^:]+):", text, re.M))


def at_once(function, items):
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        return list(pool.map(function, items))


def properties_of(path, *options):
    words = [workshop.QUERN, "check", path, *options]
    done = workshop.subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"{path}: exit status {done.returncode}\n{done.stdout}"
    kind = str(path).rsplit("/", 1)[1].split(".")[0]
    return {(kind, name) for name in re.findall(r"^  ok +([^:]+):", done.stdout, re.M)}


def check_installed():
    """All of them pass; returns what they are said to keep, as (kind, property)."""
    paths = sorted(path for path in PLUGINS.glob("*.so") if not re.search(r"\.v[34]\.so$", path.name))
    assert len(paths) > 10
    stated = set().union(*at_once(properties_of, paths))
    solvers = [path for path in paths if path.name.startswith("solver.")]
    stated |= set().union(*at_once(lambda path: properties_of(path, "--scene", workshop.SOURCE / "configs/column.yaml",
                                                              "--steps", "12"), solvers))
    print(f"{len(paths)} installed plugins pass, {len(solvers)} solvers among them in a scene")
    return stated


def check_templates():
    """Those that `quern new` writes pass too; an observer that maps is among them alone."""
    stated = set()
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("observer", "solver"):
            stated |= properties_of(compile(source(kind), f"{kind}.mine", folder))
    return stated


AVERAGED = "mpm/strain.averaged.c"
LINEAR, ROLLS, VERLET = "dem/contact.linear.c", "dem/contact.rolling.c", "dem/integrator.velocity_verlet.c"
FORCE = "b->force[0][i] += f.x;"
ADD = "static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }"


def around(statement):
    """The law's 2-D function with a statement behind the call."""
    return (ADD, ADD.replace("force(2, self, b); }", "force(2, self, b); " + statement + " }"))


INIT, UNISTD = "(void)setup, (void)err;", ("#include <quern/contact.h>", "#include <quern/contact.h>\n#include <unistd.h>")
PAIR = "if (n < cap) out[n] = (quern_pair) { (int32_t)i, (int32_t)k };\n\t\t\t\tn++;"
NO_FEATURES = "static uint32_t none(const void *self, const quern_pose *pose, const quern_real x[3], quern_real reach,\n" \
              "\tuint32_t cap, int32_t *feature) { (void)self, (void)pose, (void)x, (void)reach, (void)cap, (void)feature; " \
              "return 0; }\n"
RUB = "static void rub(const void *self, uint32_t dim, quern_real *slow, quern_real *fast, quern_real *number,\n" \
      "\tquern_real *density) { (void)self, (void)dim; *slow = 0.5, *fast = 0.4, *number = 0.3, *density = 1000; }\n"
FIXED = '{ .field = "grain.fixed", .unit = "1", .access = QUERN_READ, .shape = QUERN_SCALAR }, QUERN_END_USES'

# a plugin's source or the template of a kind, change, the property that must fail
BROKEN = [
    ("adds nothing", LINEAR, [(FORCE, "b->force[0][i] = f.x;")], "laws add up"),
    ("pushes one body only", LINEAR, [(FORCE, "b->force[0][i] += f.x + 1e-6;")], "action and reaction"),
    ("pulls at a distance", LINEAR, [(FORCE, "b->force[0][i] += f.x + 1e-6;")], "silence when apart"),
    ("gains energy", LINEAR, [("law->loss = 2 * quern_damping_ratio(law->restitution)",
                               "law->loss = -0.2 * quern_damping_ratio(law->restitution)")], "impacts gain no energy"),
    ("depends on n", LINEAR, [(FORCE, "b->force[0][i] += f.x * (1 + 1e-15 * (b->n > 100));")], "batches"),
    ("writes beyond cap", LINEAR, [around("b->force[0][b->cap] = 1;")], "guards"),
    ("writes beyond n", LINEAR, [around("if (b->n < b->cap) b->force[0][b->n] += 1;")], "guards"),
    ("makes more than n", "shape", [("value[2][i] = 0;", "value[2][i] = 0; if (b->n < b->cap) value[2][b->n] = 0;")], "guards"),
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
    ("has two units for one field", LINEAR, [('.unit = "rad/s"', '.unit = "m/s"')], "uses"),
    ("says nothing of itself", "contact", [("A spring and a dashpot with viscous friction.", "")], "identity"),
    ("cannot be set up", LINEAR, [(INIT, 'return setup->host->fail(err, QUERN_E_PARAM, NULL, "no");')], "set-up"),
    ("moves", LINEAR, [(INIT, INIT + ' if (chdir("/")) return QUERN_E_IO;'), UNISTD], "environment"),
    ("lets exceptions strike", LINEAR, [(INIT, INIT + " __builtin_ia32_ldmxcsr(0x1d80);")], "environment"),
    ("has no period", "contact", [("3.141592653589793 * __builtin_sqrt", "0 * __builtin_sqrt")],
     "period, stiffness, reach"),
    ("is driven by its dashpot", "contact", [("= quern_vec_axpy(-spring, n, f);",
                                              "= quern_vec_scale(-1, quern_vec_axpy(-spring, n, f));")],
     "dashpots only take"),
    ("stores too much", "contact", [("b->stored[i] += 0.5 * spring", "b->stored[i] += 2 * spring")], "books of energy"),
    ("keeps what it has stored", "contact", [("b->stored[i] +=", "b->stored[i] += 1e-6 +")], "silence when apart"),
    ("has a stiffness of its own", "contact", [("? p.stiffness * overlap[i]", "? (p.stiffness + 100) * overlap[i]")],
     "homogeneous in (stiffness, mass)"),
    ("turns the second otherwise", ROLLS, [("-= radius[i] * f;", "-= radius[i] * (f < 0 ? 1.001 * f : f);")],
     "action and reaction"),
    ("drives what rolls", ROLLS, [("-= radius[i] * f;", "+= radius[i] * f;")], "impacts gain no energy"),
    ("rolls against nothing", ROLLS, [("pushed > 0 ? pushed : 0), &spring", "pushed > 0 ? pushed + 1e-3 : 1e-3), &spring")],
     "nothing without a force"),
    ("has a cone of its own", ROLLS, [("pushed > 0 ? pushed : 0), &spring", "pushed > 0 ? pushed / (1 + pushed) : 0), &spring")],
     "homogeneous in (stiffness, mass)"),
    ("writes its couple over others", ROLLS, [("-= radius[i] * f;", "= -radius[i] * f;")], "laws add up"),
    ("is driven by what damps rolling", ROLLS, [("-= radius[i] * (f - k * now);", "+= radius[i] * (f - k * now);")],
     "dashpots only take"),
    ("stores what it rubs", ROLLS, [("sheared[i] += 0.5 * k * now * now;", "sheared[i] += 50 * k * now * now;")],
     "books of energy"),
    ("drives what twists", ROLLS, [('normal force; 0: twists freely; 3-D.", .max = 10)', 'normal force; 0: twists freely; 3-D.", .def = 0.5, .max = 10)'),
                                   ("axpy(-r * all, n, couple)", "axpy(r * all, n, couple)"),
                                   ('(setup->dim == 2 && law->twisting_friction > 0)', "(0)")], "impacts gain no energy"),
    ("is driven by what turns strain", "mpm_hypo/material.elastic.c", [
        ("const symmetric stress = elastic_trial(dim, old, l, dt, shear, lambda);",
         "symmetric stress = elastic_trial(dim, old, l, dt, shear, lambda); const quern_real odd = 0.2 * shear * dt; "
         "stress.xx += odd * (l.xy + l.yx); stress.yy -= odd * (l.xy + l.yx); stress.xy -= odd * (l.xx - l.yy);")],
     "work is stored or lost"),
    ("does not turn", "mpm_hypo/material.elastic.c", [
        ("const tensor l = TENSOR_AT(b->gradient, i, dim);",
         "tensor l = TENSOR_AT(b->gradient, i, dim); l.xy = l.yx = 0.5 * (l.xy + l.yx);")], "rotation"),
    ("takes a component for another", "mpm_hypo/material.elastic.c", [
        ("const tensor l = TENSOR_AT(b->gradient, i, dim);",
         "tensor l = TENSOR_AT(b->gradient, i, dim); const quern_real xz = l.xz, zx = l.zx; l.xz = l.yz; l.zx = l.zy; l.yz = xz; l.zy = zx;")],
     "any axes"),
    ("never yields", "mpm_hypo/material.mu_i.c", [("symmetric_scale_shift(dim, grown * (flow / tau), s, -(grown * p)), trial)",
                                                   "symmetric_scale_shift(dim, 1, s, -p), trial)")], "yield"),
    ("forgets", "mpm_hyper/material.drucker_prager.c", [
        ("\t\tstrain[i] = e;\n", "")], "assign and read back"),
    ("sums to more", "mpm/shape.gimp.c", [("w0[i] = folded ? 1 - hat : a0;", "w0[i] = folded ? 1 - hat : 1.001 * a0;")],
     "partition of unity"),
    ("ignores walls", "mpm/shape.gimp.c", [("folded = at_low | at_high", "folded = at_low & at_high")],
     "support and walls"),
    ("slows down", "transfers/transfer.picflip.c", [("(1 - keep) * pic[i]", "0.99 * (1 - keep) * pic[i]")],
     "uniform motion"),
    ("loses momentum", "transfers/transfer.mixed.c", [("quern_vec_add(quern_vec_sub(flip, r), back)",
                                                       "quern_vec_sub(flip, r)")], "momentum"),
    ("bends lines", "transfers/transfer.apic.c", [("fit[i] * shift[i] : fit[i]", "0.99 * fit[i] * shift[i] : fit[i]")],
     "linear motion"),
    ("adds a little", "transfers/transfer.xpic.c", [("pic[i] - echo[i]", "pic[i] - echo[i] + 1e-9 * v[i]")], "momentum"),
    ("swells", AVERAGED, [("part * (mean[i] - own)", "part * (1.001 * mean[i] - own)")], "one gradient for all stays"),
    ("forgets a part", AVERAGED, [("part * (mean[i] - own)", "part * (0.5 * mean[i] - own)")], "volume of cells"),
    ("overshoots", AVERAGED, [("part * (mean[i] - own)", "3 * part * (mean[i] - own)")], "gradients do not grow"),
    ("drives nodes", "hybrid/coupling.lumped.c", [("exchange(job);", "exchange(job); job->velocity[0][0] += 1e-3;")],
     "momentum node by node"),
    ("kicks", VERLET, [("nv[i] = v[i] + (a[i] == a[i] ? 0.5 * dt * now : dt * now);\n\t\t\tnx",
                        "nv[i] = v[i] + (a[i] == a[i] ? 0.6 * dt * now : 1.1 * dt * now);\n\t\t\tnx")],
     "constant force"),
    ("leaves another velocity than it moves by", VERLET, [
        ("nv[i] = middle;", "nv[i] = middle + (a[i] == a[i] ? half * a[i] : 0);"),
        ("? 0.5 * dt * now : dt * now);\n\t\t\tnx", "? 0.5 * dt * (now - a[i]) : dt * now);\n\t\t\tnx")],
     "moved by the velocity"),
    ("hides its damping", "dem/integrator.damped.c", [(".damps = 1, ", "")], "constant force"),
    ("is late by more than a step", VERLET, [(".lag = 0.5", ".lag = 1.5")], "late by"),
    ("is late by what it does not predict", "integrator", [(".close =", ".lag = 0.5, .close =")], "late by"),
    ("damps upwards", "dem/integrator.damped.c", [("a * v > 0 ? -local : local", "a * v > 0 ? local : -local")],
     "a spring"),
    ("overlaps", "packers/packer.random.c", [(" && job->free(job, spot)", "")], "no overlap"),
    ("goes on", "packers/packer.random.c", [("&& job->place(job, &spot))",
                                                  "&& (job->place(job, &spot) || job->place(job, &spot)))")],
     "enough is enough"),
    ("makes holes' grains large", "packers/packer.random.c", [
        ("*spot = (quern_spot) { .radius = job->radius(job) };",
         "*spot = (quern_spot) { .radius = (job->growth ? 1.1 : 1) * job->radius(job) };"),
        ("static const quern_packer_ops ops = { .size", "static const quern_packer_ops ops = { .shrinks = 1, .size")], "smaller ones"),
    ("lets grains meet", "packers/packer.random.c", [
        ("static const quern_packer_ops ops = { .size", "static quern_status relax(const void *self, quern_relax_job *job) {\n"
         "\t(void)self;\n\tif (job->n > 1) job->spot[1].x[0] = job->spot[0].x[0] + 0.98 * (job->full[0] + job->full[1]), "
         "job->spot[1].x[1] = job->spot[0].x[1], job->spot[1].x[2] = job->spot[0].x[2];\n\treturn QUERN_OK;\n}\n"
         "static const quern_packer_ops ops = { .relax = relax, .size")], "relaxes"),
    ("misses pairs", "dem/neighbours.cells.c", [("if (c + 1 < count) out[n++] = c + 1;", "")],
     "the same pairs as by brute force"),
    ("looks up alone", "dem/neighbours.hgrid.c", [("for (uint32_t h = 0; h < own; h++) look(s, h, i, dim, SMALLER);", "")],
     "the same pairs as by brute force"),
    ("looks from both", "dem/neighbours.hgrid.c", [("of == LARGER || !inside", "of != SAME || !inside")],
     "each once, in its block"),
    ("bends normals", "bodies/body.plane.c", [("/ length;", "/ (1.001 * length);")], "unit normals"),
    ("finds pairs twice", "neighbours", [(PAIR, f"for (int t = 0; t < 2; t++) {{ {PAIR} }}")],
     "each once, in its block"),
    ("counts what fits", "neighbours", [("\treturn n;\n", "\treturn n < cap ? n : cap;\n")], "room"),
    ("forgets now and then", "neighbours", [("\treturn n;\n", "\tstatic int calls; return n - (++calls % 3 == 0);\n")],
     "threads"),
    ("drifts", "integrator", [("x[i] + dt * nv[i]", "x[i] + 1.001 * dt * nv[i]")], "no force"),
    ("slows down a spring", "integrator", [("->drag * dt)", "->drag * dt + 5 * dt)")], "a spring"),
    ("stretches gaps", "body", [("= side * (distance - size)", "= 1.01 * side * (distance - size)")],
     "gap along the normal"),
    ("enlarges grains", "body", [("- radius[i]", "- 1.1 * radius[i]")], "gap and radius"),
    ("is larger than it says", "body", [(": p->centre[k] - p->radius", ": p->centre[k]")], "bounds"),
    ("does not move", "body", [("quern_vec_add(drift, quern_vec_cross(spin, arm))", "quern_vec_cross(spin, arm)")],
     "moved pose"),
    ("does not turn", "body", [("quern_vec_add(drift, quern_vec_cross(spin, arm))", "drift")], "turned pose"),
    ("hides a feature", "body", [(".bounds = bounds", ".bounds = bounds, .features = none"),
                                 ("static const quern_body_ops", NO_FEATURES + "static const quern_body_ops")], "features"),
    ("is denser than it says", "material", [("*density = m->density;", "*density = 1.1 * m->density;")],
     "moduli and density"),
    ("rubs less when fast", "material", [(".moduli = moduli", ".moduli = moduli, .friction = rub"),
                                         ("static const quern_material_ops", RUB + "static const quern_material_ops")],
     "friction at walls"),
    ("relaxes", "material", [("quern_max(-trace / dim, 0)", "0.9 * quern_max(-trace / dim, 0)")], "assign twice"),
    ("bursts", "material", [("open ? 0 :", "open ? 0 : b->density[i] > 1.05 * m->density ? 0.0 / 0.0 :")],
     "large gradients"),
    ("bends lines", "shape", [("= 1 - (t - cell);", "= 1 - (t - cell) * (t - cell);"),
                              ("= t - cell;", "= (t - cell) * (t - cell);")], "linear completeness"),
    ("leans", "shape", [("slope[0][i] = -inverse;", "slope[0][i] = -1.1 * inverse;")], "slopes sum to zero"),
    ("jumps", "shape", [("= 1 - (t - cell);", "= t - cell < 0.5 ? 1 : 0;"), ("= t - cell;", "= t - cell < 0.5 ? 0 : 1;")],
     "no jumps"),
    ("has large walls", "shape", [("*wall = 0.5;", "*wall = 0.6;")], "shares and stiffness"),
    ("pulls apart what is together", "coupling", [("* (other[i] - v[i]) : 0;", "* (other[i] - v[i]) + 1e-3 : 0;")],
     "equal velocities stay"),
    ("overdoes it", "coupling", [("both ? share * (", "both ? 2.5 * share * (")], "no energy gained"),
    ("marks the end of numbers", "oracle", [("height - up[i];", "(height - up[i]) / (up[i] > 0.5 ? 0 : 1);")],
     "levels are numbers"),
    ("wishes for more", "oracle", [(": QUERN_CONTINUUM;", ": 7;")], "wishes are zones"),
    ("asks beyond its reach", "oracle", [("((const layer *)self)->depth;", "0.5 * ((const layer *)self)->depth;")],
     "nothing changes beyond its reach"),
    ("shares more than there is", "oracles/oracle.fixed.c", [
        ("at.zone == QUERN_CONTINUUM && at.to_discrete < p->ramp;", "true;"), ("->ramp > 0 ? QUERN_ORACLE_WEIGHT : 0", "->ramp >= 0"
         " ? QUERN_ORACLE_WEIGHT : 0"), ("0.5 - 0.5 * quern_cos", "1.5 + 0 * quern_cos")], "shares are shares"),
    ("leaves the region", "packer", [("!job->inside(job, spot.x) || ", "")], "inside the region"),
    ("makes grains small", "packer", [(".radius = job->radius(job)", ".radius = 0.9 * job->radius(job)")],
     "the radius that waits"),
    ("remembers", "packer", [("const quern_real pitch = 2", "static int calls; const quern_real pitch = (2 + 1e-6 * ++calls)")],
     "the same again"),
    ("does nothing", "packer", [("\tfor (uint64_t k = 0;", "\tif (pitch > 0) return;\n\tfor (uint64_t k = 0;")],
     "places grains"),
    ("writes itself", "packer", [("const quern_real pitch", "((lattice *)(uintptr_t)self)->gap *= 1.1; const quern_real pitch")],
     "self"),
    ("explains no output", "observer", [("Largest speed.", "")], "outputs"),
    ("counts leaves", "observer", [("partial[MOVING] = 0;", "partial[MOVING] = 1;")], "partition"),
    ("counts calls", "observer", [("partial[MOVING] = 0;", "partial[MOVING] = 0; static int calls; partial[TOP] = ++calls;")],
     "threads"),
    ("comes ten thousand times", "observer", [(".map = map", ".map = map, .repeat = often"),
                                             ("static const quern_observer_ops", "static uint32_t often(const void *self) { return self ? 10000 : 1; }\nstatic const quern_observer_ops")],
     "repeat"),
    ("has one output more", "observer", [("partial[MOVING] = 0;", "partial[MOVING] = partial[3] = 0;")], "guards"),
    ("has no end of motion", "observer", [(">= threshold ? 1 : 0", ">= threshold ? 1 / (threshold - threshold) : 0")],
     "finite"),
    ("takes an index for a number", "observer", [("QUERN_VECTOR }, QUERN_END_USES", "QUERN_VECTOR }, " + FIXED)], "uses"),
    ("explains no set", "solver", [("Discs or spheres.", "")], "sets"),
    ("explains no slot", "solver", [("#include <quern/solver.h>", "#include <quern/contact.h>\n#include <quern/solver.h>"),
                                    ("slots[] = { {", "slots[] = { { .name = \"law\", .kind = &quern_contact_kind, .list = 1, "
                                     ".stage = { \"mine.move\" } }, {")], "slots"),
    ("explains no stage", "solver", [("Places the grains.", "")], "stages"),
]


FLIGHT = """
name: a flight
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.1, 0.1]}
time: {end: 1}
grains: {solver: mine, count: 3000, radius: 1 mm}
"""
GRAVITY, MOVED = "s->dt * s->gravity[k]", "(m.n + CHUNK - 1) / CHUNK, move_chunk, &m);"
UNISTD_IN_SOLVER = ("#include <stdio.h>", "#include <stdio.h>\n#include <unistd.h>")


def once_moved(statement):
    return [(MOVED, f"{MOVED} {statement}"), UNISTD_IN_SOLVER]


# what a solver does, change of its template, the property that must fail in a scene
BROKEN_SOLVERS = [
    ("looks at the number of threads", [(GRAVITY, f"{GRAVITY} * (1 + 1e-12 * s->host->workers(s->run))")], "threads"),
    ("looks at the size of batches", [(GRAVITY, f"{GRAVITY} * (1 + 1e-12 * s->batch)")], "batches"),
    ("loses mass", [("= n * mass;", "= n * mass * (1 - 1e-6 * (quern_real)s->step);")], "mass"),
    ("loses grains", once_moved('if (s->step == 5) return s->host->remap(s->run, "grain", 0, NULL, 0, NULL);'), "mass"),
    ("remembers beside its fields", once_moved("static int calls; if (++calls > 25) s->use[MOVE_VELOCITY].real[0][0] = 1;"), "resume"),
    ("says that it makes what it changes", [('{ .field = "grain.velocity", .unit = "m/s", .access = QUERN_UPDATE,',
                                             '{ .field = "grain.velocity", .unit = "m/s", .access = QUERN_WRITE,')], "scene"),
    ("sums up to no number", [("sum[KINETIC] += 0.5", "sum[KINETIC] += (v < 0 ? 0.0 / 0.0 : 0.5)")], "sums"),
    ("fails in set-up", [("for (uint32_t i = 0; i < n; i++) from[i] = -1;",
                          'if (n) return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1, "no room for grains");')], "set-up"),
    ("fails in a step", once_moved('if (s->step == 7) return s->host->stop(s->run, QUERN_E_NUMERIC, "grain", 3, "is lost");'), "steps"),
    ("makes numbers that nothing goes on from", once_moved("if (s->step == 7) s->use[MOVE_POSITION].real[0][0] = 0.0 / 0.0;"), "steps"),
    ("moves", once_moved('if (s->step == 7 && chdir("/")) return QUERN_E_IO;'), "environment"),
    ("rounds down", once_moved("if (s->step == 7) __builtin_ia32_ldmxcsr(0x3f80);"), "environment"),
]
SOLVERS_THAT_END = [
    ("if (s->step == 7) *(volatile int *)0 = 1;", "FAILED  scene: solver.mine: crashed (SIGSEGV) in mine.move"),
    ("if (s->step == 7) _exit(0);", "FAILED  scene: solver.mine: ended the program in mine.move"),
    ('while (s->step == 7) __asm__ volatile("");', "FAILED  scene: solver.mine: did not come back within 2 s from mine.move"),
    ("if (s->host->workers(s->run) > 1) __builtin_trap();", "FAILED  threads: solver.mine: crashed (SIGILL) in mine.move"),
]


def fly(folder, changes, *options, status=2):
    """A solver from the template with some changes, in a scene."""
    scene = workshop.pathlib.Path(folder) / "flight.yaml"
    scene.write_text(FLIGHT)
    path = compile(source("solver", *changes), "solver.mine", folder)
    return quern("check", path, "--scene", scene, *options, status=status)


def check_one_solver(broken):
    what, changes, wanted = broken
    with tempfile.TemporaryDirectory() as folder:
        said = fly(folder, changes)
        assert wanted in failures(said), f"a solver that {what} passes '{wanted}'\n{said}"
    return {("solver", name) for name in failures(said)}


def check_solvers():
    with tempfile.TemporaryDirectory() as folder:
        said = fly(folder, [], status=0)
        assert "steps: 40, after 0 of settling" in said and "resume: going on from a checkpoint gives the same bits" in said, said
        solver = workshop.pathlib.Path(folder) / "solver.mine.so"
        # without a scene there is a line that says what one would add; a scene must run that very object
        assert "with --scene FILE.yaml, a scene that names it, it runs: set-up, steps" in quern("check", solver, status=0)
        two = workshop.SOURCE / "configs/two_grains.yaml"
        assert f"set-up: {two} does not run {solver}" in quern("check", solver, "--scene", two, status=2)
        assert "steps: 20, after 0 of settling" in quern("check", solver, "--scene", f"{folder}/flight.yaml", "--steps", 20,
                                                         "--set", "grains.count=10", status=0)
        assert "flight.yaml cannot be used: 1 fault" in quern("check", solver, "--scene", f"{folder}/flight.yaml",
                                                              "--set", "grains.cuont=10", status=2)
        law = PLUGINS / "contact.linear.so"
        assert "--scene is for solvers, and contact.linear is none" in quern("check", law, "--scene", two, status=2)
    for statement, sentence in SOLVERS_THAT_END:
        with tempfile.TemporaryDirectory() as folder:
            said = fly(folder, once_moved(statement), "--seconds", 2)
            assert sentence in said, f"'{sentence}' is not in\n{said}"
    found = set().union(*at_once(check_one_solver, BROKEN_SOLVERS))
    print(f"{len(BROKEN_SOLVERS)} solvers broken on purpose fail where they should in a scene, "
          f"{len(SOLVERS_THAT_END)} end in a sentence")
    return found


def broken_id(path):
    return path.rsplit("/", 1)[1][:-2] if "/" in path else path + ".mine"


def check_one(broken):
    what, path, changes, wanted = broken
    with tempfile.TemporaryDirectory() as folder:
        beside = path.rsplit("/", 1)[0] if "/" in path else ""
        object_file = compile(source(path, *changes), broken_id(path), folder, beside=beside)
        done = workshop.subprocess.run([workshop.QUERN, "check", object_file], capture_output=True, text=True)
        found = failures(done.stdout)
        assert wanted in found, f"a plugin that {what} passes '{wanted}'; it fails in {sorted(found)}\n{done.stderr}"
        assert done.returncode == 2, f"a plugin that {what} ends with exit status {done.returncode}"
    return {(broken_id(path).split(".")[0], name) for name in found}


def check_broken(stated):
    failed = set().union(*at_once(check_one, BROKEN)) | check_solvers()
    print(f"{len(BROKEN)} plugins broken on purpose fail where they should")
    # what all kinds have in common is the same code for each of them
    common = {name for kind in ("contact", "shape") for k, name in failed if k == kind} & {
        "identity", "parameter rows", "uses", "set-up", "parameters", "finite", "batches", "threads", "guards", "inputs",
        "self", "arithmetic", "environment"}
    never = {(kind, name) for kind, name in stated - failed if name not in common}
    assert not never, f"stated, and never seen to fail: {sorted(never)}"
    print(f"each of {len(stated)} properties that check states is seen to fail")


ADHESION = [  # the pull of grains that attract each other as long as they touch
    ("friction;\n} law;", "friction, pull;\n} law;"),
    ("\tQUERN_END_PARAMS };", '\tQUERN_PARAM(law, pull, "N", "Adhesion.", .def = 0.05, .max = 1e9), QUERN_END_PARAMS };'),
    ("touching ? pushed : 0;", "touching ? pushed - p.pull : 0;"), ("p.friction * normal", "p.friction * quern_max(normal, 0)"),
    ("quern_vec_axpy(-spring, n, f); /*", "quern_vec_axpy(-(spring - (touching ? p.pull : 0)), n, f); /*"),
    ("b->stored[i] += 0.5 * spring * (touching ? overlap[i] : 0);",
     "b->stored[i] += (0.5 * spring - p.pull) * (touching ? overlap[i] : 0);")]
DRUM = [  # a ball whose surface runs round
    ("bool hollow;", "bool hollow;\n\tquern_real rate;"),
    ("\tQUERN_END_PARAMS };", '\tQUERN_PARAM(ball, rate, "rad/s", "Turns.", .def = 3, .max = 1e3), QUERN_END_PARAMS };'),
    ("gap[i] =", "const quern_vec own = quern_vec_scale(size, quern_vec_turn_back(pose->turn, out)), z = { 0, 0, p->rate };\n"
     "const quern_vec run = quern_vec_turn(pose->turn, quern_vec_cross(z, own)); gap[i] ="),
    ("QUERN_VEC_PUT(b->velocity, i, velocity, dim);", "QUERN_VEC_PUT(b->velocity, i, quern_vec_add(velocity, run), dim);")]
# a couple against rolling, and no force at all
ROLLING = """
#include <quern/contact.h>
typedef struct { quern_real drag; } law;
static const quern_param params[] = { QUERN_PARAM(law, drag, "N m s", "Couple per spin.", .def = 1e-9, .max = 1),
	QUERN_END_PARAMS };
static const quern_use uses[] = {
	{ .field = "contact.couple", .unit = "N m", .doc = "C.", .access = QUERN_ADD, .shape = QUERN_AXIAL },
	{ .field = "grain.spin", .unit = "rad/s", .doc = "S.", .access = QUERN_READ, .shape = QUERN_AXIAL,
		.flags = QUERN_OTHERS }, QUERN_END_USES };
static void force(const void *self, const quern_contact_batch *b) {
	for (int k = 0; k < (b->normal[2] ? 3 : 1); k++)
		for (uint32_t i = 0; i < b->n; i++) b->couple[k][i] -= b->overlap[i] > 0 ? ((const law *)self)->drag * b->spin[k][i] : 0;
}
static const quern_contact_ops ops = { .size = sizeof ops, .force = { force, force } };
static const quern_plugin plugin = { .size = sizeof plugin, .dims = 3, .id = "contact.rolling",
	.brief = "Rolling.", .instance_size = sizeof(law), .params = params, .uses = uses, .ops = &ops };
QUERN_LIBRARY(plugin, "1", "MIT");
"""


def check_legitimate():
    """Physics that is unlike the installed plugins' and all the same sound."""
    plugins = [("contact.mine", source("contact", *ADHESION)), ("body.mine", source("body", *DRUM)),
               ("contact.rolling", ROLLING)]
    for name, text in plugins:
        with tempfile.TemporaryDirectory() as folder:
            said = quern("check", compile(text, name, folder), status=0)
            assert "all ok" in said, said
    with tempfile.TemporaryDirectory() as folder:  # and what is unsound in the same physics is found
        backwards = ROLLING.replace("b->couple[k][i] -=", "b->couple[k][i] +=").replace("1e-9", "1e-5")
        said = quern("check", compile(backwards, "contact.rolling", folder), status=2)
        assert failures(said) == {"impacts gain no energy", "books of energy"}, said
    print("adhesion, couples alone and surfaces that run pass")


FORBIDDEN = [("exit(0);", "ended the program in linear.init, 2-D"), ("_exit(0);", "ended the program in linear.init, 2-D"),
             ("quick_exit(0);", "ended the program in linear.init, 2-D"), ("abort();", "crashed (SIGABRT) in linear.init"),
             ("for (int fd = 0; fd < 64; fd++) close(fd);", "linear.init, 2-D, with setting 0 of its parameters: changes what "
              "is open for reading and printing")]
if not workshop.SANITIZED:  # there, processes cannot be forbidden
    FORBIDDEN += [("fork();", "started a process in linear.init"), ("for (;;) fork();", "started a process in linear.init"),
                  ("for (;;) if (!fork()) setsid();", "started a process in linear.init"),
                  ('if (system("true")) abort();', "started a process in linear.init")]


def check_forbidden():
    """What init must not do to the program and the machine is found, and done to a child alone."""
    for statement, sentence in FORBIDDEN:
        with tempfile.TemporaryDirectory() as folder:
            text = source(LINEAR, (INIT, INIT + " " + statement), UNISTD)
            said = quern("check", compile("#include <stdlib.h>\n" + text, "contact.linear", folder), status=2)
            assert sentence in said and "properties FAILED" in said, f"'{sentence}' is not in\n{said}"
    print(f"{len(FORBIDDEN)} things that a plugin must not do are one sentence each")


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


def check_outside():
    """A kind that nobody has heard of, with its template and its conformance test in a folder on the path."""
    with tempfile.TemporaryDirectory() as name:
        folder = workshop.pathlib.Path(name)
        test = source("check").replace("mine", "glow")
        kind = test[test.index("typedef struct"):test.index("enum { PLACE")]
        template = f"""#include <quern/abi.h>
{kind}
typedef struct {{ quern_real size; }} lamp;
static const quern_param params[] = {{ QUERN_PARAM(lamp, size, "m", "Size.", .def = 1, .min = 0.1, .max = 9),
	QUERN_END_PARAMS }};
static const quern_use uses[] = {{ QUERN_END_USES }};
static void value(const void *self, const glow_batch *b) {{
	for (uint32_t i = 0; i < b->n; i++) b->value[i] = ((const lamp *)self)->size * b->place[i] * b->place[i];
}}
static const glow_ops ops = {{ .size = sizeof ops, .value = value }};
static const quern_plugin plugin = {{ .size = sizeof plugin, .dims = 3, .id = "my_kind.my_name", .brief = "A lamp.",
	.instance_size = sizeof(lamp), .params = params, .uses = uses, .ops = &ops }};
QUERN_LIBRARY(plugin, "1", "MIT");
"""
        (folder / "template.glow.c").write_text(template)
        path = {"QUERN_PLUGIN_PATH": name}
        assert "did you mean 'glow'?" in quern("new", "glwo", "bulb", status=1, **path)
        assert "unknown kind 'glow'" in quern("new", "glow", "bulb", status=1)
        quern("new", "glow", "bulb", "-o", folder / "bulb", status=0, **path)
        text = (folder / "bulb/glow.bulb.c").read_text()
        bulb = compile(text, "glow.bulb", folder)
        said = quern("check", bulb, status=0, **path)
        assert "note    check.glow is not installed" in said and "identity" in said and "set-up" not in said, said
        compile(test, "check.glow", folder)
        said = quern("check", bulb, status=0, **path)
        assert "the same on both sides" in said and "batches" in said and "61 settings" not in said, said
        assert "check.glow" in quern("list", "--all", status=0, **path)
        assert "check.glow" not in quern("list", status=0, **path)
        # nobody is offered a test in place of a plugin
        assert "no plugin 'glow'" in quern("describe", "glow", status=2, **path)
        scene = workshop.SOURCE / "configs/two_grains.yaml"
        said = quern("plan", scene, "--set", "grains.contact=glow", status=2, **path)
        assert "unknown contact 'glow'" in said and "check.glow" not in said, said
        tilted = text.replace("b->place[i];", "b->place[i] + 0.1 * b->place[i];")
        said = quern("check", compile(tilted, "glow.bulb", folder), status=2, **path)
        assert failures(said) == {"the same on both sides"}, said
        later = text.replace("uint32_t size, pad;", "uint32_t size, pad; void *later[2];")
        assert "newer header" in quern("check", compile(later, "glow.bulb", folder), status=2, **path)
        # a test that crashes, and one whose table is wrong
        begin = "static void law(const quern_check *c) {"
        bad = test.replace(begin, begin + " __builtin_trap();")
        compile(text, "glow.bulb", folder), compile(bad, "check.glow", folder)
        assert "FAILED  law: glow.bulb: crashed (SIGILL) in" in quern("check", bulb, status=2, **path)
        compile(test.replace('"check.glow"', '"check.shine"'), "check.glow", folder)
        assert "it checks the kind glow, so its id must be check.glow" in quern("check", bulb, status=2, **path)
    print("a kind from outside brings its template and its conformance test")


def check_places():
    """Nothing of a plugin runs in the process that was started."""
    start = '\n#include <stdio.h>\n#include <stdlib.h>\n#include <unistd.h>\n' \
            '__attribute__((constructor)) static void start(void) { FILE *f = fopen(getenv("NOTES"), "a"); fprintf(f, "%d\\n", (int)getpid()); fclose(f); }\n'
    with tempfile.TemporaryDirectory() as folder:
        notes = workshop.pathlib.Path(folder) / "notes"
        path = compile(source(LINEAR) + start, "contact.linear", folder)
        process = workshop.subprocess.Popen([workshop.QUERN, "check", path], stdout=workshop.subprocess.DEVNULL,
                                            env={**workshop.os.environ, "NOTES": str(notes)})
        assert process.wait(300) == 0
        loaded = [int(line) for line in notes.read_text().split()]
        assert len(loaded) >= 5 and process.pid not in loaded, f"{process.pid} among {loaded}"
    print(f"a plugin is loaded {len(loaded)} times, each time in a child")


def check_options():
    elastic = PLUGINS / "material.elastic.so"
    assert "all ok" in quern("check", elastic, "--set", "poisson=0.2", status=0)
    assert "poisson is 0.7, must be" in quern("check", elastic, "--set", "poisson=0.7", status=2)
    box = [PLUGINS / "body.box.so", "--set", "lower=[0, 0]", "--set", "upper=[0.1, 0.2]"]
    assert "must be a list of 3 numbers" in quern("check", *box, status=2)
    assert "all ok" in quern("check", *box, "--dimension", 2, status=0)
    assert "must be a list of 3 numbers" in quern("check", *box, "--dimension", 3, status=2)
    assert "must be a whole number between 2 and 3" in quern("check", *box, "--dimension", 4, status=1)
    with tempfile.TemporaryDirectory() as folder:
        flat = compile(source("body", ("QUERN_2D | QUERN_3D", "QUERN_2D")), "body.mine", folder)
        assert "body.mine does not work in 3 dimensions" in quern("check", flat, "--dimension", 3, status=2)
    assert "a plugin is missing" in quern("check", status=1)
    assert "No such file" in quern("check", "nowhere.so", status=2)
    print("options of check")


if __name__ == "__main__":
    check_broken(check_installed() | check_templates())
    check_legitimate()
    check_crashes()
    check_forbidden()
    check_outside()
    check_places()
    check_options()
