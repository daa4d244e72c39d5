"""Patterns that repeat, material that breaks, frames that cannot be used."""

import numpy as np
import pytest

import dic
from dic.fields.displacement import Status

SHAPE = (190, 230)


def noisy(image, seed, noise=2.0):
    return image + np.random.default_rng(seed).normal(0, noise, image.shape)


def tiles(period, shift):
    """Spots of 2 px that repeat after a period, in closed form."""
    rng = np.random.default_rng(5)
    count = int(period**2 / 14)
    centres, signs = rng.uniform(0, period, (count, 2)), rng.choice([-1.0, 1.0], count)
    waves = []
    for axis, length in enumerate(SHAPE[::-1]):
        away = np.arange(length)[:, None] - shift[axis] - centres[:, axis]
        away = (away + period / 2) % period - period / 2
        waves.append(np.exp(-(away**2) / 8))
    return 128 + 60 * (waves[1] * signs) @ waves[0].T


@pytest.mark.parametrize("period", [20.0, 47.5])
def test_a_pattern_that_repeats_is_ambiguous_without_a_guess(period):
    shift = (9.3, 2.0)
    ref = dic.prepare(noisy(tiles(period, (0.0, 0.0)), 1))
    frame = noisy(tiles(period, shift), 2)
    alone = dic.correlate(ref, frame)
    assert (alone.status[ref.status == Status.OK] == Status.AMBIGUOUS).all()
    assert np.isnan(alone.u).all()
    near = dic.correlate(ref, frame, guess=np.tile(np.rint(shift), (len(ref.xy), 1)))
    inside = np.all(ref.xy < np.array(SHAPE[::-1]) - 35, axis=1)
    assert near.valid[inside].all()
    assert np.abs(near.u[inside] - shift[0]).max() <= 0.06


def test_a_random_pattern_is_never_ambiguous(speckle):
    for seed in range(6):
        image = speckle(SHAPE, seed=seed).draw()
        found = dic.correlate(dic.prepare(image), image)
        assert not (found.status == Status.AMBIGUOUS).any()


@pytest.mark.parametrize(("shift", "gap"), [((0.0, 0.8), 0.0), ((0.7, 0.0), 0.7)])
def test_subsets_across_a_crack_are_broken_and_no_others(speckle, shift, gap):
    pattern = speckle(SHAPE, seed=4)
    middle = (SHAPE[1] - 1) / 2 + 0.5  # between two columns
    x = np.arange(SHAPE[1])
    after = np.clip(x + 0.5 - middle - gap, 0, 1)  # part of a pixel beyond the gap
    before = (x < middle).astype(float)
    moved = pattern.draw() * before + pattern.draw(shift) * after + 40 * (1 - before - after)
    found = dic.correlate(dic.prepare(noisy(pattern.draw(), 1)), noisy(moved, 2))
    beyond = found.xy[:, 0] > middle
    off = np.hypot(found.u - shift[0] * beyond, found.v - shift[1] * beyond)
    across = np.abs(found.xy[:, 0] - middle) <= found.subset // 2
    assert (found.valid & (off > 0.1)).sum() <= 0.02 * across.sum()
    assert not found.valid[np.abs(found.xy[:, 0] - middle) < 6].any()
    assert (found.status[across] == Status.BROKEN).mean() >= 0.2  # beside a gap many are DISTURBED
    assert not (found.status[np.abs(found.xy[:, 0] - middle) > 17] == Status.BROKEN).any()


def test_a_bend_is_no_break(speckle):
    pattern = speckle(SHAPE, seed=4)
    frame = pattern.draw((0.3, 0.1), ((0.02, 0.01), (-0.01, 0.03)))
    found = dic.correlate(dic.prepare(noisy(pattern.draw(), 1), order=0), noisy(frame, 2))
    assert not (found.status == Status.BROKEN).any()


def test_every_status_has_a_sentence_with_a_remedy():
    sentences = [status.sentence for status in Status]
    assert len(set(sentences)) == len(Status)
    assert all(";" in s for status, s in zip(Status, sentences, strict=True) if status)
