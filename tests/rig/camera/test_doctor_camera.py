"""The noise test of `touchplate doctor` on an emulated camera, through the real OpenCV."""

import pytest

pytestmark = pytest.mark.devices

DOCTOR = """
import sys
sys.argv = ["touchplate", "doctor", "--json", "--camera", "/dev/video0", "--size", "96", "64",
            "--frames", "20"]
from rig.cli import main
main()
"""


def test_the_camera_is_found_held_and_measured(emulation):
    said = emulation.answer(DOCTOR)
    texts = {finding["text"]: finding["state"] for finding in said["findings"]}
    assert texts["/dev/video0 is Speckle Cam"] == "good"
    assert texts["exposure is held at 0.025 s"] == "good"
    assert texts["focus is held at 30"] == "good"
    assert said["noise"]["frames"] == 20
    assert said["noise"]["rate"] == pytest.approx(50, rel=0.3)
    assert 0 <= said["noise"]["age"] < 0.5
    (lost,) = (text for text in texts if "lost" in text)  # none, unless the machine is busy
    assert texts[lost] == ("good" if lost == "none of 20 frames was lost" else "wrong")


def test_images_that_move_are_too_noisy_and_said_to_be(emulation):
    said = emulation.answer(DOCTOR)
    noisy = next(f for f in said["findings"] if f["text"].startswith("noise"))
    assert said["noise"]["sigma"] > 40  # each image of the emulation is another one
    assert noisy["state"] == "wrong"
    assert "see that nothing moves" in noisy["remedy"]
    assert not said["ready"]
