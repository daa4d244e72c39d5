"""The live loop on a source without a process: every frame counts, and each says what it must."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fe
from rig.live.bench import build_bench
from rig.live.diagnosing import Diagnosing
from rig.live.frame_estimate import NO_ESTIMATE
from rig.live.loop import Loop
from rig.live.pace import LATENCY
from rig.live.tracker import FrameProcessor
from rig.sources.twin import build_twin
from rig.system.frame import Frame


@pytest.fixture
def start(small, in_hand):
    """Make a loop on chosen frames of the twin: `start(sequences, changes)`."""

    def make(sequences, changes=(), with_truth=True, **options):
        scene = small(changes)
        source = in_hand(build_twin(scene), sequences, with_truth)
        return Loop(build_bench(scene, lambda done, total: None), source, **options)

    return make


def run(loop, frames):
    stream = iter(loop)
    return [next(stream) for _ in range(frames)]


def test_touches_are_found_and_scored_against_the_truth(start):
    loop = start(range(1000), {"source.script": "random", "touches.force": ["2 N", "4 N"]})
    shots = run(loop, 60)
    assert [shot.sequence for shot in shots] == list(range(16, 76))
    pattern, strain = loop.summary()["pattern"], loop.summary()["strain"]
    for figures in (pattern, strain):
        assert figures["frames"] == 60
        assert figures["misses"] == figures["false_touches"] == 0
        assert figures["scored"] == 46  # frames 30 to 75; before them nothing touches
    assert pattern["position_median_mm"] < 2.5  # 1.4 measured: 384 × 320 px see a touch to 1.5
    assert pattern["force_median_percent"] < 4  # 1.3
    assert strain["position_median_mm"] < 4
    assert strain["force_median_percent"] < 5


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.3, 0.0)])
def test_nobody_touches_and_nothing_is_found(start, shift):
    loop = start(range(1000), {"source.script": "empty", "source.shift": list(shift)})
    shots = run(loop, 100)
    assert not any(shot.touches or shot.from_strain for shot in shots)
    assert {shot.status for shot in shots} == {"no touch"}
    summary = loop.summary()
    assert summary["pattern"]["false_touches"] == summary["strain"]["false_touches"] == 0
    assert summary["pattern"]["position_median_mm"] is None


def test_a_camera_shift_changes_neither_places_nor_forces(start):
    def figures(shift):
        changes = {"source.script": "random", "touches.force": ["2 N", "4 N"]}
        loop = start(range(1000), changes | {"source.shift": shift})
        run(loop, 60)
        return loop.summary()["pattern"]

    still, shifted = figures([0.0, 0.0]), figures([0.3, 0.0])
    assert shifted["misses"] == shifted["false_touches"] == 0
    # 3.6 and 4.0 mm, 0.06 and 0.11 N: a few touches near the edges lie within a σ of 0.3 N.
    assert shifted["position_rms_mm"] < 1.25 * still["position_rms_mm"]
    assert shifted["force_median_n"] < 0.2


def test_while_the_loop_gets_ready_it_shows_the_plate_at_rest_and_how_far_it_is(start):
    loop, shown = start(range(20)), []
    follower = loop.get_ready(lambda *step: shown.append(step))
    assert loop.pace.frames == 0
    assert loop.get_ready() is follower
    for number, (done, total, shot) in enumerate(shown):
        assert (done, total) == (number, len(shown) - 1)
        assert shot.status.startswith("getting ready: ")
        assert shot.status.endswith(f"({done} of {total})")
        assert not shot.fresh
        assert not shot.touches
        np.testing.assert_allclose(shot.image, follower.chain.reference.image, atol=0.5)
    assert "one touch" in shown[1][2].status
    assert [shot.sequence for shot in run(loop, 4)] == [16, 17, 18, 19]


def test_gaps_in_the_numbers_are_dropped_frames(start):
    after_reference = [16, 20, 21, 25]
    loop = start([*range(0, 32, 2), *[k + 30 for k in after_reference]])
    shots = run(loop, 4)
    assert [shot.dropped for shot in shots] == [0, 3, 3, 6]
    assert loop.summary()["dropped"] == 6


def test_frames_lost_while_the_reference_is_prepared_are_not_dropped(start):
    loop = start([*range(16), 40, 41, 42])
    assert run(loop, 2)[-1].dropped == 0


def test_a_source_that_ends_ends_the_loop(start):
    loop = start(range(20))
    assert len(list(loop)) == loop.pace.frames == 4


def test_a_source_that_ends_too_early_is_one_sentence(start):
    with pytest.raises(OSError, match="the frames are over, and the reference takes more"):
        run(start(range(10)), 1)


class Unplugged:
    """A source that gives nothing at some grabs."""

    status = "/dev/video0 has gone; plug it in again"

    def __init__(self, source, silent):
        self._source, self._silent, self._grabs = source, silent, 0

    def grab(self, timeout):
        self._grabs += 1
        return None if self._grabs in self._silent else self._source.grab(timeout)


def test_a_source_that_falls_silent_shows_no_touch_and_says_why(start):
    loop = start([*range(16), 75, 76, 77])
    loop._source = Unplugged(loop._source, (18, 19))
    pressed, silent, _, back = run(loop, 4)
    assert pressed.fresh
    assert len(pressed.touches) == 1
    assert not silent.fresh
    assert silent.touches == silent.from_strain == ()
    assert silent.truth is silent.strain is None
    assert silent.status == Unplugged.status
    assert back.fresh
    assert len(back.touches) == 1
    assert loop.pace.frames == 2


@pytest.mark.parametrize(("interval", "patience"), [(1 / 30, 0.5), (0.5, 1.5), (2.0, 6.0)])
def test_a_slow_source_is_not_taken_for_a_silent_one(start, interval, patience):
    loop, asked = start(range(20)), []
    grab = loop._source.grab

    def slow(timeout):
        asked.append(timeout)
        frame = grab(timeout)
        return replace(frame, captured=interval * frame.sequence)

    loop._source.grab = slow
    run(loop, 2)
    assert asked[-1] == pytest.approx(patience)


def test_a_source_that_never_speaks_is_one_sentence(start):
    loop = start(range(20))
    loop._source = Unplugged(loop._source, range(9))
    with pytest.raises(OSError, match="plug it in again; none came for 5 s, look after it"):
        run(loop, 1)


def test_a_plate_that_is_touched_for_the_reference_is_refused(start):
    loop = start(range(40, 1000))
    with pytest.raises(ValueError, match="plate was touched while the reference was taken"):
        run(loop, 1)


def test_a_snapshot_holds_the_frame_its_touches_the_truth_and_the_errors(start):
    loop = start([*range(16), 75, 76])
    *_, shot = run(loop, 2)
    (mark,), (truth,), (from_strain,) = shot.touches, shot.truth, shot.from_strain
    (place,), (force,) = shot.estimate.xy, shot.estimate.force  # of this frame alone
    assert (truth.x, truth.y, truth.force) == pytest.approx((127.0, 101.5, 2.0))
    assert np.hypot(*(place - (truth.x, truth.y))) == pytest.approx(shot.position_error)
    assert abs(force - truth.force) == pytest.approx(shot.force_error)
    assert shot.position_error_median is not None
    assert 0 < mark.sigma[1] <= mark.sigma[0] < 5
    assert from_strain.sigma_force > mark.sigma_force > 0
    assert shot.status == "one touch"
    assert shot.image.shape == (320, 384)
    assert shot.plate_size == (254.0, 203.0)
    assert shot.noise == pytest.approx(2.08, rel=0.05)  # grey levels, rounding included
    assert shot.strain.exx.shape == shot.strain.exy.shape == (38, 46)
    assert shot.strain_reason == ""
    assert {name for name, _, _ in shot.stages} >= {"correlate", "estimate", "strain"}


def test_without_a_comparison_there_is_no_strain_and_the_reason_is_given(small, in_hand):
    scene = small().model_copy(update={"comparison": None})
    bench = build_bench(scene, lambda done, total: None)
    loop = Loop(bench, in_hand(build_twin(scene), range(30)))
    (shot,) = run(loop, 1)
    assert shot.strain is None
    assert shot.from_strain is None
    assert shot.strain_reason == "the scene names no [comparison] by strain"
    assert loop.summary()["strain"] is None
    assert "strain" not in loop.summary()["stages_ms"]


def test_a_source_without_truth_is_not_scored(start):
    loop = start([*range(16), 61, 62], with_truth=False)
    *_, shot = run(loop, 2)
    assert len(shot.touches) == 1
    assert shot.truth is None
    assert shot.position_error is shot.position_error_median is None
    assert loop.summary()["pattern"]["frames"] == 0


class Ticks:
    """A clock that goes on by a tenth of a second whenever it is looked at."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 0.1
        return self.now


def test_the_figures_are_taken_on_the_given_clock_and_are_json(start):
    loop = start(range(40), clock=Ticks())
    run(loop, 1)
    assert loop.summary()["fps"] is None
    text = json.dumps(loop.summary(), allow_nan=False)
    assert json.loads(text)["frames"] == 1


def test_the_rate_is_that_of_the_whole_run(start):
    loop = start(range(40), clock=Ticks())
    run(loop, 5)
    looks = (loop.pace._finished[-1] - loop.pace._first) / 0.1 / 4  # a frame
    assert loop.summary()["fps"] == pytest.approx(10.0 / looks)
    assert loop.pace.fps == pytest.approx(loop.summary()["fps"])


def test_the_latency_counts_from_the_capture(start):
    loop = start([*range(16), 18, 19])
    source, delay = loop._source, 0.25
    grab = source.grab

    def late(timeout):
        frame = grab(timeout)
        return Frame(frame.sequence, frame.captured - delay, frame.image, frame.truth)

    source.grab = late
    run(loop, 2)
    median, slow = loop.watch.quantiles(LATENCY)
    assert 1e3 * delay < median <= slow < 1e3 * (delay + 5)


class Covered:
    """A source before which a hand appears at frame 60."""

    def __init__(self, source):
        self._source = source

    def grab(self, timeout):
        frame = self._source.grab(timeout)
        if frame and frame.sequence >= 60:
            frame.image[100:200, 120:240] = 15
        return frame


def hidden(status):
    """Percent of the pattern that a status says is hidden."""
    said = re.search(r"(\d+)% of the pattern is hidden", status)
    return int(said[1]) if said else 0


def test_a_hand_before_the_plate_is_reported_and_is_no_touch(start):
    loop = start([*range(16), 18, 60, 735])  # 2 N in the middle at frame 60, nobody at 735
    loop._source = Covered(loop._source)
    clear, pressed, empty = run(loop, 3)
    assert clear.status == "no touch"
    assert pressed.status.startswith("one touch; ")
    assert 10 <= hidden(pressed.status) <= 15  # the hand covers 10 % of the image, 8 px a tile
    (mark,) = pressed.touches
    assert np.hypot(mark.x - 127.0, mark.y - 101.5) < 6.0
    assert mark.force == pytest.approx(2.0, abs=0.4)
    assert empty.status.startswith("no touch; ")
    assert 10 <= hidden(empty.status) <= 15
    assert pressed.from_strain == empty.from_strain == ()


def test_a_touch_beyond_the_theory_says_so(start):
    loop = start([*range(16), 700], {"touches.force": ["0.5 N", "1 N"], "plate.thickness": 1})
    source = loop._source
    press = fe.Touch(127.0, 101.5, 1.5)
    source.grab = lambda timeout, grab=source.grab: _pressed(source, grab(timeout), press)
    (shot,) = run(loop, 1)
    assert "1.5 N is more than linear theory is good for; it is off by" in shot.status


def test_a_touch_beyond_what_the_material_bears_says_so(start):
    loop = start([*range(16), 700], {"plate.strain_limit": 1e-5})
    source = loop._source
    press = fe.Touch(127.0, 101.5, 1.5)
    source.grab = lambda timeout, grab=source.grab: _pressed(source, grab(timeout), press)
    (shot,) = run(loop, 1)
    assert "N may strain the material to" in shot.status


def _pressed(source, frame, touch):
    if frame.sequence < 700:
        return frame
    return replace(frame, image=source._twin.frame(700, (touch,)), truth=(touch,))


def test_two_touches_are_called_two(start):
    loop = start([*range(16), 500, 501, 502])  # two fingers press from 15.3 s on
    *_, shot = run(loop, 3)
    assert shot.status == "2 touches"
    assert len(shot.truth) == 2


CAUSE = "Not as calibrated: a plate that is not flat (+0.2 mm of sag); calibrate the bench."
BLURRED = (
    "The image is blurred by 0.8 px more than the reference: let the camera stand still and focus"
    " it, or take the reference again"
)


@pytest.mark.slow
def test_a_cause_that_is_named_stands_in_frames_that_do_not_fit(start, monkeypatch):
    def named(diagnosing, found, chain, known):
        assert chain.pattern.count == len(found.measured)
        assert known is not None
        diagnosing.sentence = CAUSE

    monkeypatch.setattr(Diagnosing, "follow", named)
    usual = {"estimator.bench": "usual", "comparison": None, "source.script": "empty"}
    loop = start(range(1000), usual)
    assert {shot.status for shot in run(loop, 2)} == {"no touch"}
    monkeypatch.setattr("rig.live.tracker.is_consistent", lambda estimate: False)
    shots = run(loop, 2)
    assert {shot.status for shot in shots} == {f"no touch, but the image does not fit. {CAUSE}"}
    assert loop.summary()["diagnosis"] == CAUSE


@pytest.mark.parametrize(
    ("hidden", "p_value", "blur", "cause", "says"),
    [
        (0, 0.5, 0.3, CAUSE, "no touch"),
        (0, 0.5, 0.8, CAUSE, f"no touch. {BLURRED}"),
        (30, 0.5, 0.0, CAUSE, "no touch; 30% of the pattern is hidden: BEHIND"),
        (30, 1e-9, 0.0, CAUSE, "30% of the pattern is hidden: BEHIND, but the image does not fit"),
        (1, 1e-9, 0.0, "", "does not fit: BEHIND"),
        (
            0,
            1e-9,
            -0.8,
            "",
            "does not fit: the bench is not as the scene says, or touches are othe",
        ),
        (0, 1e-9, 0.8, "", f"does not fit. {BLURRED}"),
        (0, 1e-9, 0.8, CAUSE, f"does not fit. {CAUSE}"),
    ],
)
def test_a_sentence_says_what_is_known_of_a_misfit(hidden, p_value, blur, cause, says):
    found = SimpleNamespace(
        unusable_reason="",
        estimate=replace(NO_ESTIMATE, p_value=p_value),
        hidden=np.arange(100) < hidden,
        hidden_fraction=hidden / 100,
        blur=blur,
    )
    behind = SimpleNamespace(sentence=lambda hidden: "BEHIND" if hidden.any() else "")
    none = SimpleNamespace(_caution=lambda found: "", _unseen=lambda found: "", _hidden=behind)
    said = FrameProcessor.sentence(none, found, cause)
    assert said.endswith(says) if p_value == 0.5 else says in said
