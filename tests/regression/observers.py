# SPDX-License-Identifier: MIT
"""What observers leave: an object each in the summary and columns of their own in the series, under labels that differ; any
number of outputs; and no number that is not finite."""
import os
import pathlib
import subprocess

import lab
import workshop

ALONE = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [1, 1]}
time: {end: 1 ms}
output: {every: 1 ms}
grains:
  material: {density: 2500, radius: {mean: 1 cm}}
  contact: {linear: {stiffness: 1e5}}
  place: [%s]
"""


def start(folder, observe, *options, status=0, **environment):
    done = subprocess.run([lab.QUERN, "run", "--quiet", lab.scene("two_grains"), "-o", str(folder), "--set=time.end=1 ms",
                           f"--set=observe={observe}", *options], capture_output=True, text=True,
                          env={**os.environ, **environment})
    assert done.returncode == status, f"{observe}: exit status {done.returncode}, not {status}\n{done.stderr}"
    return done.stderr


def objects(place):
    """Energy and momentum are keys of the run as a whole too: the observers of that name keep their own place."""
    start(place / "two", "[energy, momentum]")
    s = lab.summary(place / "two")
    assert list(s["observers"]) == ["energy", "momentum"]
    assert isinstance(s["energy"], float) and isinstance(s["momentum"], list)
    assert s["observers"]["energy"]["budget"]["last"] > 0 and s["observers"]["momentum"]["x"]["unit"] == "kg m/s"


def labels(place):
    start(place / "labels", "[mass, {mass: {label: mine}}, mass, {energy: {label: mass_3}}, mass]")
    header, rows = lab.series(place / "labels")
    names = [name.split(".")[0] for name in header if name.endswith(".carried [kg]")]
    assert names == ["mass", "mine", "mass_2", "mass_4"], names
    assert len(set(header)) == len(header), "two columns have one name"
    assert list(lab.summary(place / "labels")["observers"]) == ["mass", "mine", "mass_2", "mass_3", "mass_4"]
    said = start(place / "no", "[{mass: {label: a}}, {energy: {label: a}}]", status=2)
    assert "two observers are labelled 'a'" in said, said
    said = start(place / "no", "[{mass: {label: a.b}}]", status=2)
    assert "the label 'a.b' is no name" in said, said
    print("columns and objects by label; equal labels are refused")


def many(place):
    """As many uses as there may be and a hundred outputs, over a set or whole; a column of another set is not cut to the leaf."""
    n, uses = 100, 31
    text = """
#include <quern/observer.h>
typedef struct { int32_t unused; } observer;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { { .field = "total.trembling", .unit = "1", .access = QUERN_READ, .shape = QUERN_INDEX }, %s, QUERN_END_USES };
static const quern_output outputs[] = { %s, { .name = NULL } };
static void map(const void *self, const quern_observer_batch *b, quern_real *partial) {
	(void)self;
	for (int k = 0; k < %d; k++) partial[k] = 0;
	for (uint32_t i = 0; i < b->n; i++)
		for (int k = 0; k < %d; k++) partial[k] += k * b->use[1 + k %% %d].real[0][i] + b->use[0].index[0];
}
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out, const quern_host *host, quern_run *run) {
	(void)host, (void)run;
	quern_observer_batch one = *b;
	one.n = b->count[%d];
	map(self, &one, out);
	return QUERN_OK;
}
static const quern_observer_ops ops = { .size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, %s };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = 3,
	.id = "observer.%s", .brief = "Many numbers.", .instance_size = sizeof(observer), .params = params, .uses = uses, .ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
"""
    row = '{ .field = "grain.mass", .unit = "kg", .access = QUERN_READ, .shape = QUERN_SCALAR }'
    outputs = ", ".join(f'{{ .name = "o{k}", .unit = "kg", .doc = "One of many." }}' for k in range(n))
    for name, how in (("mapped", ".map = map, .set = \"grain\""), ("wholly", ".whole = whole")):
        body = text % (", ".join([row] * uses), outputs, n, n, uses, uses, how, name)
        body = body.replace("static quern_status whole", "static __attribute__((unused)) quern_status whole")
        workshop.compile(body, f"observer.{name}", place)
    grains = ", ".join(f"{{position: [{x} mm, {y} mm], radius: 1 mm}}" for x in range(-48, 48, 4) for y in range(-48, 48, 4))
    start(place / "many", "[mapped, wholly, mass]", f"--set=grains.place=[{grains}]", QUERN_PLUGIN_PATH=str(place))
    observers = lab.summary(place / "many")["observers"]
    mass = observers["mass"]["grains"]["last"]
    for name in ("mapped", "wholly"):
        assert list(observers[name]) == [f"o{k}" for k in range(n)], f"{name}: {list(observers[name])}"
        for k in range(n):
            found = observers[name][f"o{k}"]["last"]
            assert abs(found - k * mass) <= 1e-12 * (1 + k * mass), f"{name}: o{k} is {found}, not {k * mass}"
    print(f"{n} outputs and {uses + 1} uses of one observer")


def finite(place):
    """An observer that gives a number which is not finite ends the run, and leaves it out; tests/physics/observed.c has the run's own."""
    workshop.compile("""
#include <math.h>
#include <quern/observer.h>
typedef struct { int32_t unused; } observer;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_output outputs[] = { { .name = "size", .unit = "m", .doc = "Of all." }, { .name = NULL } };
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out, const quern_host *host, quern_run *run) {
	(void)self, (void)b, (void)host, (void)run;
	out[0] = INFINITY;
	return QUERN_OK;
}
static const quern_observer_ops ops = { .size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = 3,
	.id = "observer.universe", .brief = "How large it is.", .instance_size = sizeof(observer), .params = params, .uses = uses, .ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
""", "observer.universe", place)
    said = start(place / "inf", "[mass, {universe: {label: large}}]", status=3, QUERN_PLUGIN_PATH=str(place))
    assert "observer large: column large.size is infinite at t = 0 s" in said, said
    assert lab.summary(place / "inf")["status"] == "failed"
    assert "inf" not in (place / "inf/series.csv").read_text()
    print("numbers that are not finite end the run")


def nothing_moves(place):
    """Of fixed grains alone nothing is carried, and nothing is missing."""
    scene = place / "fixed.yaml"
    scene.write_text(ALONE % "{position: [0.5, 0.5], fixed: true}")
    workshop.quern("run", scene, "-o", place / "fixed", status=0)
    s = lab.summary(place / "fixed")
    assert s["mass_initial"] == 0 and s["mass_defect"] == 0 and s["discrete_share"] == 0, s


# a continuum alone begins with points in columns, of which one stands at 0.029 m
FLOWS = "[{packing_fraction: {region: {box: {lower: [0, 0], upper: [0.02, 0.02]}}}}, coordination, " \
    "{coordination: {rattlers: false, label: bearing}}, {granular_temperature: {region: {box: {lower: [0.5, 0.2], upper: [0.6, 0.3]}}, " \
    "label: nowhere}}, granular_temperature, {flux: {at: 0.0292}}, {flux: {axis: 1, at: 0.02, label: down}}, repose, mass]"


def flows(place):
    """Grains alone, a continuum alone and a hybrid, each with all of them: finite, plausible, the same for any threads and
    batches, and after a resume."""
    options = [*lab.SMALL["column"], "--set=time.end=30 ms", "--set=output.every=5 ms", "--set=grains.settle.energy=0.02",
               f"--set=observe={FLOWS}"]
    for model in ("grains", "continuum", "all"):
        more = [] if model == "all" else [f"--set=model={model}"]
        # a continuum alone knows no density of grains
        more += [f"--set=observe={FLOWS.replace('{region', '{grain_density: 2500, region', 1)}"] if model == "continuum" else []
        one, other = place / f"{model}_1", place / f"{model}_3"
        lab.run("column", one, *options, *more)
        lab.run("column", other, *options, *more, "--set=run.batch=8", threads=3)
        assert (one / "series.csv").read_bytes() == (other / "series.csv").read_bytes(), model
        header, rows = lab.series(one)
        last = dict(zip([name.split(" ")[0] for name in header], rows[-1]))
        has_grains, has_points = model != "continuum", model != "grains"
        assert 0.4 < last["packing_fraction.fraction"] < 1, last
        assert (last["packing_fraction.grains"] > 0) == has_grains and (last["packing_fraction.points"] > 0) == has_points, last
        assert (last["coordination.number"] > 1) == has_grains and last["bearing.number"] >= last["coordination.number"], last
        assert (last["granular_temperature.temperature"] > 0) == has_grains, last
        assert last["nowhere.temperature"] == last["nowhere.grains"] == 0, last
        assert rows[0][header.index("flux.mass [kg/s]")] == 0 and last["flux.mass"] > 0 and last["down.mass"] < 0, last
        assert (last["flux.grains"] != 0) == has_grains and (last["down.points"] != 0) == has_points, last
        assert -1.2 < last["repose.angle"] < 0.1 and last["repose.columns"] > 5, last
        half = place / f"{model}_2"
        lab.run("column", half, *options, *more, "--until=12 ms")
        lab.run("column", half, *options, *more, resume=True)
        assert (one / "series.csv").read_bytes() == (half / "series.csv").read_bytes(), f"{model}, resumed"
    print("packing, contacts, temperature, fluxes and slope of grains, of a continuum and of a hybrid")


if __name__ == "__main__":
    with lab.workplace() as name:
        place = pathlib.Path(name)
        for test in (objects, labels, many, finite, nothing_moves, flows):
            test(place)
