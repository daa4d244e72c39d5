"""Subsets across a crack that are measured by their larger side."""

import numpy as np
import pytest

import dic
from dic.fields.displacement import Status

SHAPE = (190, 230)
TURNED = np.radians(20.0)
NORMALS = {"upright": np.array([1.0, 0.0]), "turned": np.array([np.cos(TURNED), np.sin(TURNED)])}


def noisy(image, seed, noise=2.0):
    return image + np.random.default_rng(seed).normal(0, noise, image.shape)


def torn(pattern, normal, shift):
    """Pattern before and after all beyond a line has moved; a gap that opens is grey."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    away = (np.stack([x, y], axis=-1) - np.array(SHAPE[::-1]) / 2) @ normal
    before = (away < 0).astype(float)
    after = np.minimum(np.clip(away + 0.5 - shift @ normal, 0, 1), 1 - before)
    moved = pattern.draw() * before + pattern.draw(tuple(shift)) * after + 40 * (1 - before - after)
    return noisy(pattern.draw(), 1), noisy(moved, 2)


def distance(field, normal):
    return (field.xy - np.array(SHAPE[::-1]) / 2) @ normal


def errors_over_sigma(pattern, normal, shift):
    """Errors of what was split over σ, how many were, and how many whole subsets lose."""
    before, after = torn(pattern, normal, shift)
    ref = dic.prepare(before)
    field = dic.correlate_split(ref, after)
    split = field.status == Status.SPLIT
    off = np.stack([field.u, field.v], axis=1) - shift * (distance(field, normal) > 0)[:, None]
    assert (field.valid_fraction[split] < 0.9).all()
    over = off[split] / np.stack([field.sigma_u, field.sigma_v], axis=1)[split]
    return over, split.sum(), (dic.correlate(ref, after).status != Status.OK).sum()


@pytest.mark.slow
@pytest.mark.parametrize("normal", NORMALS.values(), ids=NORMALS)
@pytest.mark.parametrize("along", [0.6, 1.5])
def test_split_subsets_measure_their_own_side_within_sigma(speckle, normal, along):
    shift = along * np.array([-normal[1], normal[0]])
    each = [errors_over_sigma(speckle(SHAPE, seed=seed), normal, shift) for seed in (4, 5, 6)]
    over = np.concatenate([one for one, _, _ in each])
    assert sum(split for _, split, _ in each) >= 0.2 * sum(lost for _, _, lost in each)
    assert abs(over.mean()) <= 0.5  # subsets overlap: some 40 of the errors are independent
    assert 0.7 <= np.sqrt(np.mean(over**2)) <= 1.3
    assert np.abs(over).max() <= 5


def test_split_subsets_take_no_part_in_strain(speckle):
    normal = NORMALS["upright"]
    before, after = torn(speckle(SHAPE, seed=4), normal, np.array([0.0, 0.8]))
    ref = dic.prepare(before)
    whole, field = dic.correlate(ref, after), dic.correlate_split(ref, after)
    assert (field.status == Status.SPLIT).any()
    np.testing.assert_array_equal(dic.strain(field).exx, dic.strain(whole).exx)
    others = field.status != Status.SPLIT
    np.testing.assert_array_equal(field.u[others], whole.u[others])


def test_a_pattern_without_a_break_is_measured_as_ever(speckle):
    pattern = speckle(SHAPE, seed=4)
    ref = dic.prepare(noisy(pattern.draw(), 1))
    frame = noisy(pattern.draw((0.3, 0.1), ((0.02, 0.01), (-0.01, 0.03))), 2)
    np.testing.assert_array_equal(dic.correlate_split(ref, frame).u, dic.correlate(ref, frame).u)
