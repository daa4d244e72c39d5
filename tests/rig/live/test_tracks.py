"""Touches over time: the same finger keeps its number, another one gets another."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.estimate import Estimate, Result
from rig.live.tracks import ABSENT, Tracks

RATE = 30.0


def estimate_at(places, sigma=0.5, force=2.0):
    """Estimate of touches at places (n, 2), as a solver gives it: sorted by x, then y."""
    xy = np.array(sorted(map(tuple, places)), dtype=float).reshape(-1, 2)
    spread = np.diag(np.tile([sigma**2, (0.7 * sigma) ** 2, 0.05**2], len(xy)))
    return Estimate(xy, np.full(len(xy), force), spread, 1.0, 1, 0.5, Result.FOUND)


def follow(path):
    """Follow frames of places; gives identities by frame, all events, and the last tracks."""
    tracks, names, events = Tracks(), [], []
    for index, places in enumerate(path):
        tracks, identities, news = tracks.follow(estimate_at(places), index / RATE)
        names.append(identities)
        events += news
    return names, events, tracks


def test_a_touch_appears_moves_and_leaves():
    path = [[]] * 2 + [[(20 + 3 * k, 40 + 2 * k)] for k in range(20)] + [[]] * 8
    names, events, tracks = follow(path)
    assert {name for frame in names for name in frame} == {1}
    kinds = [event.kind for event in events]
    assert kinds[0] == "appear"
    assert kinds[-1] == "leave"
    assert set(kinds[1:-1]) == {"move"}
    assert tracks.tracks == ()
    last = events[-1]
    assert (last.x, last.y) == pytest.approx((77, 78), abs=1.0)


def test_a_touch_that_rests_has_no_moves_and_no_speed():
    rng = np.random.default_rng(3)
    path = [[np.add((100, 60), rng.normal(0, (0.5, 0.35)))] for _ in range(60)]
    names, events, tracks = follow(path)
    assert {name for frame in names for name in frame} == {1}
    assert sum(event.kind == "move" for event in events) <= 3
    (track,) = tracks.tracks
    sigma = np.sqrt(np.diag(track.posterior.covariance)[2:4])
    assert (np.abs(track.velocity) < 3.5 * sigma).all()
    assert track.sure_velocity == (0.0, 0.0)
    assert sigma.max() < 50  # mm/s; a stroke has 200 and more


def test_the_velocity_is_that_of_the_finger():
    _, _, tracks = follow([[(10 + 6 * k, 200 - 4 * k)] for k in range(25)])
    assert tracks.tracks[0].velocity == pytest.approx((180.0, -120.0), rel=0.02)


def test_fingers_that_cross_keep_their_numbers_although_the_order_of_a_frame_changes():
    path = [[(40 + 4 * k, 50), (140 - 4 * k, 62)] for k in range(25)]
    names, _, _ = follow(path)
    assert names[0] == (1, 2)
    assert names[-1] == (2, 1)
    assert all(set(frame) == {1, 2} for frame in names)


def test_a_finger_that_lands_elsewhere_is_another_one():
    names, events, _ = follow([[(40, 50)]] * 10 + [[(200, 150)]] * 10)
    assert names[9] == (1,)
    assert names[10] == (2,)
    assert [(e.kind, e.identity) for e in events] == [("appear", 1), ("appear", 2), ("leave", 1)]


def test_a_touch_that_is_missed_for_a_frame_or_two_stays_itself():
    path = [[(40 + 2 * k, 50)] if k not in (10, 11, 20) else [] for k in range(30)]
    names, events, _ = follow(path)
    assert {name for frame in names for name in frame} == {1}
    assert "leave" not in {event.kind for event in events}


def test_after_an_absence_it_is_a_new_touch():
    gap = int(ABSENT * RATE) + 2
    names, _, _ = follow([[(40, 50)]] * 5 + [[]] * gap + [[(40, 50)]] * 2)
    assert names[-1] == (2,)


def test_a_touch_of_which_nothing_is_known_is_followed():
    estimate = estimate_at([(40, 50)])
    unknown = Estimate(
        estimate.xy, estimate.force, np.full((3, 3), np.inf), 1.0, 1, 0.5, Result.UNRESOLVABLE
    )
    tracks, names, _ = Tracks().follow(unknown, 0.0)
    _, again, _ = tracks.follow(unknown, 0.033)
    assert names == again == (1,)


@given(st.lists(st.lists(st.tuples(st.floats(0, 254), st.floats(0, 203)), max_size=4), max_size=12))
def test_every_touch_of_a_frame_has_one_number_and_every_number_appears_once(path):
    names, events, _ = follow(path)
    for places, identities in zip(path, names, strict=True):
        assert len(identities) == len(places) == len(set(identities))
    appeared = [event.identity for event in events if event.kind == "appear"]
    assert appeared == list(range(1, len(appeared) + 1))
    moves = [event for event in events if event.kind == "move"]
    assert all(event.identity in appeared for event in moves)
