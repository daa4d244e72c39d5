"""Cameras by their number, on a system without device nodes and without fcntl."""

import subprocess
import sys

import cv2
import numpy as np
import pytest

from rig.camera import Controls, LiveCamera
from rig.camera.numbered import open_numbered
from rig.doctor import devices

SIZE = 96, 64

ELSEWHERE = """
import sys
sys.modules["fcntl"] = None
from rig.doctor.still import examine
sys.platform = "win32"  # now, for Python itself looks then for what only Windows has
try:
    examine(sys.argv[1], (96, 64), 50.0, 20)
except OSError as error:
    print(error)
"""


class Capture:
    """What OpenCV opens: images in colour whose red is brighter than their blue."""

    def __init__(self, sizes=(SIZE,)):
        self.sizes, self.size = sizes, sizes[0]
        self.asked = {}
        self.there = True

    def __call__(self, number, backend):
        self.opened = number, backend
        return self

    def isOpened(self):  # noqa: N802
        return self.there

    def set(self, name, value):
        self.asked[name] = value
        wanted = tuple(
            self.asked.get(side) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        )
        self.size = wanted if wanted in self.sizes else self.size
        return True

    def get(self, name):
        return float(self.size[0 if name == cv2.CAP_PROP_FRAME_WIDTH else 1])

    def read(self):
        image = np.empty((*self.size[::-1], 3), np.uint8)
        image[:] = 20, 100, 220
        return self.there, image if self.there else None

    def release(self):
        self.there = False


@pytest.fixture
def capture(monkeypatch):
    played = Capture([(640, 480), SIZE])
    monkeypatch.setattr(cv2, "VideoCapture", played)
    return played


@pytest.mark.parametrize(
    ("system", "backend"),
    [("win32", cv2.CAP_DSHOW), ("darwin", cv2.CAP_AVFOUNDATION), ("freebsd14", cv2.CAP_ANY)],
)
def test_a_camera_is_opened_by_its_number_and_gives_grey_images(
    capture, system, backend, monkeypatch
):
    monkeypatch.setattr(sys, "platform", system)
    with LiveCamera(lambda: open_numbered("1", SIZE, 25, Controls())) as camera:
        frame = camera.grab(5.0)
    assert capture.opened == (1, backend)
    assert capture.asked[cv2.CAP_PROP_FPS] == 25
    assert frame.image.shape == SIZE[::-1]
    assert np.unique(frame.image) == round(0.114 * 20 + 0.587 * 100 + 0.299 * 220)


def test_controls_are_said_not_to_be_held(capture):
    opened = open_numbered("0", SIZE, 25, Controls(exposure=0.01))
    assert not any(setting.held for setting in opened.settings)
    assert [setting.sentence for setting in opened.settings] == [
        f"the {knob} of the camera cannot be held"
        for knob in ("exposure", "gain", "focus", "white balance")
    ]


def test_a_size_that_the_camera_does_not_have_is_one_sentence(capture):
    with pytest.raises(
        OSError, match="camera 0 has no images of 100 × 50 px; it offers 640 × 480 px"
    ):
        open_numbered("0", (100, 50), 25, Controls())


def test_a_camera_that_gives_nothing_gives_none(capture):
    opened = open_numbered("0", SIZE, 25, Controls())
    capture.there = False
    assert opened.read(0.1) is None


@pytest.mark.parametrize(
    ("device", "sentence"),
    [
        ("94", "camera 94 does not open; plug it in"),
        ("99999999999", "no camera at 99999999999, because this system numbers its cameras"),
        ("/dev/video0", "no camera at /dev/video0, because this system numbers its cameras"),
    ],
)
def test_without_fcntl_a_camera_that_is_not_there_is_one_sentence(device, sentence):
    command = [sys.executable, "-c", ELSEWHERE, device]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.startswith(sentence)


def test_the_doctor_says_how_a_numbered_camera_is_tested(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(devices, "VIDEO", tmp_path)
    (finding,) = devices.check_cameras()
    assert "numbers its cameras" in finding.text
    assert finding.remedy.endswith("touchplate doctor --camera 0")
