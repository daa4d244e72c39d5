"""Marks run ahead of their touches by the time that their light takes."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.estimate import Estimate, Result
from rig.live.snapshot import Mark
from rig.live.tracks import Tracks
from rig.projector.latency_prediction import FURTHEST, predicted

PLATE = (254.0, 180.0)
RATE, NOISE = 30.0, 0.25  # frames a second, mm


def test_a_mark_lies_where_its_touch_will_be():
    (mark,) = predicted([Mark(100.0, 60.0, 2.0, velocity=(80.0, -40.0))], 0.1, PLATE)
    assert (mark.x, mark.y) == pytest.approx((108.0, 56.0))
    assert mark.force == 2.0


def test_a_touch_at_rest_or_without_track_keeps_its_mark():
    mark = Mark(100.0, 60.0, 2.0)
    assert predicted([mark], 0.1, PLATE) == (mark,)


@given(
    st.tuples(st.floats(0, 254), st.floats(0, 180)),
    st.tuples(st.floats(-5000, 5000), st.floats(-5000, 5000)),
    st.floats(0, 0.5),
)
def test_a_mark_stays_on_the_plate_and_near_its_touch(place, velocity, ahead):
    (mark,) = predicted([Mark(*place, 1.0, velocity=velocity)], ahead, PLATE)
    assert 0 <= mark.x <= PLATE[0]
    assert 0 <= mark.y <= PLATE[1]
    assert np.hypot(mark.x - place[0], mark.y - place[1]) <= FURTHEST + 1e-9


def followed(path, rng):
    """Give the marks of a touch on a path (N, 2) mm, seen with noise, from the tenth frame on."""
    tracks, marks = Tracks(), []
    for n, place in enumerate(path):
        xy = place + rng.normal(0, NOISE, 2)
        spread = np.diag([NOISE**2, NOISE**2, 0.01])
        seen = Estimate(xy[None], np.array([2.0]), spread, 1.0, 1, 0.5, Result.FOUND)
        tracks, _, _ = tracks.follow(seen, n / RATE)
        (track,) = tracks.tracks
        marks.append(Mark(*xy, 2.0, velocity=track.sure_velocity))
    return marks[10:]


def test_a_finger_at_rest_gets_a_mark_that_hardly_trembles_more():
    rng = np.random.default_rng(0)
    marks = followed(np.tile([100.0, 80.0], (300, 1)), rng)
    lead = predicted(marks, 0.1, PLATE)
    still, shown = (np.std([(m.x, m.y) for m in some]) for some in (
        [Mark(m.x - 100, m.y - 80, 1.0) for m in marks],
        [Mark(m.x - 100, m.y - 80, 1.0) for m in lead],
    ))  # fmt: skip
    assert shown < 1.5 * still


def test_a_stroke_is_met_to_a_fifth_of_what_it_would_be_missed_by():
    rng, ahead = np.random.default_rng(1), 0.1
    turn = 2 * np.pi * np.arange(200) / RATE / 4.0  # once in four seconds, 94 mm/s
    path = np.array([127.0, 90.0]) + 60.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    later = turn + 2 * np.pi * ahead / 4.0
    truth = np.array([127.0, 90.0]) + 60.0 * np.column_stack([np.cos(later), np.sin(later)])
    marks = followed(path, rng)
    shown = np.array([(m.x, m.y) for m in predicted(marks, ahead, PLATE)])
    behind = np.array([(m.x, m.y) for m in marks])
    late = np.median(np.linalg.norm(behind - truth[10:], axis=1))
    met = np.median(np.linalg.norm(shown - truth[10:], axis=1))
    assert late > 8.0
    assert met < 0.2 * late
