"""Batches that a net learns from: drawn from a set, superposed as they are needed, with noise."""

from collections.abc import Iterator

import numpy as np

from models.dataset import Dataset

__all__ = ["noisy", "shuffled", "superposed"]


def shuffled(data: Dataset, size: int, rng: np.random.Generator) -> Iterator[Dataset]:
    """Go through `data` in random order again and again, `size` samples at a time.

    A rest that does not fill a batch is left out; the next round has another one.
    """
    size = min(size, len(data))
    while True:
        order = rng.permutation(len(data))
        for first in range(0, len(order) - size + 1, size):
            rows = order[first : first + size]
            yield Dataset(data.strain[rows], data.targets[rows])


def superposed(
    single: Dataset, touches: int, size: int, rng: np.random.Generator, largest: float | None = None
) -> Iterator[Dataset]:
    """Press several of the touches of `single` at a time: linear theory.

    Parameters
    ----------
    single
        Unit touches, those of a sample are drawn from.
    touches
        Of a sample, sorted by x, then y.
    size
        Samples of a batch.
    rng
        Source of the draw.
    largest
        Of the magnitudes, which are drawn evenly from 1 on and told after the places; None for
        equal touches of magnitude 1.
    """
    rank = np.lexsort(single.targets[:, 1::-1].T)
    strain, places = single.strain[rank], single.targets[rank]
    while True:
        rows = np.sort(rng.integers(0, len(places), (size, touches)), axis=1)
        told = places[rows].reshape(size, -1)
        if largest is None:
            yield Dataset(strain[rows].sum(axis=1), told)
        else:
            magnitudes = rng.uniform(1.0, largest, rows.shape)
            total = np.einsum("nk,nki->ni", magnitudes, strain[rows])
            yield Dataset(total, np.column_stack([told, magnitudes]))


def noisy(
    batches: Iterator[Dataset], sigma: float | np.ndarray, rng: np.random.Generator
) -> Iterator[Dataset]:
    """Add noise to every channel, drawn anew for each batch.

    Parameters
    ----------
    batches
        Without noise, or with some already.
    sigma
        Its deviation, strain; or a root (I, I) of its covariance where channels share noise.
    rng
        Source of the noise.
    """
    for batch in batches:
        drawn = rng.standard_normal(batch.strain.shape, dtype=np.float32)
        noise = sigma * drawn if np.ndim(sigma) == 0 else drawn @ np.transpose(sigma)
        yield Dataset(batch.strain + noise, batch.targets)
