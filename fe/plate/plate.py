"""The plate, its edges and what touches it: numbers with units, checked once at the door."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64, Mask
from fe.plate.checks import array, number, positive, short
from fe.plate.edges import Clamped, Edge, Edges, check_edge, check_held
from fe.plate.shape import Shape

# A point this far outside, in parts of the side, is on the edge but for rounding.
_ROUNDING = 1e-9

_ALL_CLAMPED = Clamped()

# A shape is shallow up to this slope: lengths and areas in the plane of the frame are then those
# of the surface but for the square of it, 1 %.
_STEEPEST = 0.1
# Places along each side at which its slope is looked at.
_LOOKS = np.linspace(0.0, 1.0, 65)


@dataclass(frozen=True)
class Touch:
    """A force on one point of the touched face, or spread evenly over a disc of it.

    Attributes
    ----------
    x, y : float
        Place in the plate, mm from its corner.
    force : float
        N, positive into the plate.
    radius : float
        Of the disc, mm; 0 for a point.

    Raises
    ------
    ValueError
        A number is not finite, or the radius is negative.
    """

    x: float
    y: float
    force: float
    radius: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("x", "mm"), ("y", "mm"), ("force", "N"), ("radius", "mm")):
            value = number(getattr(self, name), f"touch {name}", unit)
            if not isfinite(value):
                raise ValueError(f"touch {name} must be finite, got {value} {unit}; give a number")
            object.__setattr__(self, name, value)
        if self.radius < 0:
            raise ValueError(
                f"touch radius must be 0 mm or more, got {self.radius:g} mm; write 0 for a point"
            )


@dataclass(frozen=True)
class Patch:
    """A rectangle of the plate with its own thickness and modulus, about the same middle plane.

    Attributes
    ----------
    x, y : tuple of float
        From and to along each side, mm.
    thickness : float
        mm.
    young : float
        Young's modulus, MPa.

    Raises
    ------
    ValueError
        A rectangle is empty, or the thickness or the modulus is not positive.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    thickness: float
    young: float

    def __post_init__(self) -> None:
        for name in ("x", "y"):
            low, high = _pair(getattr(self, name), f"patch {name}", "from and to")
            object.__setattr__(self, name, (low, high))
            if not low < high:
                raise ValueError(
                    f"patch must run from a smaller to a larger {name}, got {low:g} to {high:g} mm;"
                    " exchange them"
                )
        thickness = positive(self.thickness, "patch thickness", "mm")
        young = positive(self.young, "Young's modulus of a patch", "MPa")
        object.__setattr__(self, "thickness", thickness)
        object.__setattr__(self, "young", young)


@dataclass(frozen=True)
class Plate:
    """A rectangular plate of one isotropic material, flat and free of stress unless said.

    The frame has its origin in a corner, x and y in the plate and z out of the touched face.
    Tension and shape are those at rest, before any touch; what is computed starts from there.

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
    edges : Edge or Edges
        How the edges are held: all alike, or each in its own way.
    patches : sequence of Patch
        Where thickness and modulus differ; a later one covers an earlier one.
    tension : tuple of float
        Resultants Nxx, Nyy, Nxy in the plane at rest, N/mm, even over the plate; negative where
        it is pressed together. A plate warmer by ΔT than a rigid frame has
        Nxx = Nyy = -E h α ΔT / (1 - ν). Where an edge is free they pull on it as a dead load.
    shape : Shape, optional
        How the middle surface lies at rest; flat if left out.
    strain_limit : float
        Strain up to which the material comes back: its yield stress over Young's modulus, 0.017 for
        PVC. If left out 0.05, beyond which a linear law fits no solid.
    taper : tuple of float
        How the thickness rises along x and along y outside patches: it is (1 + tx s + ty t) h, with
        s and t from -1 at the edge of the smaller coordinate to 1 at the other. On a mesh each
        element is as thick as in its middle.

    Raises
    ------
    ValueError
        A length or the modulus is not positive, Poisson's ratio does not lie between -1 and 0.5,
        the edges do not hold the plate, a patch leaves it, the tension is not three finite
        numbers, the shape is not shallow, the strain limit is not positive, or the taper leaves no
        thickness at a corner.
    """

    size: tuple[float, float]
    thickness: float
    young: float
    poisson: float
    edges: Edge | Edges = _ALL_CLAMPED
    patches: tuple[Patch, ...] = ()
    tension: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shape: Shape | None = None
    strain_limit: float = 0.05
    taper: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        a, b = _pair(self.size, "plate size", "two sides")
        size = positive(a, "plate side a", "mm"), positive(b, "plate side b", "mm")
        object.__setattr__(self, "size", size)
        thickness = positive(self.thickness, "plate thickness", "mm")
        object.__setattr__(self, "thickness", thickness)
        object.__setattr__(self, "young", positive(self.young, "Young's modulus", "MPa"))
        object.__setattr__(self, "poisson", number(self.poisson, "Poisson's ratio", "parts of 1"))
        if not -1.0 < self.poisson < 0.5:
            raise ValueError(
                f"Poisson's ratio must lie between -1 and 0.5, got {self.poisson}; PVC has 0.38"
            )
        if not isinstance(self.edges, Edges):
            check_edge(self.edges, "plate edges")
        check_held(self.sides)
        object.__setattr__(self, "patches", tuple(self.patches))
        for patch in self.patches:
            self._check_patch(patch)
        object.__setattr__(self, "tension", _tension(self.tension))
        if self.shape is not None:
            self._check_shape(self.shape)
        limit = positive(self.strain_limit, "strain limit of a plate", "parts of 1")
        object.__setattr__(self, "strain_limit", limit)
        object.__setattr__(self, "taper", _taper(self.taper))

    def _check_patch(self, patch: Patch) -> None:
        for name, (low, high), side in zip("xy", (patch.x, patch.y), self.size, strict=True):
            if low < 0 or high > side:
                raise ValueError(
                    f"patch must lie on the plate, {name} from 0 to {side:g} mm, "
                    f"got {low:g} to {high:g} mm; move it or make it smaller"
                )

    def _check_shape(self, shape: object) -> None:
        if not isinstance(shape, Shape):
            raise ValueError(f"plate shape must be Shape(...) or None, got {short(shape)}")
        x, y = (_LOOKS * side for side in self.size)
        along, across = (shape.on_grid(self.size, x, y, p, 1 - p) for p in (1, 0))
        steepest = float(np.hypot(along, across).max())
        if steepest > _STEEPEST:
            raise ValueError(
                f"shape of a plate must be shallow, slopes up to {_STEEPEST:g}, got "
                f"{steepest:.3g}; bend it by its base"
            )

    @property
    def flat(self) -> Plate:
        """The same plate without its shape."""
        return self if self.shape is None else replace(self, shape=None)

    @property
    def sides(self) -> Edges:
        """Each of the four edges."""
        if isinstance(self.edges, Edges):
            return self.edges
        return Edges(self.edges, self.edges, self.edges, self.edges)

    @property
    def rigidity(self) -> float:
        """Bending rigidity D = E h³ / 12 (1 - ν²) of the mean thickness outside patches, N mm."""
        return self.young * self.thickness**3 / (12.0 * (1.0 - self.poisson**2))

    @property
    def area(self) -> float:
        """Area of the face, mm²."""
        return self.size[0] * self.size[1]

    def material(self, xy: ArrayLike) -> tuple[F64, F64]:
        """Thickness and Young's modulus at points (K, 2) mm: two (K,) float64, mm and MPa.

        A point on the border of a patch belongs to the side of larger x and of larger y.
        """
        x, y = _places(xy, "point").T
        (a, b), (along, across) = self.size, self.taper
        rising = 1.0 + along * (2.0 * x / a - 1.0) + across * (2.0 * y / b - 1.0)
        thickness, young = self.thickness * rising, np.full(x.shape, self.young)
        for patch in self.patches:
            here = _within(x, patch.x, self.size[0]) & _within(y, patch.y, self.size[1])
            thickness[here], young[here] = patch.thickness, patch.young
        return thickness, young

    def rise(self, xy: ArrayLike) -> F64:
        """Height of the middle surface at rest at points (K, 2) mm: (K,) float64, mm along +z."""
        places = _places(xy, "point")
        return np.zeros(len(places)) if self.shape is None else self.shape.at(self.size, places)

    def points(self, xy: ArrayLike, name: str = "point") -> F64:
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
        places = _places(xy, name)
        a, b = self.size
        x, y = places[:, 0], places[:, 1]
        slack_x, slack_y = _ROUNDING * a, _ROUNDING * b
        # Written so that NaN falls outside.
        on = (x >= -slack_x) & (x <= a + slack_x) & (y >= -slack_y) & (y <= b + slack_y)
        if not on.all():
            k = int(np.argmin(on))
            raise ValueError(
                f"{name} {k} must lie on the plate, 0 to {a:g} by 0 to {b:g} mm, "
                f"got ({x[k]:g}, {y[k]:g}) mm"
            )
        return places


def _places(xy: ArrayLike, name: str) -> F64:
    places = array(xy, f"{name}s", "mm")
    if places.ndim != 2 or places.shape[1] != 2:
        raise ValueError(f"{name}s must have shape (K, 2) in mm, got {places.shape}")
    return places


def _pair(values: ArrayLike, name: str, what: str) -> tuple[float, float]:
    pair = array(values, name, "mm")
    if pair.shape != (2,):
        raise ValueError(f"{name} must be {what} in mm, got {short(values)}")
    return float(pair[0]), float(pair[1])


def _tension(values: ArrayLike) -> tuple[float, float, float]:
    tension = array(values, "plate tension", "N/mm")
    if tension.shape != (3,) or not np.isfinite(tension).all():
        raise ValueError(
            f"plate tension must be three finite numbers Nxx, Nyy, Nxy in N/mm, got {short(values)}"
        )
    xx, yy, xy = tension.tolist()
    return xx, yy, xy


def _taper(values: ArrayLike) -> tuple[float, float]:
    along, across = _pair(values, "plate taper", "two parts of the thickness, not")
    if not abs(along) + abs(across) < 1.0:
        raise ValueError(
            f"plate taper must leave a thickness at each corner, two numbers whose sizes add up to"
            f" less than 1, got {along:g} and {across:g}"
        )
    return along, across


def _within(x: F64, span: tuple[float, float], side: float) -> Mask:
    return (x >= span[0]) & ((x < span[1]) | (span[1] == side))
