"""`touchplate run` on images that come through a real library, out to a real websocket."""

import json
import signal
import subprocess
from contextlib import ExitStack, contextmanager

import numpy as np
import pytest
from websockets.sync.client import connect

import fe
from rig.recording.session import open_session
from rig.sources.twin import build_twin
from tests.rig.camera.test_real_clients import KINDS
from tests.rig.conftest import SMALL
from tests.rig.emulation.clients import emulate

pytestmark = pytest.mark.devices

TOUCH = fe.Touch(100.0, 120.0, 2.0)
RUN = """
import sys
from rig.cli import main
sys.argv = ["touchplate", "run", "twin", "--headless", "--json", *{arguments!r}]
main()
"""


@pytest.fixture
def images(tmp_path, small):
    """Render the plate at rest and pressed; gives the folders of both."""
    twin = build_twin(small())
    for name, touches in (("rest", ()), ("pressed", (TOUCH,))):
        (tmp_path / name).mkdir()
        for number in range(8):
            image = twin.frame(number, touches)
            (tmp_path / name / f"{number}.raw").write_bytes(image.tobytes())
    return tmp_path


def address_of_touches(client):
    """Address of the stream, as the run says it."""
    lines = (line.partition("touches: ")[2].strip() for line in client.stderr)
    return next(filter(None, lines))


@contextmanager
def ending(client):
    """End a client with the block, whatever happens there."""
    with client:
        try:
            yield client
        finally:
            client.kill()


@pytest.mark.slow
@KINDS
def test_a_press_that_a_camera_sees_is_found_sent_and_recorded(images, kind):
    size, file = SMALL["camera.pixels"], images / "session.h5"
    settings = SMALL | {
        "source": f'{{kind = "{kind}", exposure = "10 ms"}}',
        "camera.rate": 15,
        "estimator.bench": "exact",
        "outputs.websocket.port": 0,
    }
    arguments = [f"--set={key}={value}" for key, value in settings.items()]
    script = RUN.format(arguments=[*arguments, "--record", str(file)])
    with emulate("camera", *size, 15) as camera, ExitStack() as stack:
        camera.say(f"show:{images / 'rest'}")
        with ending(camera.client(script, stderr=subprocess.PIPE)) as client:
            stream = stack.enter_context(connect(address_of_touches(client)))
            for _ in range(5):
                assert json.loads(stream.recv(timeout=300))["touches"] == []
            camera.say(f"show:{images / 'pressed'}")
            found = []
            while len(found) < 10:
                found += json.loads(stream.recv(timeout=120))["touches"][:1]
            camera.say("unplug")
            status = ""
            while "no camera at /dev/video0" not in status:
                said = json.loads(stream.recv(timeout=120))
                status = said["status"]
            assert said["touches"] == []
            client.send_signal(signal.SIGINT)
            summary = json.loads(client.communicate(timeout=120)[0])
    x, y, force = np.array([(one["x"], one["y"], one["force"]) for one in found]).T
    assert np.hypot(x - TOUCH.x, y - TOUCH.y).max() < 6
    assert np.abs(np.mean([x - TOUCH.x, y - TOUCH.y], axis=1)).max() < 3
    assert force.mean() == pytest.approx(TOUCH.force, rel=0.05)
    with open_session(file) as session:
        assert session.frames == summary["recorded"]["frames"] >= 15
        assert session.scene.source.kind == kind
