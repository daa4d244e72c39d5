"""The plate, its edges and what touches it: numbers with units, checked once at the door."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

# A point this far outside, in parts of the side, is on the edge but for rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Clamped:
    """All four edges held in deflection and in rotation."""

    kind: Literal["clamped"] = "clamped"


@dataclass(frozen=True)
class Touch:
    """A force on one point of the touched face.

    Attributes
    ----------
    x, y : float
        Place in the plate, mm from its corner.
    force : float
        N, positive into the plate.

    Raises
    ------
    ValueError
        A number is not finite.
    """

    x: float
    y: float
    force: float

    def __post_init__(self) -> None:
        for name, unit in (("x", "mm"), ("y", "mm"), ("force", "N")):
            value = getattr(self, name)
            if not isfinite(value):
                raise ValueError(f"touch {name} must be finite, got {value} {unit}")


@dataclass(frozen=True)
class Plate:
    """A flat rectangular plate of one isotropic material.

    The frame has its origin in a corner, x and y in the plate and z out of the touched face.

    Attributes
    ----------
    size : tuple of float
        Sides (a, b) along x and y, mm.
    thickness : float
        h, mm.
    young : float
        Young's modulus, MPa.
    poisson : float
        Poisson's ratio.
    edges : Clamped
        How the edges are held.

    Raises
    ------
    ValueError
        A length or the modulus is not positive, Poisson's ratio does not lie between -1 and 0.5.
    """

    size: tuple[float, float]
    thickness: float
    young: float
    poisson: float
    edges: Clamped = Clamped()

    def __post_init__(self) -> None:
        lengths = np.asarray(self.size, dtype=float)
        if lengths.shape != (2,):
            raise ValueError(f"plate size must be two sides in mm, got {self.size}")
        object.__setattr__(self, "size", (float(lengths[0]), float(lengths[1])))
        _positive("plate side a", self.size[0], "mm")
        _positive("plate side b", self.size[1], "mm")
        _positive("plate thickness", self.thickness, "mm")
        _positive("Young's modulus", self.young, "MPa")
        if not -1.0 < self.poisson < 0.5:
            raise ValueError(
                f"Poisson's ratio must lie between -1 and 0.5, got {self.poisson}; PVC has 0.38"
            )
        if not isinstance(self.edges, Clamped):
            raise ValueError(f"plate edges must be Clamped(), got {self.edges!r}")

    @property
    def rigidity(self) -> float:
        """Bending rigidity D = E h³ / 12 (1 - ν²), N mm."""
        return self.young * self.thickness**3 / (12.0 * (1.0 - self.poisson**2))

    @property
    def area(self) -> float:
        """Area of the face, mm²."""
        return self.size[0] * self.size[1]

    def points(self, xy: ArrayLike, name: str = "point") -> NDArray[np.float64]:
        """Return points as an array after checking that they lie on the plate.

        Parameters
        ----------
        xy : (K, 2) array_like
            Places in the plate frame, mm.
        name : str
            What they are, for the sentence of the error.

        Returns
        -------
        (K, 2) float64, mm

        Raises
        ------
        ValueError
            The shape is not (K, 2), or a point is not finite or lies outside the plate.
        """
        xy = np.ascontiguousarray(xy, dtype=np.float64)
        if xy.ndim != 2 or xy.shape[1] != 2:
            raise ValueError(f"{name}s must have shape (K, 2) in mm, got {xy.shape}")
        a, b = self.size
        x, y = xy[:, 0], xy[:, 1]
        slack_x, slack_y = _ROUNDING * a, _ROUNDING * b
        # Written so that NaN falls outside.
        on = (x >= -slack_x) & (x <= a + slack_x) & (y >= -slack_y) & (y <= b + slack_y)
        if not on.all():
            k = int(np.argmin(on))
            raise ValueError(
                f"{name} {k} must lie on the plate, 0 to {a:g} by 0 to {b:g} mm, "
                f"got ({x[k]:g}, {y[k]:g}) mm"
            )
        return xy


def _positive(quantity: str, value: float, unit: str) -> None:
    if not (isfinite(value) and value > 0):
        raise ValueError(f"{quantity} must be positive and finite, got {value:g} {unit}")
