# SPDX-License-Identifier: MIT
"""What a calibration leaves: calibration.yaml for scenes, options.txt for the command line, rows.csv, a page with its charts."""
import argparse
import csv
import importlib.util
import io
import math
import pathlib
import shlex
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import yaml

from .chart_data import Curve, Picture
from .program import call
from .rheology import Bed, Grains, Law, Looseness, Rows, Shear, Slide, displacement_of, fit_law, law_of, looseness_of, slip_of
from .workers import save

AT = (0.01, 0.03, 0.1, 0.3)  # inertial numbers at which the law's spread is told


@dataclass(frozen=True)
class Found:
    """What was measured: a bed for each seed, for each angle a chute for each seed, and slides on a smooth plane: none if nothing slid, None if that is not known."""
    name: str
    dimension: int
    grains: Grains
    beds: list[Bed]
    chutes: dict[float, list[Rows]]  # by angle in degrees
    slides: list[Slide] | None
    sheared: list[list[Shear]]  # by seed
    by_shear: bool  # whether the law is that of plane shear

    @cached_property
    def sides(self) -> dict[str, tuple[Law, list[Law]]]:
        """The law of each kind of flow, and what it is without one of the seeds each. That of the block comes first."""
        kinds = {"chutes": self.law_without} | ({"plane shear": self.shear_without} if self.sheared else {})
        order = sorted(kinds, key=lambda kind: (kind == "plane shear") != self.by_shear)
        n = len(self.beds)
        return {kind: (kinds[kind](None), [kinds[kind](out) for out in range(n)] if n > 1 else []) for kind in order}

    def law_without(self, out: int | None) -> Law:
        return law_of([one for rows in self.chutes.values() for k, one in enumerate(rows) if k != out])

    def shear_without(self, out: int | None) -> Law:
        points = [one for k, seed in enumerate(self.sheared) if k != out for one in seed]
        return fit_law(np.array([one.inertia for one in points]), np.array([one.friction for one in points]))

    def kind(self) -> str:
        return next(iter(self.sides))

    def law(self) -> Law:
        return self.sides[self.kind()][0]

    def laws(self) -> list[Law]:
        return self.sides[self.kind()][1]

    def bulk_modulus(self) -> float:
        return float(np.mean([one.bulk_modulus for one in self.beds]))

    def looseness(self) -> Looseness:
        return looseness_of([one for rows in self.chutes.values() for one in rows], self.bulk_modulus())

    def loosenesses(self) -> list[Looseness]:
        """Of each seed."""
        return [looseness_of([rows[k] for rows in self.chutes.values()], self.bulk_modulus()) for k in range(len(self.beds))]


def spread(values) -> float:
    """Standard deviation of single seeds; NaN of one."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else math.nan


def mean(values) -> tuple[float, float]:
    """Over seeds, with its standard error."""
    return float(np.mean(values)), spread(values) / math.sqrt(len(values))


def left_out(values) -> float:
    """Standard error of what is found from all seeds, of what is found without one each (jackknife); NaN of one seed."""
    n = len(values)
    return spread(values) * (n - 1) / math.sqrt(n) if n > 1 else math.nan


def constants(found: Found) -> dict[str, tuple[float, float, str]]:
    """Key of material.mu_i: value, standard error over seeds, unit."""
    law, laws, beds = found.law(), found.laws(), found.beds
    loose, each = found.looseness(), found.loosenesses()
    return {"critical_density": (*mean([one.density for one in beds]), "kg/m^3"),
            "flow_density": (loose.density, mean([one.density for one in each])[1], "kg/m^3"),
            "dilation": (max(0.0, loose.dilation), mean([one.dilation for one in each])[1], ""),
            "static_friction": (law.mu_s, left_out([one.mu_s for one in laws]), ""),
            "limit_friction": (law.mu_2, left_out([one.mu_2 for one in laws]), ""),
            "inertial_number": (law.i_0, left_out([one.i_0 for one in laws]), ""),
            "bulk_modulus": (*mean([one.bulk_modulus for one in beds]), "Pa")}


def slip_length(found: Found) -> tuple[float, float]:
    """In diameters: mean over the angles, with its standard error over seeds."""
    return mean([np.mean([slip_of(rows[k]).length for rows in found.chutes.values()]) / found.grains.diameter for k in range(len(found.beds))])


def rough_floor(found: Found) -> str:
    """The floor of the chutes as a body's boundary. Where the block has another law than the chutes', the floor has theirs, which its slip goes with."""
    own = found.sides["chutes"][0]
    law = f", static_friction: {plain(own.mu_s)}, limit_friction: {plain(own.mu_2)}, inertial_number: {plain(own.i_0)}" if found.kind() != "chutes" else ""
    return f"boundary: {{rough: {plain(slip_length(found)[0])}{law}}}"


def displacements(found: Found) -> tuple[tuple[float, float], tuple[float, float]]:
    """In m, of the chutes, mean over the angles, and of the settled beds; with standard errors over seeds."""
    seeds = range(len(found.beds))
    return (mean([np.mean([displacement_of(rows[k], found.bulk_modulus()) for rows in found.chutes.values()]) for k in seeds]),
            mean([one.displacement for one in found.beds]))


def about_walls(found: Found) -> str:
    if found.slides is None:
        return "friction of a smooth wall: not measured"
    if not found.slides:
        return "a smooth wall holds these grains: boundary: sticky"
    friction = mean([one.friction for one in found.slides])
    return f"smooth walls, boundary: {{frictional: {plain(friction[0], 3)}}}" + (f", ± {plain(friction[1], 2)}" if math.isfinite(friction[1]) else "")


def plain(value: float, figures: int = 4) -> str:
    return f"{value:.{figures}g}" if value < 10 ** figures else f"{float(f'{value:.{figures}g}'):.0f}"


def with_spread(value: float, off: float) -> str:
    return f"{plain(value)} ± {plain(off, 2)}" if math.isfinite(off) else plain(value)


def as_yaml(tree: dict) -> str:
    """YAML that the program and Python read alike: 1.0e+5, not 1e5."""
    return yaml.safe_dump(tree, sort_keys=False, default_flow_style=None, width=140)


# ---- for scenes ----

def given(found: Found) -> dict[str, float]:
    """Keys of material.mu_i that I is defined with."""
    return {"diameter": found.grains.diameter, "grain_density": found.grains.density}


def block(found: Found, command: str) -> str:
    """What stands in a scene's continuum."""
    rows = {key: (plain(value), f"± {plain(off, 2)}" if math.isfinite(off) else "of one seed")
            for key, (value, off, _) in constants(found).items()}
    rows |= {key: (plain(value, 9), "of these grains") for key, value in given(found).items()}
    low, high = inertia_range(found)
    length, off = slip_length(found)
    flowing, settled = displacements(found)
    others = [f"# friction of {kind}: {told_law(found, kind)}" for kind in found.sides]
    lines = [f"# {command}",
             f"# chutes at {listed(found.chutes)} degrees, I from {plain(low, 2)} to {plain(high, 2)}, {len(found.beds)} seeds; ± standard error",
             *others, f"# slip over the rough floor: {with_spread(length, off)} diameters of shear rate: {rough_floor(found)}",
             f"# displacement of the rough floor: {with_spread(*flowing)} m in flow, {with_spread(*settled)} m in a settled bed",
             f"# {about_walls(found)}", "continuum:", "  material:", "    mu_i:"]
    return "\n".join(lines + [f"      {key}: {value}".ljust(40) + f"# {note}" for key, (value, note) in rows.items()]) + "\n"


def options_text(found: Found) -> str:
    values = {key: plain(value) for key, (value, _, _) in constants(found).items()}
    values |= {key: plain(value, 9) for key, value in given(found).items()}
    return "".join(f"--set=continuum.material.mu_i.{key}={value}\n" for key, value in values.items())


def listed(angles) -> str:
    *most, last = [f"{angle:g}" for angle in sorted(angles)]
    return f"{', '.join(most)} and {last}" if most else last


def inertia_range(found: Found) -> tuple[float, float]:
    every = np.concatenate([one.inertia[one.bulk] for rows in found.chutes.values() for one in rows])
    return float(every.min()), float(every.max())


# ---- for people ----

def rows_csv(found: Found) -> str:
    """Every row of every chute."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(["angle [degree]", "seed", "bulk", "height [m]", "density [kg/m^3]", "velocity [m/s]", "pressure [Pa]", "friction",
                    "inertial_number"])
    for angle, rows in sorted(found.chutes.items()):
        for seed, one in enumerate(rows, 1):
            for k in np.flatnonzero(one.density > 0):
                numbers = (one.y[k], one.density[k], one.velocity[k], one.pressure[k], one.friction[k], one.inertia[k])
                table.writerow([f"{angle:g}", seed, int(one.bulk[k]), *("" if math.isnan(x) else f"{x:.6g}" for x in numbers)])
    return out.getvalue()


def pictures(found: Found) -> list[Picture]:
    d, flow, speed = found.grains.diameter, [], []
    for angle, rows in sorted(found.chutes.items()):
        every = [(one.inertia[one.bulk], one.friction[one.bulk]) for one in rows]
        x, y = (np.concatenate([pair[k] for pair in every]) for k in (0, 1))
        order = np.argsort(x)
        flow.append(Curve(f"{angle:g}°", x[order], y[order]))
        there = np.all([one.density > 0.5 * np.median(one.density[one.bulk]) for one in rows], axis=0)
        speed.append(Curve(f"{angle:g}°", np.mean([one.velocity[there] for one in rows], axis=0), rows[0].y[there] / d))
    x = np.linspace(0, max(measured(found, kind)[1] for kind in found.sides) * 1.1, 100)
    for kind, (law, _) in found.sides.items():
        flow.append(Curve(f"the law of {kind}", x, law(x), reference=kind == found.kind()))
    if found.sheared:
        each = np.array([[(one.inertia, one.friction) for one in seed] for seed in found.sheared]).mean(axis=0)
        flow.append(Curve("plane shear", each[:, 0], each[:, 1]))
    return [Picture("mu", "scalar", "Friction over the inertial number", ("I", ""), ("tau/p", ""), flow),
            Picture("velocity", "scalar", "Velocity in the chutes", ("velocity", "m/s"), ("height over d", ""), speed)]


def constants_table(found: Found) -> list[str]:
    return ["| key of `material.mu_i` | value ± standard error | unit |", "|---|---|---|",
            *(f"| `{key}` | {with_spread(value, off)} | {unit} |" for key, (value, off, unit) in constants(found).items())]


def chutes_table(found: Found) -> list[str]:
    lines = ["| angle [°] | tau/p | I | density [kg/m³] | slip at the floor [m/s] | shear rate there [1/s] | slip length over d | displacement over d |",
             "|---|---|---|---|---|---|---|---|"]
    for angle, rows in sorted(found.chutes.items()):
        slips = [slip_of(one) for one in rows]
        parts = [[float(np.mean(one.friction[one.bulk])) for one in rows], [float(np.mean(one.inertia[one.bulk])) for one in rows],
                 [float(np.mean(one.density[one.bulk])) for one in rows], [one.velocity for one in slips], [one.rate for one in slips],
                 [one.length / found.grains.diameter for one in slips], [displacement_of(one, found.bulk_modulus()) / found.grains.diameter for one in rows]]
        lines.append(f"| {angle:g} | " + " | ".join(with_spread(*mean(part)) for part in parts) + " |")
    return lines


def measured(found: Found, kind: str) -> tuple[float, float]:
    """Smallest and largest inertial number of that kind of flow."""
    if kind == "chutes":
        return inertia_range(found)
    every = [one.inertia for seed in found.sheared for one in seed]
    return min(every), max(every)


def told_law(found: Found, kind: str) -> str:
    law, laws = found.sides[kind]
    low, high = measured(found, kind)
    return ", ".join(f"{with_spread(float(law(x)), left_out([float(one(x)) for one in laws]))} at I = {x:g}" for x in AT if low / 2 < x < 2 * high)


def about_law(found: Found) -> list[str]:
    high = measured(found, found.kind())[1]
    told = "; ".join(f"in {kind} it says {told_law(found, kind)}" for kind in found.sides)
    said = [f"The law is that of {found.kind()}: {told}. The three numbers of a law scatter more than the law does, since one can stand in for another; take "
            "them together."]
    if found.law().i_0 > high * 5:
        said.append("The flows hardly show that friction comes to an end: mu_2 and I_0 stand for a straight line, "
                    "and say nothing of faster flows.")
    return said


def about_bed(found: Found) -> str:
    settled, loaded, unloaded = ([getattr(one, name) for one in found.beds] for name in ("settled", "loaded", "unloaded"))

    def told(values) -> str:
        return with_spread(*mean(values))
    return (f"Settled grains have {told(settled)} kg/m³ as they lie; `critical_density` is less by what their weight compresses. A fifth more "
            f"weight presses the bed together with a constrained modulus of {told(loaded)} Pa, of which `bulk_modulus` is made; relieved, it "
            f"comes back with {told(unloaded)} Pa.")


def about_slides(found: Found) -> str:
    if not found.slides:
        return "Friction of a smooth wall was not measured." if found.slides is None else "On a smooth plane no layer slid, however far it leant."
    told = [with_spread(*mean([getattr(one, name) for one in found.slides])) for name in ("friction", "speed")]
    return (f"On a smooth plane that leans, a layer of these grains slides with a friction of {told[0]}, as its acceleration says; its lowest row came to "
            f"{told[1]} m/s.")


def page(found: Found, command: str, drawn: list[str]) -> str:
    pictures_of = [f"![{name}]({name}.svg)" for name in drawn]
    parts = [f"# Calibration of {found.name}", f"`{command}`", "± is the standard error over seeds.", "\n".join(constants_table(found)),
             *about_law(found), about_bed(found), about_slides(found), "\n".join(chutes_table(found)), *pictures_of, "For a scene:", f"```yaml\n{block(found, command)}```"]
    return "\n\n".join(parts) + "\n"


def command_of(options: argparse.Namespace) -> str:
    words = ["quern", "calibrate", options.scene, *(word for one in options.set for word in ("--set", one))]
    words += ["--angles", ",".join(f"{angle:g}" for angle in options.angles)] * bool(options.angles)
    words += ["--law", options.law] * (options.law != "shear")
    words += ["--seeds", str(options.seeds)] * (options.seeds != 3) + ["--size", f"{options.size:g}"] * (options.size != 1)
    return shlex.join(words)


def write(found: Found, folder: pathlib.Path, options: argparse.Namespace) -> str:
    """All files; returns what to say."""
    command, drawn = command_of(options), []
    save(folder / "calibration.yaml", block(found, command))
    save(folder / "options.txt", options_text(found))
    save(folder / "rows.csv", rows_csv(found))
    if importlib.util.find_spec("matplotlib"):
        from .chart_draw import save as draw
        for one in pictures(found):
            draw(one, [folder / f"{one.name}.svg"], {"Title": one.title, "Creator": call(["--version"]).stdout.strip(), "Description": command,
                                                     "Source": "rows.csv"})
            drawn.append(one.name)
    save(folder / "calibration.md", page(found, command, drawn))
    return f"{block(found, command)}\n{folder / 'calibration.yaml'}; {folder / 'calibration.md'}"
