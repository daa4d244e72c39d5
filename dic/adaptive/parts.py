"""Blocks of which only a part is known: beside a hole, or cut in two by a crack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import F32, I64, Mask

_SMALLEST = 0.25  # of a block: less of it says too little
_RIDGE = 1e-6  # of a tile, that holds the plane of a part on one line


@dataclass(frozen=True)
class Parts:
    """Connected parts of blocks.

    Attributes
    ----------
    block : (M,) int64
        The block of each.
    masks : (M, n, n) bool
        Its tiles.
    """

    block: I64
    masks: Mask


def parts_of(masks: Mask, broken: Mask) -> Parts:
    """Split the blocks (B, n, n) that are `broken` (B,) into parts that are large enough."""
    from scipy.ndimage import label

    block: list[int] = []
    found: list[Mask] = []
    fewest = _SMALLEST * masks.shape[1] * masks.shape[2]
    for n in np.flatnonzero(broken & (masks.sum(axis=(1, 2)) >= fewest)):
        labels = np.asarray(label(masks[n])[0])
        for part in range(1, int(labels.max()) + 1):
            mask: Mask = labels == part
            if np.count_nonzero(mask) >= fewest:
                block.append(int(n))
                found.append(mask)
    stacked = np.array(found) if found else np.zeros((0, *masks.shape[1:]), bool)
    return Parts(np.array(block, dtype=np.int64), stacked)


def filled(blocks: F32, known: Mask) -> F32:
    """Continue what is known of each block by the plane through it, (M, n, n)."""
    side = blocks.shape[1]
    axis = np.linspace(-0.5, 0.5, side)
    terms = np.stack([np.ones((side, side)), np.tile(axis, (side, 1)), np.tile(axis, (side, 1)).T])
    flat, weight = terms.reshape(3, -1), known.reshape(len(known), -1).astype(np.float64)
    given = np.where(known, blocks, 0.0).reshape(len(known), -1)
    normal = (weight[:, None, :] * flat) @ flat.T + _RIDGE * np.eye(3)
    plane = np.asarray(np.linalg.solve(normal, (given @ flat.T)[..., None]))[..., 0]
    there = (plane @ flat).reshape(known.shape)
    return np.where(known, blocks, there).astype(np.float32)
