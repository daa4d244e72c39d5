"""Training samples of the field net: drawn fields with noise, and their adaptive fields."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dic import AdaptiveTiles, denoised_tiles
from models.arrays import F32, F64, Mask
from models.field_net.drawn_fields import draw_field, draw_noise, places
from models.field_net.inputs import net_inputs

_FAR = 4.0  # σ of the adaptive field, beyond which an error counts no more
_HOLES = 0.15  # fraction of fields with one


@dataclass(frozen=True, eq=False)
class Batch:
    """Inputs of the net and what it should say.

    Attributes
    ----------
    inputs : (B, 9, R, C) float32
    error : (B, 3, R, C) float32
        Truth less the adaptive field and its slopes, over its σ.
    counted : (B, 1, R, C) float32
        1 where there is a field, 0 where none.
    """

    inputs: F32
    error: F32
    counted: F32

    def cut(self, rows: int, columns: int) -> Batch:
        """Return the first rows and columns."""
        part = np.s_[..., :rows, :columns]
        return Batch(self.inputs[part], self.error[part], self.counted[part])


def together(batches: Sequence[Batch]) -> Batch:
    """Put batches of one size together."""
    return Batch(
        np.concatenate([batch.inputs for batch in batches]),
        np.concatenate([batch.error for batch in batches]),
        np.concatenate([batch.counted for batch in batches]),
    )


def batch_of(tiles: AdaptiveTiles, truth: F64, inputs: F32) -> Batch:
    """Return the fields of tiles and what they lack of the truth (2, 3, R, C)."""
    error = np.clip((truth - tiles.values) / tiles.sigma, -_FAR, _FAR)
    counted = np.isfinite(error[:, :1])
    return Batch(inputs, np.nan_to_num(error).astype(np.float32), counted.astype(np.float32))


def stream(
    shape: tuple[int, int], pairs: int, plates: Sequence[F64], rng: np.random.Generator
) -> Iterator[Batch]:
    """Draw batches of `pairs` fields of two components without end."""
    while True:
        yield together([_draw(shape, plates, rng) for _ in range(pairs)])


def _draw(shape: tuple[int, int], plates: Sequence[F64], rng: np.random.Generator) -> Batch:
    first, second = (draw_field(shape, plates, rng) for _ in range(2))
    torn = first.torn | second.torn
    truth, noise = np.stack([first.values, second.values]), draw_noise(shape, rng)
    valid = ~(torn | _hole(shape, rng))
    seen = truth[:, 0] + noise * rng.standard_normal((2, *shape))
    tiles = denoised_tiles(seen, np.stack([noise, noise]), valid)
    return batch_of(tiles, truth, net_inputs(tiles))


def _hole(shape: tuple[int, int], rng: np.random.Generator) -> Mask:
    """Draw a round hole, or none."""
    if rng.random() > _HOLES:
        return np.zeros(shape, bool)
    x, y = places(shape)
    away = np.hypot(x - rng.uniform(0, shape[1]), y - rng.uniform(0, shape[0]))
    return away < rng.uniform(2.0, 0.25 * min(shape))
