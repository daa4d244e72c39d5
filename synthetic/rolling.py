"""A rolling shutter: rows of an image that are read one after the other."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from synthetic.arrays import F64
from synthetic.points import checked


def row_fraction(px: ArrayLike, height: int) -> F64:
    """When pixels are read: -1/2 in the first row of an image, 1/2 in the last.

    Parameters
    ----------
    px : (K, 2) float64, px.
    height : rows of the image.

    Returns
    -------
    (K,) float64, parts of the readout after its middle; beside the image as its nearest row.
    """
    rows = checked(px, 2, "pixel coordinates", "px")[:, 1]
    return np.clip(rows / (height - 1) - 0.5, -0.5, 0.5)


def while_read(displacements: Sequence[ArrayLike], fraction: ArrayLike) -> F64:
    """Displacement that each point has when its row is read.

    Parameters
    ----------
    displacements : n of (K, 3) float64, mm
        At instants evenly spread over the readout, its beginning and its end among them; in between
        the motion is straight.
    fraction : (K,) float64
        From `row_fraction`.

    Returns
    -------
    (K, 3) float64, mm

    Raises
    ------
    ValueError
        There are fewer than two instants, or they do not have a row for each point.
    """
    moved, when = np.asarray(displacements, dtype=np.float64), np.asarray(fraction)
    if len(moved) < 2 or moved.shape[1:] != (len(when), 3):
        raise ValueError(
            f"displacement must be given at 2 instants or more for {len(when)} points, got "
            f"{moved.shape}"
        )
    place = (when + 0.5) * (len(moved) - 1)
    before = np.clip(place.astype(int), 0, len(moved) - 2)
    part, every = (place - before)[:, None], np.arange(len(when))
    return (1.0 - part) * moved[before, every] + part * moved[before + 1, every]
