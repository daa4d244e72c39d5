"""A reference that is renewed while the loop runs: what it is made of, and when it is refused."""

from concurrent.futures import Future

import numpy as np
import pytest

from rig.live import beside as module
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.recording.control import Switch
from rig.recording.recorder import SessionRecorder
from rig.recording.replay import replay
from rig.recording.session import open_session
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

CALM, ONE = [*range(16, 32)], [*range(60, 72)]  # nobody, one finger
START = [*range(16)]


class AtOnce:
    """An executor without a thread."""

    def __init__(self, *given):
        pass

    def submit(self, work):
        done = Future()
        try:
            done.set_result(work())
        except Exception as error:  # noqa: BLE001 - as an executor does
            done.set_exception(error)
        return done

    def shutdown(self, wait):
        pass


@pytest.fixture
def bench(small, in_hand, monkeypatch):
    """Give a scene, and what makes a loop of it on chosen frames."""
    monkeypatch.setattr(module, "ThreadPoolExecutor", AtOnce)
    scene = small({"touches.max_touches": 2})

    def make(sequences, change=lambda frame: frame, with_truth=True, **options):
        source = in_hand(build_twin(scene), [*START, *sequences], with_truth)
        grab = source.grab
        source.grab = lambda timeout: change(grab(timeout))
        return Loop(build_bench(scene, lambda done, total: None), source, **options)

    return scene, make


def shots_with_tare(loop, before, total):
    stream = iter(loop)
    shots = [next(stream) for _ in range(before)]
    loop.tare()
    return shots + [next(stream) for _ in range(total - before)]


def test_the_new_reference_is_the_mean_of_the_frames_after_the_wish(bench):
    _, make = bench
    loop = make([*CALM[:4], *range(30, 48), *ONE], with_truth=False)
    shots = shots_with_tare(loop, 4, 4 + 18 + len(ONE))
    expected = np.mean([shot.image for shot in shots[4:20]], axis=0, dtype=np.float64)
    chain = loop.get_ready().chain
    np.testing.assert_allclose(chain.reference.image, expected, atol=1e-4)
    assert shots[3].notice == ""
    assert "touch nothing" in shots[4].notice
    assert "renewed from 16 frames" in shots[20].notice


@pytest.mark.slow
def test_after_a_tare_a_touch_is_found_as_well_as_before(bench):
    _, make = bench
    plain = make([*CALM, *ONE])
    taken = make([*CALM, *ONE])
    list(zip(range(len(CALM + ONE)), plain, strict=False))
    shots = shots_with_tare(taken, 0, len(CALM + ONE))
    assert any("renewed" in shot.notice for shot in shots)
    before, after = plain.summary()["pattern"], taken.summary()["pattern"]
    assert after["misses"] == after["false_touches"] == 0
    # Both averages have the same noise: the errors are of one size.
    assert after["position_rms_mm"] < 1.5 * before["position_rms_mm"]


def test_what_lights_up_after_the_start_is_gone_with_a_tare(bench):
    """A lamp lights the plate up by a tenth: the new reference shows it, the noise with it."""
    _, make = bench

    def lit(frame):
        if frame.sequence < 16:
            return frame
        image = np.rint(1.1 * frame.image.astype(float)).clip(0, 255).astype(np.uint8)
        return type(frame)(frame.sequence, frame.captured, image, frame.truth)

    loop = make([*CALM, *range(40, 46)], lit)
    shots = shots_with_tare(loop, 0, 22)
    light = [next(sign for sign in shot.signs if sign.name == "light").says for shot in shots]
    assert light[0].startswith("110%")
    assert light[-1].startswith("100%")


@pytest.mark.parametrize("with_truth", [True, False])
def test_a_touch_that_is_held_refuses_it_in_a_sentence(bench, with_truth):
    _, make = bench
    loop = make([*CALM[:4], *ONE], with_truth=with_truth)
    before = loop.get_ready().chain
    shots = shots_with_tare(loop, 5, 16)
    assert loop.get_ready().chain is before
    assert shots[5].notice.startswith("tare refused: a touch of ")
    assert shots[5].notice.endswith("mm; lift it, and ask again")


def test_a_touch_that_lands_meanwhile_and_a_hand_refuse_it(bench):
    _, make = bench
    loop = make([*CALM[:8], *ONE])
    assert "refused: a touch" in shots_with_tare(loop, 2, 12)[-1].notice

    def hand(frame):
        if frame.sequence >= 18:
            frame.image[:, 200:] = 90
        return frame

    shots = shots_with_tare(make(CALM, hand), 4, 8)
    assert "of the pattern is hidden; clear the view, and ask again" in shots[-1].notice


def test_a_camera_that_has_moved_far_refuses_it(bench):
    """Places would be off by as much, since the calibration is of where the camera was."""
    _, make = bench

    def bumped(frame):
        if frame.sequence < 18:
            return frame
        image = np.roll(frame.image, 2, axis=1)
        return type(frame)(frame.sequence, frame.captured, image, frame.truth)

    shots = shots_with_tare(make(CALM, bumped), 6, 10)
    assert "camera has moved by 2.0 px since the start" in shots[-1].notice


def test_an_unexpected_error_is_said_and_ends_no_run(bench, monkeypatch, caplog):
    def broken(images):
        raise TypeError("no number")

    monkeypatch.setattr("rig.live.tare.average_reference", broken)
    _, make = bench
    loop = make([*CALM, *ONE])
    shots = shots_with_tare(loop, 0, 20)
    assert shots[-1].notice == "tare refused: unexpected TypeError: no number, and ask again"
    assert "the tare failed" in caplog.text


def test_a_touch_that_lands_while_it_is_prepared_keeps_its_identity(bench, monkeypatch):
    _, make = bench
    waiting = []

    class Later(AtOnce):
        def submit(self, work):
            later = Future()
            waiting.append((later, work))
            return later

    monkeypatch.setattr(module, "ThreadPoolExecutor", Later)
    stream = iter(loop := make([*CALM, *ONE]))
    loop.tare()
    shots = [next(stream) for _ in range(20)]
    first = loop.get_ready().chain
    later, work = waiting[0]
    later.set_result(work())
    shots += [next(stream) for _ in range(8)]
    assert loop.get_ready().chain is not first
    assert {mark.identity for shot in shots[16:] for mark in shot.touches} == {1}
    assert all(shot.touches for shot in shots[16:])


@pytest.mark.slow
def test_a_recording_with_a_tare_is_replayed_bit_for_bit(bench, tmp_path):
    scene, make = bench
    path, total = tmp_path / "session.h5", len(CALM) + 4 + len(ONE)
    texts = {"scene": scene.model_dump_json()}
    with SessionRecorder(path, texts, waiting=100) as recorder:
        loop = make([*CALM, *range(40, 44), *ONE], recorder=recorder)
        shots = shots_with_tare(loop, 2, total)
    with open_session(path) as session:
        numbers = session.columns()["frames/reference"].tolist()
        replayed = list(
            replay(session, build_bench(session.scene, lambda *_: None), Stopwatch(lambda: 0.0))
        )
        row = session.row(total - 1)
        number, reference = session.reference_of(row)
        captured = session.tares["tares/captured"][:].tolist()
        with pytest.raises(ValueError, match="renewed \\(tare\\)"):
            session.require_one_reference()
    assert numbers == [0] * 18 + [1] * (total - 18)
    assert captured == [shots[18].captured]
    assert number == 1
    np.testing.assert_array_equal(reference.image, loop.get_ready().chain.reference.image)
    assert len(replayed) == total
    assert all(one.same for one in replayed)
    assert replayed[-1].frame_estimate.estimate.count == 1


def test_a_damaged_new_reference_is_said_of_the_frames_that_need_it(bench, tmp_path):
    scene, make = bench
    path = tmp_path / "session.h5"
    with SessionRecorder(path, {"scene": scene.model_dump_json()}, waiting=100) as recorder:
        shots_with_tare(make([*CALM, *ONE], recorder=recorder), 0, len(CALM + ONE))
    import h5py

    with h5py.File(path, "r+") as file:
        file["tares/check"][0] += 1
    with open_session(path) as session:
        assert session.reference_of(session.row(0))[0] == 0
        with pytest.raises(OSError, match="checksum of the reference is another"):
            session.reference_of(session.row(20))


def test_a_recording_that_is_started_after_a_tare_begins_with_the_new_reference(bench):
    _, make = bench
    with Switch(lambda file: None, None) as switch:
        loop = make([*CALM, *ONE], recorder=switch)
        shots_with_tare(loop, 0, 20)
        assert switch.begun.chain is loop.get_ready().chain
        np.testing.assert_array_equal(
            switch.begun.reference.image, switch.begun.chain.reference.image
        )
