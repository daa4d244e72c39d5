"""Touches as a node of ROS 2, for robots, RViz and rosbag (extra "ros").

Each frame is one ``sensor_msgs/msg/PointCloud2``, a message that every ROS 2 has, with one point a
touch; each gesture is one ``std_msgs/msg/String``, a JSON object. Lengths are in m, as ROS wants
them (T. Foote and M. Purvis, "REP 103: Standard Units of Measure and Coordinate Conventions"); x, y
and z are those of the plate, and the stamp is when the frame was taken.
"""

from __future__ import annotations

import json
import time
from array import array
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import numpy as np

from rig.live.gestures import Gesture
from rig.live.snapshot import Mark, Snapshot
from rig.system.newcomers import Newcomers
from rig.system.optional import need

NODE = "touchplate"
PARTS = "rclpy", "rclpy.node", "rclpy.qos", "rclpy.signals", "sensor_msgs.msg", "std_msgs.msg"
GESTURES = 10  # that wait for who listens: each is sent once, while touches come with each frame
INT32, FLOAT32 = 5, 7  # constants of sensor_msgs/msg/PointField
NUMBERS = "x", "y", "z", "force", "sigma", "sigma_force"
"""A touch: its place and the larger semi-axis of its ellipse in m, its force and σ in N."""
POINT = np.dtype([*((name, "<f4") for name in NUMBERS), ("id", "<i4")])
"""Those numbers and the identity, -1 where it has none: four bytes each."""
NANO = 10**9


class RosNode:
    """Publishes the touches of each frame, and each gesture once; use `open_ros`.

    Parameters
    ----------
    messages : module
        ``sensor_msgs.msg``.
    publisher : rclpy Publisher
        Of clouds.
    send_text : callable
        Publishes a text.
    frame : str
        `frame_id` of the clouds.
    """

    def __init__(
        self, messages: Any, publisher: Any, send_text: Callable[[str], object], frame: str
    ):
        self._messages, self._publisher = messages, publisher
        self._send_text, self._new_gestures = send_text, Newcomers[Gesture]()
        self._frame = frame
        kinds = [(name, FLOAT32) for name in NUMBERS] + [("id", INT32)]
        self._fields = [
            messages.PointField(name=name, offset=4 * at, datatype=kind, count=1)
            for at, (name, kind) in enumerate(kinds)
        ]

    def __call__(self, snapshot: Snapshot) -> None:
        """Publish the touches of a frame; a frame that nobody takes is followed by the next."""
        age = time.monotonic() - snapshot.given
        taken = time.time_ns() - int(age * NANO)
        self._publisher.publish(self._cloud(snapshot.touches, taken))
        for gesture in self._new_gestures(snapshot.gestures):
            before = snapshot.captured - gesture.time
            self._send_text(gesture_text(gesture, taken / NANO - before))

    def _cloud(self, marks: Sequence[Mark], captured: int) -> Any:
        """Message of a frame; `captured` is in ns since 1970."""
        cloud = self._messages.PointCloud2(
            height=1, width=len(marks), fields=self._fields, is_dense=True,
            point_step=POINT.itemsize, row_step=POINT.itemsize * len(marks),
            data=array("B", points(marks).tobytes()),
        )  # fmt: skip
        cloud.header.frame_id = self._frame
        cloud.header.stamp.sec, cloud.header.stamp.nanosec = divmod(captured, NANO)
        return cloud


def points(marks: Sequence[Mark]) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Touches as rows of `POINT`; they lie on the middle plane, z = 0."""
    rows = [
        (mark.x / 1e3, mark.y / 1e3, 0.0, mark.force, max(mark.sigma[:2]) / 1e3, mark.sigma_force,
         -1 if mark.identity is None else mark.identity)
        for mark in marks
    ]  # fmt: skip
    return np.array(rows, POINT)


def gesture_text(gesture: Gesture, stamp: float) -> str:
    """JSON of a gesture at `stamp`, s since 1970: `kind`, `x` and `y` in m, `value`, `angle`."""
    parts = {
        "kind": gesture.kind,
        "stamp": stamp,
        "x": gesture.x / 1e3,
        "y": gesture.y / 1e3,
        "value": gesture.value,
        "angle": gesture.angle,
        "identities": gesture.identities,
    }
    return json.dumps(parts, allow_nan=False)


@contextmanager
def open_ros(topic: str, gestures: str, frame: str) -> Generator[RosNode]:
    """Publish as a node of its own while the block runs, in the domain of ``ROS_DOMAIN_ID``.

    Parameters
    ----------
    topic, gestures : str
        Topics of touches and of gestures.
    frame : str
        `frame_id` of the plate, for transforms.

    Raises
    ------
    OSError
        If rclpy is not installed, or does not start.
    """
    need("rclpy", "ros")
    try:
        rclpy, nodes, qos, signals, messages, texts = map(import_module, PARTS)
        context = rclpy.Context()  # beside that of a program that is a node itself
        options = signals.SignalHandlerOptions.NO
        rclpy.init(args=[], context=context, signal_handler_options=options)
    except (ImportError, RuntimeError) as error:
        raise OSError(
            f"ROS 2 is installed and does not start ({error}); run pip install 'touchplate[ros]',"
            " or begin from a shell that has read its setup.bash"
        ) from error
    try:
        node = nodes.Node(NODE, context=context)
        publisher = node.create_publisher(messages.PointCloud2, topic, qos.QoSProfile(depth=1))
        heard = node.create_publisher(texts.String, gestures, qos.QoSProfile(depth=GESTURES))
        yield RosNode(
            messages, publisher, lambda text: heard.publish(texts.String(data=text)), frame
        )
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)
