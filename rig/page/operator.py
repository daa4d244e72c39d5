"""What an operator sees beside the frames, and what he may ask for while the loop runs."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, get_args

from rig.live.notice import Notice
from rig.live.snapshot import Snapshot
from rig.page.controls import UNITS, Measured, PageControls, PageSetting, Recording
from rig.projector.modes import Mode

if TYPE_CHECKING:
    from rig.calibration.store import Calibration
    from rig.page import Publisher
    from rig.page.files import Files
    from rig.projector.meter import Meter
    from rig.projector.show import Show
    from rig.recording.control import Switch

MODE = "projector.mode"


class Operator:
    """Call it with each snapshot: does what was asked for, and gives the page what it shows.

    Parameters
    ----------
    publisher : Publisher
    switch : Switch
        Of the recording.
    calibration : Calibration
    notes : tuple of str
        What is old or wrong in it, a sentence each.
    show : Show or None
        The projector, where there is one.
    meter : Meter or None
        Of its light.
    tare : callable
        Renews the reference.
    weigh : callable
        Awaits a known weight, N; raises ValueError where there can be none.
    files : Files or None
        Where snapshots and tables of touches go, and what plays recordings.
    """

    def __init__(
        self,
        publisher: Publisher,
        switch: Switch,
        calibration: Calibration,
        notes: tuple[str, ...],
        show: Show | None = None,
        meter: Meter | None = None,
        tare: Callable[[], object] = lambda: None,
        weigh: Callable[[float], object] = lambda force: None,
        files: Files | None = None,
    ):
        self._publisher, self._switch = publisher, switch
        self._notes, self._measured = notes, measured(calibration, datetime.now(UTC))
        self._show, self._meter = show, meter
        self._snapshot: Snapshot | None = None
        self._wishes: dict[str, Callable[[dict[str, Any]], object]] = {
            "record": lambda wish: switch.toggle(),
            "set": self._set,
            "tare": self._tare,
            "weigh": self._weigh,
        }
        if files:
            self._wishes |= {
                "snapshot": self._keep,
                "csv": lambda wish: files.table.toggle(),
                "recordings": lambda wish: files.playback.look(),
                "playback": self._play,
            }
        publisher.takes = tuple(self._wishes)
        self._renew = tare
        self._await_weight, self._refused = weigh, Notice()
        self._files = files

    def __call__(self, snapshot: Snapshot) -> None:
        """Follow a snapshot."""
        self._snapshot = snapshot
        for wish in self._publisher.asked():
            if act := self._wishes.get(wish["do"]):
                act(wish)
        if self._files:
            self._files.table(snapshot)
        shown = self._show.content(snapshot) if self._show else None
        if self._meter and shown is not None and (begun := self._switch.begun):
            self._meter.measure(snapshot, shown, begun.chain)
        self._publisher.publish(snapshot, self._controls(snapshot), shown)

    def _tare(self, wish: dict[str, Any]) -> None:
        """Set what is shown back, and renew the reference unless that was all."""
        if not (self._show and self._snapshot and self._show.tare(self._snapshot)):
            self._renew()

    def _weigh(self, wish: dict[str, Any]) -> None:
        """Await a known weight; what is none is refused in a note."""
        force = wish.get("force")
        self._refused.say("")
        try:
            if not isinstance(force, int | float) or isinstance(force, bool):
                raise ValueError(f"known weight must be a number in N, got {force!r}")
            self._await_weight(float(force))
        except ValueError as error:
            self._refused.say(str(error))

    def _play(self, wish: dict[str, Any]) -> None:
        """Play a recording; one that is not listed is refused in a note."""
        self._refused.say("")
        try:
            if self._files:
                self._files.playback.play(str(wish.get("name")))
        except (OSError, ValueError) as error:
            self._refused.say(str(error))

    def _keep(self, wish: dict[str, Any]) -> None:
        """Keep the snapshot that is shown."""
        if self._files and self._snapshot:
            self._files.keep(self._snapshot)

    def _set(self, wish: dict[str, Any]) -> None:
        if self._show and wish.get("key") == MODE and wish.get("value") in self._modes():
            self._show.mode = wish["value"]

    def _modes(self) -> tuple[str, ...]:
        """Modes that can be changed to: whether the window blinks is decided when it opens."""
        if self._show is None or self._show.mode == "dark":
            return ()
        return tuple(mode for mode in get_args(Mode) if mode != "dark")

    def _controls(self, snapshot: Snapshot) -> PageControls:
        notes = [alarm.sentence for alarm in snapshot.alarms]
        notes += [snapshot.notice] if snapshot.notice else []
        if self._files and (kept := self._files.notice.at(snapshot.captured)):
            notes.append(kept)
        notes += self._notes
        if self._show and self._show.trouble:
            notes.append(self._show.trouble)
        if self._meter and self._meter.sentence:
            notes.append(self._meter.sentence)
        if refused := self._refused.at(snapshot.captured):
            notes.append(refused)
        if self._switch.refusal:
            notes.append(self._switch.refusal)
        settings = ()
        if modes := self._modes():
            settings = (PageSetting(MODE, "Marks", self._show.mode if self._show else "", modes),)
        parts = tuple(notes), self._recording(), settings, self._measured
        recordings = self._files.playback.state() if self._files else None
        return PageControls(*parts, table=self._table(), recordings=recordings)

    def _table(self) -> str | None:
        """Name of the table that is written; empty while none is, None where none can be."""
        if self._files is None:
            return None
        return str(self._files.table.path or "")

    def _recording(self) -> Recording:
        said = self._switch.summary()
        if said is None:
            return Recording(False, "Nothing is recorded", 0, 0)
        return Recording(True, said["status"], said["frames"], said["dropped"])


def measured(calibration: Calibration, now: datetime) -> tuple[Measured, ...]:
    """List the parts of a calibration, with their age and error."""
    parts = ((name, getattr(calibration, name)) for name in type(calibration).model_fields)
    return tuple(
        Measured(name, (now - part.date).days, part.error, UNITS.get(name, "mm"))
        for name, part in parts
        if part
    )
