"""Vibration modes: smooth shapes that carry the deflection of the whole plate in few numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import ceil, sqrt

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh

from fe.arrays import F64
from fe.elements.factor import operator
from fe.elements.functional import derivative
from fe.elements.hermite import hermite_gram
from fe.elements.mesh import Mesh, mesh_for
from fe.elements.storage import restore, store
from fe.linear.buckling import check_buckling
from fe.linear.energy import bending_products, free, tension_products
from fe.linear.linear import CURVATURES, Linear, check_flat
from fe.linear.load import disc
from fe.linear.mesh_error import FRACTION, left, less_mesh
from fe.plate.checks import whole
from fe.plate.edges import Clamped
from fe.plate.plate import Plate
from fe.plate.thin import check_thin

# Products of beam modes for each plate mode wanted, and the fewest along a side. Against the
# sparse eigenproblem on the same mesh they leave 150 stiffnesses within 5e-5, the first within
# 5e-8; twice as many products leave a fifth of that.
_RICHNESS = 16
_FEWEST = 40
# Up to so many elements along a side and products in a quarter of them dense problems are small:
# beyond, Lanczos's method takes less memory and time.
_DENSE_ELEMENTS, _DENSE_PRODUCTS = 2000, 5000
# The lowest modes of a strip lie so close together that a few of them take Lanczos's method longer
# than many: of each so many times that it is longer than wide, one more is asked for.
_CLOSE = 5.0

# Of the unknowns of a clamped line: its ends are held in value and slope.
_CLAMPED = slice(2, -2)


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest vibration modes of a plate, orthonormal over its area.

    ∫ φ_j φ_k dA = δ_jk and the energy of φ_k, of bending and of the tension at rest, is λ_k / 2;
    with density ρ the angular frequency is sqrt(λ_k / ρ h). The deflection under touches is
    w = Σ_k q_k φ_k.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    stiffness : (count,) float64, N/mm³, read only
        λ_k, ascending.
    values : (2 nx + 2, 2 ny + 2, count) float64, 1/mm, read only
        Unknowns of φ_k, along +z.
    """

    plate: Plate
    mesh: Mesh
    stiffness: F64
    values: F64

    def __post_init__(self) -> None:
        stiffness = np.array(self.stiffness, dtype=np.float64)
        stiffness.flags.writeable = False
        object.__setattr__(self, "stiffness", stiffness)
        object.__setattr__(self, "values", self.mesh.table(self.values, len(stiffness)))

    @property
    def count(self) -> int:
        """Number of modes."""
        return len(self.stiffness)

    def value(self, xy: ArrayLike) -> F64:
        """Modes at points (K, 2) mm: (K, count) float64, 1/mm."""
        return self._derivative(self.plate.points(xy), 0, 0)

    def slope(self, xy: ArrayLike) -> F64:
        """Slopes of the modes along x and y at points (K, 2) mm: (K, count, 2), 1/mm²."""
        xy = self.plate.points(xy)
        return np.stack([self._derivative(xy, 1, 0), self._derivative(xy, 0, 1)], axis=-1)

    def curvature(self, xy: ArrayLike) -> F64:
        """Second derivatives xx, yy, xy at points (K, 2) mm: (K, count, 3), 1/mm³, error h²."""
        xy = self.plate.points(xy)
        return np.stack([self._derivative(xy, p, q) for p, q in CURVATURES], axis=-1)

    def response(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Coefficients of the deflection under a touch of 1 N into the plate at each place.

        q_k = -φ_k(xy) / λ_k, so w(p) = F Σ_k q_k φ_k(p) for a force F.

        Parameters
        ----------
        xy : (K, 2) array_like, mm
            Places of the touch.
        radius : float, mm
            Of the disc over which it presses; 0 for a point.

        Returns
        -------
        (K, count) float64, mm² per N

        Raises
        ------
        ValueError
            A place, or a part of its disc, lies outside the plate.
        """
        return self._mean(xy, radius, 0, 0) / -self.stiffness

    def gradient(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Exact derivative of `response` by the place of the touch: (K, count, 2), mm per N."""
        slope = np.stack([self._mean(xy, radius, 1, 0), self._mean(xy, radius, 0, 1)], axis=-1)
        return slope / -self.stiffness[:, None]

    def _mean(self, xy: ArrayLike, radius: float, p: int, q: int) -> F64:
        xy = self.plate.points(xy, "touch")
        points, weights = disc(self.plate, self.mesh, xy, radius)
        modes = self._derivative(points, p, q)
        if len(weights) == 1:
            return modes
        return np.einsum("q,kqc->kc", weights, modes.reshape(len(xy), len(weights), -1))

    def _derivative(self, xy: F64, p: int, q: int) -> F64:
        return derivative(self.mesh, xy, p, q).of(self.values)

    @cached_property
    def mesh_error(self) -> F64:
        """Estimated error of the stiffness of each mode, (count,) float64, N/mm³.

        Solves all modes once more, on two thirds of the elements and of the beam modes that they
        are made of, at the first call.

        Raises
        ------
        ValueError
            Two thirds of the elements do not carry so many modes.
        """
        less = _solved(self.plate, less_mesh(self.mesh), self.count, None, FRACTION)
        return left(self.stiffness, less.stiffness)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all of it as named arrays, for a file."""
        return store(self.plate, self.mesh, stiffness=self.stiffness, values=self.values)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> Modes:
        """Build the modes that `arrays` wrote.

        Raises
        ------
        ValueError
            An array is missing or has the wrong shape.
        """
        plate, mesh, (stiffness, values) = restore(arrays, "stiffness", "values")
        return cls(plate, mesh, stiffness, values)


def modes(
    plate: Plate,
    count: int,
    mesh: Mesh | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Modes:
    """Compute the lowest modes.

    A clamped plate without patches and without shear at rest has them by Ritz's method, in a
    thirtieth of the time that Lanczos's takes for any other, and for a strip with many modes.

    Parameters
    ----------
    plate : Plate
    count : int
        Number of modes.
    mesh : Mesh, optional
        `default_mesh(plate)` if left out.
    progress : callable, optional
        Called with the problems done and their number.

    Returns
    -------
    Modes

    Raises
    ------
    ValueError
        The mesh cannot carry that many modes, the plate has a shape, it buckles under its tension,
        or it is more than 250 times as long as wide and no mesh is given.
    """
    check_flat(plate)
    check_buckling(plate)
    check_thin(plate)
    mesh = mesh_for(plate, mesh)
    if whole(count, "number of modes") < 1:
        raise ValueError(f"number of modes must be at least 1, got {count}")
    return _solved(plate, mesh, count, progress)


def _solved(
    plate: Plate,
    mesh: Mesh,
    count: int,
    progress: Callable[[int, int], object] | None,
    fraction: float = 1.0,
) -> Modes:
    """Compute modes by the method that is fast, with a fraction of the beam modes."""
    alike = {plate.sides.west, plate.sides.east, plate.sides.south, plate.sides.north}
    if alike == {Clamped()} and _even(plate) and _few_products(plate, mesh, count):
        return _by_products(plate, mesh, count, progress, fraction)
    return _by_lanczos(plate, mesh, count, progress)


def _even(plate: Plate) -> bool:
    """Whether a plate is the same all over and has no shear at rest."""
    return not plate.patches and plate.taper == (0.0, 0.0) and plate.tension[2] == 0


def _few_products(plate: Plate, mesh: Mesh, count: int) -> bool:
    """Whether beam modes and their products make dense problems that are small."""
    along_x, along_y = _beam_counts(plate, mesh, count)
    return max(mesh.counts) <= _DENSE_ELEMENTS and along_x * along_y <= 4 * _DENSE_PRODUCTS


def _beam_counts(plate: Plate, mesh: Mesh, count: int, fraction: float = 1.0) -> tuple[int, int]:
    """Count the beam modes along x and along y: their finest waves are equally long."""
    x, y = (
        min(round(fraction * max(ceil(sqrt(_RICHNESS * count / plate.area) * side), _FEWEST)), n)
        for side, n in zip(plate.size, mesh.counts, strict=True)
    )
    return x, y


def _by_lanczos(
    plate: Plate, mesh: Mesh, count: int, progress: Callable[[int, int], object] | None
) -> Modes:
    """Lowest modes of K φ = λ M φ on the mesh, by Lanczos's method with the inverse of K."""
    linear = Linear(plate, mesh)
    kept = free(plate, mesh)
    mass_x, mass_y = (
        hermite_gram(line, 0, 0)[keep][:, keep] for line, keep in zip(mesh.lines, kept, strict=True)
    )
    mass = sp.csc_array(sp.kron(mass_x, mass_y))
    size = len(mass.indptr) - 1
    if count > size // 8:
        raise ValueError(
            f"a mesh of {mesh.counts[0]} by {mesh.counts[1]} elements carries at most "
            f"{size // 8} modes, got {count}; use a finer mesh"
        )

    aspect = max(plate.size) / min(plate.size)
    asked = min(count + int(aspect / _CLOSE), size // 8)
    # A start of its own kind in every place, and the same each time.
    start = np.random.default_rng(0).standard_normal(size)

    def solve(right: F64) -> F64:
        return linear.factor.solve(right.reshape(len(right), -1)).reshape(right.shape)

    inverse = operator(len(start), solve)
    # Not read in this mode: the inverse and the mass are enough.
    unread = operator(len(start), np.asarray)
    stiffness, shapes = eigsh(unread, asked, mass, sigma=0.0, OPinv=inverse, v0=start)
    order = np.argsort(stiffness, kind="stable")[:count]
    shapes = _signed(shapes[:, order])
    values = np.zeros((*mesh.shape, count))
    values[linear.free] = shapes.reshape(*values[linear.free].shape)
    if progress is not None:
        progress(1, 1)
    return Modes(plate, mesh, stiffness[order], values)


def _signed(vectors: F64) -> F64:
    """Columns with their largest part positive: the sign of an eigenvector is free."""
    return vectors * np.sign(np.take_along_axis(vectors, np.abs(vectors).argmax(0)[None], 0))


def _by_products(
    plate: Plate,
    mesh: Mesh,
    count: int,
    progress: Callable[[int, int], object] | None,
    fraction: float,
) -> Modes:
    """Lowest modes of a clamped plate by Ritz's method with products of clamped beam modes.

    Beam modes are orthonormal, hold the clamped edges, and those even and odd about the middle of
    each side do not mix: four small dense problems take the place of one large sparse one.
    """
    beams_x, beams_y = _beam_modes(plate, mesh, count, fraction)
    stiffness: list[F64] = []
    shapes: list[F64] = []
    parities = [(i, j) for i in (0, 1) for j in (0, 1)]
    for done, (i, j) in enumerate(parities, start=1):
        found, mixture = _ritz(plate, mesh, beams_x[:, i::2], beams_y[:, j::2], count)
        shape = np.zeros((beams_x.shape[1], beams_y.shape[1], len(found)))
        shape[i::2, j::2] = mixture
        stiffness.append(found)
        shapes.append(shape)
        if progress is not None:
            progress(done, len(parities))
    lowest = np.argsort(np.concatenate(stiffness), kind="stable")[:count]
    shape = np.concatenate(shapes, axis=2)[:, :, lowest]
    values = np.einsum("ai,ijk,bj->abk", beams_x, shape, beams_y, optimize=True)
    return Modes(plate, mesh, np.concatenate(stiffness)[lowest], values)


def _beam_modes(plate: Plate, mesh: Mesh, count: int, fraction: float) -> list[F64]:
    """Lowest modes of a clamped beam along each side: unknowns (2 n + 2, m), orthonormal.

    They alternate between even and odd.
    """
    beams: list[F64] = []
    for wanted, line in zip(_beam_counts(plate, mesh, count, fraction), mesh.lines, strict=True):
        mass, stiffness = (hermite_gram(line, p, p)[_CLAMPED, _CLAMPED].toarray() for p in (0, 2))
        shapes = np.zeros((line.unknowns, wanted))
        shapes[_CLAMPED] = eigh(stiffness, mass, subset_by_index=(0, wanted - 1))[1]
        beams.append(shapes)
    available = beams[0].shape[1] * beams[1].shape[1] // 4
    if count > available:
        raise ValueError(
            f"a mesh of {mesh.counts[0]} by {mesh.counts[1]} elements carries at most "
            f"{available} modes, got {count}; use a finer mesh"
        )
    return beams


def _ritz(plate: Plate, mesh: Mesh, beams_x: F64, beams_y: F64, count: int) -> tuple[F64, F64]:
    """Stiffness (k,) and mixture (m_x, m_y, k) of the lowest modes among products of beams."""

    def along(axis: int, beams: F64) -> Callable[[int, int], F64]:
        def product(p: int, q: int) -> F64:
            return beams.T @ (hermite_gram(mesh.lines[axis], p, q) @ beams)

        return product

    pair = along(0, beams_x), along(1, beams_y)
    energy: F64 = plate.rigidity * bending_products(plate.poisson, *pair, np.kron)
    if any(plate.tension):
        energy = energy + tension_products(plate.tension, *pair, np.kron)
    last = min(count, len(energy)) - 1
    found: tuple[F64, F64] = eigh(energy, subset_by_index=(0, last))
    stiffness, mixture = found
    return stiffness, _signed(mixture).reshape(beams_x.shape[1], beams_y.shape[1], -1)
