#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""growth - how fast small waves grow in steady flow of material.mu_i with a density of flow.

    studies/flow_waves/growth.py

A plane flow is sheared at the inertial number I under the pressure p and has the density rho_I (docs/theory/materials.md, section 3). Small changes of both velocities,
pressure and density have the wave number k at some angle to the flow; the shear stress is mu(I) p along the strain rate, with nothing elastic left in it, and
the flow does not carry the waves along: a growth rate below the shear rate, which is printed too, says nothing. Printed: the largest growth rate over all angles, 1/s, with the angle that it has, for wave lengths of
16 mm to 1 mm: with a pace of 20 for each unit of shear at any inertial number, with that and the angle of dilation added to friction, whole or as 8 times what the density is
off by, and with the pace that the material has at its own density. Friction and dilation are those of configs/column.yaml."""
import numpy

STATIC, LIMIT, NUMBER, DILATION = 0.2495, 0.751, 0.331, 0.384
BULK, DIAMETER, GRAIN, FLOW = 3e5, 2e-3, 2500, 2040  # Pa, m, kg/m^3
STEEPNESS, WIDEST = 20, 0.2
LENGTHS = (16e-3, 8e-3, 4e-3, 2e-3, 1e-3)  # m
ANGLES = numpy.linspace(0, numpy.pi, 181)


def pace_of(looser):
    """What the material has: of density for each unit of shear, where flow is looser by this share."""
    return STEEPNESS / (1 + STEEPNESS * looser / (1 - looser))


def rate_of(inertial, pressure):
    """1/s, of the shear."""
    return inertial * numpy.sqrt(pressure / GRAIN) / DIAMETER


def growth(inertial, pressure, length, angle, pace, dilates):
    """1/s, of the mode that grows fastest; `dilates`: times what the density is off by, added to friction."""
    mu = STATIC + (LIMIT - STATIC) / (1 + NUMBER / inertial)
    steeper = (LIMIT - STATIC) * NUMBER / (inertial + NUMBER) ** 2
    looser = min(WIDEST, DILATION * inertial)
    answers = DILATION * inertial if looser < WIDEST else 0  # to changes of I
    density = FLOW * (1 - looser)
    rate = rate_of(inertial, pressure)
    along = 2j * numpy.pi / length * numpy.cos(angle)
    across = 2j * numpy.pi / length * numpy.sin(angle)
    u, v, p, r = numpy.eye(4, dtype=complex)  # of the last two: a pressure, a density over its own
    spread = along * u + across * v
    stretch, shear = (along * u - across * v) / 2, along * v + across * u
    faster = shear / rate - p / (2 * pressure)  # of I, over it
    off = r + answers / (1 - looser) * faster - p / BULK
    side = 2 * mu * pressure / rate * stretch
    drag = mu * p + pressure * (steeper * inertial * faster + dilates * off)
    return numpy.linalg.eigvals(numpy.array([
        (-along * p + along * side + across * drag) / density,
        (-across * p + along * drag - across * side) / density,
        BULK * (-spread + pace * rate * off),
        -spread])).real.max()


def main():
    print("    I  p, Pa  shear, 1/s  pace  in friction" + "".join(f"{1e3 * length:13.0f} mm" for length in LENGTHS))
    for inertial in (0.02, 0.1, 0.2, 0.3, 0.45, 0.6):
        for pressure in (100, 1000, 5000):
            own = pace_of(min(WIDEST, DILATION * inertial))
            for pace, dilates in ((STEEPNESS, 0), (STEEPNESS, 8), (STEEPNESS, STEEPNESS), (own, 0)):
                most = (max((growth(inertial, pressure, length, angle, pace, dilates), angle) for angle in ANGLES)
                        for length in LENGTHS)
                print(f"{inertial:5.2f} {pressure:6.0f} {rate_of(inertial, pressure):11.0f} {pace:5.1f} {dilates:12.0f}" +
                      "".join(f"{rate:9.0f} at {numpy.degrees(angle):4.0f}" for rate, angle in most))


if __name__ == "__main__":
    main()
