"""Touches, gestures and notes by Open Sound Control over UDP: one bundle a frame.

| address, behind the prefix | arguments | when |
|---|---|---|
| /touch | identity, x mm, y mm, force N, σ of the place mm, σ of the force N | each touch |
| /count | touches | each frame |
| /event | "appear", "move" or "leave", identity, x, y, force | when it happens |
| /gesture | kind, x mm, y mm, value, angle rad | once each |
| /alarm | kind, sentence | once each, when it begins |
| /note | pitch, velocity; 0 ends it | where the keys are shown |
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from rig.live.gestures import Gesture
from rig.live.snapshot import Alarm, Mark, Snapshot
from rig.out.osc import bundle, message
from rig.out.udp import UdpClient
from rig.projector.demos.notes import Playing
from rig.system.newcomers import Newcomers


class OscTouches:
    """Call it with each snapshot.

    Parameters
    ----------
    host : str
        Address of the program that listens.
    port : int
    prefix : str
        What all addresses begin with.
    playing : Playing or None
        The keys that sound; None for no notes.

    Raises
    ------
    OSError
        If the host is not known.
    """

    def __init__(self, host: str, port: int, prefix: str, playing: Playing | None = None):
        self._client = UdpClient(host, port, "OSC")
        self._prefix, self._playing = prefix, playing
        self._new_gestures, self._new_alarms = Newcomers[Gesture](), Newcomers[Alarm]()

    @property
    def lost(self) -> int:
        """Frames that could not be sent."""
        return self._client.lost

    @property
    def status(self) -> str:
        """One sentence for the user."""
        return self._client.status

    def __enter__(self) -> OscTouches:
        """Leave the socket open for the block."""
        return self

    def __exit__(self, *error: object) -> None:
        """End all notes and close the socket."""
        if self._playing and (notes := list(self._notes((), inf))):
            self._client.send(bundle(notes))
        self._client.close()

    def __call__(self, snapshot: Snapshot) -> None:
        """Send a frame; never waits, and a frame that cannot go is lost."""
        parts = [*self._touches(snapshot), *self._happened(snapshot)]
        if self._playing:
            parts += self._notes(snapshot.touches, snapshot.captured)
        self._client.send(bundle(parts))

    def _touches(self, snapshot: Snapshot) -> Iterator[bytes]:
        yield message(f"{self._prefix}/count", len(snapshot.touches))
        for mark in snapshot.touches:
            name = -1 if mark.identity is None else mark.identity
            numbers = mark.x, mark.y, mark.force, max(mark.sigma[:2]), mark.sigma_force
            yield message(f"{self._prefix}/touch", name, *map(float, numbers))

    def _happened(self, snapshot: Snapshot) -> Iterator[bytes]:
        for event in snapshot.events:
            numbers = event.x, event.y, event.force
            yield message(f"{self._prefix}/event", event.kind, event.identity, *map(float, numbers))
        for one in self._new_gestures(snapshot.gestures):
            numbers = one.x, one.y, one.value, one.angle
            yield message(f"{self._prefix}/gesture", one.kind, *map(float, numbers))
        for alarm in self._new_alarms(snapshot.alarms):
            yield message(f"{self._prefix}/alarm", alarm.kind, alarm.sentence)

    def _notes(self, touches: tuple[Mark, ...], time: float) -> Iterator[bytes]:
        if self._playing is None:
            return
        self._playing, notes = self._playing.after(touches, time)
        for note in notes:
            yield message(f"{self._prefix}/note", note.pitch, note.velocity)
