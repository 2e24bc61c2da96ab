#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What pressures do within a cell: of each run, the root mean square of the points' pressures about the mean of their cell, over that of these
means, as a mean over its frames; cells that bear 300 Pa or more. The runs need `output.fields` with point.pressure and point.volume.

    quern run configs/column.yaml -o out/plain --set model=continuum --set 'output.fields=[point.pressure, point.volume]'
    quern run configs/column.yaml -o out/averaged --set model=continuum --set continuum.strain=averaged \
        --set 'output.fields=[point.pressure, point.volume]'
    studies/locking/scatter.py out/plain out/averaged
"""
import pathlib
import sys

import h5py
import numpy

CELL, LEAST = 4e-3, 300


def scatter(frame):
    with h5py.File(frame) as file:
        x, p, v = (file[f"points/{name}"][:] for name in ("position", "pressure", "volume"))
    cells = numpy.unique(numpy.floor(x[:, :2] / CELL).astype(int), axis=0, return_inverse=True)[1].ravel()
    volume = numpy.bincount(cells, v)
    mean = numpy.bincount(cells, v * p) / volume
    spread = numpy.bincount(cells, v * (p - mean[cells]) ** 2)
    counts = (numpy.bincount(cells) > 1) & (mean > LEAST)
    return numpy.sqrt(spread[counts].sum() / (volume * mean**2)[counts].sum()) if counts.any() else numpy.nan


for run in sys.argv[1:]:
    found = [scatter(frame) for frame in sorted((pathlib.Path(run) / "frames").glob("*.h5"))]
    print(f"{run}: {numpy.nanmean(found):.3f}; at the end {found[-1]:.3f}")
