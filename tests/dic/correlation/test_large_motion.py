"""Large motion, rotation and strain, and patterns that change on the way."""

import numpy as np
import pytest

import dic
from dic import Status


def turned(degrees):
    angle = np.deg2rad(degrees)
    return (
        (np.cos(angle) - 1, -np.sin(angle)),
        (np.sin(angle), np.cos(angle) - 1),
    )


def inside(speckle, xy, motion, half):
    """Points whose moved subset lies on the image, a px away from its border."""
    moved = xy + speckle.displacement(xy, *motion)
    reach = half * np.abs(np.eye(2) + np.asarray(motion[1])).sum(axis=1) + 1
    size = np.array(speckle.shape[::-1])
    return np.all((moved - reach >= 0) & (moved + reach <= size - 1), axis=1)


def error(disp, truth, some):
    return (np.column_stack([disp.u, disp.v]) - truth)[some & disp.valid]


@pytest.fixture(scope="module")
def large(speckle):
    return speckle((240, 280), seed=5, margin=120)


@pytest.fixture(scope="module")
def image(large):
    return large.draw()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("degrees", [20, -75, 170])
def test_any_rotation_is_found_from_nothing(large, image, degrees, order):
    motion = (3.2, -1.7), turned(degrees)
    disp = dic.correlate(dic.prepare(image, order=order), large.draw(*motion))
    seen = inside(large, disp.xy, motion, 10)
    assert disp.valid[seen].all()
    off = error(disp, large.displacement(disp.xy, *motion), seen)
    assert np.abs(off.mean(axis=0)).max() <= 1e-3
    assert off.std(axis=0).max() <= 3e-3
    assert np.median(disp.iterations[seen]) <= 7


def test_hundred_pixels_are_found_from_nothing(large, image):
    motion = (101.3, -64.6), ((0, 0), (0, 0))
    disp = dic.correlate(dic.prepare(image), large.draw(*motion))
    seen = inside(large, disp.xy, motion, 10)
    assert disp.valid[seen].all()
    assert np.abs(error(disp, (101.3, -64.6), seen)).max() <= 5e-3
    assert (disp.status[~seen & ~disp.valid] == Status.OUTSIDE).mean() >= 0.95


def steps(count):
    """Stretch by 50 % along x and as much narrower along y, in steps."""
    for k in range(1, count + 1):
        stretch = 1 + 0.5 * k / count
        yield (1.5 * k, -0.7 * k), ((stretch - 1, 0.01 * k), (0, 1 / stretch - 1))


@pytest.mark.parametrize("named", [0.0, 1.7])
def test_a_renewed_reference_passes_the_prefilter_of_the_first(large, image, named):
    ref = dic.prepare(image, step=20, prefilter=named)
    later = large.draw((3.0, 1.0))
    renewed = dic.renewed_reference(ref, dic.correlate(ref, later), later)
    assert renewed.prefilter == ref.prefilter
    assert renewed.prefilter.sigma == named


def test_half_again_as_long_is_followed_in_steps(large, image):
    motions = list(steps(5))
    fields = list(dic.correlate_sequence(dic.prepare(image), (large.draw(*m) for m in motions)))
    for motion, disp in zip(motions, fields, strict=True):
        seen = inside(large, disp.xy, motion, 10)
        assert disp.valid[seen].mean() >= 0.99
        off = error(disp, large.displacement(disp.xy, *motion), seen)
        assert np.abs(off.mean(axis=0)).max() <= 1e-3
        assert np.sqrt(np.mean(off**2)) <= 0.01
    strain = dic.strain(fields[-1], kind="logarithmic")
    assert np.nanmedian(strain.exx) == pytest.approx(np.log(1.5), abs=2e-3)


@pytest.mark.slow
def test_pattern_that_becomes_another_is_followed_by_new_references(large, image, speckle):
    other = speckle(large.shape, seed=77, margin=120)
    motions = [((0.31 * k, -0.2 * k), ((0.01 * k, 0), (0, 0))) for k in range(1, 7)]
    angles = np.deg2rad(9.0) * np.arange(1, 7)  # from one pattern to another, contrast kept
    frames = [
        128 + np.cos(a) * (large.draw(*m) - 128) + np.sin(a) * (other.draw(*m) - 128)
        for a, m in zip(angles, motions, strict=True)
    ]
    ref = dic.prepare(image)
    assert dic.correlate(ref, frames[-1]).valid.mean() < 0.2
    disp = list(dic.correlate_sequence(ref, frames))[-1]
    seen = inside(large, disp.xy, motions[-1], 10)
    assert disp.valid[seen].mean() >= 0.99
    assert disp.grid is not None
    off = error(disp, large.displacement(disp.xy, *motions[-1]), seen)
    # What the pattern itself turns into is taken for motion; measured 0.45 px.
    assert np.sqrt(np.mean(off**2)) <= 0.6
    assert np.abs(off.mean(axis=0)).max() <= 0.05
    assert np.median(disp.ux[disp.valid]) == pytest.approx(0.06, abs=2e-3)


def test_displacements_compose_as_motions_do(large, image):
    first, second = ((2.0, 1.0), ((0.03, 0), (0.01, 0))), ((-1.3, 0.4), ((0, 0.02), (0, -0.02)))
    turn, stretch = (np.eye(2) + np.array(m[1]) for m in (second, first))
    shift = turn @ first[0] + second[0]
    both = shift, turn @ stretch - np.eye(2)
    middle, end = large.draw(*first), large.draw(*both)
    there = dic.correlate(dic.prepare(image, step=20), middle)
    moved = there.xy + np.column_stack([there.u, there.v])
    assert there.valid.all()
    onward = dic.correlate(dic.prepare(middle, points=moved), end)
    disp, direct = dic.compose_displacements(there, onward), large.displacement(there.xy, *both)
    seen = disp.valid
    assert np.abs(np.column_stack([disp.u, disp.v]) - direct)[seen].max() <= 0.01
    np.testing.assert_allclose(disp.gradient[seen].mean(axis=0), both[1], atol=5e-4)
    assert (disp.sigma_u >= there.sigma_u)[seen].all()
