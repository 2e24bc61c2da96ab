# SPDX-License-Identifier: MIT
"""Runs that must end as promised, whatever they were given, and what a run that ends well must not have left.

A run ends with 0, 2, 3 or 4 and without a signal; where it fails it says why in a sentence. A run that ends with 0 left
nothing that is impossible: numbers that are not finite, grains or points behind a body or outside of the domain, deep
overlaps at the end, mass that is gone, kinetic energy that gravity and the start cannot give.
"""
import concurrent.futures
import json
import math
import os
import pathlib
import signal
import subprocess
import sys

import h5py
import numpy
import yaml

QUERN = os.environ["QUERN"]
SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])
sys.path.insert(0, str(SOURCE / "tests/regression"))
import lab  # noqa: E402

# a sanitizer takes ten times as long
SLOW = 10 if any(name in pathlib.Path(QUERN).read_bytes() for name in (b"__asan_init", b"__tsan_init")) else 1
SENTENCES = ("error:", "quern", "fault")


class Fault(Exception):
    pass


def need(good, what):
    if not good:
        raise Fault(what)


# ---- ends ----

def call(*words, limit, stop_after=None):
    """Exit status and what was said; after `stop_after` seconds a program that still runs is asked to stop."""
    process = subprocess.Popen([QUERN, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env={**os.environ, "QUERN_CACHE": ""})
    try:
        out, said = process.communicate(timeout=SLOW * (stop_after or limit))
    except subprocess.TimeoutExpired:
        if stop_after:
            process.send_signal(signal.SIGINT)
        try:
            need(stop_after, f"{words[0]} is past its {limit} s")
            out, said = process.communicate(timeout=SLOW * limit)
        except (subprocess.TimeoutExpired, Fault):
            process.kill()
            process.communicate()
            raise Fault(f"{words[0]} is past its {limit} s") from None
    return process.returncode, out, said.decode(errors="replace")


def check_end(words, status, said, allowed=(0, 2, 3, 4)):
    need(status >= 0, f"{words}: killed by signal {-status}\n{said[-2000:]}")
    need(status in allowed, f"{words}: exit status {status}\n{said[-2000:]}")
    need("Sanitizer" not in said and "runtime error" not in said, f"{words}: {said[-3000:]}")
    if status not in (0, 130):
        lines = [line for line in said.splitlines() if any(word in line for word in SENTENCES)]
        need(lines, f"{words}: exit status {status} and not a word but\n{said[-500:]}")


# ---- what a run has left ----

def number(value):
    return float(value)  # PyYAML takes 1e-05 for text


def check_numbers(folder):
    header, rows = lab.series(folder)
    table = numpy.array(rows, dtype=float).reshape(len(rows), len(header))
    for k, name in enumerate(header):
        need(numpy.isfinite(table[:, k]).all(), f"series.csv: {name} is not finite")
    for path in lab.frames(folder):
        for name, value in lab.contents(path).items():
            if numpy.asarray(value).dtype.kind == "f":
                need(numpy.isfinite(value).all(), f"{path.name}: {name} is not finite")

    def walk(value, name):
        need(value is not None, f"summary.json: {name} is null")
        if isinstance(value, float):
            need(math.isfinite(value), f"summary.json: {name} is {value}")
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
            walk(inner, f"{name}.{key}")
    summary = lab.summary(folder)
    walk(summary, "")
    return header, table, summary


class State:
    """Grains and points as the checkpoint at the end has them."""

    def __init__(self, folder, scene):
        self.dim = d = int(scene["dimension"])
        held = lab.contents(folder / "checkpoint.h5")

        def columns(name):
            return numpy.stack([held[f"{name}.{k}"] for k in range(d)], axis=1) if f"{name}.0" in held else None
        self.x, self.radius, self.v = columns("grain/position"), held.get("grain/radius.0"), columns("grain/velocity")
        self.fixed = held.get("grain/fixed.0", numpy.zeros(0 if self.x is None else len(self.x))) != 0
        self.points = columns("point/position")
        self.step = float(held["@dt"])
        self.watched = held.get("total/deep_first.0", numpy.array([-1.0]))[0] >= 0
        self.time = float(held["@begin"]) + float(held["@at"]) * float(held["@dt"])
        domain = scene["domain"]
        self.lower, self.upper = (numpy.array([number(v) for v in domain[k][:d]]) for k in ("lower", "upper"))
        self.periodic = numpy.array([bool(p) for p in domain["periodic"][:d]])
        self.open = numpy.array([[f"{side}_{axis}" in domain.get("open", []) for axis in "xyz"[:d]] for side in ("lower", "upper")])
        self.flows = self.open.any() or any(scene.get(part, {}).get("source") for part in ("grains", "continuum"))


def gap_of(body, x):
    """Signed distance of places from a body's surface."""
    (kind, what), = [(k, v) for k, v in body.items() if k in ("plane", "box")]
    if kind == "plane":
        normal = numpy.array([number(v) for v in what["normal"]])[:x.shape[1]]
        point = numpy.array([number(v) for v in what["point"]])[:x.shape[1]]
        return (x - point) @ (normal / numpy.linalg.norm(normal))
    lower, upper = (numpy.array([number(v) for v in what[k]])[:x.shape[1]] for k in ("lower", "upper"))
    outside = numpy.maximum(numpy.maximum(lower - x, x - upper), 0)
    inside = numpy.minimum(x - lower, upper - x).min(axis=1)
    return numpy.where(inside > 0, -inside, numpy.linalg.norm(outside, axis=1))


def is_there(body):
    inner = next((v for k, v in body.items() if k in ("plane", "box")), {})
    return "settling" not in (body.get("while"), inner.get("while"))


def check_places(s, scene):
    """Nothing that moves is behind a body or out of the domain."""
    for name, x, radius in (("grain", s.x, s.radius), ("point", s.points, None)):
        if x is None or not len(x):
            continue
        if name == "grain" and not scene["grains"]["contact"]:
            continue  # where no law is asked for, bodies bear nothing
        free = ~s.fixed if name == "grain" else numpy.ones(len(x), bool)
        slack = 1e-9 * (s.upper - s.lower)
        out = ((x < s.lower - slack) & ~s.open[0] | (x > s.upper + slack) & ~s.open[1]) & ~s.periodic
        need(not (out.any(axis=1) & free).any(), f"{(out.any(axis=1) & free).sum()} {name}s outside of the domain")
        for k, body in enumerate(b for b in scene.get("bodies", []) if is_there(b)):
            if not any(kind in body for kind in ("plane", "box")):
                continue
            # bodies act on the continuum's nodes: between two of them a point may be behind by part of a cell
            deep = (gap_of(body, x) < (0 if radius is not None else -number(scene["continuum"]["cell"]))) & free
            need(not deep.any(), f"{deep.sum()} {name}s behind the surface of body {k}")


def check_overlaps(s, scene):
    """No two grains in each other by more than a tenth of the smaller radius, unless the scene allows it."""
    most = number(scene["grains"]["overlap"]["most"])
    if s.x is None or len(s.x) < 2 or not most:
        return
    width, reach = s.upper - s.lower, 2 * s.radius.max()
    order = numpy.argsort(s.x[:, 0])
    x, v, radius, fixed = s.x[order], s.v[order], s.radius[order], s.fixed[order]
    since = 50 * s.step  # what is deep is looked for that often; a blow may have come in between
    for i in range(len(x)):
        j = slice(i + 1, numpy.searchsorted(x[:, 0], x[i, 0] + reach))
        if s.periodic[0]:
            j = slice(i + 1, len(x))
        way = x[j] - x[i]
        way -= numpy.where(s.periodic, width * numpy.round(way / width), 0)
        smaller = numpy.minimum(radius[j], radius[i])
        depth = (radius[j] + radius[i] - numpy.linalg.norm(way, axis=1)) / smaller
        depth[fixed[j] & fixed[i]] = 0
        deep = depth > max(most, 0.1)
        struck = numpy.linalg.norm(v[j] - v[i], axis=1) * since > depth * smaller
        need(s.watched or not (deep & ~struck).any(), f"an overlap of {depth[deep].max() if deep.any() else 0:.2g} radii at the end")


def check_sums(s, scene, header, table, summary, since):
    """What is carried stays; kinetic energy is what the start had, or row `since` if a run goes on there from a state that
    somebody has made, and what falling gives."""
    columns = ([k for k, name in enumerate(header) if name == f"{set} [1]"] for set in ("grains", "points"))
    grains, points = (table[:, of].sum(axis=1) for of in columns)  # a set that the scene does not have has no column
    if "hybrid" not in scene and not s.flows:
        need((grains == grains[0]).all() and (points == points[0]).all(), "grains or points vanish")
    need(grains[-1] + points[-1] > 0 or s.flows, "nothing is left")
    need(abs(summary["mass_defect"]) < 1e-9, f"mass_defect is {summary['mass_defect']}")
    if "energy.grains [J]" not in header or not len(table) or s.flows:
        return
    column = {name.split(" ")[0]: table[:, k] for k, name in enumerate(header)}
    kinetic = column["energy.grains"] + column["energy.spin"] + column["energy.points"]
    held = column["energy.stored"] + column["energy.sheared"] + column["energy.elastic"]
    g = math.sqrt(sum(number(v) ** 2 for v in scene["gravity"]))
    time = column["time"][-1]
    start = min(since, len(table) - 1)
    speed = math.sqrt(2 * kinetic[start] / max(summary["mass_final"], 1e-300))
    fall = float(numpy.linalg.norm(s.upper - s.lower)) * math.sqrt(len(s.upper)) + speed * time + 0.5 * g * time * time
    allowed = 1.05 * (kinetic[start] + abs(held[start]) + summary["mass_final"] * g * fall) + 1e-12 * summary["mass_final"]
    need(kinetic[start:].max() <= allowed or scene["time"]["force"], f"kinetic energy comes to {kinetic.max():.4g} J, and {allowed:.4g} J is all there can be")


def look(folder, since=0):
    """Raises Fault if a run that ended well has left nonsense; `since`: see check_sums."""
    folder = pathlib.Path(folder)
    header, table, summary = check_numbers(folder)
    scene = yaml.safe_load((folder / "scene.yaml").read_text())
    s = State(folder, scene)
    check_places(s, scene)
    if "grains" in scene:
        check_overlaps(s, scene)
    check_sums(s, scene, header, table, summary, since)


# ---- many ----

def each(work, cases, what):
    """work(case) -> a word that is counted, on as many processors as there are; the faults of all, then an end."""
    counts, faults = {}, []
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for case, done in [(case, pool.submit(work, case)) for case in cases]:
            try:
                word = done.result()
            except Exception as fault:  # what cannot be read back is one too
                word = "FAULT"
                faults.append(f"{case}: {fault if isinstance(fault, Fault) else repr(fault)}")
            counts[word] = counts.get(word, 0) + 1
    print(f"{what}: " + json.dumps(counts, sort_keys=True), flush=True)
    return faults
