# SPDX-License-Identifier: MIT
"""Solvers that a scene does not use are in nobody's way, whatever they do when they are asked which section they read; solvers
that clash are told apart by a sentence; what is added to a field begins at nothing in every step of settling."""
import json
import pathlib
import tempfile

import lab
from workshop import PLUGINS, compile, quern

SCENE = lab.scene("two_grains")
# a solver that counts: `SETTLE` substeps of settling, each of which adds 1 to count.part and then that to count.sum
COUNTER = """#include <quern/solver.h>
typedef struct { quern_real a; } counter;
static const quern_param params[] = { QUERN_PARAM(counter, a, "1", "A.", .def = 1, .max = 9), QUERN_END_PARAMS };
static const quern_use none[] = { QUERN_END_USES };
static const quern_set sets[] = { { .name = "%(set)s", .plural = "%(plural)s", .doc = "S.", .counted = 1 }, { .name = NULL } };
#define F(name, how) { .field = name, .unit = "1", .doc = "F.", .access = how, .shape = QUERN_SCALAR }
static const quern_use fill_uses[] = { F("%(set)s.sum", QUERN_WRITE), QUERN_END_USES };
static const quern_use add_uses[] = { F("%(set)s.part", QUERN_ADD), QUERN_END_USES };
static const quern_use sum_uses[] = { F("%(set)s.part", QUERN_READ), F("%(set)s.sum", QUERN_UPDATE), QUERN_END_USES };
static const quern_use look_uses[] = { F("%(set)s.sum", QUERN_READ), QUERN_END_USES };
static quern_status look(const void *self, const quern_step *s) { return (void)self, (void)s, QUERN_OK; }
static quern_status fill(const void *self, const quern_step *s) {
	const int32_t fresh = -1;
	const quern_status status = s->host->remap(s->run, "%(set)s", 1, &fresh, 0, NULL);
	if (status == QUERN_OK) s->use[0].real[0][0] = 0;
	return (void)self, status;
}
static quern_status add(const void *self, const quern_step *s) {
	s->use[0].real[0][0] += ((const counter *)self)->a;
	return QUERN_OK;
}
static quern_status sum(const void *self, const quern_step *s) {
	s->use[1].real[0][0] += s->use[0].real[0][0];
	return (void)self, QUERN_OK;
}
static bool settled(const void *self, const quern_step *s) { return (void)self, s->substep >= 60; }
static void account(const void *self, const quern_step *s, quern_real *out) { (void)self, *out = s->use[0].real[0][0]; }
static const quern_output sums[] = { { .name = "%(name)s_sum", .unit = "1" }, { .name = NULL } };
static uint32_t substeps(const void *self) { return (void)self, %(substeps)s; }
static const quern_stage stages[] = { { .name = "%(name)s.fill", .doc = "F.", .phase = QUERN_SETUP, .uses = fill_uses, .run = fill },
	{ .name = "%(name)s.add", .doc = "A.", .phase = QUERN_SUBSTEP, .flags = QUERN_SETTLES, .uses = add_uses, .run = add },
	{ .name = "%(name)s.sum", .doc = "S.", .phase = QUERN_SUBSTEP, .flags = QUERN_SETTLES, .uses = sum_uses, .run = sum },
	{ .name = "%(name)s.look", .doc = "L.", .phase = QUERN_END, .uses = look_uses, .run = look, .when = %(when)s },
	{ .name = NULL } };
static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "%(section)s", .sets = sets, .stages = stages,
	.settled = settled, .sums = sums, .account = account, .substeps = substeps%(more)s };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = 3, .id = "solver.%(name)s", .brief = "C.",
	.instance_size = sizeof(counter), .params = params, .uses = none, .ops = &ops };
QUERN_LIBRARY(plugin, "1", "MIT");
"""
# before it in the order of sections: adds nothing to the same field, and does not settle
PUSHER = """#include <quern/solver.h>
typedef struct { int32_t unused; } pusher;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use none[] = { QUERN_END_USES };
static const quern_use uses[] = { { .field = "bead.part", .unit = "1", .doc = "F.", .access = QUERN_ADD, .shape = QUERN_SCALAR },
	QUERN_END_USES };
static quern_status nothing(const void *self, const quern_step *s) { return (void)self, (void)s, QUERN_OK; }
static const quern_stage stages[] = { { .name = "pusher.push", .doc = "P.", .phase = QUERN_SUBSTEP, .uses = uses, .run = nothing },
	{ .name = NULL } };
static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "ahead", .stages = stages };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = 3, .id = "solver.pusher", .brief = "P.",
	.instance_size = sizeof(pusher), .params = params, .uses = none, .ops = &ops };
QUERN_LIBRARY(plugin, "1", "MIT");
"""
# what `more` may name: a cell for the shared grid
CELL = "static double cell(const void *self) { return *(const double *)self; }\n"
BEGINS = "__attribute__((constructor)) static void begin(void) { %s }\n"


# an observer with as many outputs as gravity says
OFTEN = """#include <quern/observer.h>
typedef struct { quern_real n; } often;
static const quern_param params[] = { QUERN_PARAM(often, n, "m/s^2", "N.", .from = "scene.gravity", .max = 9), QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_output outputs[] = { { .name = "one", .unit = "1" }, { .name = NULL } };
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out, const quern_host *host, quern_run *run) {
	return (void)self, (void)b, (void)out, (void)host, (void)run, QUERN_OK;
}
static uint32_t repeat(const void *self) { return (uint32_t)((const often *)self)->n; }
static const quern_observer_ops ops = { .size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole,
	.repeat = repeat };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = 3, .id = "observer.often", .brief = "O.",
	.instance_size = sizeof(often), .params = params, .uses = uses, .ops = &ops };
QUERN_LIBRARY(plugin, "1", "MIT");
"""


def counter(folder, name, section=None, file=None, before="", **changes):
    words = {"name": name, "section": section or name, "set": "bead", "plural": "beads", "substeps": "1", "when": "NULL", "more": "",
             **changes}
    return compile(before + COUNTER % words, file or f"solver.{name}", folder)


def run(scene, folder, path, *options, status=0):
    text = quern("run", scene, "-o", folder, "--force", *options, status=status, QUERN_PLUGIN_PATH=path)
    return text if status else json.loads((pathlib.Path(folder) / "summary.json").read_text())


def scene(folder, *sections):
    path = pathlib.Path(folder) / "scene.yaml"
    path.write_text("quern: 1\ndimension: 2\ngravity: [0, 0]\ndomain: {lower: [0, 0], upper: [1, 1]}\n"
                    "time: {end: 1, step: 0.5}\n" + "".join(f"{name}: {{}}\n" for name in sections))
    return path


def check_starts(place):
    """Whatever start-up code does in a solver that is not used."""
    lab.run("two_grains", place / "alone")
    harm = {"crash": "*(volatile int *)8 = 1;", "end": "__builtin_trap();", "round": "__builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8040);"}
    for what, code in harm.items():
        folder = place / what
        folder.mkdir()
        counter(folder, "x", before=BEGINS % code)
        lab.run("two_grains", folder / "run", QUERN_PLUGIN_PATH=str(folder))
        lab.same(place / "alone", folder / "run", f"beside a solver that does harm ({what})")
        checked = quern("check", PLUGINS / "coupling.lumped.so", status=0, QUERN_PLUGIN_PATH=folder)
        assert "all ok" in checked, checked
    said = quern("plan", scene(place, "x"), status=2, QUERN_PLUGIN_PATH=place / "crash")
    staged = "--set=stages=[{for: 5 ms}, {set: {gravity: [0, 0]}}]"
    quern("plan", SCENE, staged, status=0, QUERN_PLUGIN_PATH=place / "crash")
    assert "unknown key 'x'" in said and "solver.x.so crashed (SIGSEGV) while it was asked which section it reads" in said, said


def check_asked_once(place):
    """However many stages a scene has, solvers are asked once which section they read, as each has the same plugins."""
    note = place / "asked"
    counter(place, "x", before="#include <stdio.h>\n" + BEGINS % f'FILE *f = fopen("{note}", "a"); fputs("x\\n", f); fclose(f);')
    stages = "--set=stages=[" + ", ".join(f"{{for: 1 ms, set: {{gravity: [0, {k}]}}}}" for k in range(1, 6)) + "]"
    quern("plan", SCENE, stages, "--set=time.end=5 ms", status=0, QUERN_PLUGIN_PATH=place)
    assert note.read_text() == "x\n", note.read_text()


def check_clashes(place):
    def refused(what, sections, expected, *solvers):
        folder = place / what
        folder.mkdir()
        for words in solvers:
            counter(folder, **words)
        said = quern("plan", scene(folder, *sections), status=2, QUERN_PLUGIN_PATH=folder)
        assert expected in said, said
    refused("claims", ["one"], "section one is claimed by solver.one and solver.two: say which", dict(name="one"),
            dict(name="two", section="one"))
    refused("sets", ["one", "two"], "two: there is another set that is called bead", dict(name="one"), dict(name="two"))
    refused("groups", ["one"], "one: there is another set that is called plugins", dict(name="one", set="plugins", plural="p"))
    refused("substeps", ["one", "two"], "two wants 3 substeps in a step, and one 2", dict(name="one", substeps="2"),
            dict(name="two", set="pearl", plural="pearls", substeps="3"))
    after = ', .after = (const char *const[]) { "%s", NULL }'
    refused("circle", ["one", "two"], "waits for another one that waits for it", dict(name="one", more=after % "two"),
            dict(name="two", set="pearl", plural="pearls", more=after % "one"))
    claim = place / "claim"
    claim.mkdir()
    counter(claim, "one", section="stages")
    quern("plan", scene(claim, "stages"), status=2, QUERN_PLUGIN_PATH=claim)
    quern("plan", SCENE, "--set=stages=[{for: 5 ms}, {set: {}}]", status=0, QUERN_PLUGIN_PATH=claim)
    copies = place / "copies"
    copies.mkdir()
    counter(copies, "one")
    counter(copies, "one", file="solver.one_old")
    assert run(scene(copies, "one"), copies / "run", copies)["sums"]["one_sum"]["value"] > 0


def check_sums(place):
    """60 steps of settling and 50 up to the end; a solver before it that does not settle changes nothing."""
    counter(place, "one")
    compile(PUSHER, "solver.pusher", place)
    for sections in (["one"], ["one", "ahead"]):
        summary = run(scene(place, *sections), place / "run", place, "--no-cache")
        assert summary["sums"]["one_sum"]["value"] == 110, (sections, summary["sums"])


def check_stages(place):
    """What a stage of a scene makes of wishes and of stages of solvers is looked at before the run begins."""
    def refused(what, stage, expected, *solvers, base=None, sections=("one", "two")):
        folder = place / what
        folder.mkdir()
        for words in solvers:
            counter(folder, **words)
        options = ["--set=stages=[{for: 5 ms}, {set: {%s}}]" % stage]
        for changed, status in ((options, 2), ([], 0)):
            said = quern("plan", base or scene(folder, *sections), *([f"--set={s}={{}}" for s in sections] if base else []), *changed,
                         status=status, QUERN_PLUGIN_PATH=folder)
            assert status == 0 or expected in said and said.count("error:") == 1, said
    own = "(uint32_t)((const counter *)self)->a"
    other = dict(name="two", set="pearl", plural="pearls")
    refused("substeps", "two.a: 3", "two wants 3 substeps in a step, and one 1", dict(name="one"), dict(substeps=own, **other))
    refused("cell", "one.a: 0.5", "one wants a grid with cells of 0.5 m, and continuum one of 1 m",
            dict(name="one", before=CELL, more=", .cell = cell"), base=lab.scene("elastic_bar"), sections=["one"])
    refused("more", "one.a: 0", "one.look runs in one and not in another: what a stage switches on must be on in the scene",
            dict(name="one", when='"a"'), sections=["one"])
    compile(OFTEN, "observer.often", place)
    bare = "--set=observe=often"
    quern("plan", SCENE, bare, status=0, QUERN_PLUGIN_PATH=place)
    said = quern("plan", SCENE, bare, "--set=gravity=[0, 2]", "--set=stages=[{for: 5 ms}, {set: {gravity: [0, 3]}}]", status=2,
                 QUERN_PLUGIN_PATH=place)
    assert "stages: observer.often would have other columns in one than in another" in said, said


if __name__ == "__main__":
    for test in (check_starts, check_asked_once, check_clashes, check_stages, check_sums):
        with tempfile.TemporaryDirectory() as name:
            test(pathlib.Path(name))
        print(test.__name__.replace("_", " "), "ok")
