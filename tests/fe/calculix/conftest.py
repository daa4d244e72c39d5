"""CalculiX on plates of ours: writes its deck, runs it for real and reads its fields.

Its shell element S8R is expanded to a quadratic solid, integrated with 2 x 2 x 2 points. With
OUTPUT=3D the fields stand on the nodes of that solid: the nodes at z = h/2 are the touched face,
and strain there is extrapolated from the integration points and averaged over neighbours. It is
small strain in a linear step and Green-Lagrange strain with NLGEOM, exy the tensor component.
"""

import os
import shutil
import subprocess
from dataclasses import dataclass

import numpy as np
import pytest

# Transverse shear modulus of `thin`, in parts of the real one. Its share of the deflection falls
# with it; much stiffer, and the element locks: 100 doubles the error of coarse meshes.
SHEAR = 10.0

# Corners, then middles of sides of an element, in steps of half an element along x and y.
AROUND = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)])


def solid(plate):
    """Give the real material: shear across the thickness, and thickness that changes."""
    return ["*ELASTIC", f"{plate.young}, {plate.poisson}"]


def thin(plate):
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


def clamped(xy):
    """Hold u, v, w and the rotations about x and y at edge points (K, 2): (K, 5) zeros."""
    return np.zeros((len(xy), 5))


@dataclass(frozen=True)
class Fields:
    """Displacement (N, 3), mm, and strain exx, eyy, exy (N, 3) at nodes xyz (N, 3), mm."""

    xyz: np.ndarray
    displacement: np.ndarray
    strain: np.ndarray

    def nodes(self, xy, z):
        """Index of the node at each point (K, 2) mm and height z."""
        level = np.flatnonzero(np.abs(self.xyz[:, 2] - z) < 1e-3)
        apart = np.abs(self.xyz[level, None, :2] - np.asarray(xy)).max(-1)
        assert apart.min(0).max() < 1e-3, "a point lies on no node"
        return level[apart.argmin(0)]


class Grid:
    """Nodes xy (N, 2), mm, and elements (E, 8) of quadratic quadrilaterals."""

    def __init__(self, size, counts):
        nx, ny = (2 * count for count in counts)
        i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
        there = (i % 2 == 0) | (j % 2 == 0)  # an element has no node in its middle
        number = np.cumsum(there).reshape(there.shape) - 1
        self.xy = np.column_stack([i[there] * size[0] / nx, j[there] * size[1] / ny])
        first = np.stack([i[:-1:2, :-1:2], j[:-1:2, :-1:2]], -1).reshape(-1, 1, 2)
        self.elements = number[tuple(np.moveaxis(first + AROUND, -1, 0))]
        on_edge = (i % nx == 0) | (j % ny == 0)
        self.edge = np.flatnonzero(on_edge[there])

    def node(self, x, y):
        apart = np.abs(self.xy - (x, y)).max(1)
        assert apart.min() < 1e-9, "a touch lies on no node"
        return int(apart.argmin())


def deck(plate, counts, loads, material, edge, nonlinear):
    """Return the input of CalculiX: one step a load, each from the flat plate."""
    grid = Grid(plate.size, counts)
    nodes = [f"{k}, {x}, {y}, 0" for k, (x, y) in enumerate(grid.xy, 1)]
    numbered = enumerate(grid.elements + 1, 1)
    elements = [", ".join(map(str, (k, *corners))) for k, corners in numbered]
    held = [
        f"{node + 1}, {dof}, {dof}, {value:.9f}"
        for node, values in zip(grid.edge, edge(grid.xy[grid.edge]), strict=True)
        for dof, value in enumerate(values, 1)
    ]
    lines = ["*NODE, NSET=ALL", *nodes, "*ELEMENT, TYPE=S8R, ELSET=PLATE", *elements]
    lines += ["*MATERIAL, NAME=SHEET", *MATERIALS[material](plate)]
    lines += ["*SHELL SECTION, ELSET=PLATE, MATERIAL=SHEET", f"{plate.thickness}"]
    for touches in loads:
        lines += ["*STEP, NLGEOM" if nonlinear else "*STEP", "*STATIC, SOLVER=SPOOLES"]
        lines += ["*BOUNDARY", *held, "*CLOAD, OP=NEW"]
        lines += [f"{grid.node(t.x, t.y) + 1}, 3, {-t.force}" for t in touches]
        lines += ["*NODE FILE, OUTPUT=3D, FREQUENCY=9999", "U"]
        lines += ["*EL FILE, OUTPUT=3D, FREQUENCY=9999", "E", "*END STEP"]
    return "\n".join([*lines, ""])


def read(path):
    """Return the fields of each step from a file of results of fixed columns."""
    blocks, name, rows = [], "", []
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


def numbers(rows):
    """Values of rows, ordered by their nodes: mark of 3 characters, node of 10, values of 12."""
    table = np.array([row.rstrip() for row in rows], dtype="S")
    table = table.view("S1").reshape(len(rows), -1)
    node = np.ascontiguousarray(table[:, 3:13]).view("S10")[:, 0].astype(int)
    values = np.ascontiguousarray(table[:, 13:]).view("S12").astype(float)
    return values[np.argsort(node)]


@pytest.fixture(scope="session")
def calculix(tmp_path_factory):
    """Solve a plate with CalculiX: fields (one of each load, a sequence of touches)."""
    program = shutil.which("ccx")
    if program is None:
        pytest.skip("CalculiX is not installed; run `make system-deps`")

    def solve(plate, counts, loads, material="thin", edge=clamped, nonlinear=False):
        folder = tmp_path_factory.mktemp("calculix")
        (folder / "plate.inp").write_text(deck(plate, counts, loads, material, edge, nonlinear))
        ended = subprocess.run(
            [program, "plate"],
            cwd=folder,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert "Job finished" in ended.stdout, ended.stdout[-2000:] + ended.stderr
        fields = read(folder / "plate.frd")
        assert len(fields) == len(loads)
        return fields

    return solve
