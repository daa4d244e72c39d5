"""The websocket stream of touches, read by the client of the websockets package."""

import json
import threading
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from models import Tap
from rig.live.snapshot import Mark, Snapshot
from rig.out.stream import serve_touches

TOUCHES = (Mark(120.0, 80.5, 2.25, (1.5, 0.5, 0.25), 0.125, 7), Mark(30.0, 40.0, 1.0))


@pytest.fixture
def shot():
    """Make a snapshot: `shot(5, touches)`."""
    corners, unit = np.zeros((4, 2)), np.eye(3)

    def make(sequence, touches=TOUCHES):
        return Snapshot(
            sequence, 100.0 + sequence, np.zeros((2, 3), np.uint8), (254.0, 200.0), corners, unit,
            touches, (), None, None, "two touches", None, None, None, None, 30.0, 0, (),
            (1.0, 2.0), 2.0,
        )  # fmt: skip

    return make


def test_a_client_gets_the_touches_of_each_frame_as_json(shot):
    with serve_touches(0) as stream, connect(stream.url) as client:
        stream(shot(5))
        assert json.loads(client.recv(timeout=10)) == {
            "sequence": 5,
            "captured": 105.0,
            "plate": [254.0, 200.0],
            "status": "two touches",
            "touches": [
                {"id": 7, "x": 120.0, "y": 80.5, "force": 2.25, "sigma": [1.5, 0.5, 0.25],
                 "sigma_force": 0.125, "force_interval": None},
                {"id": None, "x": 30.0, "y": 40.0, "force": 1.0, "sigma": [0, 0, 0],
                 "sigma_force": 0, "force_interval": None},
            ],
            "gestures": [],
            "alarms": [],
            "taps": [],
        }  # fmt: skip
        stream(shot(6, ()))
        assert json.loads(client.recv(timeout=10))["touches"] == []


def test_what_is_not_a_number_is_null(shot):
    with serve_touches(0) as stream, connect(stream.url) as client:
        stream(shot(1, (Mark(1.0, 2.0, 3.0, (np.inf, 1.0, 0.0), np.nan),)))
        (touch,) = json.loads(client.recv(timeout=10))["touches"]
    assert touch["sigma"] == [None, 1.0, 0.0]
    assert touch["sigma_force"] is None


def test_a_force_that_is_not_known_evenly_goes_out_with_its_bounds(shot):
    mark = Mark(5.0, 2.0, 3.0, force_interval=(2.0, np.inf))
    with serve_touches(0) as stream, connect(stream.url) as client:
        stream(shot(1, (mark,)))
        (touch,) = json.loads(client.recv(timeout=10))["touches"]
    assert touch["force_interval"] == [2.0, None]


def test_taps_of_the_last_second_go_out(shot):
    taps = (
        Tap(10.0, 20.0, 4.5, 3.0, 99.5, (0.5, 0.25, 0.125)),
        Tap(30.0, 40.0, np.nan, 1.5, 99.75, (1.0, 1.0, np.inf)),
    )
    with serve_touches(0) as stream, connect(stream.url) as client:
        stream(replace(shot(1), recent_taps=taps))
        first, second = json.loads(client.recv(timeout=10))["taps"]
    assert first == {
        "x": 10.0, "y": 20.0, "force": 4.5, "at_least": 3.0, "time": 99.5,
        "sigma": [0.5, 0.25, 0.125],
    }  # fmt: skip
    assert (second["force"], second["at_least"], second["sigma"]) == (None, 1.5, [1.0, 1.0, None])


def test_a_client_that_never_reads_does_not_hold_the_loop_and_others_see_the_newest(shot):
    with serve_touches(0) as stream, connect(stream.url, max_queue=1, close_timeout=0.1):
        for sequence in range(5000):
            stream(shot(sequence))
        with connect(stream.url) as second:
            assert json.loads(second.recv(timeout=10))["sequence"] == 4999


def test_a_foreign_page_is_refused(shot):
    with serve_touches(0) as stream, pytest.raises(InvalidStatus, match="403"):
        connect(stream.url, origin="http://evil.example")


def test_the_end_lets_clients_go_and_leaves_no_thread(shot):
    threads = set(threading.enumerate())
    with ExitStack() as clients:
        with serve_touches(0) as stream:
            client = clients.enter_context(connect(stream.url))
            stream(shot(1))
            client.recv(timeout=10)
        with pytest.raises(ConnectionClosed):
            client.recv(timeout=10)
    assert not {thread for thread in set(threading.enumerate()) - threads if thread.is_alive()}


def test_a_port_in_use_is_one_sentence():
    with serve_touches(0) as stream:
        port = int(stream.url.split(":")[2].split("/")[0])
        with (
            pytest.raises(OSError, match=rf"port {port} on 127.0.0.1 is in use"),
            serve_touches(port),
        ):
            pass
    with (
        pytest.raises(
            ValueError, match=r"outputs websocket port must lie in 0\.\.65535, got 70000"
        ),
        serve_touches(70000),
    ):
        pass
