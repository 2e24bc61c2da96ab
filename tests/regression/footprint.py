# SPDX-License-Identifier: MIT
"""What a sphere of a close packing takes of memory at the peak of a run is little more than its columns: no second copy of grains or
contacts, nothing that filling leaves behind, and files in the place of what stages work in. Taken between two sizes of the packing, since
libraries take the same for both."""
import pathlib

import h5py

import lab

SIZES = {"small": (20, 17.3205080756888), "large": (64, 55.4256258422041)}
SCENE = lab.SOURCE / "studies/scale/spheres.yaml"
AHEAD = 1.1    # of columns: a sixteenth more than there are entries, and how they are laid out
SPARE = 8      # bytes by entry: the other half of a reordering
ROWS = 96      # bytes by sphere: place and motion packed for contacts
PAIR = 10      # bytes by contact: the pairs as they are found, and what the last growth has ahead
SEARCH = 40    # bytes by sphere: cells, the buffer of a group of blocks, touches
MOST = 700     # bytes: contacts of the packing may not become so many that the sum above allows anything


def packing(place, name):
    x, y = SIZES[name]
    options = lab.sets(time__end=0.003, domain__upper=[x, y, 30], grains__fill__region__box__upper=[x, y, 19.5])
    # what malloc fills by request would count
    lab.run(SCENE, place / name, *options, MALLOC_PERTURB_="0")
    with h5py.File(place / name / "checkpoint.h5") as file:
        contacts = len(file["contact/first.0"])
    return lab.summary(place / name), contacts, lab.plan(SCENE, *options)


with lab.workplace() as name:
    place = pathlib.Path(name)
    (small, fewer, _), (large, more, plan) = packing(place, "small"), packing(place, "large")
    spheres = large["grains"] - small["grains"]
    contacts = (more - fewer) / spheres
    size = (large["state_rss_bytes"] - small["state_rss_bytes"]) / spheres
    entry = {one["name"]: one["bytes_per_entry"] for one in plan["sets"]}
    columns = entry["grain"] + SPARE + contacts * (entry["contact"] + SPARE)
    most = AHEAD * columns + ROWS + PAIR * contacts + SEARCH
    print(f"a sphere with {contacts:.2f} entries of the list takes {size:.0f} bytes; columns {columns:.0f}, allowed {most:.0f}")
    assert size < most < MOST
