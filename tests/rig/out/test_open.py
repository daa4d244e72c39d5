"""The ways out that a scene names are opened, and no others."""

import json
import socket
import subprocess
import sys
from contextlib import ExitStack

import numpy as np
import pytest
from websockets.sync.client import connect

import rig
from rig.live.snapshot import Mark, Snapshot
from rig.out.open import open_outputs
from rig.projector.markers import Screen
from rig.scene import SceneError

SIZE = (254.0, 200.0)
SCREEN = Screen((1280, 800), np.array([[4.0, 0.0, 100.0], [0.0, -3.0, 700.0], [0.0, 0.0, 1.0]]))
TOUCH = Mark(127.0, 50.0, 2.0, (1.0, 0.5, 0.0), 0.1, 7)
SHOT = Snapshot(
    5, 100.0, np.zeros((2, 3), np.uint8), SIZE, np.zeros((4, 2)), np.eye(3), (TOUCH,), (), None,
    None, "one touch", None, None, None, None, 30.0, 0, (), (1.0, 2.0), 2.0,
)  # fmt: skip


def outputs(**ways):
    opened = rig.load("twin", {"outputs": ways}).outputs
    assert opened is not None
    return opened


@pytest.fixture
def client():
    """Receive what comes by UDP."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5.0)
        yield receiver


def place(packet):
    """Read x and y of the one cursor in a bundle."""
    start = packet.index(b",sifffff") + 12 + 4 + 4  # type tags, "set", session
    return np.frombuffer(packet[start : start + 8], ">f4")


@pytest.mark.parametrize(
    ("surface", "expected"),
    [("plate", (0.5, 0.75)), ("projector", (608.5 / 1280, 550.5 / 800))],
)
def test_tuio_goes_to_the_client_in_the_surface_asked_for(client, surface, expected):
    ways = outputs(tuio={"port": client.getsockname()[1], "surface": surface})
    with ExitStack() as stack:
        (sink,) = open_outputs(ways, SIZE, SCREEN, 2, stack)
        sink(SHOT)
        np.testing.assert_allclose(place(client.recv(2000)), expected, atol=1e-6)


def test_a_websocket_and_tuio_may_go_side_by_side(client):
    ways = outputs(tuio={"port": client.getsockname()[1]}, websocket={"port": 0})
    with ExitStack() as stack:
        tuio, stream = open_outputs(ways, SIZE, SCREEN, 2, stack)
        with connect(stream.url) as listener:
            tuio(SHOT)
            stream(SHOT)
            (touch,) = json.loads(listener.recv(timeout=10))["touches"]
        assert (touch["id"], touch["force"]) == (7, 2.0)
        assert b"/tuio/2Dcur" in client.recv(2000)


def test_what_is_not_named_is_not_imported():
    code = (
        "import sys, rig, numpy as np\n"
        "from contextlib import ExitStack\n"
        "from rig.projector.markers import Screen\n"
        "from rig.out.open import open_outputs\n"
        "ways = rig.load('twin', {'outputs.tuio.port': 3333}).outputs\n"
        "with ExitStack() as stack:\n"
        "    open_outputs(ways, (254.0, 200.0), Screen((4, 3), np.eye(3)), 2, stack)\n"
        "print({'pylsl', 'starlette', 'uvicorn'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_a_wrong_way_out_is_one_sentence():
    with pytest.raises(SceneError, match=r"outputs\.tuio\.port is 0; give at least 1"):
        outputs(tuio={"port": 0})
    with pytest.raises(SceneError, match=r"unknown key 'tui' in .*did you mean 'tuio'"):
        outputs(tui={})
