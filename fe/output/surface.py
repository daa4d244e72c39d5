"""The touched face of a bent plate, sampled on the lines of its mesh: what plots show."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.mesh import Mesh
from fe.plate.plate import Plate, Touch


class PlateState(Protocol):
    """What every theory gives for a plate under load: places in mm, results at (K, 2) points."""

    @property
    def plate(self) -> Plate:
        """The plate."""
        ...

    @property
    def mesh(self) -> Mesh:
        """Its grid of elements."""
        ...

    def displacement(self, xy: ArrayLike) -> F64:
        """Displacement u, v, w of the touched face, (K, 3), mm."""
        ...

    def strain(self, xy: ArrayLike) -> F64:
        """Strain exx, eyy, exy of the touched face, (K, 3)."""
        ...


class FaceSamples(NamedTuple):
    """Points of the touched face: those of a grid row by row, then the places of touches.

    Attributes
    ----------
    xy : (K, 2) float64, mm
        Places on the flat plate.
    displacement : (K, 3) float64, mm
    strain : (K, 3) float64, strain
        exx, eyy and the tensor component exy.
    thickness : (K,) float64, mm
    shape : (rows, columns)
        Nodes along y and along x; the first rows * columns points are theirs.
    """

    xy: F64
    displacement: F64
    strain: F64
    thickness: F64
    shape: tuple[int, int]


def sample(state: PlateState, touches: Sequence[Touch] = ()) -> FaceSamples:
    """Read a state on the nodes of its mesh and where it is touched.

    Raises
    ------
    ValueError
        A touch lies outside the plate.
    """
    x, y = state.mesh.nodes
    nodes = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    places = np.array([(t.x, t.y) for t in touches], dtype=np.float64).reshape(-1, 2)
    xy = np.concatenate([nodes, state.plate.points(places, "touch")])
    thickness = state.plate.material(xy)[0]
    return FaceSamples(xy, state.displacement(xy), state.strain(xy), thickness, (y.size, x.size))


def writable(path: str | Path, suffixes: tuple[str, ...]) -> Path:
    """Return the path after checking that a file of that kind can be written there.

    Raises
    ------
    ValueError
        The name ends in none of `suffixes`.
    OSError
        Its folder does not exist, or it is a folder itself.
    """
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        raise ValueError(f"name of the file must end in {' or '.join(suffixes)}, got {path.name!r}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"folder {path.parent} does not exist; create it first")
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder; give the name of a file in it")
    return path


def write_whole(path: Path, content: bytes) -> None:
    """Write a file aside and rename it: whole or not at all.

    Raises
    ------
    OSError
        The folder cannot be written.
    """
    draft = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        draft.write_bytes(content)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)
