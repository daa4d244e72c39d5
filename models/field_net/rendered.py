"""Training samples of the field net from rendered images, as it meets them in use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dic import AdaptiveTiles, adaptive_tiles, correlate, prepare
from models.arrays import F64
from models.field_net.inputs import net_inputs
from models.field_net.rendered_pairs import RenderedPair, draw_pairs
from models.field_net.samples import Batch, batch_of, together
from models.field_net.unet import STRIDE
from synthetic import BatchWarper

_SUBSETS = 15, 21, 31  # px
_STEP = 5  # px, that of the tiles
_APART = 1.0  # px, over which a slope of the truth is taken


def rendered_batch(
    pool: Sequence[BatchWarper],
    plates: Sequence[F64],
    pairs: int,
    side: int,
    rng: np.random.Generator,
) -> Batch:
    """Render pairs of images, measure their adaptive fields, and compare these with the truth.

    Parameters
    ----------
    pool, plates, side, rng
        As of `draw_pairs`.
    pairs : int
        Those of which nothing is found are left out, and others drawn.
    """
    found: list[Batch] = []
    while len(found) < pairs:
        for pair in draw_pairs(pool, plates, pairs - len(found), side, rng):
            tiles = _measured(pair, int(rng.choice(_SUBSETS)))
            if tiles is not None:
                found.append(batch_of(tiles, tile_truth(pair, tiles), net_inputs(tiles)))
    rows, columns = (
        min(batch.error.shape[axis] for batch in found) // STRIDE * STRIDE for axis in (2, 3)
    )
    return together([batch.cut(rows, columns) for batch in found])


def tile_truth(pair: RenderedPair, tiles: AdaptiveTiles) -> F64:
    """Displacement of tiles and its slopes along x and y, px and px per tile, (2, 3, R, C)."""
    xy, shape = tiles.lattice.xy, tiles.lattice.shape
    parts = [pair.truth_at(xy)]
    for axis in range(2):
        step = 0.5 * _APART * np.eye(2)[axis]
        change = pair.truth_at(xy + step) - pair.truth_at(xy - step)
        parts.append(_STEP / _APART * change)
    return np.stack(parts, axis=1).reshape(2, 3, *shape)


def _measured(pair: RenderedPair, subset: int) -> AdaptiveTiles | None:
    ref = prepare(pair.first, subset, _STEP, roi=pair.roi)
    return adaptive_tiles(ref, pair.second, correlate(ref, pair.second))
