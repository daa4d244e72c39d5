"""Displacement fields in closed form or by finite elements, on which estimators are compared."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

import fe
from rig.studies.correlation.moved_speckle import Displacement, Origin, came_from
from rig.system.arrays import F64, Mask

Absent = Callable[[F64, F64], Mask]
"""Whether there is no material at x and y of the reference, px."""

SHAPE = (480, 512)  # px
STAR = (501, 1080)
PERIODS = (10.0, 118.0)  # px, of the star
NOISY_STAR = (501, 2000)
NOISY_PERIODS = (10.0, 150.0)  # px
BANDS = ((20, 30), (30, 50), (50, 118))
EDGE = 40  # px from the border, that no estimator is judged on


@dataclass(frozen=True, eq=False)
class KnownField:
    """A displacement, px of the reference, on an image.

    Attributes
    ----------
    name : str
    shape : (H, W), px
    displacement : callable
    origin : callable
        Where the material came from.
    bands : dict of callables
        Parts of the image, each judged by itself: x, y → mask.
    absent : callable, optional
        Where there is no material, and so no pattern.
    """

    name: str
    shape: tuple[int, int]
    displacement: Displacement
    origin: Origin
    bands: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    absent: Absent | None = None

    def truth(self, xy: F64) -> F64:
        """Displacement of points (N, 2) px, (N, 2) px."""
        return np.column_stack(self.displacement(*xy.T))

    def inside(self, xy: F64) -> Mask:
        """Points (N,) of the material, away from the border."""
        away = np.all((xy >= EDGE) & (xy < np.array(self.shape[::-1]) - EDGE), axis=1)
        return away if self.absent is None else away & ~self.absent(*xy.T)

    def pierced(self, image: F64, moved: bool) -> F64:
        """Take the pattern off a drawing (H, W) where there is no material, moved or not."""
        if self.absent is None:
            return image
        y, x = np.indices(self.shape).astype(np.float64)
        return np.where(self.absent(*(self.origin(x, y) if moved else (x, y))), 128.0, image)

    def parts(self, xy: F64) -> dict[str, Mask]:
        """Points of each band, (N,) each; all of them where there are no bands."""
        inside = self.inside(xy)
        if not self.bands:
            return {self.name: inside}
        p = period(xy[:, 0])
        return {
            f"{self.name}, {name}": inside & (p >= low) & (p < high)
            for name, (low, high) in self.bands.items()
        }


def _smooth(name: str, displacement: Displacement) -> KnownField:
    return _smooth_over(name, SHAPE, displacement)


def _smooth_over(name: str, shape: tuple[int, int], displacement: Displacement) -> KnownField:
    return KnownField(name, shape, displacement, came_from(displacement))


def period(x: F64) -> F64:
    """Period of the star at columns x, px."""
    low, high = PERIODS
    return low + (high - low) * x / STAR[1]


@cache
def star() -> KnownField:
    """Wave along y whose period grows with x, of 0.5 px."""

    def displacement(x: F64, y: F64) -> tuple[F64, F64]:
        return 0 * x, 0.5 * np.cos(2 * np.pi * (y - 250) / period(x))

    bands = {f"{low} to {high} px": (float(low), float(high)) for low, high in BANDS}
    return KnownField("star", STAR, displacement, came_from(displacement), bands)


def noisy_star_period(x: F64) -> F64:
    """Period of the noisy star at columns x, px."""
    low, high = NOISY_PERIODS
    return low + (high - low) * x / (NOISY_STAR[1] - 1)


@cache
def noisy_star() -> KnownField:
    """Wave along y whose period grows with x to waves that no subset holds, of 0.5 px."""
    return _smooth_over(
        "noisy star",
        NOISY_STAR,
        lambda x, y: (0 * x, 0.5 * np.cos(2 * np.pi * (y - 250) / noisy_star_period(x))),
    )


def waves(length: float, size: float) -> KnownField:
    """Wave along y of one period and amplitude, px."""
    return _smooth(
        f"waves of {length:g} px",
        lambda x, y: (0 * x, size * np.cos(2 * np.pi * y / length)),
    )


@cache
def plate(seed: int) -> KnownField:
    """Draw a clamped plate under one to three touches, as a camera at a finite distance sees it."""
    rng = np.random.default_rng((seed, 1))
    size = np.array([250.0, 250.0 * SHAPE[0] / SHAPE[1]])
    made = fe.Plate(
        size=(float(size[0]), float(size[1])), thickness=1.0, young=3000.0, poisson=0.38,
        edges=fe.Clamped(),
    )  # fmt: skip
    touches = [
        fe.Touch(*(rng.uniform(0.2, 0.8, 2) * size), force=float(rng.uniform(0.3, 1)), radius=5.0)
        for _ in range(int(rng.integers(1, 4)))
    ]
    state = fe.deflect(made, touches, fe.grid(made, 60))
    along, down = (np.linspace(0, float(length), 241) for length in size)
    xy = np.column_stack([np.repeat(along, 241), np.tile(down, 241)])
    depths = state.deflection(xy)
    w = RectBivariateSpline(along, down, depths.reshape(241, 241))
    largest = 0.5 / np.abs(depths).max()  # px at the edge of the image
    scale, middle = size[0] / SHAPE[1], (np.array(SHAPE[::-1]) - 1) / 2

    def displacement(x: F64, y: F64) -> tuple[F64, F64]:
        at = (np.clip((a + 0.5) * scale, 0, n) for a, n in zip((x, y), size, strict=True))
        depth = largest * np.asarray(w.ev(*at))
        return depth * (x - middle[0]) / middle[0], depth * (y - middle[1]) / middle[1]

    return _smooth("plate", displacement)


@cache
def bumps(seed: int) -> KnownField:
    """Draw eight bumps of random place, width and size."""
    rng = np.random.default_rng((seed, 2))
    places, widths = rng.uniform(0, 1, (8, 2)) * SHAPE[::-1], rng.uniform(20, 90, 8)
    sizes = rng.normal(0, 0.4, (8, 2))

    def displacement(x: F64, y: F64) -> tuple[F64, F64]:
        u, v = 0 * x, 0 * y
        for (left, top), width, size in zip(places, widths, sizes, strict=True):
            bump = np.exp(-((x - left) ** 2 + (y - top) ** 2) / (2 * width**2))
            u, v = u + size[0] * bump, v + size[1] * bump
        return u, v

    return _smooth("bumps", displacement)


@cache
def shift(seed: int) -> KnownField:
    """Draw one motion of all."""
    a, b = np.random.default_rng((seed, 3)).uniform(-2, 2, 2)
    return _smooth("pure shift", lambda x, y: (0 * x + a, 0 * y + b))


@cache
def still(_: int) -> KnownField:
    """Nothing moves: the images differ by noise alone."""
    return _smooth("noise alone", lambda x, y: (0 * x, 0 * y))


@cache
def hole(seed: int) -> KnownField:
    """Draw a round hole in a sheet that is pulled: strains are twice as large at its rim."""
    rng = np.random.default_rng((seed, 6))
    middle = (np.array(SHAPE[::-1]) - 1) / 2 + rng.uniform(-60, 60, 2)
    radius, stretch = rng.uniform(40, 80), rng.uniform(1e-3, 4e-3)

    def displacement(x: F64, y: F64) -> tuple[F64, F64]:
        right, down = x - middle[0], y - middle[1]
        more = 1 + radius**2 / np.maximum(right**2 + down**2, radius**2 / 4)
        return stretch * right * more, -0.4 * stretch * down * more

    def absent(x: F64, y: F64) -> Mask:
        return np.hypot(x - middle[0], y - middle[1]) < radius

    return KnownField("hole", SHAPE, displacement, came_from(displacement), absent=absent)


@cache
def crack(seed: int) -> KnownField:
    """Draw a crack of 1 px: one side has moved by it, in a direction of its own, and strains."""
    rng = np.random.default_rng((seed, 4))
    angle, along = rng.uniform(-0.6, 0.6), rng.uniform(0, 2 * np.pi)
    jump, stretch = np.array([abs(np.cos(along)), np.sin(along)]), 1e-3

    def beyond(x: F64, y: F64) -> F64:
        return distance(x, y, angle)

    def displacement(x: F64, y: F64) -> tuple[F64, F64]:
        side = beyond(x, y) > 0
        return stretch * (x - 256) + jump[0] * side, jump[1] * side

    def origin(x: F64, y: F64) -> tuple[F64, F64]:
        near, there = (
            (x + 256 * stretch) / (1 + stretch),
            (x - jump[0] + 256 * stretch) / (1 + stretch),
        )
        moved = beyond(there, y - jump[1]) > 0
        return np.where(moved, there, near), np.where(moved, y - jump[1], y)

    return KnownField("crack of 1 px", SHAPE, displacement, origin)


def distance(x: F64, y: F64, angle: float) -> F64:
    """Distance from the line of the crack, px."""
    return (x - SHAPE[1] / 2) * np.cos(angle) + (y - SHAPE[0] / 2) * np.sin(angle)
