"""What lives on a plate and a mesh as named arrays, for files, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fe.elements.mesh import Mesh
from fe.plate.edges import Edges, Springs, edge_of, taper_of
from fe.plate.plate import Patch, Plate
from fe.plate.shape import Shape

_SIDES = ("west", "east", "south", "north")


def store(plate: Plate, mesh: Mesh, **arrays: Any) -> dict[str, np.ndarray]:
    """Return the arrays together with the numbers of their plate and mesh."""
    numbers = (*plate.size, plate.thickness, plate.young, plate.poisson)
    patches = [(*patch.x, *patch.y, patch.thickness, patch.young) for patch in plate.patches]
    return {
        "plate": np.array(numbers),
        "edges": np.array([getattr(plate.sides, side).springs for side in _SIDES]),
        "tapers": np.array([taper_of(getattr(plate.sides, side)) for side in _SIDES]),
        "tension": np.array(plate.tension),
        "strain_limit": np.array(plate.strain_limit),
        "taper": np.array(plate.taper),
        **_shape_arrays(plate.shape),
        "patches": np.array(patches, dtype=np.float64).reshape(-1, 6),
        "counts": np.array(mesh.counts),
        "breaks_x": np.array(mesh.breaks[0], dtype=np.float64),
        "breaks_y": np.array(mesh.breaks[1], dtype=np.float64),
        "runs_x": np.array(mesh.runs[0], dtype=np.int64),
        "runs_y": np.array(mesh.runs[1], dtype=np.int64),
        **{name: np.asarray(value) for name, value in arrays.items()},
    }


def restore(arrays: Mapping[str, np.ndarray], *names: str) -> tuple[Plate, Mesh, list[np.ndarray]]:
    """Return plate, mesh and the named arrays that `store` wrote.

    Of plates stored without tapers, tension and shape there are none, and the strain limit is the
    usual one; of meshes without runs they are equal.

    Raises
    ------
    ValueError
        An array is missing or has the wrong shape.
    """
    found = [_array(arrays, name) for name in names]
    numbers, counts = _shaped(arrays, "plate", (5,)), _shaped(arrays, "counts", (2,))
    springs, patches = _shaped(arrays, "edges", (4, 3)), _shaped(arrays, "patches", (None, 6))
    optional = {
        "tapers": np.zeros((4, 3)),
        "tension": np.zeros(3),
        "strain_limit": np.array(Plate.strain_limit),
        "taper": np.array(Plate.taper),
        **arrays,
    }
    tapers, tension = _shaped(optional, "tapers", (4, 3)), _shaped(optional, "tension", (3,))
    sides = [
        edge_of(Springs(*held), Springs(*uneven))
        for held, uneven in zip(springs.tolist(), tapers.tolist(), strict=True)
    ]
    edges = sides[0] if sides == sides[:1] * 4 else Edges(*sides)
    a, b, thickness, young, poisson = (float(v) for v in numbers)
    parts = tuple(_patch(row) for row in patches.tolist())
    limit = float(_shaped(optional, "strain_limit", ()))
    rising = tuple(_shaped(optional, "taper", (2,)).tolist())
    rest = tuple(tension.tolist()), _shape(arrays), limit, rising
    plate = Plate((a, b), thickness, young, poisson, edges, parts, *rest)
    breaks = tuple(_array(arrays, "breaks_x")), tuple(_array(arrays, "breaks_y"))
    equal = {"runs_x": np.empty(0, np.int64), "runs_y": np.empty(0, np.int64), **arrays}
    runs = tuple(_array(equal, "runs_x").tolist()), tuple(_array(equal, "runs_y").tolist())
    return plate, Mesh(plate.size, (int(counts[0]), int(counts[1])), breaks, runs), found


def _shape_arrays(shape: Shape | None) -> dict[str, np.ndarray]:
    """Arrays of a shape; none of a flat plate."""
    if shape is None:
        return {}
    return {"sag": np.array(shape.sag), "shape_modes": np.array(shape.modes)}


def _shape(arrays: Mapping[str, np.ndarray]) -> Shape | None:
    if "sag" not in arrays:
        return None
    return Shape(
        float(_shaped(arrays, "sag", ())), tuple(map(tuple, _array(arrays, "shape_modes")))
    )


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
