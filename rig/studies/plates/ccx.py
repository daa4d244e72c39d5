"""CalculiX on plates of ours: writes its deck, runs it for real and reads its fields.

Its shell element S8R is expanded to a quadratic solid, integrated with 2 x 2 x 2 points. With
OUTPUT=3D the fields stand on the nodes of that solid: the nodes at z = h/2 are the touched face,
and strain there is extrapolated from the integration points and averaged over neighbours. It is
small strain in a linear step and Green-Lagrange strain with NLGEOM, exy the tensor component.
"""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

import fe

# Transverse shear modulus of `thin`, in parts of the real one. Its fraction of the deflection falls
# with it; much stiffer, and the element locks: 100 doubles the error of coarse meshes.
SHEAR = 10.0

# Corners, then middles of sides of an element, in steps of half an element along x and y.
AROUND = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)])


def solid(plate: fe.Plate) -> list[str]:
    """Give the real material: shear across the thickness, and thickness that changes."""
    return ["*ELASTIC", f"{plate.young}, {plate.poisson}"]


def thin(plate: fe.Plate) -> list[str]:
    """Give the material of Kirchhoff's plate.

    It is stiff in shear across the thickness, and its thickness does not answer to stretch in the
    plane: the rigid edges of S8R hold the thickness and would stiffen a real material by 18 %.
    """
    young, shear = plate.young, plate.young / (2 * (1 + plate.poisson))
    return [
        "*ELASTIC, TYPE=ENGINEERING CONSTANTS",
        f"{young}, {young}, {young}, {plate.poisson}, 0, 0, {shear}, {SHEAR * shear}",
        f"{SHEAR * shear}",
    ]


MATERIALS = {"thin": thin, "solid": solid}


def clamped(xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Hold u, v, w and the rotations about x and y at edge points (K, 2): (K, 5) zeros."""
    return np.zeros((len(xy), 5))


@dataclass(frozen=True)
class Fields:
    """Displacement (N, 3), mm, and strain exx, eyy, exy (N, 3) at nodes xyz (N, 3), mm.

    Of a plate with a shape the nodes are named by their foot on the plane and their height over
    the middle surface.
    """

    xyz: NDArray[np.float64]
    displacement: NDArray[np.float64]
    strain: NDArray[np.float64]

    def nodes(self, xy: ArrayLike, z: float) -> NDArray[np.int64]:
        """Index of the node at each point (K, 2) mm and height z."""
        level = np.flatnonzero(np.abs(self.xyz[:, 2] - z) < 1e-3)
        apart = np.abs(self.xyz[level, None, :2] - np.asarray(xy)).max(-1)
        if apart.min(0).max() >= 1e-3:
            raise ValueError("a point lies on no node")
        return level[apart.argmin(0)]


class Grid:
    """Nodes xy (N, 2), mm, and elements (E, 8) of quadratic quadrilaterals."""

    def __init__(self, size: tuple[float, float], counts: tuple[int, int]):
        nx, ny = (2 * count for count in counts)
        i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
        there = (i % 2 == 0) | (j % 2 == 0)  # an element has no node in its middle
        number = np.cumsum(there).reshape(there.shape) - 1
        self.xy = np.column_stack([i[there] * size[0] / nx, j[there] * size[1] / ny])
        first = np.stack([i[:-1:2, :-1:2], j[:-1:2, :-1:2]], -1).reshape(-1, 1, 2)
        self.elements = number[tuple(np.moveaxis(first + AROUND, -1, 0))]
        on_edge = (i % nx == 0) | (j % ny == 0)
        self.edge = np.flatnonzero(on_edge[there])

    def node(self, x: float, y: float) -> int:
        """Index of the node at a point, mm."""
        apart = np.abs(self.xy - (x, y)).max(1)
        if apart.min() >= 1e-9:
            raise ValueError(f"a touch at ({x:g}, {y:g}) mm lies on no node")
        return int(apart.argmin())


Loads = Sequence[Sequence[fe.Touch]]
Held = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""From edge points (K, 2), mm, to u, v, w and the rotations about x and y there, (K, 5)."""


def deck(
    plate: fe.Plate,
    counts: tuple[int, int],
    loads: Loads,
    material: str,
    edge: Held,
    nonlinear: bool,
    expansion: float,
) -> str:
    """Return the input of CalculiX: one step a load, each from the plate at rest."""
    grid = Grid(plate.size, counts)
    height = np.zeros(len(grid.xy)) if plate.shape is None else plate.shape.at(plate.size, grid.xy)
    places = np.column_stack([grid.xy, height])
    nodes = [f"{k}, {x}, {y}, {z:.9f}" for k, (x, y, z) in enumerate(places.tolist(), 1)]
    numbered = enumerate(grid.elements + 1, 1)
    elements = [", ".join(map(str, (k, *corners))) for k, corners in numbered]
    held = [
        f"{node + 1}, {dof}, {dof}, {value:.9f}"
        for node, values in zip(grid.edge, edge(grid.xy[grid.edge]), strict=True)
        for dof, value in enumerate(values, 1)
    ]
    lines = ["*NODE, NSET=ALL", *nodes, "*ELEMENT, TYPE=S8R, ELSET=PLATE", *elements]
    lines += ["*MATERIAL, NAME=SHEET", *MATERIALS[material](plate)]
    warm: list[str] = []
    if expansion:
        # So much for one degree, from none to one.
        lines += ["*EXPANSION, ZERO=0", f"{expansion}"]
        warm = ["*TEMPERATURE", "ALL, 1"]
    lines += ["*SHELL SECTION, ELSET=PLATE, MATERIAL=SHEET", f"{plate.thickness}"]
    if expansion:
        lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALL, 0"]
    for touches in loads:
        lines += ["*STEP, NLGEOM" if nonlinear else "*STEP", "*STATIC, SOLVER=SPOOLES"]
        lines += ["*BOUNDARY", *held, *warm, "*CLOAD, OP=NEW"]
        lines += [f"{grid.node(t.x, t.y) + 1}, 3, {-t.force}" for t in touches]
        lines += ["*NODE FILE, OUTPUT=3D, FREQUENCY=9999", "U"]
        lines += ["*EL FILE, OUTPUT=3D, FREQUENCY=9999", "E", "*END STEP"]
    return "\n".join([*lines, ""])


def read(path: Path) -> list[Fields]:
    """Return the fields of each step from a file of results of fixed columns."""
    blocks: list[tuple[str, NDArray[np.float64]]] = []
    name, rows = "", list[str]()
    for line in path.read_text(encoding="ascii").splitlines():
        if line.startswith(" -1"):
            rows.append(line)
        elif line.startswith("    2C"):
            name, rows = "nodes", []
        elif line.startswith("    3C"):
            name, rows = "elements", []
        elif line.startswith(" -4"):
            name, rows = line.split()[1], []
        elif line.startswith(" -3") and name != "elements":
            blocks.append((name, numbers(rows)))
    (_, xyz), *results = blocks
    found = [values for wanted in ("DISP", "TOSTRAIN") for n, values in results if n == wanted]
    steps = len(found) // 2
    pairs = zip(found[:steps], found[steps:], strict=True)
    return [Fields(xyz, displacement, strain[:, [0, 1, 3]]) for displacement, strain in pairs]


def numbers(rows: Iterable[str]) -> NDArray[np.float64]:
    """Values of rows, ordered by their nodes: mark of 3 characters, node of 10, values of 12."""
    table = np.array([row.rstrip() for row in rows], dtype="S")
    table = table.view("S1").reshape(len(table), -1)
    node = np.ascontiguousarray(table[:, 3:13]).view("S10")[:, 0].astype(int)
    values = np.ascontiguousarray(table[:, 13:]).view("S12").astype(float)
    return values[np.argsort(node)]


def program() -> str | None:
    """Return the path of CalculiX, None where it is not installed."""
    return shutil.which("ccx")


def solve(
    folder: Path,
    plate: fe.Plate,
    counts: tuple[int, int],
    loads: Loads,
    *,
    material: str = "thin",
    edge: Held = clamped,
    nonlinear: bool = False,
    expansion: float = 0.0,
) -> list[Fields]:
    """Solve a plate with CalculiX in a folder; return the fields of each load.

    Its shape is that of the plate. Its tension is not: the plate expands by a part `expansion` of
    its length as it grows warmer than its frame, in a nonlinear step.

    Raises
    ------
    OSError
        If CalculiX is not installed, or does not finish.
    """
    path = program()
    if path is None:
        raise OSError("CalculiX is not installed; `make system-deps` installs it")
    text = deck(plate, counts, loads, material, edge, nonlinear, expansion)
    (folder / "plate.inp").write_text(text, encoding="ascii")
    ended = subprocess.run(
        [path, "plate"],
        cwd=folder,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    fields = read(folder / "plate.frd") if "Job finished" in ended.stdout else []
    if len(fields) != len(loads):
        raise OSError(f"CalculiX did not finish: {ended.stdout[-400:]}{ended.stderr[-400:]}")
    return [replace(each, xyz=flattened(plate, each.xyz)) for each in fields]


def flattened(plate: fe.Plate, xyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Foot x, y and height over the middle surface of nodes (N, 3) mm along its normals."""
    if plate.shape is None:
        return xyz
    xy, z = xyz[:, :2], xyz[:, 2] - plate.shape.at(plate.size, xyz[:, :2])
    slope = np.stack([plate.shape.at(plate.size, xy, p, 1 - p) for p in (1, 0)], axis=1)
    foot = xy + z[:, None] * slope
    return np.column_stack([foot, xyz[:, 2] - plate.shape.at(plate.size, foot)])
