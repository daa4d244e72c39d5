"""The live loop bounds forces near an edge, on an exact bench and on one known only so well."""

import time

import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.tracker import FrameProcessor
from rig.live.view import tracked_marks
from rig.sources.twin import build_twin
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

EDGE, MIDDLE = fe.Touch(16.0, 90.0, 3.0), fe.Touch(140.0, 120.0, 2.0)
HARDLY_KNOWN = fe.Touch(32.0, 90.0, 4.0)  # on a bench of which nothing is known: σ of 1.1 N


def seen(scene, touches):
    """Return the marks of touches in the third frame that shows them: some wait for it."""
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    reference = average_reference([twin.frame(k, ()) for k in range(16)])
    follower = FrameProcessor(bench, reference, Stopwatch(time.monotonic), time.monotonic)
    for number in (16, 17, 18):
        result = follower.process(Frame(number, number / 30, twin.frame(number, touches)))
    found = tracked_marks(result.tracks, result.frame_estimate.estimate)
    return sorted(found, key=lambda mark: mark.x)


def test_a_touch_near_an_edge_has_bounds_and_one_in_the_middle_has_none(small):
    scene = small({"comparison": None, "estimator.modes": 100})
    at_edge, inside = seen(scene, (EDGE, MIDDLE))
    low, high = at_edge.force_interval
    assert 0 < low < EDGE.force < high
    assert inside.force_interval is None


@pytest.mark.slow
def test_a_force_that_the_bench_leaves_open_has_bounds(small):
    scene = small({"comparison": None, "estimator.bench": "usual"})
    (mark,) = seen(scene, (HARDLY_KNOWN,))
    low, high = mark.force_interval
    assert 0 < low < HARDLY_KNOWN.force < high
