# SPDX-License-Identifier: MIT
"""A scene that starts from another run's state goes on as that run would have, to the bit where nothing else has changed; what does
not fit is refused with a sentence, or begins anew and is said."""
import math
import os
import pathlib
import re
import resource
import shutil
import subprocess

import h5py
import numpy

import lab

BED = """
quern: 1
dimension: 2
seed: 3
gravity: [0, -10]
domain: {lower: [0, -0.05], upper: [0.25, 0.25]}
time: {end: 0.125}
grains:
  material: {density: 2500, radius: {mean: 4 mm, spread: 10 %}}
  contact: {linear: {stiffness: 1e5, restitution: 0.5, friction: 0.5}}
  overlap: {most: 0}
  fill: {region: {box: {lower: [0.01, 0.01], upper: [0.24, 0.09]}}, settle: true}
bodies:
  - {plane: {point: [0, 0], normal: [0, 1]}}
  - {plane: {point: [0, 0], normal: [1, 0]}}
  - {plane: {point: [0.25, 0], normal: [-1, 0]}}
output: {every: 0.03125, fields: [grain.velocity, grain.spin, contact.slip, touch.slip]}
observe: [mass, momentum]
"""
BOX = """
quern: 1
dimension: 3
gravity: [0, 0, -10]
domain: {lower: [0, 0, -0.01], upper: [0.06, 0.06, 0.1]}
time: {end: 0.0625}
grains:
  material: {density: 2500, radius: {mean: 4 mm, spread: 10 %}}
  contact: [{linear: {stiffness: 1e4, restitution: 0.5, friction: 0.5}}, {rolling: {stiffness: 1e3, friction: 0.1}}]
  overlap: {most: 0}
  fill: {region: {box: {lower: [0.005, 0.005, 0.005], upper: [0.055, 0.055, 0.03]}}, settle: true}
bodies:
  - {plane: {point: [0, 0, 0], normal: [0, 0, 1]}}
  - {plane: {point: [0, 0, 0], normal: [1, 0, 0]}}
  - {plane: {point: [0.06, 0, 0], normal: [-1, 0, 0]}}
  - {plane: {point: [0, 0, 0], normal: [0, 1, 0]}}
  - {plane: {point: [0, 0.06, 0], normal: [0, -1, 0]}}
output: {every: 0.03125, fields: [grain.velocity, grain.spin]}
observe: [mass, momentum]
"""
LAYER = """
quern: 1
dimension: {dim}
gravity: [{zero}, -10]
domain: {{lower: [-1, {zero}], upper: [2, {one}]}}
time: {{end: 0.125}}
continuum:
  cell: 0.1
  material: {material}
  transfer: {{picflip: {{rate: 2}}}}
  fill: {{region: {{box: {{lower: [0, {zero}], upper: [0.6, {third}]}}}}, stress: at_rest}}
bodies: [{{plane: {{name: floor, point: [0, {zero}], normal: [{zero}, 1]}}}}]
output: {{every: 0.03125, fields: [point.velocity, point.stress, point.mass]}}
observe: [mass, momentum]
"""
ELASTIC = "{elastic: {bulk_modulus: 1e5, poisson: 0.2, density: 1000}}"
PLASTIC = "{drucker_prager: {density: 1500, bulk_modulus: 1e5}}"


def layer(dim, material):
    three = dim == 3
    return LAYER.format(dim=dim, material=material, zero="0, 0" if three else "0", one="0.3, 1" if three else "1",
                        third="0.3, 0.3" if three else "0.3")


def write(place, name, text):
    path = place / f"{name}.yaml"
    path.write_text(text)
    return path


def started(text, run, end, gravity):
    """The same scene from another run, with other gravity and another end."""
    text = re.sub(r"\n  fill: .*", f"\n  from: {run}", text)
    text = re.sub(r"gravity: .*", f"gravity: {gravity}", text)
    return re.sub(r"time: .*", f"time: {{end: {end}}}", text)


def table(path, group, name):
    """A field, of grains in the order of their numbers."""
    with h5py.File(path) as file:
        value = file[group][name][:]
        return value[numpy.argsort(file[group]["id"][:])] if "id" in file[group] else value


def same_from(whole, later, frame, group, names):
    """Frames of `whole` from `frame` on are those of `later`; so are the numbers of the series, but for time and step."""
    pairs = list(zip(lab.frames(whole)[frame:], lab.frames(later), strict=True))
    for a, b in pairs:
        for name in names:
            assert numpy.array_equal(table(a, group, name), table(b, group, name)), f"{a}, {b}: {name}"
    rows = [[line.split(",")[2:] for line in (folder / "series.csv").read_text().splitlines()[1:]] for folder in (whole, later)]
    assert rows[0][frame + 1:] == rows[1][1:], "series"
    return len(pairs)


def tilt(place, name, text, end, gravity, group, names):
    """A state tilted in a second scene runs as one tilted by the scene's own stages."""
    first, tilted, stages = (place / (name + more) for more in ("", "_tilted", "_stages"))
    lab.run(write(place, name, text), first)
    lab.run(write(place, tilted.name, started(text, name, 2 * end, gravity)), tilted)
    long = re.sub(r"time: .*", f"time: {{end: {3 * end}}}", text)
    lab.run(write(place, stages.name, long + f"stages: [{{for: {end}}}, {{set: {{gravity: {gravity}}}}}]\n"), stages)
    frame = round(end / 0.03125)
    found = f"{same_from(stages, tilted, frame, group, names)} frames to the bit"
    begin = table(lab.frames(tilted)[0], group, "position")
    way = numpy.abs(table(lab.frames(tilted)[-1], group, "position").mean(0) - begin.mean(0)).max()
    print(f"{name}: {len(begin)} {group} tilted in a second scene as in the first, {found}; they move by {way:.3g} m")
    assert way > 1e-4


def grains_tilt(place):
    tilt(place, "bed", BED, 0.125, "[4, -9]", "grains", ("id", "position", "velocity", "spin", "radius"))
    tilt(place, "box", BOX, 0.0625, "[4, 1, -9]", "grains", ("id", "position", "velocity", "spin", "radius"))


def layers_tilt(place):
    names = ("position", "velocity", "stress", "volume", "mass")
    tilt(place, "elastic", layer(2, ELASTIC), 0.125, "[2, -10]", "points", names)
    tilt(place, "plastic", layer(2, PLASTIC), 0.125, "[2, -10]", "points", names)
    tilt(place, "plastic_3d", layer(3, PLASTIC), 0.125, "[2, 0, -10]", "points", names)


def lasts(place):
    """The scene that it leaves gives the same again, wherever the first run has gone; so does a stop; so do --set and threads."""
    tilted = place / "bed_tilted"
    for scene in ("bed", "elastic"):
        lab.run(place / f"{scene}_tilted" / "scene.yaml", place / f"{scene}_again")
        lab.same(place / f"{scene}_tilted", place / f"{scene}_again", f"{scene}: from the scene that it left", checkpoint=False)
    lab.run(place / "bed_tilted.yaml", place / "stopped", "--until=0.1")
    lab.run(place / "bed_tilted.yaml", place / "stopped", resume=True)
    lab.same(tilted, place / "stopped", "stopped and gone on")
    lab.run(write(place, "set", started(BED, "null", 0.25, "[4, -9]")), place / "set", f"--set=grains.from={place / 'bed'}", threads=2)
    lab.same(tilted, place / "set", "named by --set, 2 threads")
    changed = place / "other"
    shutil.copytree(place / "bed", changed)
    lab.run(write(place, "changes", started(BED, "other", 0.25, "[4, -9]")), place / "changes", "--until=0.1")
    shutil.copy(place / "bed_tilted" / "checkpoint.h5", changed / "checkpoint.h5")
    said = lab.run(place / "changes.yaml", place / "changes", status=2, resume=True)
    assert "grains.from was" in said, said
    print("a run whose beginning has changed meanwhile does not go on from its checkpoint")


def history_counts(place):
    """From a frame that shows slips grains of 2-D begin with their springs; without them, beds give way a little first. Root mean square over all
    grains of three beds: how far the one goes that moves most is chance."""
    after = dict.fromkeys(("checkpoint", "frame", "none"), 0.0)
    for seed in (3, 4, 5):
        here = place / f"at_rest_{seed}"
        here.mkdir()
        bed = BED.replace("seed: 3", f"seed: {seed}")
        (here / "bed.yaml").write_text(bed)
        for name, options in (("bed", []), ("bare", ["--set=output.fields=[grain.velocity, grain.spin]"])):
            lab.run(here / "bed.yaml", here / name, *options)
        for name, source in (("checkpoint", "bed"), ("frame", "bed:4"), ("none", "bare:4")):
            scene = write(here, f"rest_{name}", started(bed, source, 0.0625, "[0, -10]"))
            lab.run(scene, here / f"rest_{name}")
            log = (here / f"rest_{name}" / "log.txt").read_text()
            assert ("all touches" in log) == (name != "checkpoint") and ("all contacts" in log) == (name == "none"), log
            start, end = (table(lab.frames(here / f"rest_{name}")[i], "grains", "position") for i in (0, -1))
            after[name] += numpy.mean((end - start) ** 2) / 3
    after = {name: math.sqrt(square) for name, square in after.items()}
    print("beds at rest move on by", ", ".join(f"{after[k]:.3g} m ({k})" for k in after))
    assert after["checkpoint"] < 0.6 * after["frame"] < 0.3 * after["none"]


def changes(place):
    """Density, friction and the law are this scene's; grains keep their numbers and new ones count on."""
    text = started(BED, "bed", 0.0625, "[0, -10]").replace("density: 2500", "density: 1000")
    text = text.replace("linear: {stiffness: 1e5", "hertz: {young: 1e7, poisson: 0.3").replace("output:", "label:")
    text = text.replace("label: {every: 0.03125, fields: [grain.velocity, grain.spin, contact.slip, touch.slip]}",
                        "output: {every: 0.03125, fields: [grain.velocity, grain.mass]}")
    text = text.replace("  overlap:", "  place: [{position: [0.125, 0.2], velocity: [0, -2], radius: 0.01}]\n  overlap:")
    lab.run(write(place, "changed", text), place / "changed")
    log = (place / "changed" / "log.txt").read_text()
    first = lab.frames(place / "changed")[0]
    mass, radius, number = (table(first, "grains", name) for name in ("mass", "radius", "id"))
    before = table(lab.frames(place / "bed")[-1], "grains", "id")
    assert numpy.allclose(mass, 1000 * numpy.pi * radius ** 2, rtol=1e-12)
    assert set(number) == set(before) | {before.max() + 1} and radius[-1] == 0.01
    assert re.search(r"begins anew: .*contact\.\w+ of contact\.hertz", log), log
    print(re.search(r"grains: not in .*", log)[0])
    other = started(layer(2, ELASTIC.replace("1000", "1500")), "plastic", 0.0625, "[0, -10]")
    lab.run(write(place, "stressed", other), place / "stressed")
    log = (place / "stressed" / "log.txt").read_text()
    assert "the state of material.elastic follows from the stress alone" in log, log
    a, b = (table(lab.frames(place / name)[i], "points", "stress") for name, i in (("plastic", -1), ("stressed", 0)))
    print(f"another material begins with the stress of the first: {numpy.abs(b).max():.5g} Pa, off by {numpy.abs(a - b).max():.2g}")
    assert numpy.abs(a - b).max() < 1e-12 * numpy.abs(b).max()


def stiffens(place):
    """The same material with another stiffness makes its state anew: the stress is that of the run, and nothing jumps."""
    text = started(layer(2, PLASTIC), "plastic", 0.0625, "[0, -10]")
    text, count = re.subn(r"bulk_modulus: (\w+)", lambda found: f"bulk_modulus: {2 * float(found[1]):g}", text)
    assert count == 1, text
    lab.run(write(place, "stiffer", text), place / "stiffer", "--set=output.every=1 ms", "--set=time.end=2 ms")
    assert "the state of material.drucker_prager follows from the stress alone" in (place / "stiffer" / "log.txt").read_text()
    was = numpy.abs(table(lab.frames(place / "plastic")[-1], "points", "stress")).max()
    for frame in lab.frames(place / "stiffer")[:2]:
        now = numpy.abs(table(frame, "points", "stress")).max()
        print(f"twice as stiff: the largest stress is {now / was:.3f} of that of the run at {frame.name}")
        assert 0.9 < now / was < 1.1, "the stress has jumped"


def becomes_hybrid(place):
    """A hybrid starts from grains that a run of grains has left, and keeps its ledger closed."""
    column = [*lab.SMALL["column"], "--set=time.end=5 ms"]
    lab.run("column", place / "grains", *column, "--set=model=grains")
    lab.run("column", place / "hybrid", *column, f"--set=grains.from={place / 'grains'}", "--set=grains.fill=null")
    found = lab.summary(place / "hybrid")
    print(f"hybrid: {found['grains']} grains and {found['points']} points, mass {found['mass_defect']:.2g}")
    assert found["points"] > 0 and abs(found["mass_defect"]) < 1e-12
    said = lab.run("column", place / "again", *column, f"--set=grains.from={place / 'hybrid'}", "--set=grains.fill=null", status=2)
    assert "it is of a run with a section hybrid" in said, said
    # from a frame, whose copy lies beside the hybrid's own scene; and a hybrid's own frame, wherever it lies
    frame = f"--set=grains.from={place / 'grains'}:0"
    lab.run("column", place / "shown", *column, frame, "--set=grains.fill=null")
    lab.run(place / "shown" / "scene.yaml", place / "shown_again")
    lab.same(place / "shown", place / "shown_again", "a hybrid from a frame, once more from its own scene", checkpoint=False)
    copy = place / "moved.h5"
    shutil.copy(lab.frames(place / "hybrid")[-1], copy)
    said = lab.run("column", place / "again", *column, f"--set=grains.from={copy}", "--set=grains.fill=null", status=2)
    assert "it is of a run with a section hybrid" in said, said


def processor_seconds():
    """Of all programs that were started from here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def is_fast(place):
    """A state of 10^5 grains is read in under a second of a processor: a busy machine or a slow disk is not what is asked."""
    scene = """
quern: 1
dimension: 3
gravity: [0, 0, -10]
domain: {lower: [0, 0, 0], upper: [0.5, 0.5, 0.5]}
time: {end: 1e-5}
grains:
  material: {density: 2500, radius: {mean: 4 mm}}
  contact: {linear: {stiffness: 1e4, friction: 0.5}}
  fill: {region: {box: {lower: [0.004, 0.004, 0.004], upper: [0.496, 0.496, 0.496]}}, packer: {random: {trials: 400}}}
bodies: [{plane: {point: [0, 0, 0], normal: [0, 0, 1]}}]
output: {every: 1e-5}
"""
    lab.run(write(place, "many", scene), place / "many")
    n = lab.summary(place / "many")["grains"]
    later = write(place, "many_later", started(scene, "many", 1e-5, "[0, 0, -10]"))
    empty = write(place, "empty", re.sub(r"\n  fill: .*", "\n  place: [{position: [0.2, 0.2, 0.2]}]", scene))
    took = []
    for path in (empty, later):
        begin = processor_seconds()
        lab.plan(path, MALLOC_PERTURB_="0")  # what malloc fills by request would count
        took.append(processor_seconds() - begin)
    print(f"{n} grains are read in {took[1] - took[0]:.2f} s")
    assert n >= 100_000 and took[1] - took[0] < 1


def refused(place, name, text, *expected):
    done = subprocess.run([lab.QUERN, "plan", str(write(place, name, text))], capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and not done.stdout, f"{name}: exit status {done.returncode}\n{done.stderr}"
    assert re.search(rf"{name}\.yaml:\d+:\d+: error: ", done.stderr), done.stderr
    for word in expected:
        assert word in done.stderr, f"{name}: '{word}' is not in\n{done.stderr}"
    print(done.stderr.splitlines()[0].replace(str(place) + "/", ""))


def damaged(place, name, change):
    """A copy of a run's frame 4 with a change."""
    folder = place / f"run_{name}" / "frames"
    folder.mkdir(parents=True)
    shutil.copy(place / "bed" / "frames" / "000004.h5", folder)
    with h5py.File(folder / "000004.h5", "r+") as file:
        change(file)
    return f"run_{name}:4"


def replace(group, name, value):
    del group[name]
    group[name] = value


def doubles(file):
    numbers = file["grains/id"][:]
    numbers[1] = numbers[0]
    file["grains/id"][...] = numbers


def put(name, value):
    def change(file):
        data = file[name][:]
        data[0] = value
        file[name][...] = data
    return change


def within(place, flat):
    """A frame is its run's also where it is named from within the run's folder."""
    write(place / "elastic", "within", flat.replace("from: elastic", "from: frames/000004.h5").replace("cell: 0.1", "cell: 0.05"))
    done = subprocess.run([lab.QUERN, "plan", "within.yaml"], cwd=place / "elastic", capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and "continuum.cell was 0.1 and is 0.05" in done.stderr, done.stderr


def what_does_not_fit(place):
    bed = started(BED, "bed", 0.25, "[4, -9]")
    flat = started(layer(2, ELASTIC), "elastic", 0.25, "[2, -10]")
    refused(place, "nowhere", bed.replace("from: bed", "from: nowhere"), "cannot read")
    refused(place, "no_frame", bed.replace("from: bed", "from: bed:99"), "frames/000099.h5", "No such file")
    (place / "unfinished" / "frames").mkdir(parents=True)
    refused(place, "no_checkpoint", bed.replace("from: bed", "from: unfinished"), "checkpoint.h5", "No such file")
    refused(place, "no_run", bed.replace("from: bed", "from: bed/series.csv"), "checksum does not hold")
    refused(place, "list", bed.replace("from: bed", "from: [bed]"), "from")
    refused(place, "dimension", started(BOX, "bed", 0.25, "[0, 0, -10]"), "2 dimensions", "has 3")
    refused(place, "other_kind", flat.replace("from: elastic", "from: bed"), "it holds no points")
    refused(place, "both", layer(2, ELASTIC).replace("  fill:", f"  from: {place / 'elastic'}\n  fill:"), "from", "fill")
    refused(place, "cell", flat.replace("cell: 0.1", "cell: 0.05"), "continuum.cell was 0.1 and is 0.05")
    within(place, flat)
    refused(place, "narrow", bed.replace("upper: [0.25, 0.25]", "upper: [0.2, 0.25]"), "lies outside of the domain")
    refused(place, "short", flat.replace("upper: [2, 1]", "upper: [0.4, 1]"), "lies outside of the domain")
    refused(place, "body", bed.replace("output:", "  - {box: {lower: [0.1, 0], upper: [0.15, 0.05]}}\noutput:"), "starts in body 3, a body.box")
    raised = bed.replace("{plane: {point: [0, 0], normal: [0, 1]}}", "{plane: {point: [0, 0.03], normal: [0, 1]}}")
    refused(place, "inside", raised, "starts in body 0, a body.plane, with its centre")
    sunk = flat.replace("point: [0, 0]", "point: [0, 0.15]")
    refused(place, "deep", sunk, "starts in body 'floor', a body.plane, deeper than a cell")
    two = BED.replace("material: {density: 2500, radius: {mean: 4 mm, spread: 10 %}}",
                      "materials: {sand: {density: 2500, radius: {mean: 4 mm}}, steel: {density: 7800, radius: {mean: 4 mm}}}")
    lab.run(write(place, "two", two), place / "two", "--set=time.end=0.03125")
    turned = started(two, "two", 0.25, "[0, -10]").replace("sand:", "mud:")
    refused(place, "materials", turned, "grains.materials.name was sand and is mud here")
    short = bed.replace("from: bed", "from: cut")
    (place / "cut").mkdir()
    (place / "cut/checkpoint.h5").write_bytes((place / "bed/checkpoint.h5").read_bytes()[:-999])
    refused(place, "cut_off", short, "checksum does not hold")
    for name, change, expected in (
            ("no_velocity", lambda file: file["grains"].__delitem__("velocity"), "it holds no grain.velocity"),
            ("no_grains", lambda file: file.__delitem__("grains"), "it holds no grains"),
            ("shorter", lambda file: replace(file["grains"], "velocity", numpy.zeros((3, 3))), "does not fit its set"),
            ("whole", lambda file: replace(file["grains"], "velocity", file["grains/velocity"][:].astype("i4")), "does not fit its set"),
            ("twice", doubles, "two entries have one grain.id"),
            ("index", put("contacts/first", 10 ** 6), "an index out of its set"),
            ("endless", put("grains/position", numpy.inf), "not finite"),
            ("light", put("grains/velocity", 1e9), "faster than light"),
            ("nothing", put("grains/radius", -1), "a radius of no grain"),
            ("format", lambda file: file.attrs.__setitem__("format", numpy.bytes_("other")), "no frame of this program")):
        refused(place, name, bed.replace("from: bed", f"from: {damaged(place, name, change)}"), expected)


def hostile(place):
    """Bytes of a frame changed anywhere: a sentence, or a run that starts; never a crash."""
    good = (place / "bed" / "frames" / "000004.h5").read_bytes()
    folder = place / "bytes" / "frames"
    folder.mkdir(parents=True)
    scene = write(place, "bytes", started(BED, "bytes:4", 0.25, "[4, -9]"))
    draw = numpy.random.default_rng(11)
    # HDF5 does not free all that it has read of a damaged file; and where it crashes a sanitizer must not stay to tell of it
    leaks = {**os.environ, "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0:handle_segv=0:handle_sigbus=0:handle_abort=0"}
    ends = {}
    for _ in range(60):
        data = bytearray(good)
        for at in draw.integers(0, min(len(data), 4096 if draw.random() < 0.5 else len(data)), 8):
            data[at] = draw.integers(0, 256)
        (folder / "000004.h5").write_bytes(data)
        done = subprocess.run([lab.QUERN, "plan", str(scene)], capture_output=True, text=True, timeout=120, env=leaks)
        assert done.returncode in (0, 2) and (done.returncode == 0 or "error: " in done.stderr), (done.returncode, done.stderr)
        ends[done.returncode] = ends.get(done.returncode, 0) + 1
    print(f"60 frames with changed bytes: {ends.get(2, 0)} refused, {ends.get(0, 0)} taken")


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (grains_tilt, layers_tilt, lasts, history_counts, changes, stiffens, becomes_hybrid, is_fast, what_does_not_fit, hostile):
            test(pathlib.Path(name))
