"""What interpolation and aliasing leave of a motion, by its size."""

import numpy as np

from dic.arrays import F64
from dic.numbers import read_array


def aliasing_left(flow: F64) -> float:
    """Give the variance that aliasing leaves of motions (n, 2) px, over that of any motion.

    A wave that is folded back turns against the pattern: of a motion u it leaves sin²(πu) along
    each axis, and nothing of a pixel or of none. Tiles count by the square of their motion.

    Raises
    ------
    ValueError
        If the motions are not finite numbers of two columns.
    """
    flow = _read_motions(flow)
    weight = np.square(flow).sum(axis=1)
    left = np.square(np.sin(np.pi * flow)).sum(axis=1)
    return float(weight @ left / max(float(weight.sum()), 1e-30))


def gain_left(flow: F64) -> float:
    """Give the part by which motions (n, 2) px are measured too large, over that of small ones.

    Of a motion u a gain g of small ones leaves g sin(2πu)/2π. Tiles count as in `aliasing_left`.

    Raises
    ------
    ValueError
        If the motions are not finite numbers of two columns.
    """
    flow = _read_motions(flow)
    left = flow * np.sin(2.0 * np.pi * flow) / (2.0 * np.pi)
    return float(left.sum() / max(float(np.square(flow).sum()), 1e-30))


def _read_motions(flow: F64) -> F64:
    """Check motions (n, 2) px."""
    flow = read_array(flow, "flow", "px")
    if flow.ndim != 2 or flow.shape[1] != 2 or not np.isfinite(flow).all():
        raise ValueError(
            f"flow must be (n, 2) finite px, one motion a tile; got shape {flow.shape}"
            f" and {np.sum(~np.isfinite(flow))} numbers that are not finite; give u and v of each"
        )
    return flow
