"""Lévy's series for a plate whose two sides across x are supported."""

from collections.abc import Callable, Sequence
from math import isinf
from typing import cast

import numpy as np

import fe
from fe.plate.edges import Springs
from rig.system.arrays import F64

Spot = tuple[float, float]
"""x, y, mm."""


def levy(plate: fe.Plate, load: Spot, at: Spot, terms: int = 4000) -> tuple[float, F64]:
    """Deflection and curvatures at a point for 1 N along +z at another, Timoshenko's chapter 6.

    Along x the solution is a sum of sines. For each, the line load on an infinite strip has the
    closed form g(s) = (1 + α|s|) exp(-α|s|) / 4α³, and four exponentials that fall from the two
    edges make it meet them. Returns w in mm and w,xx w,yy w,xy in 1/mm; terms fall as exp(-α|Δy|)
    and as α⁻³ in w where load and point have one y.
    """
    (a, b), d, nu = plate.size, plate.rigidity, plate.poisson
    (xi, eta), (x, y) = load, at
    alpha = np.arange(1, terms + 1, dtype=np.float64) * (np.pi / a)
    south, north = (edge.springs for edge in plate.sides.along(1))
    rows: list[F64] = []
    right: list[F64] = []
    for place, springs, outward in ((0.0, south, -1.0), (b, north, 1.0)):
        waves = [wave(alpha, b, place, n) for n in range(4)]
        line = [strip(alpha, place - eta, n) for n in range(4)]
        for condition in conditions(alpha, d, nu, springs, outward):
            rows.append(condition(waves))
            right.append(-condition(line))
    matrix = np.moveaxis(np.array(rows), 2, 0)  # (terms, 4, 4)
    scale = np.abs(matrix).max(axis=2)
    forced = (np.array(right)[:, 0].T / scale)[..., None]
    amplitude = cast(F64, np.linalg.solve(matrix / scale[:, :, None], forced))[..., 0]
    derivatives = [
        strip(alpha, y - eta, n)[0] + (wave(alpha, b, y, n) * amplitude.T).sum(axis=0)
        for n in range(3)
    ]
    part = 2 * np.sin(alpha * xi) / (a * d)
    s, c = np.sin(alpha * x), np.cos(alpha * x)
    return (
        float((part * derivatives[0] * s).sum()),
        np.array(
            [
                (part * derivatives[0] * -(alpha**2) * s).sum(),
                (part * derivatives[2] * s).sum(),
                (part * derivatives[1] * alpha * c).sum(),
            ]
        ),
    )


def strip(alpha: F64, s: float, n: int) -> F64:
    """Take derivative n of the line load's solution on an infinite strip, (1, terms)."""
    t, e = alpha * abs(s), np.exp(-alpha * abs(s))
    sign = np.sign(s)
    return [
        (1 + t) * e / (4 * alpha**3),
        -sign * t * e / (4 * alpha**2),
        -(1 - t) * e / (4 * alpha),
        sign * (2 - t) * e / 4,
    ][n][None]


def wave(alpha: F64, b: float, y: float, n: int) -> F64:
    """Take derivative n of the four solutions that fall from the edges, (4, terms)."""
    t, u = alpha * y, alpha * (b - y)
    down, up = np.exp(-t), np.exp(-u)
    return alpha**n * np.array(
        [
            (-1) ** n * down,
            (-1) ** n * (t - n) * down,
            up,
            (u - n) * up,
        ]
    )


Condition = Callable[[Sequence[F64]], F64]
"""Takes derivatives 0 to 3 across an edge."""


def conditions(
    alpha: F64, d: float, nu: float, springs: Springs, outward: float
) -> tuple[Condition, Condition]:
    """Return what an edge asks of derivatives 0 to 3 across it."""

    def turn(f: Sequence[F64]) -> F64:
        if isinf(springs.rotation):
            return f[1]
        return outward * d * (f[2] - nu * alpha**2 * f[0]) + springs.rotation * f[1]

    def shift(f: Sequence[F64]) -> F64:
        if isinf(springs.deflection):
            return f[0]
        shear = f[3] - (2 - nu) * alpha**2 * f[1]
        return -outward * d * shear + springs.deflection * f[0]

    return turn, shift
