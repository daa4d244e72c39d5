"""What lives on a plate and a mesh as named arrays, for files, and back."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fe.mesh import Mesh
from fe.plate import Plate


def store(plate: Plate, mesh: Mesh, **arrays: np.ndarray) -> dict[str, np.ndarray]:
    """Return the arrays together with the numbers of their plate and mesh."""
    numbers = (*plate.size, plate.thickness, plate.young, plate.poisson)
    return {"plate": np.array(numbers), "counts": np.array(mesh.counts), **arrays}


def restore(arrays: Mapping[str, np.ndarray], *names: str) -> tuple[Plate, Mesh, list[np.ndarray]]:
    """Return plate, mesh and the named arrays that `store` wrote.

    Raises
    ------
    ValueError
        An array is missing, or plate and counts have not their 5 and 2 numbers.
    """
    found = [_array(arrays, name) for name in names]
    numbers, counts = _array(arrays, "plate"), _array(arrays, "counts")
    if numbers.shape != (5,) or counts.shape != (2,):
        raise ValueError(
            "stored plate and counts must hold 5 and 2 numbers, "
            f"got {numbers.size} and {counts.size}; compute them again"
        )
    a, b, thickness, young, poisson = (float(v) for v in numbers)
    plate = Plate((a, b), thickness, young, poisson)
    return plate, Mesh(plate.size, (int(counts[0]), int(counts[1]))), found


def _array(arrays: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    if name not in arrays:
        raise ValueError(
            f"stored arrays must hold {name!r}, got {', '.join(arrays)}; compute them again"
        )
    return np.asarray(arrays[name])
