"""Sections for what the live loop shows and sends: page, projector, touches for other programs."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.quantity import LARGEST_SIDE, Count
from rig.scene.section import Section


class Page(Section):
    """The operator page."""

    port: Count = Field(8765, ge=0, le=65535, description="port, 0 for any free one")
    viewers: Literal["user", "machine", "network"] = Field(
        "user",
        description="who may look: whoever runs it, by a link that is printed where the machine has"
        " other users; everyone on this machine; or others too, by a link that is printed",
    )
    control: Literal["machine", "viewers"] = Field(
        "machine", description="who may record and change settings"
    )


Side = Annotated[Count, Field(ge=1, le=LARGEST_SIDE)]


Index = Annotated[Count, Field(ge=0, le=64)]


class ProjectorSection(Section):
    """The window that shows the touches on the plate."""

    display: Annotated[str, Field(min_length=1)] | None = Field(
        None, description="name of the X display [that of the session]"
    )
    output: Annotated[str, Field(min_length=1)] | Index | None = Field(
        None,
        description="output of the desktop: its number from 0, its name or a part of it, or left,"
        " right, top or bottom [the last one of the projector's size]",
    )
    size: tuple[Side, Side] = Field((1280, 800), description="width and height of its image, px")
    full_screen: bool = Field(True, strict=True, description="whether it fills the display")
    mode: Literal["on", "beside", "outside", "dark"] = Field(
        "on",
        description="where marks are: on the touch, beside it, outside the measured area, or on it"
        " but only in frames that are not measured",
    )
    content: Literal["marks", "ripples", "trails", "scale", "painting", "keys"] = Field(
        "marks",
        description="what it shows: a mark for each touch; waves, or light that fingers draw"
        " behind them; the load in newton with its sigma; paint that stays; keys of a piano, whose"
        " notes go to [outputs.osc]",
    )

    @model_validator(mode="after")
    def _on_the_touches(self) -> ProjectorSection:
        if self.content != "marks" and self.mode in ("beside", "outside"):
            raise PydanticCustomError(
                "scene",
                "projector.mode '{mode}' moves marks, and projector.content is '{content}', which"
                " lies where it is touched; set projector.mode to 'on' or 'dark'",
                {"mode": self.mode, "content": self.content},
            )
        return self


class TuioSection(Section):
    """Touches by TUIO 1.1 over UDP."""

    host: str = Field("127.0.0.1", min_length=1, description="address of the client")
    port: Count = Field(3333, ge=1, le=65535, description="port of the client")
    surface: Literal["plate", "projector"] = Field(
        "plate", description="what 0 to 1 spans: the plate, or the projector's image"
    )


class Websocket(Section):
    """Touches as JSON over a websocket on a loopback address."""

    port: Count = Field(8766, ge=0, le=65535, description="port, 0 for any free one")


class Lsl(Section):
    """Touches as a stream of the Lab Streaming Layer (needs pylsl)."""

    name: str = Field("touchplate", min_length=1, description="name that clients look for")


class Mqtt(Section):
    """Touches as JSON to an MQTT broker (needs paho-mqtt)."""

    host: str = Field("127.0.0.1", min_length=1, description="address of the broker")
    port: Count = Field(1883, ge=1, le=65535, description="port of the broker")
    topic: str = Field(
        "touchplate", pattern=r"^[^+#\x00]+$", description="what all topics begin with"
    )


TOPIC = r"^/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*$"
"""What ROS takes for a topic."""


class Ros(Section):
    """Touches by a node of ROS 2 (needs rclpy)."""

    topic: str = Field(
        "touchplate/touches",
        pattern=TOPIC,
        description="topic of sensor_msgs/msg/PointCloud2",
    )
    gestures: str = Field(
        "touchplate/gestures",
        pattern=TOPIC,
        description="topic of std_msgs/msg/String: each gesture as JSON",
    )
    frame: str = Field("plate", min_length=1, description="frame_id of the plate")


class OscSection(Section):
    """Touches, gestures and notes by Open Sound Control over UDP."""

    host: str = Field("127.0.0.1", min_length=1, description="address of the program that listens")
    port: Count = Field(9000, ge=1, le=65535, description="its port")
    prefix: str = Field(
        "/touchplate",
        pattern=r"^(/[A-Za-z0-9_.-]+)+$",
        description="what all addresses begin with",
    )


class Outputs(Section):
    """Where touches are sent to; also by a headless run."""

    tuio: TuioSection | None = Field(None, description="tables of fingers")
    osc: OscSection | None = Field(None, description="synthesizers and programs of media art")
    websocket: Websocket | None = Field(None, description="programs that read JSON")
    lsl: Lsl | None = Field(None, description="beside recordings of EEG and the like")
    mqtt: Mqtt | None = Field(None, description="home automation, Node-RED and the like")
    ros: Ros | None = Field(None, description="robots, RViz and rosbag")
