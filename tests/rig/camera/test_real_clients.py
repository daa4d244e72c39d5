"""Cameras through the real OpenCV and the real linuxpy, on an emulated /dev/video0."""

import textwrap
from importlib.util import find_spec

import pytest

from tests.rig.emulation.clients import nudge

SIZE, RATE = (96, 64), 50

# linuxpy is an extra, and not in the lock: its licence is the GPL
KINDS = pytest.mark.parametrize("kind", ["opencv", "v4l2"] if find_spec("linuxpy") else ["opencv"])

pytestmark = pytest.mark.devices


def script(kind, body, size=SIZE, controls=""):
    opening = f"""
    import json, sys, time
    import numpy as np
    from rig.camera import Controls, LiveCamera
    from rig.camera.{kind} import open_camera

    def say(**what):
        print(json.dumps(what), flush=True)

    def image(number):
        x, y = np.meshgrid(np.arange({SIZE[0]}), np.arange({SIZE[1]}))
        return (x + 3 * y + 7 * number) % 256

    def device():
        return open_camera("/dev/video0", {size}, {RATE}, Controls({controls}))
    """
    return textwrap.dedent(opening) + textwrap.dedent(body)


@KINDS
def test_two_cameras_on_one_pulse_are_paired_within_a_millisecond(emulation, kind):
    emulation.say("second")
    said = emulation.answer(
        script(
            kind,
            f"""
            import rig

            scenes = [
                rig.load(
                    "twin",
                    {{
                        "source": {{"kind": "{kind}", "device": node}},
                        "camera.pixels": {list(SIZE)},
                        "camera.rate": {RATE},
                    }},
                )
                for node in ("/dev/video0", "/dev/video1")
            ]
            pairs = [pair for pair, _ in zip(rig.frame_pairs(*scenes), range(20))]
            starts = [[int(f.image[0, 0]) for f in (p.first, p.second)] for p in pairs]
            say(apart=[p.apart for p in pairs], starts=starts)
            """,
        )
    )
    assert len(said["apart"]) == 20
    assert max(map(abs, said["apart"])) < 1e-3
    # Each camera numbers its frames from its own start on, so the same moments differ evenly.
    assert len({(second - first) % 256 for first, second in said["starts"]}) == 1
    assert len({first for first, _ in said["starts"]}) == 20


@KINDS
def test_pixels_are_those_that_the_camera_sent_and_none_is_late(emulation, kind):
    said = emulation.answer(
        script(
            kind,
            """
            with LiveCamera(device) as camera:
                frames = [(camera.grab(5.0), time.monotonic()) for _ in range(20)]
            first = int(frames[0][0].image[0, 0]) * pow(7, -1, 256) % 256
            say(
                same=all((f.image == image(first + f.sequence)).all() for f, _ in frames),
                sequences=[f.sequence for f, _ in frames],
                ages=[now - f.captured for f, now in frames],
                dropped=camera.dropped,
            )
            """,
        )
    )
    assert said["same"]
    assert said["sequences"] == list(range(20))
    assert said["dropped"] == 0
    assert all(0 < age < 1 for age in said["ages"])  # a stamp of another clock would be far off


@KINDS
def test_the_newest_frame_wins_after_a_pause_and_the_others_count_as_dropped(emulation, kind):
    said = emulation.answer(
        script(
            kind,
            """
            with LiveCamera(device) as camera:
                camera.grab(5.0)
                time.sleep(0.5)
                asked = time.monotonic()
                frame = camera.grab(5.0)
                say(age=asked - frame.captured, sequence=frame.sequence, dropped=camera.dropped)
            """,
        )
    )
    assert said["age"] < 0.25  # four buffers of the driver alone would be 0.4 s old
    assert said["sequence"] == said["dropped"] + 1 > 5


@KINDS
def test_controls_are_held_and_what_is_refused_is_said(emulation, kind):
    said = emulation.answer(
        script(
            kind,
            """
            opened = device()
            say(settings=[(s.sentence, s.held) for s in opened.settings])
            opened.close()
            """,
            controls="exposure=0.00832, gain=300, focus=45",
        )
    )
    assert said["settings"] == [
        ["exposure is held at 0.0083 s", True],
        ["gain 300 was refused, it is 16", False],
        ["focus is held at 45", True],
        ["white balance is held at 4600 K", True],
    ]


@KINDS
def test_a_camera_that_is_plugged_in_again_goes_on_and_is_set_up_again(emulation, kind):
    body = """
    with LiveCamera(device) as camera:
        before = camera.grab(5.0).sequence
        say(seen=before)
        sys.stdin.readline()
        while camera.grab(0.3) is not None:
            pass
        say(status=camera.status, outages=camera.outages)
        sys.stdin.readline()
        frame = camera.grab(10.0)
        say(
            status=camera.status,
            held=all(s.held for s in camera.settings),
            later=frame.sequence > before,
            age=time.monotonic() - frame.captured,
        )
    """
    with emulation.client(script(kind, body, controls="exposure=0.01")) as client:
        client.stdout.readline()
        emulation.say("unplug")
        gone = nudge(client)
        assert gone["status"] == (
            "no camera at /dev/video0 (there is none at all); plug it in or name another"
        )
        assert gone["outages"] == 1
        emulation.say("plug")
        back = nudge(client)
    assert back["status"] == "/dev/video0 is open again"
    assert back["held"]
    assert back["later"]
    assert back["age"] < 1


@KINDS
def test_a_camera_that_falls_silent_is_opened_anew(emulation, kind):
    body = """
    with LiveCamera(device) as camera:
        camera.grab(5.0)
        say(ready=True)
        sys.stdin.readline()
        while not camera.outages:
            camera.grab(0.1)
        say(status=camera.status)
        sys.stdin.readline()
        camera.grab(0.0)
        say(came=camera.grab(20.0) is not None)
    """
    with emulation.client(script(kind, body)) as client:
        client.stdout.readline()
        emulation.say("freeze")
        assert "/dev/video0" in nudge(client)["status"]
        emulation.say("thaw")
        assert nudge(client)["came"]


@KINDS
def test_jpegs_are_decoded_and_one_that_is_cut_off_is_left_out(compressing, kind):
    camera, path = compressing
    body = f"""
    import cv2
    with LiveCamera(device) as camera:
        camera.grab(5.0)
        say(ready=True)
        sys.stdin.readline()
        frames = [camera.grab(5.0) for _ in range(15)]
        sent = cv2.imread({str(path)!r}, cv2.IMREAD_GRAYSCALE)
        say(same=all((f.image == sent).all() for f in frames), dropped=camera.dropped)
    """
    with camera.client(script(kind, body)) as client:
        client.stdout.readline()
        camera.say("tear")
        said = nudge(client)
    assert said["same"]
    assert said["dropped"] == 1


REFUSED = """
try:
    device()
except OSError as error:
    say(sentence=str(error))
"""


@KINDS
def test_no_camera_is_one_sentence_that_names_those_that_are_there(emulation, kind):
    asking = script(kind, REFUSED).replace("/dev/video0", "/dev/video7")
    assert emulation.answer(asking)["sentence"] == (
        "no camera at /dev/video7 (there are /dev/video0); plug it in or name another"
    )


@KINDS
def test_a_camera_in_use_is_one_sentence(emulation, kind):
    emulation.say("busy")
    sentence = emulation.answer(script(kind, REFUSED))["sentence"]
    assert sentence.startswith("/dev/video0 is in use")
    assert sentence.endswith("close the other program")


@KINDS
def test_a_size_that_the_camera_does_not_have_is_one_sentence(emulation, kind):
    sentence = emulation.answer(script(kind, REFUSED, size=(1024, 768)))["sentence"]
    assert sentence.startswith("/dev/video0 has no images of 1024 × 768 px in GREY")
    assert "it offers GREY 96 × 64 px and YUYV 96 × 64 px" in sentence
