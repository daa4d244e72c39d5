"""Touches to ROS 2: by rclpy where it is installed, else by a fake of what is sent."""

import json
import struct
import sys
import time
from contextlib import ExitStack
from importlib.util import find_spec
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import rig
from rig.live.gestures import Gesture
from rig.live.snapshot import Mark, Snapshot
from rig.out.open import open_outputs
from rig.projector.markers import Screen
from rig.scene import SceneError

SCREEN = Screen((1280, 800), np.eye(3))
TOUCHES = (
    Mark(127.0, 50.0, 2.0, (1.0, 0.5, 0.0), 0.1, 7),
    Mark(20.0, 180.0, 0.5, (2.0, 3.0, 0.4), 0.2, None),
)
WAIT = 20.0  # s
PATIENCE = 0.05  # s between two trials to be heard: who listens is found in the background


def shot(touches=TOUCHES, captured=None, gestures=()):
    return Snapshot(
        5, time.monotonic() if captured is None else captured, np.zeros((2, 3), np.uint8),
        (254.0, 200.0), np.zeros((4, 2)), np.eye(3), touches, (), None, None, "", None, None,
        None, None, 30.0, 0, (), (1.0, 2.0), 2.0, gestures=gestures,
    )  # fmt: skip


class Message:
    """Takes the fields it is made with, as messages of rclpy do."""

    def __init__(self, **fields):
        self.header = SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id="")
        self.__dict__.update(fields)


class FakeRos:
    """What of rclpy is called, and what it was called with."""

    def __init__(self, monkeypatch):
        self.published, self.events = [], []
        self.modules = {name: ModuleType(name) for name in (
            "rclpy", "rclpy.node", "rclpy.qos", "rclpy.signals", "sensor_msgs", "sensor_msgs.msg",
            "std_msgs", "std_msgs.msg",
        )}  # fmt: skip
        ros = self.modules
        ros["rclpy"].__spec__ = SimpleNamespace()
        ros["rclpy"].Context = SimpleNamespace
        ros["rclpy"].init = lambda args, context, signal_handler_options: self.events.append("init")
        ros["rclpy"].shutdown = lambda context: self.events.append("shutdown")
        ros["rclpy.signals"].SignalHandlerOptions = SimpleNamespace(NO=0)
        ros["rclpy.qos"].QoSProfile = SimpleNamespace
        ros["rclpy.node"].Node = self.node
        ros["std_msgs.msg"].String = Message
        ros["sensor_msgs.msg"].PointCloud2 = ros["sensor_msgs.msg"].PointField = Message
        for name, module in ros.items():
            monkeypatch.setitem(sys.modules, name, module)

    def node(self, name, context):
        def create(kind, topic, qos):
            return SimpleNamespace(publish=lambda cloud: self.published.append((topic, cloud)))

        destroy = lambda: self.events.append("destroy")  # noqa: E731
        return SimpleNamespace(create_publisher=create, destroy_node=destroy)

    def receive(self, topic, send, kind="PointCloud2"):
        before = len(self.published)
        send()
        (message,) = [one for name, one in self.published[before:] if name == topic]
        return message

    def close(self):
        assert self.events == ["init", "destroy", "shutdown"]


class RealRos:
    """Another node, which listens to what comes."""

    def __init__(self, _):
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node

        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context)
        self.listener = Node("listener", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.listener)

    def receive(self, topic, send, kind="PointCloud2"):
        import sensor_msgs.msg
        import std_msgs.msg

        kinds = {"PointCloud2": sensor_msgs.msg.PointCloud2, "String": std_msgs.msg.String}
        came = []
        heard = self.listener.create_subscription(kinds[kind], topic, came.append, 10)
        deadline = time.monotonic() + WAIT
        while not came and time.monotonic() < deadline:
            send()
            self.executor.spin_once(timeout_sec=PATIENCE)
        self.listener.destroy_subscription(heard)
        return came[-1]

    def close(self):
        import rclpy

        self.executor.shutdown()
        self.listener.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def ros(monkeypatch):
    opened = (RealRos if find_spec("rclpy") else FakeRos)(monkeypatch)
    yield opened
    opened.close()


def open_sink(parts, **way):
    ways = rig.load("twin", {"outputs": {"ros": way}}).outputs
    (sink,) = open_outputs(ways, (254.0, 200.0), SCREEN, 2, parts)
    return sink


def read(cloud):
    """Read each point of a cloud by what its fields say of it."""
    kinds = {7: "f", 5: "i"}
    return [
        {
            field.name: struct.unpack_from(
                f"<{kinds[field.datatype]}", bytes(cloud.data), at * cloud.point_step + field.offset
            )[0]
            for field in cloud.fields
        }
        for at in range(cloud.width * cloud.height)
    ]


def test_each_touch_is_a_point_in_metres(ros):
    with ExitStack() as parts:
        sink = open_sink(parts, topic="plate/touches", frame="desk")
        cloud = ros.receive("plate/touches", lambda: sink(shot()))
        first, second = read(cloud)
    assert (first["id"], second["id"]) == (7, -1)
    assert [first[name] for name in ("x", "y", "z")] == pytest.approx([0.127, 0.05, 0.0])
    assert (first["force"], first["sigma_force"]) == pytest.approx((2.0, 0.1))
    assert second["sigma"] == pytest.approx(0.003)
    assert (cloud.header.frame_id, cloud.row_step) == ("desk", len(cloud.data))


def test_a_frame_without_touches_is_published_and_says_so(ros):
    with ExitStack() as parts:
        sink = open_sink(parts)
        cloud = ros.receive("touchplate/touches", lambda: sink(shot(touches=())))
    assert (cloud.width, len(cloud.data), len(cloud.fields)) == (0, 0, 7)


def test_the_stamp_is_when_the_frame_was_taken(ros):
    taken = time.monotonic() - 100.0
    with ExitStack() as parts:
        sink = open_sink(parts)
        before = time.time()
        stamp = ros.receive(
            "touchplate/touches", lambda: sink(shot(captured=taken))
        ).header.stamp  # fmt: skip
        after = time.time()
    assert before - 100.5 <= stamp.sec + 1e-9 * stamp.nanosec <= after - 99.5


def test_each_gesture_is_a_text_of_its_own(ros):
    sent = iter(range(1, 10**6))

    def gesture():  # another one each time: it may be heard late, and is sent once
        return Gesture("swipe", time.monotonic() - 0.5, 127.0, 50.0, 300.0, 0.25, (next(sent),))

    with ExitStack() as parts:
        sink = open_sink(parts, gestures="plate/gestures")
        before = time.time()
        came = ros.receive(
            "plate/gestures", lambda: sink(shot(gestures=(gesture(),))), "String"
        )  # fmt: skip
        after = time.time()
    read = json.loads(came.data)
    assert (read["kind"], read["x"], read["y"]) == ("swipe", 0.127, 0.05)
    assert (read["value"], read["angle"]) == (300.0, 0.25)
    assert before - 0.6 <= read["stamp"] <= after - 0.4


def test_a_gesture_that_frames_repeat_is_sent_once(monkeypatch):
    fake = FakeRos(monkeypatch)
    tap = Gesture("tap", time.monotonic(), 127.0, 50.0, 2.0, 0.0, (3,))
    with ExitStack() as parts:
        sink = open_sink(parts)
        for gestures in ((), (tap,), (tap,), ()):
            sink(shot(gestures=gestures))
    topics = [topic for topic, _ in fake.published]
    assert topics.count("touchplate/gestures") == 1
    assert topics.count("touchplate/touches") == 4


def test_a_ros_that_does_not_start_is_a_sentence(monkeypatch):
    fake = FakeRos(monkeypatch)

    def fail(**_):
        raise RuntimeError("no middleware")

    fake.modules["rclpy"].init = fail
    with (
        ExitStack() as parts,
        pytest.raises(OSError, match=r"not start \(no middleware\); run pip"),
    ):
        open_sink(parts)


def test_a_topic_that_ros_would_refuse_is_refused():
    with pytest.raises(SceneError, match=r"outputs\.ros\.topic"):
        rig.load("twin", {"outputs": {"ros": {"topic": "plate touches"}}})
