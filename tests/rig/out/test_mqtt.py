"""Touches to an MQTT broker: one of a few messages, which stands for those of others."""

import json
import queue
import socket
import threading
from contextlib import ExitStack, suppress

import numpy as np
import pytest

import rig
from rig.live.snapshot import Mark, Snapshot
from rig.out.open import open_outputs
from rig.projector.markers import Screen
from rig.scene import SceneError

SCREEN = Screen((1280, 800), np.eye(3))
TOUCH = Mark(127.0, 50.0, 2.0, (1.0, 0.5, 0.0), 0.1, 7)
SHOT = Snapshot(
    5, 100.0, np.zeros((2, 3), np.uint8), (254.0, 200.0), np.zeros((4, 2)), np.eye(3), (TOUCH,),
    (), None, None, "one touch", None, None, None, None, 30.0, 0, (), (1.0, 2.0), 2.0,
)  # fmt: skip
CONNECT, CONNACK, PUBLISH, DISCONNECT = 1, 2, 3, 14
ACCEPTED = bytes([CONNACK << 4, 2, 0, 0])
WAIT = 20.0  # s


def packets(link):
    """Kind, flags and body of each packet (MQTT 3.1.1, chapter 2)."""
    with link.makefile("rb") as stream:
        while head := stream.read(1):
            length = shift = 0
            while True:
                (byte,) = stream.read(1)
                length |= (byte & 127) << shift
                shift += 7
                if byte < 128:
                    break
            yield head[0] >> 4, head[0] & 15, stream.read(length)


def field(body):
    """Text before which its length stands, and what follows it."""
    end = 2 + int.from_bytes(body[:2], "big")
    return body[2:end], body[end:]


class Broker:
    """Accepts one client after the other; `said` has topic, text and whether it is kept."""

    def __init__(self):
        self.said, self.wills, self.links = queue.Queue(), queue.Queue(), queue.Queue()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        with suppress(OSError):
            while True:
                link, _ = self._listener.accept()
                self.links.put(link)
                self._listen(link)

    def _listen(self, link):
        with suppress(OSError, ValueError):
            for kind, flags, body in packets(link):
                if kind == CONNECT:
                    name, rest = field(body)
                    assert (name, rest[0]) == (b"MQTT", 4)
                    _, rest = field(
                        rest[4:]
                    )  # level, flags, two bytes of keep-alive; then its name
                    topic, rest = field(rest)
                    self.wills.put((topic.decode(), field(rest)[0].decode()))
                    link.sendall(ACCEPTED)
                if kind == PUBLISH:
                    topic, text = field(body)
                    self.said.put((topic.decode(), text.decode(), flags))
                if kind == DISCONNECT:
                    self.said.put(("left", "", 0))

    def close(self):
        self._listener.close()


@pytest.fixture
def broker():
    opened = Broker()
    yield opened
    opened.close()


def open_sink(broker, parts, topic="plate"):
    ways = rig.load("twin", {"outputs": {"mqtt": {"port": broker.port, "topic": topic}}}).outputs
    (sink,) = open_outputs(ways, (254.0, 200.0), SCREEN, 2, parts)
    return sink


def test_touches_reach_the_broker_and_the_end_of_the_run_is_said(broker):
    with ExitStack() as parts:
        sink = open_sink(broker, parts)
        assert broker.wills.get(timeout=WAIT) == ("plate/online", "0")
        assert broker.said.get(timeout=WAIT) == ("plate/online", "1", 1)
        sink(SHOT)
        topic, text, flags = broker.said.get(timeout=WAIT)
    frame = json.loads(text)
    assert (topic, flags) == ("plate/touches", 0)
    assert (frame["sequence"], frame["status"]) == (5, "one touch")
    assert frame["touches"] == [
        {"id": 7, "x": 127.0, "y": 50.0, "force": 2.0, "sigma": [1.0, 0.5, 0.0], "sigma_force": 0.1,
         "force_interval": None}
    ]  # fmt: skip
    assert broker.said.get(timeout=WAIT) == ("plate/online", "0", 1)
    assert broker.said.get(timeout=WAIT)[0] == "left"


def test_a_link_that_breaks_is_made_again_and_nobody_is_held_up(broker):
    with ExitStack() as parts:
        sink = open_sink(broker, parts)
        broker.said.get(timeout=WAIT)
        link = broker.links.get(timeout=WAIT)
        link.shutdown(socket.SHUT_RDWR)
        assert broker.links.get(timeout=WAIT) is not link
        assert broker.said.get(timeout=WAIT) == ("plate/online", "1", 1)
        sink(SHOT)
        assert broker.said.get(timeout=WAIT)[0] == "plate/touches"


class Slow:
    """A client whose messages do not leave until they are let go."""

    rc, gone = 0, False

    def __init__(self):
        self.published = []

    def is_connected(self):
        return True

    def publish(self, topic, text):
        self.published.append(topic)
        return self

    def is_published(self):
        return self.gone


def test_no_more_than_one_frame_waits_for_a_slow_broker():
    from rig.out.mqtt import MqttClient

    client = Slow()
    sink = MqttClient(client, "plate")
    for _ in range(5):
        sink(SHOT)
    assert client.published == ["plate/touches"]
    client.gone = True
    sink(SHOT)
    assert len(client.published) == 2
    client.gone, client.rc = False, 7  # the link broke with it
    sink(SHOT)
    assert len(client.published) == 3


def test_a_broker_that_is_not_there_is_a_sentence():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    ways = rig.load("twin", {"outputs": {"mqtt": {"port": port}}}).outputs
    with (
        ExitStack() as parts,
        pytest.raises(OSError, match=f"no MQTT broker answers at 127.0.0.1:{port} "),
    ):
        open_outputs(ways, (254.0, 200.0), SCREEN, 2, parts)


def test_a_topic_with_a_wildcard_is_refused():
    with pytest.raises(SceneError, match=r"outputs\.mqtt\.topic"):
        rig.load("twin", {"outputs": {"mqtt": {"topic": "plate/#"}}})
