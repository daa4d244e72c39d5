"""Opens what touches are sent to; of all ways only those that a scene names are imported."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from rig.live.snapshot import Snapshot
from rig.scene.loop import Outputs

if TYPE_CHECKING:
    from rig.projector.markers import Screen

Sink = Callable[[Snapshot], object]


def open_outputs(
    outputs: Outputs,
    size: tuple[float, float],
    screen: Screen,
    max_touches: int,
    open_parts: ExitStack,
    keys: bool = False,
) -> list[Sink]:
    """Open the ways out for touches until `open_parts` is closed; each takes a snapshot at once.

    Parameters
    ----------
    outputs : Outputs
    size : (float, float), mm
        Sides of the plate.
    screen : Screen
        The projector's image, for programs that fill it.
    max_touches : int
        Touches that a sample of LSL holds.
    open_parts : ExitStack
    keys : bool
        Whether the plate has keys, whose notes go out by OSC.

    Raises
    ------
    OSError
        If a package is missing, a host is not known, a port is taken, no broker answers or ROS
        does not start.
    """
    sinks: list[Sink] = []
    if way := outputs.tuio:
        from rig.out.cursors import across_plate, across_screen
        from rig.out.tuio import Tuio

        surface = across_plate(size) if way.surface == "plate" else across_screen(screen)
        tuio = open_parts.enter_context(Tuio(surface, way.host, way.port))
        sinks.append(lambda snapshot: tuio(snapshot.touches, snapshot.captured))
    if way := outputs.osc:
        from rig.out.osc_touches import OscTouches
        from rig.projector.demos.keyboard import lay_keys
        from rig.projector.demos.notes import Playing

        playing = Playing(lay_keys(size)) if keys else None
        sinks.append(open_parts.enter_context(OscTouches(way.host, way.port, way.prefix, playing)))
    if way := outputs.websocket:
        from rig.out.stream import serve_touches

        sinks.append(open_parts.enter_context(serve_touches(way.port)))
    if way := outputs.lsl:
        from rig.out.lsl import LslOutlet

        sinks.append(LslOutlet(max_touches, way.name))
    if way := outputs.mqtt:
        from rig.out.mqtt import open_mqtt

        sinks.append(open_parts.enter_context(open_mqtt(way.host, way.port, way.topic)))
    if way := outputs.ros:
        from rig.out.ros import open_ros

        sinks.append(open_parts.enter_context(open_ros(way.topic, way.gestures, way.frame)))
    return sinks
