"""What lives on a plate and a mesh as named arrays, for files, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fe.elements.mesh import Mesh
from fe.plate.edges import Edges, Springs, edge_of
from fe.plate.plate import Patch, Plate

_SIDES = ("west", "east", "south", "north")


def store(plate: Plate, mesh: Mesh, **arrays: Any) -> dict[str, np.ndarray]:
    """Return the arrays together with the numbers of their plate and mesh."""
    numbers = (*plate.size, plate.thickness, plate.young, plate.poisson)
    patches = [(*patch.x, *patch.y, patch.thickness, patch.young) for patch in plate.patches]
    return {
        "plate": np.array(numbers),
        "edges": np.array([getattr(plate.sides, side).springs for side in _SIDES]),
        "patches": np.array(patches, dtype=np.float64).reshape(-1, 6),
        "counts": np.array(mesh.counts),
        "breaks_x": np.array(mesh.breaks[0], dtype=np.float64),
        "breaks_y": np.array(mesh.breaks[1], dtype=np.float64),
        **{name: np.asarray(value) for name, value in arrays.items()},
    }


def restore(arrays: Mapping[str, np.ndarray], *names: str) -> tuple[Plate, Mesh, list[np.ndarray]]:
    """Return plate, mesh and the named arrays that `store` wrote.

    Raises
    ------
    ValueError
        An array is missing or has the wrong shape.
    """
    found = [_array(arrays, name) for name in names]
    numbers, counts = _shaped(arrays, "plate", (5,)), _shaped(arrays, "counts", (2,))
    springs, patches = _shaped(arrays, "edges", (4, 3)), _shaped(arrays, "patches", (None, 6))
    sides = [edge_of(Springs(*map(float, row))) for row in springs]
    edges = sides[0] if sides == sides[:1] * 4 else Edges(*sides)
    a, b, thickness, young, poisson = (float(v) for v in numbers)
    parts = tuple(_patch(row) for row in patches.tolist())
    plate = Plate((a, b), thickness, young, poisson, edges, parts)
    breaks = tuple(_array(arrays, "breaks_x")), tuple(_array(arrays, "breaks_y"))
    return plate, Mesh(plate.size, (int(counts[0]), int(counts[1])), breaks), found


def _patch(row: list[float]) -> Patch:
    x0, x1, y0, y1, thickness, young = row
    return Patch((x0, x1), (y0, y1), thickness, young)


def _shaped(
    arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int | None, ...]
) -> np.ndarray:
    array = _array(arrays, name)
    wanted = tuple(n if m is None else m for n, m in zip(array.shape, shape, strict=False))
    if array.ndim != len(shape) or array.shape != wanted:
        raise ValueError(
            f"stored array {name!r} must have shape {shape}, got {array.shape}; compute it again"
        )
    return array


def _array(arrays: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    if name not in arrays:
        raise ValueError(
            f"stored arrays must hold {name!r}, got {', '.join(arrays)}; compute them again"
        )
    return np.asarray(arrays[name])
