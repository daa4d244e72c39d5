"""A twin whose plate rings: against finite elements stepped through time, and before the loop."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
import rig
from fe.elements.functional import derivative
from fe.linear.energy import free
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.tracker import FrameProcessor
from rig.sources import script
from rig.sources.ringing import KNOT, Reached, RingingFace
from rig.sources.twin import open_play
from rig.studies.dynamics.vibrating import KEPT, STEP, Damping, summed_readings
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

RATE, EXPOSURE, DENSITY, RATIO = 120.0, 0.006, 1400.0, 0.02
THIN = {
    "plate.thickness": 1.0,
    "plate.theory": "linear",
    "camera.rate": RATE,
    "touches.force": [1.0, 1.5],
    "comparison": None,
}
FOLLOWED = {"dynamics.density": DENSITY, "dynamics.damping": RATIO, "dynamics.exposure": EXPOSURE}
RINGS = FOLLOWED | {"source.rings": True, "source.script": "taps"}
PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
POINTS = np.array([[40.0, 35.0], [75.0, 55.0], [120.0, 80.0]])
PLACE, BEGINS, LASTS = (66.0, 71.0), 0.02, 0.02


def tap(time):
    age = (time - BEGINS) / LASTS
    return (fe.Touch(*PLACE, float(np.sin(np.pi * age))),) if 0 < age < 1 else ()


def fresh(modes):
    """Prepare points of the top face of a plate at rest."""
    omega = np.sqrt(modes.stiffness / (1e-12 * DENSITY * PLATE.thickness))
    slope = -0.5 * PLATE.thickness * modes.slope(POINTS)
    shown = np.stack([slope[:, :, 0], slope[:, :, 1], modes.value(POINTS)], axis=1)
    reached = Reached(None, np.zeros(modes.count, dtype=np.complex128))
    return RingingFace(modes, omega, RATIO, EXPOSURE, shown, reached)


@pytest.fixture(scope="module")
def moved():
    linear = fe.Linear(PLATE, fe.grid(PLATE, 24))

    def displacement(touches):
        return linear.deflect(touches).displacement(POINTS) if touches else np.zeros((3, 3))

    return displacement


@pytest.fixture(scope="module")
def modes():
    return fe.modes(PLATE, 60, fe.grid(PLATE, 40))


def test_it_moves_as_finite_elements_that_are_stepped_through_time(modes, moved):
    face, mesh = fresh(modes), fe.grid(PLATE, 12)
    rows, columns = free(PLATE, mesh)
    size = int(rows.sum() * columns.sum())
    unit = np.zeros((*mesh.shape, size))
    unit[np.ix_(rows, columns)] = np.eye(size).reshape(rows.sum(), columns.sum(), size)
    # Rayleigh's damping is that of the modes at the first and at the fourth frequency.
    low, high = (float(face.omega[k]) / (2 * np.pi) for k in (0, 3))
    summed = summed_readings(
        PLATE,
        mesh,
        1e-12 * DENSITY,
        Damping(RATIO, low, high),
        derivative(mesh, POINTS).of(unit),
        np.array([PLACE]),
        lambda t: np.array([np.sin(np.pi * np.clip((t - BEGINS) / LASTS, 0, 1))]),
        0.1,
    )[:, 0]
    grain = KEPT * STEP
    ends = np.arange(0.02, 0.099, 0.007)
    truth = [
        (summed[round(end / grain)] - summed[round((end - EXPOSURE) / grain)]) / EXPOSURE
        for end in ends
    ]
    found = [face.displacement(float(end), tap, moved)[:, 2] for end in ends]
    off = np.abs(np.array(found) - truth).max()
    assert off < 0.05 * np.abs(truth).max()  # measured 0.02


def test_a_frame_is_the_same_whatever_frames_were_taken_before(modes, moved):
    followed, times = fresh(modes), np.arange(0.01, 0.12, 1 / RATE)
    one_by_one = [followed.displacement(float(t), tap, moved) for t in times]
    back = followed.displacement(float(times[4]), tap, moved)
    for t, known in ((times[4], back), (times[-1], one_by_one[-1]), (times[7], one_by_one[7])):
        alone = fresh(modes).displacement(float(t), tap, moved)
        np.testing.assert_allclose(known, alone, atol=1e-9)


def test_it_comes_to_rest_under_a_press_that_lasts(modes, moved):
    def press(time):
        return (fe.Touch(*PLACE, 1.0),) if time > 0.01 else ()

    face = fresh(modes)
    settled = face.displacement(3.0, press, moved)
    np.testing.assert_allclose(settled, moved(press(3.0)), atol=1e-3 * np.abs(settled).max())
    assert face.reached.knot == pytest.approx((3.0 - EXPOSURE) / KNOT, abs=1)


def test_taps_end_after_a_fiftieth_of_a_second_and_lie_inside():
    taps = script.taps((254.0, 200.0), (1.0, 2.0), 3)
    times = np.arange(0.0, 8.0, 1e-3)
    touched = [touch for time in times for touch in taps(float(time))]
    assert 0.9 * 7 * script.TAPPED < 1e-3 * len(touched) <= 7 * script.TAPPED
    assert not taps(0.5)
    assert max(touch.force for touch in touched) <= 2.0
    assert all(20 < touch.x < 234 and 20 < touch.y < 180 for touch in touched)


@pytest.fixture(scope="module")
def ringing(small):
    scene = small(THIN | RINGS)
    return scene, open_play(scene)


def tapped(scene, twin):
    """Take the frames of one tap and of the second after it: forces found, ghosts, taps stated."""
    bench = build_bench(scene, lambda done, total: None)
    reference = average_reference([twin.frame(k, ()) for k in range(16)])
    follower = FrameProcessor(bench, reference, Stopwatch(time.monotonic), time.monotonic)
    ghosts, taps = 0, []
    for number in range(112, 200):
        image, when = twin.frame(number, twin.touches(number)), number / RATE
        found = follower.process(Frame(number, when, image)).frame_estimate
        taps += found.state.past.taps
        released = when - EXPOSURE > script.STILL + script.TAPPED
        ghosts += released and found.estimate.count > 0
    return ghosts, taps


@pytest.mark.slow
def test_the_loop_that_follows_the_ringing_states_the_tap_and_sees_no_ghost(small, ringing):
    scene, twin = ringing
    begun = script.STILL + script.TAPPED / 2
    (hardest,) = twin.script(begun)
    ghosts, (tap,) = tapped(scene, twin)
    assert ghosts == 0
    assert tap.force == pytest.approx(hardest.force, rel=0.15)  # measured 0.9 %
    assert np.hypot(tap.x - hardest.x, tap.y - hardest.y) < 3.0
    # The same frames, each taken as an equilibrium: touches that nobody makes, and no tap.
    ghosts, taps = tapped(small(THIN), twin)
    assert ghosts > 10  # measured 26
    assert not taps


def test_an_untouched_plate_that_rings_stands_still_and_warms_up_like_any_other(ringing):
    _, twin = ringing
    still = replace(twin, ringing=None)
    np.testing.assert_array_equal(twin.frame(60, ()), still.frame(60, ()))
    # What is no touch of the script is an equilibrium: the source warms up by one.
    middle = (fe.Touch(120.0, 90.0, 1.0),)
    np.testing.assert_array_equal(twin.frame(3, middle), still.frame(3, middle))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"source.rings": True}, r"give dynamics\.density"),
        (RINGS | {"plate.theory": "large"}, r"with plate\.theory 'large'; leave one"),
        (RINGS | {"source.departure.sag": 0.1}, r"with source\.departure; leave one"),
        (RINGS | {"camera.row_time": "10 µs"}, r"with camera\.row_time; leave one"),
    ],
)
def test_a_plate_that_cannot_ring_is_refused(small, changes, says):
    with pytest.raises(ValueError, match=says):
        open_play(small(THIN | changes))


def test_whether_a_plate_rings_is_true_or_false(small):
    with pytest.raises(rig.SceneError, match=r"source\.rings"):
        small({"source.rings": "loudly"})
