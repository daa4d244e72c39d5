"""What pressed and went: a plate may show a few percent of it for a while."""

import numpy as np
import pytest

import fe
from models import Estimate, Result
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.memory import BRIEF, FADED, MANY, SLID, Memory
from rig.live.tracker import FrameProcessor
from rig.sources.twin import build_twin
from rig.system.frame import Frame
from rig.system.timing import Stopwatch


def pressed(*touches):
    return np.array(touches, dtype=float).reshape(-1, 3)


def after(*frames):
    memory = Memory()
    for frame in frames:
        memory = memory.after(pressed(*frame))
    return memory


def test_a_touch_that_goes_is_left_with_the_largest_force_it_had():
    memory = after([(50, 40, 1.0)], [(51, 40, 4.0)], [(52, 40, 3.0)], [])
    assert len(memory.held) == 0
    np.testing.assert_allclose(memory.left.touches, [[52.5, 40, 4.0]])


def test_what_fades_under_what_a_plate_keeps_of_it_has_ended():
    memory = after([(50, 40, 4.0)], [(50, 40, 0.9 * FADED * 4.0)])
    assert len(memory.held) == 0
    assert len(memory.left) == 1
    assert len(after([(50, 40, 4.0)], [(50, 40, 1.1 * FADED * 4.0)]).held) == 1


def test_one_of_two_that_goes_leaves_the_other_held():
    memory = after([(50, 40, 2.0), (120, 90, 3.0)], [(120, 90, 3.0)])
    np.testing.assert_allclose(memory.held, [[120, 90, 3.0]])
    np.testing.assert_allclose(memory.left.touches, [[50, 40, 2.0]])


def test_a_touch_that_was_lost_for_a_frame_is_not_its_own_memory():
    assert len(after([(50, 40, 2.0)], [], [(50, 41, 2.0)]).left) == 0


def test_a_weak_touch_where_a_strong_one_was_keeps_its_memory():
    memory = after([(50, 40, 4.0)], [], [(50, 40, 0.5)])
    assert len(memory.left) == 1


def test_the_last_that_ended_count():
    places = [(20.0 * k, 50.0, 1.0 + k) for k in range(MANY + 4)]
    memory = after(*[frame for place in places for frame in ([place], [])])
    np.testing.assert_allclose(memory.left.touches, places[: -MANY - 1 : -1])


def test_a_slide_that_outruns_the_frames_leaves_what_ended_before_it():
    slide = [[(30.0 + 25.0 * k, 150.0, 2.0 + 0.1 * k)] for k in range(MANY + 4)]
    memory = after([(50, 40, 3.5)], [], *slide, [])
    half_way = (slide[-1][0][0] + 12.5, *slide[-1][0][1:])
    np.testing.assert_allclose(memory.left.touches, [half_way, (50, 40, 3.5)])


def test_a_touch_far_away_or_of_another_force_is_another():
    assert len(after([(50, 40, 2.0)], [(50 + 1.2 * SLID, 40, 2.0)]).left) == 1
    assert len(after([(50, 40, 2.0)], [(50 + 0.8 * SLID, 40, 3.0)]).left) == 1
    assert len(after([(50, 40, 2.0)], [(50 + 0.8 * SLID, 40, 2.2)]).left) == 0


def test_a_place_is_remembered_once():
    memory = after([(50, 40, 2.0)], [], [(52, 40, 0.9)], [])
    np.testing.assert_allclose(memory.left.touches, [[52, 40, 0.9]])


def test_a_touch_that_slides_as_it_lifts_leaves_its_trace_further_on():
    rested, slid = (after([(x, 40, 2.0)], [(50, 40, 2.0)], []).left for x in (50.0, 35.0))
    np.testing.assert_allclose(rested.touches, [[50.0, 40.0, 2.0]])
    np.testing.assert_allclose(slid.touches, [[57.5, 40.0, 2.0]])
    np.testing.assert_allclose(rested.covariance, np.eye(3))
    assert slid.covariance[1, 1] > 2.0
    np.testing.assert_allclose(slid.covariance[[0, 2]], np.eye(3)[[0, 2]])


def test_a_touch_that_lands_has_not_moved_yet():
    memory = after([(50, 40, 2.0)], [(52, 41, 2.0), (120, 90, 1.0)])
    np.testing.assert_allclose(memory.moved, [[2.0, 1.0], [0.0, 0.0]])


def test_left_stays_the_same_array_while_none_ends():
    memory = after([(50, 40, 2.0)], [])
    assert memory.after(pressed((120, 90, 1.0))).left is memory.left


def test_what_a_gliding_touch_passes_over_is_there_again_when_it_has_gone_on():
    path = [[(x, 40.0, 3.0)] for x in (30.0, 37.0, 44.0, 51.0, 58.0, 65.0, 72.0)]
    memory = after([(50, 40, 2.0)], [], *path[:4])
    assert len(memory.left) == 0
    memory = after([(50, 40, 2.0)], [], *path)
    np.testing.assert_allclose(memory.left.touches, [[50, 40, 2.0]])
    memory = after([(50, 40, 2.0)], [], *path, [])
    np.testing.assert_allclose(memory.left.touches, [[75.5, 40, 3.0], [50, 40, 2.0]])


def test_what_may_be_a_trace_itself_leaves_none():
    memory = after([(50, 40, 4.0)], [], [(90, 80, 0.15)], [])
    np.testing.assert_allclose(memory.left.touches, [[50, 40, 4.0]])
    assert len(after([(50, 40, 4.0)], [], [(90, 80, 0.25)], []).left) == 2


def found(*touches):
    """Touches found with a σ of 6 mm along x, 3 mm along y and 0.01 N."""
    each = pressed(*touches)
    covariance = np.diag(np.tile([36.0, 9.0, 1e-4], len(each)))
    return Estimate(each[:, :2], each[:, 2], covariance, 200.0, 200, 0.5, Result.FOUND)


KEPT = 0.02  # of a touch


def test_what_appears_after_a_time_without_frames_may_be_the_trace_of_a_touch():
    """It slid on for a second, and lifted where nobody saw it."""
    memory, faint = after([(50, 40, 2.0)]).by_frame(1.0, lost=True), found((150, 90, 0.03))
    stray, traces = memory.strays(faint, KEPT)
    assert stray.tolist() == [True]
    left = memory.after(pressed(), traces).left
    np.testing.assert_allclose(left.touches, [[50, 40, 2.0], [150, 90, 2.0]])
    usual = after([(50, 40, 2.0)], []).left.covariance
    np.testing.assert_allclose(left.covariance[:3, :3], usual)
    wider = np.diag(left.covariance)[3:] - np.diag(usual)
    assert wider[1] == 4.0 * wider[2] > 1.0, "its place is known as badly as it was found"


def test_one_that_came_and_went_unseen_may_have_been_as_strong_as_any():
    beside = found((60, 120, 3.0), (150, 90, 0.03))
    stray, traces = Memory().by_frame(1.0, lost=True).strays(beside, KEPT)
    assert stray.tolist() == [False, True]
    np.testing.assert_allclose(traces.touches, [[150, 90, 3.0]])


def test_a_touch_is_no_trace_while_all_is_seen_or_where_it_is_strong_or_near():
    seen, unseen = (
        after([(50, 40, 2.0)]).by_frame(0.5 * BRIEF, lost=True),
        after([(50, 40, 2.0)]).by_frame(1, lost=True),
    )
    assert not seen.strays(found((150, 90, 0.03)), KEPT)[0].any()
    for touch in ((150, 90, 3.3 * KEPT * 2.0), (52, 40, 0.03)):
        stray, traces = unseen.strays(found(touch), KEPT)
        assert not stray.any()
        assert not len(traces)


def test_what_was_not_seen_counts_for_as_long_as_it_may_have_been():
    memory = Memory().by_frame(1.0, lost=True).after(pressed((50, 40, 2.0)))
    held = found((50, 40, 2.0), (150, 90, 0.03))
    assert memory.by_frame(0.1, lost=True).strays(held, KEPT)[0].tolist() == [False, True]
    for _ in range(8):
        memory = memory.by_frame(0.1, lost=True).after(pressed((50, 40, 2.0)))
    assert not memory.strays(held, KEPT)[0].any()


def test_a_slow_source_has_shown_all_it_has():
    memory = after([(50, 40, 2.0)]).by_frame(2.0, lost=False)
    assert not memory.strays(found((150, 90, 0.03)), KEPT)[0].any()


def test_it_says_below_which_force_a_touch_may_be_a_trace():
    memory = after([(50, 40, 2.0)])
    assert memory.by_frame(1.0, lost=False).faint(KEPT) == 0.0
    missed = memory.by_frame(1.0, lost=True)
    assert missed.faint(KEPT) == pytest.approx(3 * KEPT * 2.0)
    assert missed.faint(KEPT, 5.0) == pytest.approx(3 * KEPT * 5.0)


def test_while_frames_were_lost_the_sentence_says_what_cannot_be_known(small):
    scene = small({"comparison": None, "estimator.bench": "usual"})
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    reference = average_reference([twin.frame(k, ()) for k in range(8)])
    follower = FrameProcessor(bench, reference, Stopwatch(lambda: 0.0), lambda: 0.0)
    touches = (fe.Touch(140.0, 110.0, 3.0),)

    def said(number, now):
        frame = Frame(number, now, twin.frame(number, touches))
        return follower.sentence(follower.process(frame).frame_estimate)

    assert said(8, 0.0) == said(9, 1.0) == "one touch"  # a source that is slow
    assert "frames were lost: for 1.0 s a new touch of less than" in said(12, 2.0)
    assert said(13, 3.5) == "one touch"
