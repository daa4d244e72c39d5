"""Touches as JSON to an MQTT broker, for home automation, Node-RED and the like (extra "mqtt").

Source: OASIS, "MQTT Version 3.1.1", 2014. Messages have quality of service 0: a frame that is lost
is followed by the next. ``TOPIC/touches`` has the text of `rig.out.stream`; ``TOPIC/online`` is
kept by the broker: 1 while the run lasts, 0 after it, however it ended.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any

from rig.live.snapshot import Snapshot
from rig.out.stream import text
from rig.system.optional import need

KEEP_ALIVE = 10  # s after which a broker that hears nothing says that the run has ended
PATIENCE = 3.0  # s to say goodbye to a broker that is slow
AGAIN = 1, 5  # s, shortest and longest, from one trial to reach a broker that is away to the next


class MqttClient:
    """Publishes the touches of each frame; use `open_mqtt`.

    Where the broker is slow or away, frames are left out, and later ones come when it is back.
    """

    def __init__(self, client: Any, topic: str):
        self._client, self._topic = client, topic
        self._last: Any = None

    def __call__(self, snapshot: Snapshot) -> None:
        """Publish the touches of a frame, unless the one before has not left yet."""
        if self._client.is_connected() and self._has_left():
            self._last = self._client.publish(f"{self._topic}/touches", text(snapshot))

    def _has_left(self) -> bool:
        """Whether the last message has gone to the system, or was lost with its link."""
        return self._last is None or self._last.rc != 0 or self._last.is_published()


@contextmanager
def open_mqtt(host: str, port: int, topic: str) -> Generator[MqttClient]:
    """Publish to a broker while the block runs; a link that breaks is made again.

    Parameters
    ----------
    host : str
    port : int
    topic : str
        That all topics begin with.

    Raises
    ------
    OSError
        If paho-mqtt is not installed, or no broker answers there.
    """
    need("paho", "mqtt")
    mqtt: Any = import_module("paho.mqtt.client")
    client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv311)
    online = f"{topic}/online"
    client.will_set(online, "0", retain=True)
    client.reconnect_delay_set(*AGAIN)

    def greet(*_: object) -> None:
        client.publish(online, "1", retain=True)

    client.on_connect = greet
    try:
        client.connect(host, port, KEEP_ALIVE)
    except OSError as error:
        raise OSError(
            f"no MQTT broker answers at {host}:{port} ({error}); start one, or set"
            " outputs.mqtt.host and outputs.mqtt.port"
        ) from error
    client.loop_start()
    try:
        yield MqttClient(client, topic)
    finally:
        with suppress(RuntimeError, ValueError):  # the link has broken: the broker says it itself
            client.publish(online, "0", retain=True).wait_for_publish(PATIENCE)
        client.disconnect()
        client.loop_stop()
