# SPDX-License-Identifier: MIT
"""`hybrid.substeps: auto` takes as many grain steps as fit into a step of the continuum: `plan` says the same number and why, scene.yaml has it, runs with
it are the same to the bit when stopped or made again, and a bed rests with it. What cannot be counted is refused. Of a hybrid `plan` expects what a
run then holds."""
import math
import pathlib

import lab
from workshop import quern

AUTO = "--set=hybrid.substeps=auto"
NARROW = [*lab.sets(domain__upper="[40 mm, 120 mm]", output__every="10 ms"), "--set=output.fields=[grain.velocity]",
          "--set=grains.fill.0.region.box.upper=[40 mm, -0.7 mm]", "--set=grains.fill.1.region.box.upper=[40 mm, 40 mm]",
          "--set=continuum.fill.region.box.upper=[40 mm, 38 mm]", "--set=observe=[energy, discrete_share, ledger]"]
WEIGHTS = lab.sets(domain__upper="[40 mm, 60 mm]", time__end="12 ms", output__every="2 ms")


def chosen(name, *options):
    return lab.plan(name, AUTO, *options)


def as_many_as_fit():
    """The number is that for which plan has room; with it the grains set the step, and what sets both steps is said."""
    for name in ("bed", "column", "shear"):
        plan = chosen(name)
        n, why = plan["substeps"], plan["most_substeps_set_by"]
        print(f"{name}: {n} substeps; {why}")
        assert n == plan["most_substeps"] > 10, plan
        assert plan["step_set_by"].startswith(f"{n} times contact.linear"), plan["step_set_by"]
        assert "stress waves of material.mu_i" in why and "contact.linear between the two lightest grains" in why
    half, twice = (chosen("column", f"--set=continuum.cell={h} mm")["substeps"] for h in (2, 4))
    assert abs(twice - 2 * half) <= 2, f"cells half as wide: {half} substeps, and {twice}"
    assert chosen("bed") == chosen("bed"), "two plans of one scene"


def the_scene_s_own_step():
    """A long step that the scene gives is cut into as many as leave no grain step longer than recommended."""
    short = chosen("bed")["step"] / chosen("bed")["substeps"]
    for step in (50e-6, 100e-6, 3e-6):
        n = chosen("bed", f"--set=time.step={step}")["substeps"]
        assert n == math.ceil(step / short * (1 - 1e-9)), f"{step}: {n} substeps of {short} s"


def refusals():
    for word, cure in (("atuo", "did you mean 'auto'?"), ("many", "auto"), ("[auto]", "must be one number")):
        said = quern("plan", lab.scene("bed"), f"--set=hybrid.substeps={word}", status=2)
        assert "substeps" in said and cure in said, said
    said = quern("plan", lab.scene("chute"), "--set=stages.0.set.hybrid={substeps: auto, oracle: {packing_fraction: {depth: 16 mm}}}", status=2)
    assert "auto is chosen once, before the run" in said, said
    said = quern("plan", lab.scene("bed"), AUTO, "--set=grains.contact=[]", "--set=grains.fill.1.settle=false", status=2)
    assert "auto has nothing to count" in said, said
    assert "most_substeps" not in chosen("bed", "--set=model=grains")


def the_number_is_kept(place):
    """scene.yaml has the number and not the word, and not what it was counted from; a stage that makes grains stiffer keeps it."""
    stages = "--set=stages=[{for: 5 ms}, {set: {grains.contact.linear.stiffness: 6e5}}]"
    scene = [*NARROW, *WEIGHTS, AUTO, stages]
    lab.run("bed", place / "whole", *scene, threads=2)
    kept = (place / "whole/scene.yaml").read_text().split("\nhybrid:")[1].split("\nobserve:")[0]
    n = chosen("bed", *NARROW, *WEIGHTS)["substeps"]
    assert f"  substeps: {n}\n" in kept and not any(word in kept for word in ("auto", "time_step", "    step:")), kept
    summary = lab.summary(place / "whole")
    assert summary["substeps"] == n * summary["steps"], f"{n} substeps, and {summary['substeps']} in {summary['steps']} steps"
    lab.run(place / "whole/scene.yaml", place / "again")
    lab.same(place / "whole", place / "again", "auto, and from the scene that it leaves")
    lab.run("bed", place / "stopped", *scene, "--until=7 ms")
    lab.run("bed", place / "stopped", *scene, resume=True)
    lab.same(place / "whole", place / "stopped", "auto, stopped and resumed")


def a_bed_rests(place):
    """With as many substeps as fit a bed at rest stays at rest, in its energy, its mass and its books; and it holds what plan has expected."""
    lab.run("bed", place / "rests", *NARROW, AUTO, "--set=time.end=60 ms")
    head, table = lab.series(place / "rests")
    rows = {name: [row[k] for row in table] for k, name in enumerate(column.split()[0] for column in head)}
    plan, summary = chosen("bed", *NARROW), lab.summary(place / "rests")
    expected, last = plan["expected"], -1
    moving = max(a + b for a, b in list(zip(rows["energy.grains"], rows["energy.points"]))[len(table) // 2:])
    lift = summary["mass_initial"] * 9.81 * 0.002
    print(f"{plan['substeps']} substeps: kinetic energy of at most {moving / lift:.2g} m g D in the second half")
    assert moving < 3e-3 * lift and summary["mass_defect"] < 1e-3
    share = rows["discrete_share.share"][last]
    for what, found, wanted in (("grains", expected["entries"]["grains"], summary["grains"]), ("points", expected["entries"]["points"], summary["points"]),
                                ("share", expected["share"], share)):
        print(f"{what}: expected {found:.4g}, held {wanted:.4g}")
        assert abs(found / wanted - 1) < 0.2, what
    assert expected["in_substeps"] == "grains" and 0 < expected["cost_with_most_substeps"] <= expected["cost"] + 1e-12 < 2


if __name__ == "__main__":
    as_many_as_fit()
    the_scene_s_own_step()
    refusals()
    with lab.workplace() as name:
        for test in (the_number_is_kept, a_bed_rests):
            test(pathlib.Path(name))
