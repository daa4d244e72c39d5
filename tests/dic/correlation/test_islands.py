"""Small parts of a ROI that move by themselves: islands and strips, drawn in closed form."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import dic
from dic.correlation.start import start

SHAPE = (150, 200)
MIDDLE = (72, 104)  # row and column of the middle of the part
NOISE = 2.0
AROUND = (0.4, -0.7)  # px, the motion of all else


@dataclass(frozen=True)
class Part:
    """A part `height` x `width` px, with `gap` px around it that the ROI leaves out."""

    height: int
    width: int
    gap: float

    def within(self, more=0.0):
        y, x = np.indices(SHAPE)
        down, across = (np.abs(a - m) for a, m in zip((y, x), MIDDLE, strict=True))
        return (down < self.height / 2 + more) & (across < self.width / 2 + more)

    @property
    def roi(self):
        return self.within() | ~self.within(self.gap)

    def frame(self, draw, moved):
        y, x = np.indices(SHAPE)
        mask = self.within().astype(float)
        there = map_coordinates(mask, [y - moved[1], x - moved[0]], order=1) > 0.5
        return np.where(there, draw(moved), draw(AROUND))

    def holds(self, xy):
        column, row = np.rint(xy).astype(int).T
        return self.within()[row, column]


def noisy(image, seed):
    return image + np.random.default_rng(seed).normal(0, NOISE, image.shape)


@pytest.fixture(scope="module")
def draw(speckle):
    """Images of the speckle, each drawn once: draw(shift)."""
    return lru_cache(speckle(SHAPE).draw)


def off(field, moved, which):
    return np.column_stack([field.u, field.v])[which] - moved


ISLANDS = [Part(18, 20, 10), Part(24, 20, np.inf), Part(30, 26, 8)]
STRIPS = [Part(400, 16, 8), Part(24, 400, 9)]
MOTIONS = [(-3.4, 2.3), (6.4, -0.7)]
MEASURES = [dic.correlate, dic.adaptive_field]


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("moved", MOTIONS)
@pytest.mark.parametrize("part", ISLANDS + STRIPS, ids=str)
def test_a_small_part_is_measured_by_its_own_motion(draw, part, moved, measure):
    ref = dic.prepare(noisy(draw(), 1), 15, roi=part.roi)
    found = measure(ref, noisy(part.frame(draw, moved), 2))
    inside = part.holds(found.xy)
    wanted = inside & ~np.isin(found.status, (dic.Status.EXCLUDED, dic.Status.OUTSIDE))
    assert wanted.sum() > 5
    assert found.valid[wanted].mean() > 0.94
    assert not (found.status[inside] == dic.Status.FLAT).any()
    errors = off(found, moved, inside & found.valid)
    assert np.abs(errors.mean(axis=0)).max() < 0.07  # px, bias
    assert errors.std(axis=0).max() < 0.12  # px, of subsets of which a third is left
    rest = found.valid & ~inside
    if rest.any():  # what lies around starts from no island
        errors = off(found, AROUND, rest)
        assert np.abs(errors.mean(axis=0)).max() < 0.01
        assert np.quantile(np.abs(errors), 0.99) < 0.15


@pytest.mark.parametrize("measure", MEASURES)
def test_a_small_part_that_is_gone_is_lost_and_not_flat(speckle, draw, measure):
    part = Part(24, 22, 9)
    frame = np.where(part.within(9), speckle(SHAPE, seed=9).draw(), draw(AROUND))
    ref = dic.prepare(noisy(draw(), 3), 15, roi=part.roi)
    found = measure(ref, noisy(frame, 4))
    inside = part.holds(found.xy)
    assert found.valid[inside].mean() < 0.1  # a few speckles may look like others
    assert not (found.status[inside] == dic.Status.FLAT).any()
    assert found.valid[~inside & (found.status != dic.Status.EXCLUDED)].mean() > 0.9


def test_a_small_part_whose_pattern_repeats_has_no_motion_of_its_own(draw):
    part = Part(28, 30, 34)
    y, x = np.indices(SHAPE)
    dots = 128 + 60 * np.cos(2 * np.pi * x / 9) * np.cos(2 * np.pi * y / 9)
    image = np.where(part.within(32), dots, draw())
    ref = dic.prepare(noisy(image, 5), 15, roi=part.roi)
    begun = start(ref, noisy(image, 6).astype(np.float32), None, ref.status == dic.Status.OK)
    assert begun.alone is not None
    assert not begun.alone.any()


def test_no_part_is_small_where_the_roi_is_one_and_large(draw):
    image = noisy(draw(), 7)
    assert dic.prepare(image).islands is None
    y, x = np.indices(SHAPE)
    assert dic.prepare(image, roi=np.hypot(x - 104, y - 72) > 25).islands is None


def test_a_point_whose_pixels_the_roi_takes_is_excluded_and_not_flat(draw):
    part = Part(400, 16, 8)
    ref = dic.prepare(noisy(draw(), 8), 15, roi=part.roi)
    assert not (ref.status[part.holds(ref.xy)] == dic.Status.FLAT).any()


def test_torch_starts_small_parts_where_the_loops_do(draw):
    pytest.importorskip("torch")
    part, moved = Part(30, 26, 8), (6.4, -0.7)
    frame = noisy(part.frame(draw, moved), 2)
    here, there = (
        dic.correlate(dic.prepare(noisy(draw(), 1), 15, roi=part.roi, device=place), frame)
        for place in (None, "cpu")
    )
    inside = part.holds(here.xy)
    both = here.valid & there.valid
    assert both[inside & (here.status != dic.Status.EXCLUDED)].mean() > 0.94
    # Points that go on alone beside a part end on either side of their threshold.
    assert np.count_nonzero(here.valid != there.valid) <= 2
    apart = np.abs(here.u - there.u)[both]
    assert (apart / here.sigma_u[both]).max() < 1
    assert np.median(apart) < 1e-4  # px
