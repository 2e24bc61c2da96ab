# SPDX-License-Identifier: MIT
"""Grains that a hybrid makes of continuum have the radii that their law asks for: whoever would draw anew where a grain finds no room
would make them too small."""
import pathlib

import h5py
import lab
import numpy

MEAN, SPREAD, SEEDS, DENSITY = 1e-3, 0.3, 5, 2500


def converted(name, seed, folder):
    """Radii of all grains that came after the first frame, those they will have when they have grown: what goes with their mass."""
    lab.run(name, folder, *lab.SMALL[name], *lab.sets(
        seed=seed, time__end="250 ms", hybrid__update=60, output__fields="[grain.mass]",
        grains__material__radius=f"{{mean: {MEAN}, spread: {SPREAD}, law: uniform}}"))
    first, radii = None, {}
    for frame in lab.frames(folder):
        with h5py.File(frame) as file:
            number, mass = file["grains/id"][()].ravel(), file["grains/mass"][()].ravel()
        radius = (mass / (numpy.pi * DENSITY)) ** 0.5
        first = number.max() if first is None else first
        radii.update(zip(number[number > first].tolist(), radius[number > first].tolist()))
    return list(radii.values())


def main():
    radii = []
    for seed in range(1, SEEDS + 1):
        with lab.workplace() as place:
            radii += converted("column", seed, pathlib.Path(place) / "run")
    n = len(radii)
    place = numpy.sort((numpy.array(radii) / MEAN - 1 + SPREAD) / (2 * SPREAD))  # 0 to 1, evenly if all is well
    steps = numpy.arange(n)
    distance = max((place - steps / n).max(), ((steps + 1) / n - place).max())
    below, error = 0.5 - place.mean(), (1 / 12 / n) ** 0.5
    print(f"{n} grains made of continuum: mean radius {2 * SPREAD * -below:+.2%} off, standard error {2 * SPREAD * error:.2%}; "
          f"Kolmogorov and Smirnov's distance {distance:.4f}, at 1 % {1.63 / n ** 0.5:.4f}")
    assert n > 800 and 0 <= place[0] and place[-1] <= 1
    assert distance < 1.63 / n ** 0.5, "the radii do not follow their law"


if __name__ == "__main__":
    main()
