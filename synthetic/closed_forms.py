"""Displacements with known strain: to draw images of, and to check what was measured.

Each is called as a displacement of the plate, (K, 2) → (K, 3), and knows its gradient. They hold in
any unit of length, as long as points and parameters share it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dic import StrainKind, strain_measure
from synthetic.arrays import F64, AnyArray
from synthetic.points import checked, polynomial_value


@dataclass(frozen=True)
class Uniform:
    """The same displacement gradient everywhere: stretch, shear, rotation, of any size.

    Attributes
    ----------
    rows : ((u,x, u,y), (v,x, v,y)).
    about : the point that moves by `shift` alone, mm.
    shift : mm.
    """

    rows: tuple[tuple[float, float], tuple[float, float]]
    about: tuple[float, float] = (0.0, 0.0)
    shift: tuple[float, float] = (0.0, 0.0)

    def __call__(self, points: F64) -> F64:
        """Displace points (K, 2): (K, 3), in the plane."""
        return _in_plane((points - self.about) @ np.array(self.rows).T + self.shift)

    def gradient(self, points: F64) -> F64:
        """Displacement gradient at points (K, 2): (K, 2, 2)."""
        return np.tile(np.array(self.rows, dtype=np.float64), (len(points), 1, 1))


def rotation(angle: float, about: tuple[float, float] = (0.0, 0.0)) -> Uniform:
    """Rigid rotation by `angle` rad from x towards y: no Green-Lagrange strain."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return Uniform(((c - 1, -s), (s, c - 1)), about)


@dataclass(frozen=True, eq=False)
class Polynomial:
    """Displacement u = Σ u[i, j] X^i Y^j with (X, Y) = point − about, and v alike.

    Attributes
    ----------
    u, v : (m, n) float64, mm per mm^(i + j).
    about : mm.
    """

    u: F64
    v: F64
    about: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self):
        for name in ("u", "v"):
            c = np.array(getattr(self, name), dtype=np.float64)
            if c.ndim != 2 or not np.isfinite(c).all():
                raise ValueError(f"coefficients {name} must be finite (m, n), got shape {c.shape}")
            c.flags.writeable = False
            object.__setattr__(self, name, c)

    def __call__(self, points: F64) -> F64:
        """Displace points (K, 2): (K, 3), in the plane."""
        return _in_plane(np.column_stack([self._value(c, points) for c in (self.u, self.v)]))

    def gradient(self, points: F64) -> F64:
        """Displacement gradient at points (K, 2): (K, 2, 2)."""
        return _stacked(
            [
                [self._value(_derivative(c, axis), points) for axis in (0, 1)]
                for c in (self.u, self.v)
            ]
        )

    def _value(self, c: F64, points: F64) -> F64:
        x, y = (points - self.about).T
        return polynomial_value(c, x, y)


@dataclass(frozen=True)
class Wave:
    """Plane wave of displacement, amplitude · cos(2π (x/period_x + y/period_y) + phase).

    Attributes
    ----------
    amplitude : (u, v), mm.
    frequency : (1/period_x, 1/period_y), per mm.
    phase : rad.
    """

    amplitude: tuple[float, float]
    frequency: tuple[float, float]
    phase: float = 0.0

    def __call__(self, points: F64) -> F64:
        """Displace points (K, 2): (K, 3), in the plane."""
        return _in_plane(np.cos(self._angle(points))[:, None] * self.amplitude)

    def gradient(self, points: F64) -> F64:
        """Displacement gradient at points (K, 2): (K, 2, 2)."""
        slopes = -2 * np.pi * np.outer(self.amplitude, self.frequency)
        return np.sin(self._angle(points))[:, None, None] * slopes

    def _angle(self, points: F64) -> F64:
        return 2 * np.pi * (points @ self.frequency) + self.phase


@dataclass(frozen=True)
class Star:
    """The star of the DIC Challenge 2.0: v waves along y, ever longer along x.

    With period p(x) = first + period_slope · x: v = amplitude · cos(2π (y − middle)/p(x)).

    Attributes
    ----------
    amplitude, first, middle : mm.
    period_slope : of the period along x, mm per mm.

    References
    ----------
    Reu et al. 2022, DIC Challenge 2.0, Experimental Mechanics 62, 639.
    """

    amplitude: float
    first: float
    period_slope: float
    middle: float

    def __call__(self, points: F64) -> F64:
        """Displace points (K, 2): (K, 3), in the plane."""
        _, angle = self._wave(points)
        return _in_plane(np.column_stack([0 * angle, self.amplitude * np.cos(angle)]))

    def gradient(self, points: F64) -> F64:
        """Displacement gradient at points (K, 2): (K, 2, 2)."""
        period, angle = self._wave(points)
        steep = self.amplitude * np.sin(angle) / period
        none = np.zeros_like(angle)
        return _stacked([[none, none], [steep * angle * self.period_slope, -2 * np.pi * steep]])

    def _wave(self, points: F64) -> tuple[F64, F64]:
        period = self.first + self.period_slope * points[:, 0]
        return period, 2 * np.pi * (points[:, 1] - self.middle) / period


@dataclass(frozen=True)
class Hole:
    """A round hole in a wide plate that is pulled along x.

    Attributes
    ----------
    radius : mm.
    centre : mm; it stays.
    strain : along x, far away.
    poisson : Poisson's ratio.

    References
    ----------
    Kirsch 1898; in the complex form of Muskhelishvili for plane stress.
    """

    radius: float
    centre: tuple[float, float]
    strain: float
    poisson: float = 0.3

    def __post_init__(self):
        if not 0 < self.radius < np.inf:
            raise ValueError(f"radius of the hole must be positive, got {self.radius} mm")

    def __call__(self, points: F64) -> F64:
        """Displace points (K, 2): (K, 3), in the plane."""
        z = self._outside(points)
        kappa, a2 = self._kappa, self.radius**2
        phi, slope = z + 2 * a2 / z, 1 - 2 * a2 / z**2
        psi = -2 * (z + a2 / z - a2**2 / z**3)
        moved = self._scale * (kappa * phi - z * slope.conj() - psi.conj())
        return _in_plane(np.column_stack([moved.real, moved.imag]))

    def gradient(self, points: F64) -> F64:
        """Displacement gradient at points (K, 2): (K, 2, 2); NaN in the hole."""
        z = self._outside(points)
        kappa, a2 = self._kappa, self.radius**2
        slope, bend = 1 - 2 * a2 / z**2, 4 * a2 / z**3
        twist = -2 * (1 - a2 / z**2 + 3 * a2**2 / z**4)
        by_z = kappa * slope - slope.conj()
        by_conjugate = -z * bend.conj() - twist.conj()
        along_x = self._scale * (by_z + by_conjugate)
        along_y = 1j * self._scale * (by_z - by_conjugate)
        gradient = _stacked([[along_x.real, along_y.real], [along_x.imag, along_y.imag]])
        gradient[np.hypot(*(points - self.centre).T) < self.radius] = np.nan
        return gradient

    @property
    def _kappa(self) -> float:
        return (3 - self.poisson) / (1 + self.poisson)

    @property
    def _scale(self) -> float:
        # Stress S far away over 8 times the shear modulus, where S = E · strain.
        return self.strain * (1 + self.poisson) / 4

    def _outside(self, points: F64) -> F64:
        """Points as complex numbers from the centre; those in the hole moved to its rim."""
        x, y = (points - self.centre).T
        z = x + 1j * y
        r = np.abs(z)
        return np.where(r > 0, z * np.maximum(self.radius / np.where(r > 0, r, 1), 1), self.radius)


Formula = Uniform | Polynomial | Wave | Star | Hole


def strain_of(formula: Formula, points: ArrayLike, kind: StrainKind = "small") -> F64:
    """Exact strain of a formula.

    Parameters
    ----------
    points : (K, 2) float64, mm.
    kind : as of `dic.strain`.

    Returns
    -------
    (K, 3) float64, exx, eyy and the tensor component exy in the frame of the points.
    """
    return strain_measure(formula.gradient(checked(points, 2, "points", "mm")), kind)


def _derivative(coefficients: F64, axis: int) -> F64:
    return np.asarray(np.polynomial.polynomial.polyder(coefficients, axis=axis), np.float64)


def _in_plane(moved: F64) -> F64:
    return np.column_stack([moved, np.zeros(len(moved))])


def _stacked(rows: Sequence[Sequence[AnyArray]]) -> F64:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
