"""What is compiled is compiled before the first frame: touches, hands and bumps find it all there.

In a process of its own, so that no other test has compiled or loaded anything before.
"""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest

from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.tracker import FrameProcessor
from rig.live.warm_up import rehearsal
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

CODE = """
import gc, json, sys, time
import numpy as np
from numba.core import event
from numba.core.dispatcher import Dispatcher
import fe, rig
from rig.live.bench import build_bench
from rig.live.tracker import FrameProcessor
from rig.system.frame import Frame
from rig.system.timing import Stopwatch
from rig.sources.twin import build_twin
from rig.live.baseline import average_reference

class Compiled(event.Listener):
    names = []
    def on_start(self, happened):
        self.names.append(happened.data["dispatcher"].py_func.__qualname__)
    def on_end(self, happened):
        pass

def kernels():
    every = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {(str(one), str(kind)) for one in every for kind in one.overloads}

def quiet(done, total):
    pass

scene = rig.load("twin", json.loads(sys.argv[1]))
bench, twin = build_bench(scene, quiet), build_twin(scene)
a, b = bench.plate.size
places = [(0.31, 0.28), (0.66, 0.71), (0.27, 0.74), (0.72, 0.33)]
touches = tuple(fe.Touch(x * a, y * b, 0.8 * bench.theory.force) for x, y in places)
begun, moved = 20, int(2 * twin.rate)  # before and after the camera is bumped
shots = [twin.frame(begun, touches[:count]) for count in (0, 1, 2, 4, 4, 2, 1, 0)]
hand = twin.frame(begun, touches[:1])
hand[:, : hand.shape[1] // 3] = 70
shade = np.linspace(0.6, 1.0, hand.shape[1]) * twin.frame(begun, touches[:1])
dark = 0.1 * twin.frame(begun, ())
bumped = [twin.frame(moved, touches[:count]) for count in (0, 1)]
shots += [hand, hand, shade.astype(np.uint8), dark.astype(np.uint8), *bumped]
zero = average_reference([twin.frame(number, ()) for number in range(16)])
compiled = Compiled()
event.register("numba:compile", compiled)
follower = FrameProcessor(bench, zero, Stopwatch(time.monotonic), time.monotonic)
first, known = len(compiled.names), kernels()
said = []
for number, image in enumerate(shots):
    seen = follower.process(Frame(number, number / 30, image))
    said.append(follower.sentence(seen.frame_estimate))
new = sorted(name for name, _ in kernels() - known)
print(json.dumps({"before": first, "compiled": compiled.names[first:], "new": new, "said": said}))
"""


@pytest.fixture
def reported(small, live_cache):
    """Follow frames of all kinds in a new process: `reported(scene, **environment)`."""

    def follow(scene, **variables):
        run = subprocess.run(
            [sys.executable, "-c", CODE, json.dumps(scene)],
            capture_output=True, text=True, check=False,
            env=os.environ | {"TOUCHPLATE_CACHE": str(live_cache)} | variables,
        )  # fmt: skip
        assert run.returncode == 0, run.stderr
        return json.loads(run.stdout.splitlines()[-1])

    return follow


def assert_ready(said):
    """Nothing was compiled or read from the cache, and the frames showed what they should."""
    assert said["compiled"] == said["new"] == []
    calm, one, two, four, *_ = said["said"]
    assert (calm, one, two) == ("no touch", "one touch", "2 touches")
    assert four.startswith("2 touches, but the image does not fit")
    assert any("of the pattern is hidden" in text for text in said["said"])
    assert any("too faint" in text for text in said["said"])


@pytest.fixture
def bumped(small_overrides):
    return small_overrides | {"source.shift": [3.0, -2.0]}


@pytest.mark.slow
def test_no_frame_meets_a_kernel_that_was_not_called_before(reported, bumped):
    assert_ready(reported(bumped))


@pytest.mark.slow
def test_after_an_install_everything_is_compiled_before_the_first_frame(reported, bumped, tmp_path):
    said = reported(bumped, NUMBA_CACHE_DIR=str(tmp_path))
    assert said["before"] > 10
    assert_ready(said)


@pytest.mark.slow
def test_nor_does_one_of_large_deflection(reported, small, bumped):
    plate = small().model_dump()["plate"] | {"thickness": 1.0, "theory": None}
    large = {"plate": plate, "touches.force": [0.5, 3.0], "estimator.modes": 80}
    said = reported({key: part for key, part in bumped.items() if "plate" not in key} | large)
    assert said["compiled"] == said["new"] == []
    assert said["said"][:3] == ["no touch", "one touch", "2 touches"]


@pytest.fixture
def chain(small):
    scene = small()
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    zero = average_reference([twin.frame(number, ()) for number in range(16)])
    return bench, zero, bench.prepare(zero)[0]


def test_what_is_made_up_shows_what_it_says(chain):
    bench, zero, _ = chain
    follower = FrameProcessor(bench, zero, Stopwatch(time.monotonic), time.monotonic)
    names, said = [], {}
    for frame in rehearsal(follower.chain, 3.0, lambda done, total, what: names.append(what)):
        assert (frame.image.dtype, frame.image.shape) == (np.uint8, (320, 384))
        said[names[-1]] = follower.sentence(follower.process(frame).frame_estimate)
    assert said["no touch"] == said["a bump of the camera"] == "no touch"
    assert said["one touch"] == said["a shadow"] == "one touch"
    assert said["2 touches"] == "2 touches"
    assert said["4 touches"].startswith("2 touches, but the image does not fit")
    assert said["a hand"].startswith("one touch; 5")
    assert names[-1] == "ready"


def test_getting_ready_is_reported_step_by_step_and_leaves_no_trace(chain):
    bench, zero, _ = chain
    steps, watch = [], Stopwatch(time.monotonic)
    follower = FrameProcessor(
        bench, zero, watch, time.monotonic, lambda *step: steps.append(step)
    )  # fmt: skip
    assert [done for done, _, _ in steps] == list(range(len(steps)))
    assert {total for _, total, _ in steps} == {len(steps) - 1}
    assert watch.table() == ()
    assert len(follower._state.touches) == 0
    assert not follower._state.motion.any()
    assert not follower._tracks.tracks
