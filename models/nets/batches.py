"""Batches that a net learns from: drawn from a set, superposed as they are needed, with noise."""

from collections.abc import Iterator

import numpy as np

from models.data.dataset import Dataset


def shuffled_batches(data: Dataset, size: int, rng: np.random.Generator) -> Iterator[Dataset]:
    """Go through `data` in random order again and again, `size` samples at a time.

    A rest that does not fill a batch is left out; the next round has another one.
    """
    size = min(size, len(data))
    while True:
        order = rng.permutation(len(data))
        for first in range(0, len(order) - size + 1, size):
            rows = order[first : first + size]
            yield Dataset(data.strain[rows], data.targets[rows])


def superposed_batches(
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
        Of the magnitudes, which are drawn evenly from 1 on and reported after the places; None for
        equal touches of magnitude 1.
    """
    rank = np.lexsort(single.targets[:, 1::-1].T)
    strain, places = single.strain[rank], single.targets[rank]
    while True:
        rows = np.sort(rng.integers(0, len(places), (size, touches)), axis=1)
        targets = places[rows].reshape(size, -1)
        if largest is None:
            yield Dataset(strain[rows].sum(axis=1), targets)
        else:
            magnitudes = rng.uniform(1.0, largest, rows.shape)
            total = np.einsum("nk,nki->ni", magnitudes, strain[rows])
            yield Dataset(total, np.column_stack([targets, magnitudes]))


def noisy_batches(
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


def mixed_batches(batches: Iterator[Dataset], others: Iterator[Dataset]) -> Iterator[Dataset]:
    """Join each batch with one of others: of touches that were simulated in another way."""
    for batch, more in zip(batches, others, strict=False):
        strain = np.concatenate([batch.strain, more.strain])
        yield Dataset(strain, np.concatenate([batch.targets, more.targets]))


def estimated(
    single: Dataset,
    gain: np.ndarray,
    sigma: tuple[float, float],
    size: int,
    rng: np.random.Generator,
) -> Iterator[Dataset]:
    """Add noise to single touches, with what least squares would make of each.

    Noise n moves the estimate of least squares by G n to first order, see `gain`. A net that is
    reported x + G n in place of x learns that estimate, which reaches the bound, and not first to
    average the noise of its targets over many batches.

    Parameters
    ----------
    single
        Touches without noise.
    gain
        (N, 2, I) float, mm per strain, G of each touch.
    sigma
        Least and largest deviation of the noise, strain; drawn evenly in its logarithm for each
        sample.
    size
        Samples of a batch.
    rng
        Source of the draws.
    """
    low, high = np.log(sigma)
    while True:
        rows = rng.integers(0, len(single), size)
        drawn = rng.standard_normal((size, single.strain.shape[1]), dtype=np.float32)
        noise = np.exp(rng.uniform(low, high, (size, 1))) * drawn
        moved = np.einsum("nai,ni->na", gain[rows], noise)
        yield Dataset(single.strain[rows] + noise, single.targets[rows] + moved)


def gain(slope: np.ndarray) -> np.ndarray:
    """Return how noise moves the places that least squares finds, forces known.

    Parameters
    ----------
    slope
        (N, M, 3, 2) float64, strain per mm of N touches at M gauges, J: `gradient` of an influence
        times the force.

    Returns
    -------
    (N, 2, 3 M) float64, mm per strain, G = (Jᵀ J)⁻¹ Jᵀ.
    """
    columns = slope.reshape(len(slope), -1, 2)
    rows = columns.transpose(0, 2, 1)
    return np.linalg.solve(rows @ columns, rows)
