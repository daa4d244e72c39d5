"""The live loop on a camera: the twin's pictures pass an emulated /dev/video0."""

import json

import numpy as np
import pytest

import fe
from rig.twin import build_twin
from tests.rig.conftest import SMALL
from tests.rig.emulation.clients import emulate

pytestmark = pytest.mark.devices

TOUCH = fe.Touch(100.0, 120.0, 2.0)

LOOP = """
import json, os
import rig
from rig.bench import build_bench
from rig.camera import Camera, Controls
from rig.camera.v4l2 import open_camera
from rig.loop import Loop

scene = rig.load("twin", json.loads({overrides!r}))
bench = build_bench(scene, lambda done, total: None)
with Camera(lambda: open_camera("/dev/video0", scene.camera.pixels, 15, Controls())) as camera:
    for shot in Loop(bench, camera):
        touches = [(mark.x, mark.y, mark.force) for mark in shot.touches]
        print(json.dumps([touches, shot.dropped, shot.sequence]), flush=True)
"""


@pytest.fixture
def pictures(tmp_path, small):
    """Render the plate at rest and pressed; gives the folders of both."""
    twin = build_twin(small())
    for name, touches in (("rest", ()), ("pressed", (TOUCH,))):
        (tmp_path / name).mkdir()
        for number in range(8):
            image = twin.frame(number, touches)
            (tmp_path / name / f"{number}.raw").write_bytes(image.tobytes())
    return tmp_path


@pytest.mark.slow
@pytest.mark.timeout(600)  # the client may have to compile every kernel first
def test_a_press_that_a_camera_sees_is_found(pictures):
    size = SMALL["camera.pixels"]
    script = LOOP.format(overrides=json.dumps(SMALL))
    with emulate("camera", *size, 15) as camera:
        camera.say(f"show:{pictures / 'rest'}")
        with camera.client(script) as client:
            for _ in range(5):
                touches, _, _ = json.loads(client.stdout.readline())
                assert touches == []
            camera.say(f"show:{pictures / 'pressed'}")
            found = []
            while len(found) < 10:
                touches, _, _ = json.loads(client.stdout.readline())
                found += touches[:1]
            client.kill()
    x, y, force = np.array(found).T
    assert np.hypot(x - TOUCH.x, y - TOUCH.y).max() < 6
    assert np.abs(np.mean([x - TOUCH.x, y - TOUCH.y], axis=1)).max() < 3
    assert force.mean() == pytest.approx(TOUCH.force, rel=0.05)
