# SPDX-License-Identifier: MIT
"""Settled states are kept: a second run of the same beginning starts from one, to the same bits, whoever made it."""
import os
import pathlib
import shutil
import signal

import h5py

import lab
import workshop

OPTIONS = [*lab.SMALL["column"], "--set=time.end=10 ms", "--set=output.every=5 ms",
           "--set=grains.fill.1.region.box.upper=[0.039, 0.08]", "--set=grains.settle.step=0.05"]
# Stands in for the continuum: lets grains grow a little at every step, also while they settle, and shows by how much.
SWELL = """#include <quern/solver.h>
#include <math.h>
typedef struct { quern_real rate; } swell;
static const quern_param params[] = { QUERN_PARAM(swell, rate, "1", "Per step.", .max = 1), QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES }, rows[] = {
	{ .field = "grain.radius", .unit = "m", .access = QUERN_UPDATE, .shape = QUERN_SCALAR },
	{ .field = "grain.swollen", .unit = "m", .doc = "Growth.", .access = QUERN_WRITE, .shape = QUERN_SCALAR },
	QUERN_END_USES };
static quern_status grow(const void *self, const quern_step *s) {
	for (uint32_t i = 0; i < s->host->set(s->run, "grain").n; i++) {
		quern_real *radius = &s->use[0].real[0][i], more = *radius * ((const swell *)self)->rate;
		*radius += more;
		if (s->use[1].real[0]) s->use[1].real[0][i] = more;
	}
	return QUERN_OK;
}
static const quern_stage stages[] = {
	{ .name = "swell.grow", .phase = QUERN_SUBSTEP, .flags = QUERN_SETTLES, .uses = rows, .run = grow }, { .name = NULL } };
static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	return *hard = INFINITY; /* the other solver's is the least */
}
static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .stages = stages, .limit = limit };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1,
	.dims = QUERN_2D | QUERN_3D, .id = "solver.swell", .brief = "Growth.", .instance_size = sizeof(swell),
	.params = params, .uses = uses, .ops = &ops };
QUERN_LIBRARY(plugin, "0", "MIT");
"""
TAKEN, KEPT = "settled already: ", "settled state kept in "


def run(out, cache, *options, **how):
    lab.run("column", out, *OPTIONS, *options, QUERN_CACHE=str(cache), **how)
    return (out / "log.txt").read_text()


def files(cache):
    return sorted(cache.glob("settled-*.h5")) if cache.exists() else []


def same_bits(place, cache):
    """The hybrid, with its energies, from its own state; and nothing is read or written that should not be."""
    log = run(place / "none", cache, "--no-cache")
    assert not files(cache) and TAKEN not in log and KEPT not in log
    assert KEPT in run(place / "first", cache) and len(files(cache)) == 1
    lab.same(place / "none", place / "first", "a state kept")
    assert TAKEN in run(place / "second", cache, threads=2)
    lab.same(place / "none", place / "second", "a state taken, two threads")
    one, two = lab.summary(place / "first"), lab.summary(place / "second")
    assert one["settle_steps"] == two["settle_steps"] > 1000
    assert two["settle_seconds"] < one["settle_seconds"] / 5, (one["settle_seconds"], two["settle_seconds"])
    assert TAKEN not in run(place / "not", cache, "--no-cache")


def shared(place, cache):
    """What does not act while grains settle does not ask for a state of its own: twins, oracles, observers, steps, fields."""
    for name, options in {"grains": ["--set=model=grains"], "oracle": ["--set=hybrid.substeps=3"],
                          "observe": ["--set=observe=[]"], "fields": ["--set=output.fields=[]"],
                          "verlet": ["--set=model=grains", "--set=grains.integrator=velocity_verlet"]}.items():
        own = place / f"{name}_own"
        log = run(place / name, cache, *options)
        if name == "verlet":  # its keys stand in the section: a state of its own, by caution
            assert KEPT in log
            continue
        assert TAKEN in log, f"{name}: {log}"
        run(own, cache, "--no-cache", *options)
        lab.same(own, place / name, f"another run's state, {name}")
    assert len(files(cache)) == 2


def by_twin(place, _):
    """The hybrid from a state that its grains alone have kept, whose lists were made at other times: the bits of its own."""
    cache = place / "kept_by_twin"
    assert KEPT in run(place / "twin", cache, "--set=model=grains")
    assert TAKEN in run(place / "from_twin", cache)
    lab.same(place / "none", place / "from_twin", "a state kept by grains alone")


def by_twin_that_wraps(place, _):
    """The same where grains come back through a face as their list is made, and round by when that is: while grains settle, and nobody else moves them, that
    is when their twin's lists are made. Which fields are written out does not matter either."""
    cache, options = place / "wraps", ["--set=time.end=2 ms", "--set=output.every=1 ms"]
    lab.run("chute", place / "wraps_twin", *options, "--set=model=grains", QUERN_CACHE=str(cache))
    lab.run("chute", place / "wraps_from_twin", *options, QUERN_CACHE=str(cache))
    assert TAKEN in (place / "wraps_from_twin/log.txt").read_text()
    lab.run("chute", place / "wraps_none", *options, "--no-cache")
    lab.same(place / "wraps_none", place / "wraps_from_twin", "a state kept by grains alone in a periodic domain")
    weight = ["--set=model=grains", "--set=output.fields=[grain.weight]"]
    lab.run("chute", place / "wraps_weight", *options, *weight, QUERN_CACHE=str(cache))
    assert TAKEN in (place / "wraps_weight/log.txt").read_text()
    lab.run("chute", place / "wraps_weight_none", *options, *weight, "--no-cache")
    lab.same(place / "wraps_weight_none", place / "wraps_weight", "a state kept without weights")


def apart(place, cache):
    """What acts does: seed, gravity, bodies, laws by their contents, and the plugin's own object."""
    for k, option in enumerate(["seed=3", "gravity=[0, -9.0]", "bodies.1.plane.contact.friction=0.1",
                                "grains.contact.linear.friction=0.3", "grains.settle.energy=2e-3"]):
        assert TAKEN not in run(place / f"apart{k}", cache, f"--set={option}", "--until=0"), option
    law = workshop.source("dem/contact.linear.c")
    folder = place / "plugins"
    folder.mkdir()
    workshop.compile(law + "\nstatic const char *const other __attribute__((used)) = \"another object\";\n", "contact.linear", folder)
    assert TAKEN not in run(place / "rebuilt", cache, "--until=0", QUERN_PLUGIN_PATH=str(folder))


def damaged(place, cache):
    """A file that is cut, altered or of something else is passed over and replaced; a folder that cannot be written to, too."""
    shutil.rmtree(cache)
    for k, damage in enumerate([lambda b: b[:len(b) // 2], lambda b: b[:3000] + bytes([b[3000] ^ 1]) + b[3001:], lambda b: b""]):
        run(place / f"base{k}", cache, "--until=0")
        path, = files(cache)
        path.write_bytes(damage(path.read_bytes()))
        assert KEPT in run(place / f"damaged{k}", cache, "--until=0"), k
        assert TAKEN in run(place / f"mended{k}", cache, "--until=0"), k
    path, = files(cache)
    with open(path, "wb") as file:
        file.truncate(8 << 30)  # of nothing: it is not read to its end
    run(place / "huge", cache, "--until=0")
    assert lab.summary(place / "huge")["settle_seconds"] < 10
    path.unlink()
    os.mkfifo(path)
    assert KEPT in run(place / "pipe", cache, "--until=0") and path.is_file()
    blocked = place / "blocked"
    blocked.write_text("no folder")
    assert "settled state not kept: " in run(place / "nowhere", blocked / "cache", "--until=0")
    run(place / "off", "", "--until=0")


def seal(path):
    """Gives a file that was altered a checksum that holds."""
    data, checksum = bytearray(path.read_bytes()), 1469598103934665603
    for byte in data[512:]:
        checksum = (checksum ^ byte) * 1099511628211 % 2**64
    data[16:24] = checksum.to_bytes(8, "little")
    path.write_bytes(data)


def forged(place, cache):
    """What no settling leaves is passed over, or ends the run before its first step; a number is given to one grain."""
    shutil.rmtree(cache)
    run(place / "sound", cache, "--until=0")
    path, = files(cache)
    sound = path.read_bytes()
    for k, (name, value) in enumerate([("grain/id.0", None), ("steps", 2**60), ("grain/position.0", 1e300), ("contact/first.0", 1 << 30)]):
        path.write_bytes(sound)
        with h5py.File(path, "r+") as file:
            if "/" in name:
                file[name][4] = file[name][5] if value is None else value
            else:
                file.attrs[name] = value
        seal(path)
        if k < 2:
            assert KEPT in run(place / f"forged{k}", cache, "--until=0"), name
        else:
            assert "remove it" in lab.run("column", place / f"forged{k}", *OPTIONS, "--until=0", status=4, QUERN_CACHE=str(cache))
    path.write_bytes(sound)
    assert TAKEN in run(place / "sound_again", cache, "--until=0")


def changed_on_the_way(place, cache):
    """A state is kept for what settling began with, whatever has become of the files since."""
    table, out = place / "dropped.txt", place / "on_the_way"
    dropped, cache = "x y radius\n0.02 {} 0.001\n", place / "on_the_way_cache"
    options = [*OPTIONS, f"--set=grains.file={table}", "--until=0"]
    table.write_text(dropped.format(0.25))
    os.environ["QUERN_CACHE"] = str(cache)
    process = lab.start("column", out, *options)
    assert lab.wait_for(out / "scene.yaml", process)
    table.write_text(dropped.format(0.3))
    assert process.wait() == 0
    assert KEPT in (out / "log.txt").read_text()
    assert TAKEN not in run(place / "changed", cache, *options)
    assert TAKEN in run(place / "changed_not", cache, *options)


def resumed(place, cache):
    """One that began with other plugins is nobody's: a run that goes on from a checkpoint keeps none."""
    out, cache = place / "stopped", place / "resumed_cache"
    lab.on_the_way("column", out, OPTIONS, signal.SIGINT, lambda process, share: None)
    assert not lab.frames(out)
    log = run(out, cache, "--until=0", "--force", resume=True, QUERN_PLUGIN_PATH=str(place / "plugins"))
    assert "contact.linear was" in log and KEPT not in log and TAKEN not in log
    assert TAKEN not in run(place / "not_resumed", cache, "--until=0", QUERN_PLUGIN_PATH=str(place / "plugins"))


def helped(place, cache):
    """A solver without an end of settling of its own that acts on grains counts, and so does what it shows of that."""
    folder = place / "swelling"
    folder.mkdir()
    workshop.compile(SWELL, "solver.swell", folder)
    how = {"QUERN_PLUGIN_PATH": str(folder)}
    for k, (rate, taken) in enumerate([(1e-9, False), (2e-9, False), (1e-9, True)]):
        options = ["--until=0", f"--set=hybrid={{solver: swell, rate: {rate}}}",
                   "--set=output.fields=[grain.swollen]", "--set=observe=[energy]"]
        assert (TAKEN in run(place / f"helped{k}", cache, *options, **how)) == taken, rate
        with h5py.File(place / f"helped{k}/checkpoint.h5") as file:
            assert 1e-6 < file.attrs["settle_dt"] < 1e-4, "the step while settling is not the least of both"
        lab.run("column", place / f"helped{k}_own", *OPTIONS, *options, "--no-cache", **how)
        lab.same(place / f"helped{k}_own", place / f"helped{k}", f"with another solver's help, {rate}")


def together(place, cache):
    """Runs that keep the same state at once each leave it whole."""
    os.environ["QUERN_CACHE"] = str(cache)
    for attempt in range(2):
        shutil.rmtree(cache)
        outs = [place / f"together{attempt}{k}" for k in range(3)]
        processes = [lab.start("column", out, *OPTIONS, "--until=0") for out in outs]
        assert [process.wait() for process in processes] == [0, 0, 0]
        logs = [(out / "log.txt").read_text() for out in outs]
        assert all(KEPT in log or TAKEN in log for log in logs), logs
        assert [path.name for path in cache.iterdir()] == [path.name for path in files(cache)] and len(files(cache)) == 1


def renamed(place, cache):
    """The text of all it depends on is in the file: one under another's name is not taken."""
    a = files(cache)[0]
    run(place / "other", cache, "--set=seed=11", "--until=0")
    b = next(path for path in files(cache) if path != a)
    shutil.copy(a, b)
    assert TAKEN not in run(place / "other2", cache, "--set=seed=11", "--until=0")
    with h5py.File(a) as file:
        assert bytes(file["depends"][:]).startswith(b"quern ")


if __name__ == "__main__":
    with lab.workplace() as name:
        place = pathlib.Path(name)
        cache = place / "cache"
        for test in (same_bits, shared, by_twin, by_twin_that_wraps, apart, damaged, forged, changed_on_the_way, resumed, helped, together, renamed):
            test(place, cache)
            print(test.__name__.replace("_", " "), "holds")
