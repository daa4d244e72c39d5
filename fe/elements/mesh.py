"""The grid of elements under a plate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.line import Line, divide
from fe.plate.checks import array, short, whole
from fe.plate.plate import Plate

# Recovery of curvature needs five elements between breaks; one more leaves an inside.
_FEWEST = 6
# Strains near a touch need it: five millimetres from one, on a plate of 100, 100 elements leave
# 1.6e-4 of the largest strain and 120 leave 8e-5. Round sides get nodes on round places, too.
_LONG_SIDE = 120

Breaks = tuple[tuple[float, ...], tuple[float, ...]]


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

    Raises
    ------
    ValueError
        There are fewer than six elements along a side or between two breaks.
    """

    size: tuple[float, float]
    counts: tuple[int, int]
    breaks: Breaks = ((), ())

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

    @cached_property
    def lines(self) -> tuple[Line, Line]:
        """Elements along x and along y."""
        x, y = (
            divide(side, count, places, _FEWEST)
            for side, count, places in zip(self.size, self.counts, self.breaks, strict=True)
        )
        return x, y

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


def default_mesh(plate: Plate) -> Mesh:
    """Return the `grid` of 120 elements along the longer side.

    On it the strains of the clamped square are exact to 1e-5, or 1e-4 at a twentieth of the side
    from a touch, and the deflection under a touch to 5e-5.
    """
    return grid(plate, _LONG_SIDE)


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
