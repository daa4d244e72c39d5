"""Light that falls on the plate: uneven, unsteady, and that of the projector."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from synthetic.arrays import F64
from synthetic.points import polynomial_value

Field = Callable[[F64], F64]


@dataclass(frozen=True)
class Light:
    """Light on the face of the plate, 1 where it is as bright as without this part.

    Attributes
    ----------
    lamp : maps (K, 2) mm plate points to (K,) light; None for an even 1.
    projector : maps (K, 2) mm plate points to (K,) light that comes on top; None for a dark one.
    flicker : standard deviation of the whole light from image to image, relative.

    Raises
    ------
    ValueError
        A flicker that is negative or not finite.
    """

    lamp: Field | None = None
    projector: Field | None = None
    flicker: float = 0.0

    def __post_init__(self):
        if not 0 <= self.flicker < np.inf:
            raise ValueError(f"flicker must be at least 0, got {self.flicker} of the light")

    def at(self, points: F64, rng: Generator | None) -> F64:
        """Light (K,) at plate points (K, 2) mm in one image; None for steady light."""
        light = np.ones(len(points)) if self.lamp is None else _light_of(self.lamp, points, "lamp")
        if self.projector is not None:
            light = light + _light_of(self.projector, points, "projector")
        if self.flicker > 0 and rng is not None:
            light = light * max(1 + self.flicker * rng.standard_normal(), 0)
        return light


def polynomial_light(coefficients: ArrayLike, size: tuple[float, float]) -> Field:
    """Light that varies smoothly over a plate.

    Parameters
    ----------
    coefficients : (m, n), light Σ c[i, j] (x/a)^i (y/b)^j.
    size : (a, b) of the plate, mm.
    """
    c = np.array(coefficients, dtype=np.float64)
    if c.ndim != 2 or not np.isfinite(c).all():
        raise ValueError(f"coefficients of the light must be finite (m, n), got shape {c.shape}")

    def light(points: F64) -> F64:
        x, y = (points / size).T
        return polynomial_value(c, x, y)

    return light


def projected_discs(places: ArrayLike, radius: float, level: float, border: float = 0.5) -> Field:
    """Light of a projector that shows discs.

    Parameters
    ----------
    places : (n, 2), mm, middles.
    radius : mm.
    level : light of a disc, in units of the lamp's.
    border : width over which the light falls off, mm.
    """
    if not min(radius, border) > 0:
        raise ValueError(f"radius and border of a disc must be positive, got {radius}, {border} mm")
    middles = np.asarray(places, dtype=np.float64).reshape(-1, 2)

    def light(points: F64) -> F64:
        total = np.zeros(len(points))
        for middle in middles:
            total += soft_step((radius - np.hypot(*(points - middle).T)) / border)
        return level * total

    return light


def soft_step(depth: F64) -> F64:
    """0 below −1/2, 1 above 1/2, and a cubic with even slope in between."""
    t = np.clip(depth + 0.5, 0, 1)
    return t * t * (3 - 2 * t)


def _light_of(field: Field, points: F64, name: str) -> F64:
    light = np.asarray(field(points), dtype=np.float64)
    if light.shape != (len(points),):
        raise ValueError(
            f"light of the {name} must be ({len(points)},) for ({len(points)}, 2) mm points, "
            f"got {light.shape}"
        )
    if not (light >= 0).all():
        raise ValueError(f"light of the {name} must be at least 0, got {light.min():.6g}")
    return light
