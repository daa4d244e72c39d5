"""Ringing and creep by the command line: from a recording into the calibration, and into a run."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

import fe
import models
from models import Estimate, Result
from rig import cli
from rig.calibration import store
from rig.calibration.creep import learn_held_press
from rig.calibration.recorded import Recorded
from rig.calibration.ringing import learn_ringing
from rig.calibration.ringing_plate import Ringing
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.live.plate_in_time import in_time
from rig.recording.recorder import SessionRecorder
from rig.sources.twin import build_twin
from rig.system.frame import Frame
from tests.rig.live.test_creeping import CREEP, LANDS, shown_force
from tests.rig.live.test_in_time import frames as tapped_frames

FLAT = {"comparison": None, "estimator.modes": 100}
PLACE = (140.0, 110.0)


class Stored:
    """Frames that were made before, as a source."""

    def __init__(self, frames):
        self._frames, self.status = iter(frames), "the frames are over"

    def grab(self, timeout):
        try:
            return next(self._frames)
        except StopIteration:
            raise EOFError("the frames are over") from None


@pytest.fixture
def recorded(small, tmp_path, monkeypatch):
    """Record images with their times: `recorded(lambda bench, twin: [(time, image)])`."""
    monkeypatch.chdir(tmp_path)

    def make(shown):
        scene = small(FLAT)
        bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
        rest = [(k / 120 - 1.0, twin.frame(k, ())) for k in range(16)]
        images = [*rest, *shown(bench, twin)]
        source = Stored(Frame(k, time, image) for k, (time, image) in enumerate(images))
        with SessionRecorder(
            tmp_path / "one.h5", {"scene": scene.model_dump_json()}, waiting=200
        ) as recorder:
            stream = iter(Loop(bench, source, recorder=recorder))
            for _ in images[16:]:
                next(stream)
        return tmp_path / "one.h5"

    return make


def calibrate(what, recording, small_settings, *settings):
    arguments = ["calibrate", what, "twin", str(recording), "--json", *small_settings, *settings]
    done = CliRunner().invoke(cli.application(arguments), arguments)
    assert done.exit_code == 0, done.output or done.exception
    return json.loads(done.stdout)


@pytest.mark.slow
def test_damping_is_learned_from_a_recorded_tap_and_taken_by_a_run(recorded, small, small_settings):
    recording = recorded(lambda bench, twin: [*tapped_frames(bench, twin, 0.3)])
    supposed = {
        "dynamics.density": "1250 kg/m³",
        "dynamics.damping": 0.05,
        "dynamics.exposure": "6 ms",
    }
    settings = [f"--set={key}={value}" for key, value in supposed.items()]
    said = calibrate("damping", recording, small_settings, *settings)
    assert said["density"] == pytest.approx(1400.0, rel=0.01)
    assert abs(said["damping"] - 0.02) < 0.005
    kept = store.read_calibration(store.beside("twin"))
    bench = build_bench(small(FLAT | supposed), lambda done, total: None, kept)
    assert bench.in_time.ringing.dynamics.damping[0] == said["damping"]


@pytest.mark.slow
def test_creep_is_learned_from_a_recorded_press_and_taken_by_a_run(recorded, small, small_settings):
    def pressed(bench, twin):
        for number, now in enumerate(np.arange(0.0, 100.0, 0.5).tolist()):
            force = shown_force(10.0, now)
            yield now, twin.frame(100 + number, (fe.Touch(*PLACE, force),) if force else ())

    said = calibrate("creep", recorded(pressed), small_settings)
    learned = models.Creep(tuple(said["parts"]), tuple(said["times"]))
    for held in (5.0, 20.0, 45.0):
        expected = shown_force(1.0, LANDS + held) - 1.0
        grown = learned.after(learned.rest(1), np.ones(1), held).sum()
        assert grown == pytest.approx(expected, abs=0.01)  # σ of one reading is 0.005
    kept = store.read_calibration(store.beside("twin"))
    bench = build_bench(small(FLAT), lambda done, total: None, kept)
    assert bench.in_time.creep == learned
    assert bench.in_time.ringing is None


def test_what_was_calibrated_stands_in_the_place_of_what_a_scene_says(small, tmp_path):
    motions = SimpleNamespace(plate_modes=fe.modes(fe.Plate((254.0, 203.0), 2.0, 3000.0, 0.38), 50))
    said = {"dynamics.density": 1400, "dynamics.damping": 0.02, "dynamics.creep": [[0.01, 3.0]]}
    path = tmp_path / "twin.calibration.json"
    for part in (Ringing(1300.0, 0.03, 0.001), models.LearnedCreep(CREEP, 0.002)):
        calibration = store.keep(path, part)
    scene, silent = small(said), small()
    without, learned = in_time(scene, motions), in_time(scene, motions, calibration)
    ratio = learned.ringing.dynamics.omega / without.ringing.dynamics.omega
    np.testing.assert_allclose(ratio, np.sqrt(1400.0 / 1300.0))
    assert (without.creep.parts, learned.creep) == ((0.01,), CREEP)
    assert in_time(silent, motions) is None
    assert in_time(silent, motions, calibration).creep == CREEP


SHAPE = np.array([3.0, -4.0, 12.0])  # what 1 N shows, in units of the noise


def shown(forces, times=None, counts=None):
    """Frames that show forces at one place, and an estimate of each that pushes."""
    forces = np.asarray(forces, dtype=float)
    counts = (forces > 0.0).astype(int) if counts is None else counts
    estimates = tuple(
        Estimate(np.tile(PLACE, (n, 1)), np.full(n, f), np.eye(3 * n), 1.0, 1, 0.5, Result.FOUND)
        for n, f in zip(counts, forces, strict=True)
    )
    forward = SimpleNamespace(response=lambda xy: np.tile(SHAPE, (len(xy), 1)))
    chain = SimpleNamespace(estimator=SimpleNamespace(forward=forward))
    times = np.arange(len(forces)) * 0.5 if times is None else times
    return Recorded(None, chain, times, np.outer(forces, SHAPE), estimates)


def test_the_force_at_a_place_is_that_of_least_squares():
    force, sigma = shown([0.5, -2.0, 0.0]).shown_at(np.array(PLACE))
    np.testing.assert_allclose(force, [0.5, -2.0, 0.0])
    assert sigma == pytest.approx(1.0 / 13.0)


@pytest.mark.parametrize(
    ("forces", "counts", "says"),
    [
        ([0.0] * 60, None, "none of the 60 frames shows a touch"),
        ([0.0] * 5 + [2.0] * 60, None, "does not end in the recording"),
        ([2.0] * 60, [2] * 60, "more than one touch at once"),
        ([0.0] * 5 + [2.0] * 60 + [0.1] * 9, None, "20 readings after the release"),
        ([0.0] * 5 + [2.0] * 60 + [0.0] * 60, None, "no more than noise"),
    ],
)
def test_a_press_that_says_nothing_of_creep_is_refused(forces, counts, says):
    with pytest.raises(ValueError, match=says):
        learn_held_press(shown(forces, counts=counts))


def test_a_tap_that_does_not_ring_or_a_scene_without_a_density_is_refused(small):
    scene = small({"dynamics.density": 1400})
    pressed = shown([0.0, 2.0, 1.0, 0.1, 0.0, -0.2, 0.0])
    object.__setattr__(pressed, "bench", SimpleNamespace(motions=SimpleNamespace(plate_modes=None)))
    with pytest.raises(ValueError, match="never swings beyond its rest"):
        learn_ringing(pressed, scene)
    with pytest.raises(ValueError, match=r"names no density .* dynamics\.density"):
        learn_ringing(pressed, small())
