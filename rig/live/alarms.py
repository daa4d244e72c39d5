"""Alarms: what is beyond a bound of the scene, frame by frame."""

from __future__ import annotations

import shutil
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from rig.live.snapshot import Alarm, Snapshot
from rig.system.newcomers import Newcomers

if TYPE_CHECKING:
    from rig.scene.alarms import AlarmsSection

STAYS = 3.0  # s that an alarm stays when its reason has gone: nobody looks all the time
MINUTE = 60.0  # s over which dropped frames are counted
LOOKS = 5.0  # s between two looks at the disk
MB = 2**20


def free_space() -> int:
    """Bytes that are free where the run was started; none where that is gone, as a stick may be."""
    try:
        return shutil.disk_usage(".").free
    except OSError:
        return 0


class Alarms:
    """Call it with each snapshot: gives it with the alarms that stand.

    Parameters
    ----------
    section : AlarmsSection
    clock : callable
        Monotonic time, s.
    free : callable
        Bytes that are free on the disk.
    """

    def __init__(
        self,
        section: AlarmsSection,
        clock: Callable[[], float] = time.monotonic,
        free: Callable[[], int] = free_space,
    ):
        self._section, self._clock, self._free = section, clock, free
        self._standing: dict[str, tuple[Alarm, float]] = {}  # and until when
        self._fresh = self._looked = -float("inf")
        self._space = 0
        self._dropped = deque[tuple[float, int]]()

    def __call__(self, snapshot: Snapshot) -> Snapshot:
        """Give the snapshot with its alarms."""
        now = self._clock()
        self._standing = {kind: one for kind, one in self._standing.items() if one[1] >= now}
        for kind, sentence in self._reasons(snapshot, now):
            begun = self._standing[kind][0].time if kind in self._standing else snapshot.captured
            self._standing[kind] = Alarm(kind, begun, sentence), now + STAYS
        return replace(snapshot, alarms=tuple(alarm for alarm, _ in self._standing.values()))

    def _reasons(self, snapshot: Snapshot, now: float) -> Iterator[tuple[str, str]]:
        """Give kind and sentence of each bound that is crossed now."""
        section = self._section
        hardest = max((mark.force for mark in snapshot.touches), default=0.0)
        if section.force is not None and hardest > section.force:
            said = f"a touch presses with {hardest:.2f} N, more than {section.force:g} N; lift it"
            yield "force", said
        silent = self._silent(snapshot, now)
        if section.silence is not None and silent > section.silence:
            yield "silence", f"no frame came for {silent:.1f} s; see to the camera and its cable"
        if section.disk is not None and (space := self._megabytes(now)) < section.disk:
            yield "disk", f"{space} MB are free, less than {section.disk} MB; free space"
        lost = self._lost(snapshot, now)
        if section.dropped is not None and lost > section.dropped:
            yield "dropped", f"{lost} frames were dropped in a minute; close other programs"

    def _silent(self, snapshot: Snapshot, now: float) -> float:
        """Time since the last new frame, s."""
        if snapshot.fresh or self._fresh == -float("inf"):
            self._fresh = now
        return now - self._fresh

    def _megabytes(self, now: float) -> int:
        """Free space, looked at now and then."""
        if now - self._looked >= LOOKS:
            self._looked, self._space = now, self._free() // MB
        return self._space

    def _lost(self, snapshot: Snapshot, now: float) -> int:
        """Frames that were dropped in the last minute."""
        if not self._dropped or snapshot.dropped != self._dropped[-1][1]:
            self._dropped.append((now, snapshot.dropped))
        while len(self._dropped) > 1 and self._dropped[1][0] < now - MINUTE:
            self._dropped.popleft()
        return snapshot.dropped - self._dropped[0][1]


def says_new(say: Callable[[str], object]) -> Callable[[Snapshot], None]:
    """Return what takes snapshots and says the sentence of each alarm that begins."""
    new = Newcomers[Alarm]()

    def look(snapshot: Snapshot) -> None:
        for alarm in new(snapshot.alarms):
            say(alarm.sentence)

    return look


def watched(snapshots: Iterable[Snapshot], section: AlarmsSection | None) -> Iterator[Snapshot]:
    """Give snapshots with their alarms, where the scene has bounds."""
    return iter(snapshots) if section is None else map(Alarms(section), snapshots)
