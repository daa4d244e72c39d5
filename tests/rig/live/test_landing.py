"""A touch that comes between two frames and moves a free edge by more than tiles can follow."""

import time

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

TWO_EDGES = {
    "plate.edges": {
        "kind": "mixed",
        "west": {"kind": "clamped"},
        "east": {"kind": "clamped"},
        "south": {"kind": "free"},
        "north": {"kind": "free"},
    },
    "plate.thickness": 1.5,
    "camera.stand_off": 250,
    "comparison": None,
}


@pytest.fixture(scope="module")
def rig_of(small):
    scene = small(TWO_EDGES)
    twin, bench = build_twin(scene), build_bench(scene, lambda done, total: None)
    chain, _ = bench.prepare(average_reference([twin.frame(k, ()) for k in range(16)]))
    return chain, twin


@pytest.mark.slow
@pytest.mark.parametrize("y", [5.0, 20.0])
def test_it_is_one_touch_and_hides_nothing(rig_of, y):
    """Over to the other edge of the plate by 3 px; tiles that were lost made a second touch."""
    chain, twin = rig_of
    watch = Stopwatch(time.monotonic)
    before = estimate_frame(
        chain, twin.frame(39, (fe.Touch(170.0, 185.0, 4.0),)), at_rest(chain), watch
    )
    image = twin.frame(40, (fe.Touch(90.0, y, 4.0),))
    found = estimate_frame(chain, image, before.state, watch)
    assert chain.pattern.motions.max_motion(found.state.motion) > 2.5  # px
    assert found.estimate.count == 1
    assert np.hypot(*(found.estimate.xy[0] - (90.0, y))) < 0.6  # mm
    assert found.hidden.sum() < 10
