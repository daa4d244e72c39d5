"""The touch net begins where a search is cold, and says where it does not."""

import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

import fe
import models
import rig
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

HALF = {"camera.pixels": [512, 512], "pattern.diameter": 2.5, "touches.max_touches": 3}
TOUCHES = (fe.Touch(80.0, 90.0, 3.0), fe.Touch(170.0, 180.0, 2.0), fe.Touch(190.0, 70.0, 3.5))


def build(overrides):
    return build_bench(rig.load("twin", HALF | overrides), lambda done, total: None)


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TOUCHPLATE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield build_twin(rig.load("twin", HALF))


@pytest.fixture(scope="module")
def chain(twin):
    reference = average_reference([twin.frame(k, ()) for k in range(16)])
    return build({"estimator.start": "net"}).prepare(reference)[0]


def estimated(chain, image):
    return estimate_frame(chain, image, at_rest(chain), Stopwatch(time.monotonic))


def test_a_cold_frame_ends_where_the_search_ends(chain, twin):
    image = twin.frame(40, TOUCHES)
    begun, searched = estimated(chain, image), estimated(replace(chain, start=None), image)
    assert begun.estimate.count == searched.estimate.count == 3
    assert not begun.start_reason
    np.testing.assert_allclose(begun.estimate.xy, searched.estimate.xy, atol=0.01)
    np.testing.assert_allclose(begun.estimate.force, searched.estimate.force, atol=1e-3)
    assert begun.estimate.stats.descents < searched.estimate.stats.descents


def test_touches_that_are_followed_ask_no_net(chain, twin):
    first = estimated(chain, twin.frame(41, TOUCHES))

    class Unasked:
        def read(self, measured):
            raise AssertionError("the net was asked")

    blind = replace(chain, start=replace(chain.start, reader=Unasked()))
    watch = Stopwatch(time.monotonic)
    after = estimate_frame(blind, twin.frame(42, TOUCHES), first.state, watch)
    assert after.estimate.count == 3


def test_what_the_net_does_not_know_is_searched_and_said(chain, twin):
    # Far beside the range of places and forces of its training.
    corner = (fe.Touch(14.0, 240.0, 14.0),)
    image = twin.frame(43, corner)
    found, searched = estimated(chain, image), estimated(replace(chain, start=None), image)
    assert "seen nothing like this frame" in found.start_reason
    assert found.estimate.count == 1
    np.testing.assert_array_equal(found.estimate.xy, searched.estimate.xy)


def test_a_hidden_part_is_searched_and_said(chain, twin):
    image = twin.frame(44, TOUCHES[:1])
    image[350:, 380:] = 0
    found = estimated(chain, image)
    assert "the touch net knows the whole pattern only" in found.start_reason
    assert found.estimate.count == 1


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        ({"estimator.bench": "usual"}, "not an uncertain bench"),
        ({"plate.theory": "large"}, "not large deflection"),
        ({"dynamics.density": 1400.0}, "not a plate in time"),
    ],
)
def test_a_scene_of_another_kind_is_refused(overrides, said):
    from rig.live.touch_start import touch_net_of

    scene = rig.load("twin", HALF | {"estimator.start": "net"} | overrides)
    theory = "large" if "plate.theory" in overrides else "linear"
    exact = "estimator.bench" not in overrides
    with pytest.raises(ValueError, match=f"{said}.*set estimator.start to 'search'"):
        touch_net_of(scene, theory, exact=exact)


def test_a_net_of_another_plate_is_refused(chain, twin):
    reference = average_reference([twin.frame(k, ()) for k in range(16)])
    bench = build({"estimator.start": "net"})
    net = models.shipped_touch_net()
    other = replace(net, touches=replace(net.touches, size=(300.0, 200.0)))
    with pytest.raises(ValueError, match="a plate of 300 × 200 mm, and this one has 254 × 254 mm"):
        replace(bench, start=other).prepare(reference)


def test_a_file_that_is_not_there_names_the_command_that_trains():
    with pytest.raises(FileNotFoundError, match="by 'touchplate train touch-net'"):
        build({"estimator.start": "nowhere.npz"})


@pytest.mark.parametrize("start", ["search", "net"])
def test_torch_is_not_imported_to_read_touches(start, tmp_path):
    code = (
        "import sys, rig; from rig.live.touch_start import touch_net_of;"
        f"scene = rig.load('twin', {{'estimator.start': '{start}'}});"
        "net = touch_net_of(scene, 'linear', exact=True);"
        "print('torch' in sys.modules, any('touch_net.' in name for name in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", str(start == "net")]


def test_the_net_of_the_package_is_the_one_that_is_loaded():
    assert build({"estimator.start": "net"}).start is models.shipped_touch_net()
    assert build({}).start is None
