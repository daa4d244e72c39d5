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


@pytest.mark.parametrize("normal", [np.array([1.0, 0.0]), np.array([0.0, 1.0])])
def test_a_slide_of_half_a_pixel_is_seen_that_is_hardly_louder_than_the_noise(speckle, normal):
    pattern, slide = speckle(SHAPE, seed=4), 0.5 * normal[::-1]
    edge = np.array(SHAPE[::-1]) // 2 @ normal + 0.5
    beyond = np.indices(SHAPE)[::-1].T @ normal > edge
    moved = np.where(beyond.T, pattern.draw(slide), pattern.draw())
    found = dic.correlate(dic.prepare(noisy(pattern.draw(), 1, 4.0)), noisy(moved, 2, 4.0))
    off = found.xy @ normal - edge
    wrong = np.hypot(*(np.column_stack([found.u, found.v]) - np.outer(off > 0, slide)).T) > 0.1
    across = np.abs(off) <= found.subset // 2
    assert (found.valid & wrong)[across].mean() <= 0.05
    assert found.valid[~across].mean() >= 0.96


@pytest.mark.parametrize("noise", [10.0, 20.0])
def test_noise_that_a_prefilter_has_passed_is_no_break(speckle, noise):
    pattern = speckle(SHAPE, seed=4)
    ref = dic.prepare(noisy(pattern.draw(), 1, noise))
    assert ref.prefilter.sigma > 0
    for seed in range(2, 6):
        frame = pattern.draw((0.0, 0.3), ((0.0, 0.0), (0.01, 0.0)))
        found = dic.correlate(ref, noisy(frame, seed, noise))
        assert not (found.status == Status.BROKEN).any()


def test_a_bend_is_no_break(speckle):
    pattern = speckle(SHAPE, seed=4)
    frame = pattern.draw((0.3, 0.1), ((0.02, 0.01), (-0.01, 0.03)))
    found = dic.correlate(dic.prepare(noisy(pattern.draw(), 1), order=0), noisy(frame, 2))
    assert not (found.status == Status.BROKEN).any()


def test_every_status_has_a_sentence_with_a_remedy():
    sentences = [status.sentence for status in Status]
    assert len(set(sentences)) == len(Status)
    assert all(";" in s for status, s in zip(Status, sentences, strict=True) if status)
