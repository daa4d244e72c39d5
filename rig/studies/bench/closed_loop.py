"""The closed loop: a plate is seen, touches are found and lit, and their light is seen again.

Parts: loop. See `emulated`. Projector and latency are measured first, by the app itself in the same
loop. Reported are how far from each touch its mark lies on the plate at that moment, also by what
the touch does; frames a second; how old what is shown is; memory. Then a finger taps for a minute,
each time elsewhere and at once with all of its force: touch to light is the time from the exposure
with which it comes until light is seen within `REACH` of it; a tap that is never lit counts as
infinite.
"""

from __future__ import annotations

import json
import os
import signal
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fe
from rig.calibration import store
from rig.projector.markers import project
from rig.report.figure import Bar, Figure, at_least, at_most
from rig.sources import script
from rig.studies.bench.emulated import (
    RATE,
    Display,
    Emulation,
    Listener,
    Room,
    emulated_camera,
    free_port,
    keep_lens_and_pose,
    scene_of,
    touchplate,
    twin_of,
)
from rig.studies.study import line, part, run

MINUTES, SIZE = 10.0, 1024  # size of an image in px
TABLE = f"The closed loop, {MINUTES:g} minutes, calibrated by itself"
SETTLED = 20.0  # s after which memory must be flat
Touches = tuple[fe.Touch, ...]
Exposed = tuple[float, Touches, NDArray[np.float64]]
"""When a frame was exposed, its touches, and where the light of their marks fell."""
Heard = tuple[float, dict[str, Any]]
"""When a message of the app came, and what it said."""
TAPPED = 60.0  # s of taps
HELD, LIFTED = 0.5, 0.4  # s of each, and to the next
TAPS = ((60, 70), (190, 180), (70, 190), (185, 60), (125, 125), (200, 125), (65, 130), (130, 200))
"""Where they are, one after the other, mm: farther from each other than light counts."""
HARD = 2.0  # N
LOOK = 0.002  # s from one look at the projector's light to the next
SPAN, STILL = 0.3, 1.0  # s and mm: a touch that has gone less far is still, less round moves on
# The projector hangs a little askew.
T_TRUE = np.array([[2.82, 0.06, 268.0], [0.03, -2.80, 752.0], [2e-5, -3e-5, 1.0]])


def loop() -> Iterator[Figure]:
    """Run the loop; projector and latency are measured in it first."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        display = Display(folder)
        room = Room(twin_of(SIZE), display, folder / "images", T_TRUE)
        room.start()
        try:
            with emulated_camera((SIZE, SIZE), folder / "images") as camera:
                port = free_port()
                scene = scene_of(folder, display, port, SIZE)
                yield from calibrate(scene, room, camera)
                yield from follow(scene, room, camera, Listener(port))
        finally:
            room.close()
            display.unplug()


def calibrate(scene: Path, room: Room, camera: Emulation) -> Iterator[Figure]:
    """Keep the true lens and pose; measure projector and latency."""
    path = store.beside(scene)
    keep_lens_and_pose(scene, room.camera)
    for what in ("projector", "latency"):
        app = touchplate(camera, "calibrate", what, scene, "--json")
        out, said = app.communicate(timeout=300)
        if app.returncode:
            raise OSError(f"calibrate {what}: {said.strip().splitlines()[-1]}")
        yield from line(TABLE, f"calibrate {what}: error", measured=json.loads(out)["error"])
    grid = np.stack(np.meshgrid(np.linspace(5, 249, 9), np.linspace(5, 249, 9)), -1).reshape(-1, 2)
    known = store.read_calibration(path)
    shown = project(part(known.screen()).T_px_plate, grid)
    away = np.linalg.norm(project(np.linalg.inv(T_TRUE), shown) - grid, axis=1)
    latency = part(known.latency)
    worst = float(away.max()), "mm", at_most(0.3)
    yield from line(TABLE, "projector off by, at most", measured=worst)
    strength = part(known.projector).strength, "of the room's light"
    yield from line(TABLE, "strength of the projector, truth 1", measured=strength)
    times = 1e3 * latency.median, "ms, median"
    yield from line(TABLE, "latency", measured=times, p95=(1e3 * latency.p95, "ms"))


def follow(scene: Path, room: Room, camera: Emulation, listener: Listener) -> Iterator[Figure]:
    """Run the app while the tour of touches goes round, then a finger that taps."""
    app = touchplate(camera, "run", scene, "--json")
    listener.start()
    while not listener.heard:
        if app.poll() is not None:
            raise OSError(part(app.stderr).read())
        time.sleep(0.1)
    time.sleep(2.0)
    room.begin(script.tour((254.0, 254.0)), script.TOUR_LENGTH)
    begun, seconds = time.monotonic(), 60 * MINUTES
    memory: list[tuple[float, int]] = []
    room.late = 0
    while time.monotonic() - begun < seconds and app.poll() is None:
        memory.append((time.monotonic() - begun, resident(app.pid)))
        time.sleep(1.0)
    late, frames, heard = room.late, list(room.seen), list(listener.heard)
    room.begin(taps, len(TAPS) * (HELD + LIFTED))
    lit = lights(room, TAPPED)
    if app.poll() is None:
        os.killpg(app.pid, signal.SIGINT)
    out, said = app.communicate(timeout=60)
    if app.returncode:
        raise OSError(f"the app has ended: {said}")
    yield from of_the_marks(frames, heard, begun, seconds)
    yield from of_the_app(json.loads(out[out.index("{") :]), heard, begun)
    middle = 1e3 * float(np.median(lit)), "ms, median", at_most(60.0), len(lit)
    late_light = 1e3 * float(np.percentile(lit, 95, method="higher")), "ms"
    yield from line(TABLE, "closed loop", touch_to_light=middle, p95=late_light)
    flat = np.array([size for at, size in memory if at > min(SETTLED, seconds / 3)])
    growth = 100 * float(flat.max() / flat[0] - 1), "%, at most", at_most(5.0)
    yield from line(TABLE, "memory grows by", measured=growth)
    yield from line(TABLE, "memory", measured=(float(flat[0]) / 2**20, "MB"))
    left_out = 100 * late / (RATE * seconds), "%", None, round(RATE * seconds)
    yield from line(TABLE, "frames that the renderer left out", measured=left_out)


def taps(now: float) -> Touches:
    """Press one place after the other, each at once and evenly."""
    turn, age = divmod(now, HELD + LIFTED)
    x, y = TAPS[int(turn) % len(TAPS)]
    return (fe.Touch(float(x), float(y), HARD),) if age < HELD else ()


def lights(room: Room, seconds: float) -> list[float]:
    """Time from the exposure with which each touch comes until light is seen at it, s."""
    end, place = time.monotonic() + seconds, None
    came, lit = 0.0, list[float]()
    while (now := time.monotonic()) < end:
        exposed, touches, _ = room.seen[-1]
        there = (touches[0].x, touches[0].y) if touches else None
        if there and there != place:
            came = exposed
            lit.append(np.inf)
        place = there
        if there and np.isinf(lit[-1]) and room.lit_at(there):
            lit[-1] = time.monotonic() - came
        time.sleep(max(0.0, now + LOOK - time.monotonic()))
    return lit


def of_the_marks(
    exposed: list[Exposed], heard: list[Heard], begun: float, seconds: float
) -> Iterator[Figure]:
    """Yield where marks were lit."""
    frames = [one for one in exposed if begun + 2 < one[0] < begun + seconds]
    phases = by_phase(frames)
    every = np.concatenate([np.array(gaps) for gaps in phases.values()])
    yield from quantiles("mark to touch", every, (at_most(2.0), at_most(4.0)))
    for name, gaps in sorted(phases.items()):
        yield from quantiles(f"mark to touch, {name}", np.array(gaps))
    found = [gap for one in heard for gap in missed(frames, *one)]
    yield from quantiles("touch as found, where it was when it was seen", np.array(found))


def of_the_app(figures: dict[str, Any], heard: list[Heard], begun: float) -> Iterator[Figure]:
    """Yield how fast the app was."""
    ages = np.array([came - said["captured"] for came, said in heard if came > begun])
    rate = figures["fps"], "frames/s", at_least(30.0)
    oldest = 1e3 * float(ages.max()), "ms", at_most(100.0), len(ages)
    yield from line(TABLE, "closed loop", rate=rate, oldest_frame=oldest)
    middle = 1e3 * float(np.median(ages)), "ms, median"
    dropped = figures["dropped"], "frames"
    yield from line(TABLE, "age of touches when sent", measured=middle, dropped=dropped)
    latency = figures["latency_ms"]
    yield from line(
        TABLE,
        "capture to touches",
        measured=(latency["median"], "ms, median"),
        p95=(latency["p95"], "ms"),
    )


def by_phase(frames: list[Exposed]) -> dict[str, list[float]]:
    """Distances of marks from touches of 0.5 N or more, mm, by what the touches do."""
    times = np.array([one[0] for one in frames])
    found: defaultdict[str, list[float]] = defaultdict(list)
    for now, touches, lit in frames:
        middle, early = (frames[np.searchsorted(times, now - age)][1] for age in (SPAN / 2, SPAN))
        for index, touch in enumerate(touches):
            if touch.force >= 0.5:
                gap = np.hypot(*(lit[index] - (touch.x, touch.y)))
                found[phase(index, early, middle, touches)].append(float(gap))
    return found


def phase(index: int, early: Touches, middle: Touches, now: Touches) -> str:
    """Say what a touch does, from the touches at three times `SPAN` / 2 apart."""
    if not len(early) == len(middle) == len(now):
        return "another has come or gone" if len(now) > 1 or len(early) > 1 else "just come"
    a, b, c = (np.array([at[index].x, at[index].y]) for at in (early, middle, now))
    if np.hypot(*(c - a)) < STILL:
        return "still"
    return "moving" if np.hypot(*(c - 2 * b + a)) < STILL else "turning"


def missed(frames: list[Exposed], came: float, said: dict[str, Any]) -> list[float]:
    """Distances of the touches found in a frame from those that were there, mm."""
    times = np.array([one[0] for one in frames])
    # The stamp has whole microseconds.
    before = frames[max(int(np.searchsorted(times, float(said["captured"]) + 1e-3)) - 1, 0)][1]
    marks = said["touches"]
    if said["captured"] < times[0] or len(before) != len(marks):
        return []
    return [
        min(float(np.hypot(mark["x"] - touch.x, mark["y"] - touch.y)) for mark in marks)
        for touch in before
        if touch.force >= 0.5
    ]


def quantiles(
    what: str, away: NDArray[np.float64], bars: tuple[Bar | None, Bar | None] = (None, None)
) -> Iterator[Figure]:
    """Make the line of some distances, mm; NaN where nothing was lit."""
    there = away[np.isfinite(away)]
    middle, late = np.percentile(there, (50, 95)).tolist() if len(there) else (np.inf, np.inf)
    return line(
        TABLE,
        what,
        measured=(middle, "mm, median", bars[0], len(there)),
        p95=(late, "mm", bars[1], len(there)),
        not_lit=(100 * (1 - len(there) / max(len(away), 1)), "%"),
    )


def resident(pid: int) -> int:
    """Memory of the app itself, bytes."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


PARTS = {"loop": loop}

if __name__ == "__main__":
    run(PARTS, __doc__)
