"""The app on an emulated bench to which faults happen, and what becomes of it, for `faults`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import connect

import fe
from rig.projector.markers import fit_plate
from rig.report.figure import Figure, at_most
from rig.studies.bench.emulated import (
    RATE,
    Display,
    Listener,
    Room,
    emulated_camera,
    free_port,
    keep_lens_and_pose,
    scene_of,
    touchplate,
    twin_of,
)
from rig.studies.study import Cell, line

TOUCH = fe.Touch(100.0, 140.0, 3.0)
NEAR, FAR = 8.0, 25.0  # mm: found again; somewhere else
HOLD, PATIENCE = 2.5, 30.0  # s that a fault lasts; that the touch may take to come back
USUAL = {"one touch"}


TABLE = "Faults"
BACK, NONE = at_most(PATIENCE), at_most(0)


def measured(
    fault: str, sees: str, back: float | None, heard: list[dict[str, Any]], **more: Cell
) -> Iterator[Figure]:
    """Make the line of a fault: `back` in s, None where the touch never came back."""
    return line(
        TABLE,
        fault,
        what_the_user_sees=sees,
        back=(inf if back is None else back, "s", BACK),
        false_touches=(sum(map(wrong, heard)), "frames", NONE, len(heard)),
        **more,
    )


class Bench:
    """The app, and what stands round it."""

    def __init__(self, folder: Path, size: int, parts: ExitStack):
        self.folder, self.size, self._parts = folder, size, parts
        self.display = Display(folder)
        parts.callback(self.display.unplug)
        truth = fit_plate((1280, 800), (254.0, 254.0)).T_px_plate
        self.room = Room(twin_of(size), self.display, folder / "images", truth)
        self.room.start()
        parts.callback(self.room.close)
        self.camera = parts.enter_context(emulated_camera((size, size), folder / "images"))
        self.page, stream = free_port(), free_port()
        changes = f'[page]\nport = {self.page}\nviewers = "machine"\n'
        self.scene = scene_of(folder, self.display, stream, size, changes)
        keep_lens_and_pose(self.scene, self.room.camera)
        self.record = folder / "session.h5"
        self.listener = Listener(stream)

    def start(self) -> None:
        """Start the app and wait for its first frames; then the finger presses."""
        errors = (self.folder / "errors").open("w")
        self.app = touchplate(
            self.camera, "run", self.scene, "--record", self.record, "--json", stderr=errors
        )
        self._parts.callback(self.app.kill)
        self.listener.start()
        wait(lambda: bool(self.listener.heard) or self.app.poll() is not None, 120)
        if self.app.poll() is not None:
            raise OSError((self.folder / "errors").read_text())
        self.room.begin(lambda seconds: (TOUCH,), 1 / RATE)
        if self.back(time.monotonic(), 60) is None:
            last = self.heard(0.0)[-1:]
            said = (self.folder / "errors").read_text()
            raise OSError(f"the touch was never found: {self.app.poll()}, {said}, {last}")

    def heard(self, since: float) -> list[dict[str, Any]]:
        """Return what the app has reported since a time."""
        return [said for came, said in list(self.listener.heard) if came >= since]

    def back(self, since: float, patience: float = PATIENCE) -> float | None:
        """Wait until the touch is found three times in a row; s, None if it is not."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            if (last := self.heard(since)[-3:]) and len(last) == 3 and all(map(good, last)):
                return time.monotonic() - since
            time.sleep(0.02)
        return None

    def notes(self) -> list[str]:
        """Return what the page says beside the frame."""
        with connect(f"ws://127.0.0.1:{self.page}/stream", max_size=None) as client:
            client.send("")
            return json.loads(client.recv(timeout=20))["notes"]

    def windows(self) -> list[int]:
        """Return the processes of the projector's window."""
        children = Path(f"/proc/{self.app.pid}/task/{self.app.pid}/children").read_text().split()
        return [pid for pid in map(int, children) if "spawn_main" in command_of(pid)]

    def lit(self) -> bool:
        """Whether a mark is lit on the touch."""
        _, touches, places = self.room.seen[-1]
        return bool(len(touches) and np.isfinite(places).all())

    def episode(
        self, fault: str, make: Callable[[], object], undo: Callable[[], object], hold: float = HOLD
    ) -> Iterator[Figure]:
        """Let a fault happen and see what becomes of it."""
        if self.app.poll() is not None:
            raise OSError((self.folder / "errors").read_text())
        began = time.monotonic()
        make()
        time.sleep(hold)
        sees = self.sees(began)
        undo()
        undone = time.monotonic()
        back = self.back(undone)
        heard = self.heard(began)
        time.sleep(0.5)
        yield from measured(fault, sees or "nothing: the touch stays", back, heard)

    def sees(self, since: float) -> str:
        """Sum up what was reported since a time, the usual left out."""
        said = [one["status"] for one in self.heard(since)]
        other = [status for status in dict.fromkeys(said) if status not in USUAL]
        return "; ".join(f"“{status}”" for status in other[:2])

    def projector(
        self, fault: str, make: Callable[[], object], undo: Callable[[], object]
    ) -> Iterator[Figure]:
        """Let a fault of the projector happen; it is back when another window lights the touch."""
        began, before = time.monotonic(), self.windows()
        notes: dict[str, None] = {}
        make()
        while time.monotonic() < began + 1.5:
            notes |= dict.fromkeys(note for note in self.notes() if "projector" in note)
            time.sleep(0.2)
        undo()
        undone = began if undo is nothing else time.monotonic()
        lit = wait(lambda: self.windows() not in ([], before) and self.lit(), PATIENCE)
        back = time.monotonic() - undone
        notes |= dict.fromkeys(note for note in self.notes() if "projector" in note)
        time.sleep(1.0)
        heard = self.heard(began)
        gap = float(max((b["captured"] - a["captured"] for a, b in pairwise(heard)), default=0.0))
        sees = "; ".join(f"“{note}”" for note in list(notes)[:2]) or "nothing on the page"
        yield from measured(fault, sees, back if lit else None, heard, longest_gap=(gap, "s"))


def good(said: dict[str, Any]) -> bool:
    """Whether exactly the touch that presses is reported."""
    marks = said["touches"]
    return len(marks) == 1 and away(marks[0]) < NEAR


def wrong(said: dict[str, Any]) -> bool:
    """Whether a touch is reported where nobody presses."""
    marks = said["touches"]
    return len(marks) > 1 or any(away(mark) > FAR for mark in marks)


def away(mark: dict[str, float]) -> float:
    """Distance of a mark from the touch, mm."""
    return float(np.hypot(mark["x"] - TOUCH.x, mark["y"] - TOUCH.y))


def wait(condition: Callable[[], object], patience: float) -> bool:
    """Wait until something is so; whether it came to that."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.05)
    return False


def command_of(pid: int) -> str:
    """Return the command line of a process, nothing where there is none."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""


def nothing() -> None:
    """Undo nothing."""
