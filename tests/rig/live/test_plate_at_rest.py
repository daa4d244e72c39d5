"""A plate in tension, and one that is thicker at an edge: the loop takes them as the scene says."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

TOUCH = fe.Touch(90.0, 120.0, 2.0)
TENSE = {"plate.tension": ["6 N/mm", "2 N/mm", 0]}
TAPERED = {"plate.taper": [0.2, 0.0]}


def found(scene, images):
    """Touches that the bench of a scene finds in the last of some images."""
    bench = replace(build_bench(scene, lambda done, total: None), strain=False)
    chain = bench.prepare(average_reference(images[:-1]))[0]
    watch = Stopwatch(time.monotonic)
    return estimate_frame(chain, images[-1], at_rest(chain), watch).estimate


@pytest.mark.slow
@pytest.mark.parametrize(("rest", "off"), [(TENSE, 0.3), (TAPERED, 0.08)])
def test_a_touch_is_found_on_the_plate_as_it_is_and_missed_on_another(small, rest, off):
    usual = {"comparison": None, "plate.theory": "linear", "sensor.noise": 0.1}
    scene = small(usual | rest)
    twin = build_twin(scene)
    images = [twin.frame(number, ()) for number in range(8)] + [twin.frame(8, (TOUCH,))]
    said = found(scene, images)
    sigma = np.sqrt(np.diag(said.covariance))
    assert said.count == 1
    assert np.abs(said.xy[0] - (TOUCH.x, TOUCH.y)).max() < 4.0 * sigma[:2].max() < 4.0
    assert said.force[0] == pytest.approx(TOUCH.force, rel=0.02)
    other = found(small(usual), images)
    assert abs(other.force[0] / TOUCH.force - 1.0) > off
