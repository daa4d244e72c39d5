"""What the projector shows of a frame: where its touches will be when the light arrives."""

from dataclasses import replace

import numpy as np
import pytest

from rig.live.snapshot import Mark
from rig.projector.display_log import DisplayLog
from rig.projector.markers import Screen, fit_plate
from rig.projector.show import OLDEST, Show
from tests.rig.page.conftest import draw_snapshot

PLATE = (254.0, 180.0)
DELAY, AGE = 0.03, 0.04  # s


class Window:
    """A window that remembers what it was given."""

    alive, status, shown = True, "open", DisplayLog()

    def __init__(self):
        self.given = []

    def __call__(self, content):
        self.given.append(content)


def show_of(age, mark, mode="on"):
    """Show one mark of a frame that is so old; gives what the window was given."""
    snapshot = replace(draw_snapshot(1), captured=100.0, touches=(mark,))
    window = Window()
    Show(window, fit_plate((640, 400), PLATE), mode, PLATE, DELAY, lambda: 100.0 + age)(snapshot)
    (content,) = window.given
    return content


def test_a_mark_runs_ahead_by_the_age_of_its_frame_and_the_delay_of_the_light():
    (mark,) = show_of(AGE, Mark(100.0, 60.0, 2.0, velocity=(50.0, -20.0)))
    assert (mark.x, mark.y) == pytest.approx(
        (100.0 + 50 * (AGE + DELAY), 60.0 - 20 * (AGE + DELAY))
    )


def test_what_is_too_old_is_not_shown():
    assert show_of(OLDEST + 0.01, Mark(100.0, 60.0, 2.0)) == ()
    assert len(show_of(OLDEST - 0.01, Mark(100.0, 60.0, 2.0))) == 1


def test_outside_a_mark_lies_beyond_the_nearer_edge():
    at_x, at_y = show_of(0.0, Mark(100.0, 150.0, 2.0), "outside")
    assert (at_x.x, at_y.y) == pytest.approx((100.0, 150.0))
    assert at_x.y > PLATE[1]
    assert at_y.x < 0


def test_the_log_says_what_was_shown_at_a_time():
    log = DisplayLog()
    early, late = (Mark(1.0, 2.0, 1.0),), (Mark(3.0, 4.0, 1.0),)
    log.add(10.0, early)
    log.add(11.0, late)
    assert [log.at(time) for time in (9.9, 10.0, 10.9, 11.0, 50.0)] == [
        (),
        early,
        early,
        late,
        late,
    ]


@pytest.mark.parametrize("size", [(640, 400), (401, 640), (1280, 800)])
def test_the_middle_of_the_plate_is_the_middle_of_the_screen(size):
    screen = fit_plate(size, PLATE)
    x, y, w = screen.T_px_plate @ (PLATE[0] / 2, PLATE[1] / 2, 1.0)
    assert (x / w, y / w) == pytest.approx(((size[0] - 1) / 2, (size[1] - 1) / 2))
    assert isinstance(screen, Screen)
    assert np.linalg.det(screen.T_px_plate) < 0  # plate y runs up, that of the screen down
