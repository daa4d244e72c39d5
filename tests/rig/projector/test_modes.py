"""Where marks go: on, beside and outside, and only in the dark."""

import itertools

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig.live.snapshot import Mark
from rig.projector.blanking import Blanked, Blink
from rig.projector.markers import draw_marks, fit_plate, project
from rig.projector.modes import BESIDE, placed
from rig.system.frame import Frame

PLATE = (254.0, 180.0)
places = st.tuples(st.floats(0, PLATE[0]), st.floats(0, PLATE[1]))


@given(places)
def test_beside_keeps_its_distance_and_stays_on_the_plate(place):
    (mark,) = placed([Mark(*place, 2.0, (3, 1, 0.2))], "beside", PLATE)
    assert np.hypot(mark.x - place[0], mark.y - place[1]) == pytest.approx(BESIDE)
    assert 0 <= mark.x <= PLATE[0]
    assert 0 <= mark.y <= PLATE[1]
    assert (mark.force, mark.sigma) == (2.0, (3, 1, 0.2))


@given(places)
def test_outside_shows_x_and_y_beyond_the_edges(place):
    at_x, at_y = placed([Mark(*place, 2.0)], "outside", PLATE)
    assert at_x.x == place[0]
    assert at_y.y == place[1]
    assert not 0 <= at_x.y <= PLATE[1]
    assert not 0 <= at_y.x <= PLATE[0]


@pytest.mark.parametrize("mode", ["on", "dark"])
def test_on_is_on_the_touch(mode):
    marks = (Mark(30.0, 40.0, 1.0),)
    assert placed(marks, mode, PLATE) == marks


def test_beside_leaves_the_touch_itself_dark():
    screen = fit_plate((640, 400), PLATE)
    touch = Mark(60.0, 90.0, 4.0)
    image = draw_marks(placed([touch], "beside", PLATE), screen)
    column, row = np.rint(project(screen.T_px_plate, np.array([[60.0, 90.0]])))[0].astype(int)
    assert image[row, column].max() <= 12  # grey levels of 255


@given(st.floats(0, 1e5))
def test_light_comes_and_goes_when_it_says(time):
    blink = Blink()
    change = time + blink.until_change(time)
    assert 0 < blink.until_change(time) <= blink.period
    assert blink.on(time) != blink.on(change + 1e-6)


class Ticking:
    """A source of 30 frames a second from a moment on."""

    def __init__(self):
        self.frames = (
            Frame(n, 50.0 + n / 30, np.zeros((2, 2), np.uint8)) for n in itertools.count()
        )

    def grab(self, timeout):
        return next(self.frames)


def test_no_frame_that_can_have_seen_light_passes_and_none_counts_as_lost():
    blink, delay, exposure = Blink(), 0.03, 1 / 30
    source = Blanked(Ticking(), blink, delay, exposure)
    kept = [source.grab(1.0) for _ in range(60)]
    assert [frame.sequence for frame in kept] == list(range(60))
    for frame in kept:
        emitted = frame.captured - delay - np.linspace(0, exposure, 50)
        assert not any(blink.on(time) for time in emitted)
    seconds = kept[-1].captured - kept[0].captured
    assert 60 / seconds > 9  # frames a second that are left of 30; measured 12
