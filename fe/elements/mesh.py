"""The grid of elements under a plate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.line import Line, cut, divide
from fe.plate.aspect import check_aspect
from fe.plate.checks import array, short, whole
from fe.plate.plate import Plate

# Recovery of curvature needs five elements between breaks; one more leaves an inside.
_FEWEST = 6
# Strains near a touch need it: five millimetres from one, on a plate of 100, 100 elements leave
# 1.6e-4 of the largest strain and 120 leave 8e-5. Round sides get nodes on round places, too.
_SIDE = 120

# Elements across a long plate: with fewer, nothing of how it bends across is left.
_ACROSS = 16
# Longer plates take so many elements, 256 along each width, that they fill the memory.
_LONGEST = 250.0

Breaks = tuple[tuple[float, ...], tuple[float, ...]]
Runs = tuple[tuple[int, ...], tuple[int, ...]]


@dataclass(frozen=True)
class Mesh:
    """A grid of bicubic Hermite elements, uniform between breaks.

    The unknowns form a table: row = unknown of the x line, column = unknown of the y line, where
    each line holds (value, slope times mean element length) at each node. A node so has four of
    them: w, u_y w,y, u_x w,x and u_x u_y w,xy.

    Attributes
    ----------
    size : tuple of float
        Sides (a, b), mm.
    counts : tuple of int
        Elements along x and y.
    breaks : pair of tuples of float
        Places along x and along y, mm, that must lie on lines of the grid: borders of patches.
    runs : pair of tuples of int
        Elements of each run between breaks, along x and along y; as equally long as whole numbers
        allow where none are given.

    Raises
    ------
    ValueError
        There are fewer than six elements along a side or between two breaks, or the runs do not
        add up to the elements.
    """

    size: tuple[float, float]
    counts: tuple[int, int]
    breaks: Breaks = ((), ())
    runs: Runs = ((), ())

    def __post_init__(self) -> None:
        size = array(self.size, "size of a mesh", "mm")
        if size.shape != (2,) or not (np.isfinite(size) & (size > 0)).all():
            raise ValueError(
                f"size of a mesh must be two positive sides in mm, got {short(self.size)}"
            )
        counts = array(self.counts, "elements of a mesh", "whole numbers")
        if counts.shape != (2,):
            raise ValueError(
                f"elements of a mesh must be given along x and y, got {short(self.counts)}"
            )
        object.__setattr__(self, "size", (float(size[0]), float(size[1])))
        object.__setattr__(
            self, "counts", tuple(whole(v, "elements of a mesh") for v in self.counts)
        )
        if len(self.breaks) != 2:
            raise ValueError(
                f"breaks of a mesh must be given along x and y, got {short(self.breaks)}"
            )
        breaks = tuple(
            tuple(float(v) for v in array(places, "breaks of a mesh", "mm").ravel())
            for places in self.breaks
        )
        object.__setattr__(self, "breaks", breaks)
        for name, side, count, places in zip("xy", self.size, self.counts, breaks, strict=True):
            if not (np.diff([0.0, *places, side]) > 0).all():
                raise ValueError(
                    f"breaks of a mesh along {name} must ascend between 0 and {side:g} mm, "
                    f"got {places}"
                )
            min_count = _FEWEST * (len(places) + 1)
            if count < min_count:
                between = f" ({_FEWEST} between borders of patches)" if places else ""
                raise ValueError(
                    f"mesh must have at least {min_count} elements along {name}{between}, "
                    f"got {count}"
                )
        self._check_runs()

    def _check_runs(self) -> None:
        runs = tuple(tuple(whole(v, "elements of a run") for v in axis) for axis in self.runs)
        object.__setattr__(self, "runs", runs)
        for name, count, places, each in zip("xy", self.counts, self.breaks, runs, strict=True):
            fits = len(each) == len(places) + 1 and sum(each) == count
            if each and not (fits and min(each) >= _FEWEST):
                raise ValueError(
                    f"runs of a mesh along {name} must be {len(places) + 1} of at least {_FEWEST} "
                    f"elements, {count} in all, got {short(each)}; leave them out for equal ones"
                )

    @cached_property
    def lines(self) -> tuple[Line, Line]:
        """Elements along x and along y."""
        x, y = (
            cut(side, places, each) if each else divide(side, count, places, _FEWEST)
            for side, count, places, each in zip(
                self.size, self.counts, self.breaks, self.runs, strict=True
            )
        )
        return x, y

    @property
    def finest(self) -> float:
        """Length of the shortest element, mm."""
        return float(min(np.diff(nodes).min() for nodes in self.nodes))

    @property
    def nodes(self) -> tuple[F64, F64]:
        """Places of the nodes along x (nx + 1,) and along y (ny + 1,), mm."""
        return self.lines[0].nodes, self.lines[1].nodes

    @property
    def units(self) -> tuple[float, float]:
        """Mean sides of an element, mm, by which unknowns of slope are scaled."""
        return self.lines[0].unit, self.lines[1].unit

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the table of unknowns."""
        return self.lines[0].unknowns, self.lines[1].unknowns

    @property
    def middles(self) -> F64:
        """Middle of each element, (nx, ny, 2) float64, mm."""
        x, y = (0.5 * (nodes[1:] + nodes[:-1]) for nodes in self.nodes)
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)

    def table(self, values: ArrayLike, functions: int) -> F64:
        """Return the unknowns of some functions as a read-only array of the right shape.

        Raises
        ------
        ValueError
            The shape is not `(*mesh.shape, functions)`.
        """
        table = array(values, "nodal values", "numbers")
        expected = (*self.shape, functions)
        if table.shape != expected:
            raise ValueError(
                f"nodal values must have shape {expected}, got {table.shape}; compute them again"
            )
        table.flags.writeable = False
        return table


def grid(plate: Plate, longer: int) -> Mesh:
    """Return a mesh of nearly square elements, even in number, with lines along all patches.

    Even counts put a line of nodes through the middle of a plate without patches.

    Parameters
    ----------
    plate : Plate
    longer : int
        Elements along the longer side; more where patches need them.
    """
    if whole(longer, "elements along the longer side") < 1:
        raise ValueError(f"elements along the longer side must be 1 or more, got {longer}; use 40")
    side = max(plate.size)
    breaks = borders(plate)
    counts = tuple(
        max(2 * round(longer / 2 * length / side), _FEWEST * (len(places) + 1))
        for length, places in zip(plate.size, breaks, strict=True)
    )
    return Mesh(plate.size, (counts[0], counts[1]), breaks)


def even_grid(plate: Plate, side: int) -> Mesh:
    """Return a `grid` with as many elements as a square plate has with so many along its side.

    The number says how fine a plate of any shape is at one cost; along a long plate it leaves 16
    elements across at least, and then there are more of them.

    Parameters
    ----------
    plate : Plate
    side : int

    Raises
    ------
    ValueError
        The plate is more than 250 times as long as wide.
    """
    check_aspect(plate, _LONGEST)
    aspect = max(plate.size) / min(plate.size)
    return grid(plate, max(round(side * aspect**0.5), round(min(_ACROSS, side) * aspect)))


def default_mesh(plate: Plate) -> Mesh:
    """Return the `even_grid` of 120 elements a side, where touches may be anywhere.

    On it the strains of the clamped square are exact to 1e-5, or 1e-4 at a twentieth of the side
    from a touch, and the deflection under a touch to 5e-5. Longer plates get coarser across: where
    the touches are known, `deflect` takes a mesh that is fine there instead.
    """
    return even_grid(plate, _SIDE)


def scaled_mesh(mesh: Mesh, factor: float) -> Mesh:
    """Return the mesh with so many times the elements in each run, or six where that are fewer."""
    runs = [
        tuple(max(int((last - first) * factor), _FEWEST) for first, last in line.runs)
        for line in mesh.lines
    ]
    counts = sum(runs[0]), sum(runs[1])
    return Mesh(mesh.size, counts, mesh.breaks, (runs[0], runs[1]))


def borders(plate: Plate) -> Breaks:
    """Places inside the plate where a patch begins or ends, along x and along y, mm."""
    along = [
        tuple(
            sorted({v for patch in plate.patches for v in (patch.x, patch.y)[axis]} - {0.0, side})
        )
        for axis, side in enumerate(plate.size)
    ]
    return along[0], along[1]


def on_elements(plate: Plate, mesh: Mesh) -> tuple[F64, F64]:
    """Thickness, mm, and Young's modulus, MPa, of each element: two (nx, ny) float64."""
    thickness, young = plate.material(mesh.middles.reshape(-1, 2))
    return thickness.reshape(mesh.counts), young.reshape(mesh.counts)


def mesh_for(plate: Plate, mesh: Mesh | None) -> Mesh:
    """Return the mesh asked for, or the default one.

    Raises
    ------
    ValueError
        The mesh has another size than the plate, or no breaks at the borders of its patches.
    """
    if mesh is None:
        return default_mesh(plate)
    if mesh.size != plate.size:
        raise ValueError(
            f"mesh must have the size of the plate, {plate.size} mm, got {mesh.size} mm; "
            "use Mesh(plate.size, counts)"
        )
    for name, wanted, breaks in zip("xy", borders(plate), mesh.breaks, strict=True):
        missing = set(wanted) - set(breaks)
        if missing:
            raise ValueError(
                f"mesh must have a break at each border of a patch, none at {name} = "
                f"{min(missing):g} mm; use fe.grid(plate, longer)"
            )
    return mesh
