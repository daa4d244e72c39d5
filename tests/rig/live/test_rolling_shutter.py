"""A rolling shutter in the live chain: touches that change while the rows of a frame are read."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.scene.refusal import SceneError
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

ROLLING = {"camera.row_time": "90 us", "estimator.bench": "usual", "plate.thickness": 1.0}
PLACES = ((90.0, 120.0), (150.0, 60.0), (60.0, 45.0), (190.0, 150.0))
GROWS = 4.0  # of the force in a second: 13 % in a frame


def quiet(done, total):
    """Report of progress that nobody reads."""


@pytest.mark.slow
def test_a_force_that_changes_is_one_touch_within_its_own_uncertainty(small):
    scene = small(ROLLING)
    bench, still = build_bench(scene, quiet), build_twin(scene)
    chain, _ = bench.prepare(average_reference([still.frame(k, ()) for k in range(16)]))
    off, phantoms = [], 0
    for number, (x, y) in enumerate(PLACES, 60):
        middle = still.time(number)
        grows = GROWS if number % 2 else -GROWS
        touch = fe.Touch(x, y, 2.0)

        def pressed(at, touch=touch, middle=middle, grows=grows):
            return (replace(touch, force=touch.force * (1 + grows * (at - middle))),)

        twin = replace(still, script=pressed)
        image = twin.frame(number, twin.touches(number))
        watch = Stopwatch(time.monotonic)
        found = estimate_frame(chain, image, at_rest(chain), watch).estimate
        phantoms += found.count > 1
        height = np.array([[x, y, bench.height]])
        row = bench.camera.project(height)[0, 1] - (bench.camera.size[1] - 1) / 2
        (then,) = pressed(middle + 9e-5 * row)  # when its own row is read
        error = [*found.xy[0] - (x, y), found.force[0] - then.force]
        off.append(error / np.sqrt(np.diag(found.covariance)[:3]))
    assert phantoms == 0
    assert np.abs(off).max() < 3.0


def test_the_twin_shows_each_row_the_touch_of_its_time(small):
    scene = small(ROLLING)
    twin = replace(
        build_twin(scene), script=lambda at: (fe.Touch(127.0, 100.0, 20.0 * (at - 2.0)),)
    )
    middle = 2.1 * twin.rate
    touches = twin.touches(int(middle))
    rolled = twin.frame(int(middle), touches).astype(float)
    for rows, at in ((slice(0, 8), -1.0), (slice(-8, None), 1.0), (slice(156, 164), 0.0)):
        then = twin.script(twin.time(int(middle)) + at * twin.readout / 2)
        same = replace(twin, readout=0.0).frame(int(middle), then).astype(float)
        other = replace(twin, readout=0.0).frame(int(middle), ()).astype(float)
        away = [np.abs(rolled[rows] - image[rows]).mean() for image in (same, other)]
        assert away[0] <= away[1]
        assert away[0] < 0.5  # grey levels: the noise of a frame is drawn from its number


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (
            {"camera.row_time": "200 us"},
            r"row_time of 200 µs reads 320 rows in 63.8 ms, longer than",
        ),
        ({"camera.row_time": "-1 us"}, "row_time"),
    ],
)
def test_a_row_that_takes_too_long_is_refused(small, said, sentence):
    with pytest.raises(SceneError, match=sentence):
        small(said)


def test_an_exact_bench_has_no_rows_in_time(small):
    scene = small({"camera.row_time": "90 us"})
    with pytest.raises(ValueError, match=r"camera\.row_time is 90 µs, and touches that change"):
        build_bench(scene, quiet)
