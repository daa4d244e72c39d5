"""Basler and GenICam through their real libraries, on the cameras that these emulate.

Collected where the extra "vision" is installed.
"""

import importlib.util
import os
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.camera import Controls, LiveCamera

SIZE = (640, 480)
SERIAL = "0815-0000"  # of pylon's emulated camera


@pytest.fixture(scope="session")
def pylon_emulation():
    os.environ["PYLON_CAMEMU"] = "2"  # read once, when pylon starts


@pytest.fixture(scope="session")
def producer():
    """Path of the GenTL producer that comes with genicam: three cameras that show a ball."""
    found = importlib.util.find_spec("genicam")
    assert found is not None
    assert found.origin is not None
    return Path(found.origin).parent / "viky.cti"


def open_emulated(size=SIZE, serial=SERIAL, controls=Controls(), trigger=None):  # noqa: B008
    from rig.camera.basler import open_basler

    return open_basler(serial, size, 30.0, controls, trigger)


def test_a_basler_camera_gives_frames_and_holds_its_controls(pylon_emulation):
    with LiveCamera(lambda: open_emulated(controls=Controls(exposure=0.004, gain=1.0))) as camera:
        frames = [camera.grab(5.0) for _ in range(5)]
        assert [setting.held for setting in camera.settings] == [True, True]
    assert frames[0].image.shape == SIZE[::-1]
    assert frames[0].image.dtype == np.uint8
    assert [frame.sequence for frame in frames] == sorted({frame.sequence for frame in frames})


def test_a_basler_camera_shows_the_images_that_it_is_given(pylon_emulation, tmp_path):
    cv2.imwrite(str(tmp_path / "only.png"), np.full(SIZE[::-1], 77, np.uint8))
    camera = open_emulated()
    try:
        inner = camera._camera
        inner.StopGrabbing()
        inner.ImageFilename.Value = str(tmp_path)
        inner.TestImageSelector.Value = "Off"
        inner.ImageFileMode.Value = "On"
        inner.StartGrabbing()
        wanted = (camera.read(1.0) for _ in range(30))
        assert any(frame is not None and (frame.image == 77).all() for frame in wanted)
    finally:
        camera.close()


def test_an_image_that_failed_on_the_way_counts_as_dropped(pylon_emulation):
    opened = []

    def opening():
        opened.append(open_emulated())
        return opened[-1]

    with LiveCamera(opening) as camera:
        camera.grab(5.0)
        opened[0]._camera.ForceFailedBufferCount.Value = 3
        opened[0]._camera.ForceFailedBuffer.Execute()
        for _ in range(20):
            camera.grab(5.0)
        assert camera.dropped >= 3
        assert camera.outages == 0


def test_a_basler_camera_that_is_not_there_in_use_or_too_small_is_one_sentence(pylon_emulation):
    with pytest.raises(OSError, match="no Basler camera has serial number 7"):
        open_emulated(serial="7")
    with pytest.raises(OSError, match=r"has no images of 99999 × 99999 px in Mono8; it offers"):
        open_emulated(size=(99999, 99999))


def test_a_triggered_basler_camera_gives_one_frame_for_each_pulse(pylon_emulation):
    """Its emulation has no wire; a pulse of the library stands for one on an input."""
    camera = open_emulated(trigger="Software")
    try:
        assert camera.read(0.2) is None
        for _ in range(5):
            camera._camera.ExecuteSoftwareTrigger()
            assert camera.read(5.0) is not None
            assert camera.read(0.1) is None
    finally:
        camera.close()


def test_an_input_without_pulses_is_said_and_one_that_is_not_there_refused(pylon_emulation):
    with LiveCamera(lambda: open_emulated(trigger="Line1")) as camera:
        assert camera.grab(0.3) is None
        assert camera.status.endswith("triggered by Line1, is open")
    with pytest.raises(OSError, match=r"takes no frames by its input 'Line7'; set source\.trigger"):
        open_emulated(trigger="Line7")


def test_a_genicam_camera_without_inputs_is_refused_a_trigger(producer):
    from rig.camera.genicam import open_genicam

    with pytest.raises(OSError, match=r"takes no frames by its input 'Line1'"):
        open_genicam(producer, "1", SIZE, 20.0, Controls(), "Line1")


def test_a_genicam_camera_gives_frames_and_says_what_it_does_not_have(producer):
    from rig.camera.genicam import open_genicam

    def opening():
        return open_genicam(producer, "1", SIZE, 20.0, Controls(exposure=0.004))

    with LiveCamera(opening) as camera:
        frames = [camera.grab(5.0) for _ in range(5)]
        assert [setting.sentence for setting in camera.settings] == [
            "the exposure of the camera cannot be held"
        ]
    assert frames[0].image.shape == SIZE[::-1]
    assert [frame.sequence for frame in frames] == sorted({frame.sequence for frame in frames})


def test_a_genicam_camera_or_producer_that_is_not_there_is_one_sentence(producer):
    from rig.camera.genicam import open_genicam

    with pytest.raises(OSError, match=r"no camera has serial number 7 \(there is 0, 1, 2\)"):
        open_genicam(producer, "7", SIZE, 20.0, Controls())
    with pytest.raises(OSError, match=r"GenTL producer 'none\.cti' does not exist"):
        open_genicam("none.cti", "1", SIZE, 20.0, Controls())


def test_two_cameras_on_one_pulse_give_pairs_within_a_millisecond(pylon_emulation):
    from rig.sources.frame_pairs import matched

    opened = [open_emulated(serial=f"0815-000{k}", trigger="Software") for k in range(2)]
    ending = threading.Event()

    def pulses():
        while not ending.wait(0.02):
            for camera in opened:
                camera._camera.ExecuteSoftwareTrigger()

    pulsing = threading.Thread(target=pulses)
    with LiveCamera(lambda: opened[0]) as first, LiveCamera(lambda: opened[1]) as second:
        pulsing.start()
        try:
            pairs = matched(first, second, 1e-3)
            found = [next(pairs) for _ in range(5)]
        finally:
            ending.set()
            pulsing.join()
    assert all(abs(pair.apart) <= 1e-3 for pair in found)
    assert [pair.first.sequence for pair in found] == sorted({p.first.sequence for p in found})
