"""The app on an emulated bench to which faults happen, and what becomes of it, for `faults`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from websockets.sync.client import connect

import fe
from rig.projector.markers import fit_plate
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

TOUCH = fe.Touch(100.0, 140.0, 3.0)
NEAR, FAR = 8.0, 25.0  # mm: found again; somewhere else
HOLD, PATIENCE = 2.5, 30.0  # s that a fault lasts; that the touch may take to come back
USUAL = {"one touch"}


@dataclass(frozen=True)
class Row:
    """A line of the table."""

    fault: str
    sees: str
    back: str
    false: str


class Bench:
    """The app, and what stands round it."""

    def __init__(self, folder: Path, size: int, parts: ExitStack):
        self.folder, self.size, self._parts = folder, size, parts
        self.display = Display(folder)
        parts.callback(self.display.unplug)
        truth = fit_plate((1280, 800), (254.0, 254.0)).T_px_plate
        self.room = Room(twin_of(size), self.display, folder / "pictures", truth)
        self.room.start()
        parts.callback(self.room.close)
        self.camera = parts.enter_context(emulated_camera((size, size), folder / "pictures"))
        self.page, stream = free_port(), free_port()
        changes = f"[page]\nport = {self.page}\n"
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
        wait(lambda: self.listener.heard or self.app.poll() is not None, 120)
        if self.app.poll() is not None:
            raise OSError((self.folder / "errors").read_text())
        self.room.begin(lambda seconds: (TOUCH,), 1 / RATE)
        if self.back(time.monotonic(), 60) is None:
            last = self.heard(0.0)[-1:]
            said = (self.folder / "errors").read_text()
            raise OSError(f"the touch was never found: {self.app.poll()}, {said}, {last}")

    def heard(self, since: float) -> list[dict]:
        """Return what the app has told since a time."""
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
    ) -> Row:
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
        told = self.heard(began)
        false = sum(wrong(said) for said in told)
        time.sleep(0.5)
        return Row(
            fault,
            sees or "nothing: the touch stays",
            "never" if back is None else f"{back:.1f} s",
            f"{false} of {len(told)} frames",
        )

    def sees(self, since: float) -> str:
        """Sum up what was told since a time, the usual left out."""
        said = [one["status"] for one in self.heard(since)]
        other = [status for status in dict.fromkeys(said) if status not in USUAL]
        return "; ".join(f"“{status}”" for status in other[:2])

    def projector(self, fault: str, make: Callable[[], object], undo: Callable[[], object]) -> Row:
        """Let a fault of the projector happen; it is back when another window lights the touch."""
        began, notes, before = time.monotonic(), {}, self.windows()
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
        told = self.heard(began)
        gap = max(np.diff([said["captured"] for said in told]), default=0.0)
        return Row(
            fault,
            "; ".join(f"“{note}”" for note in list(notes)[:2]) or "nothing on the page",
            f"{back:.1f} s" if lit else "never",
            f"{sum(map(wrong, told))} of {len(told)} frames, {gap:.2f} s apart at most",
        )


def good(said: dict) -> bool:
    """Whether exactly the touch that presses is told."""
    marks = said["touches"]
    return len(marks) == 1 and away(marks[0]) < NEAR


def wrong(said: dict) -> bool:
    """Whether a touch is told where nobody presses."""
    marks = said["touches"]
    return len(marks) > 1 or any(away(mark) > FAR for mark in marks)


def away(mark: dict) -> float:
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
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""


def nothing() -> None:
    pass
