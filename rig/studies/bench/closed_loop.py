"""The closed loop: a plate is seen, touches are found and lit, and their light is seen again.

    python benchmarks/closed_loop.py [--minutes 10] [--size 512] [--calibrate]

See `emulated_bench`. With --calibrate projector and latency are measured first, by the app itself
in the same loop. Printed: how far from each touch its mark lies on the plate at that moment, also
by what the touch does; frames a second; how old what is shown is; memory.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rig.calibration import store
from rig.calibration.projector import Light
from rig.projector.markers import Screen, project
from rig.sources import script
from rig.studies.bench.emulated import (
    PROJECTOR,
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

SETTLED = 20.0  # s after which memory must be flat
SPAN, STILL = 0.3, 1.0  # s and mm: a touch that has gone less far is still, less round moves on
# The projector hangs a little askew.
T_TRUE = np.array([[2.82, 0.06, 268.0], [0.03, -2.80, 752.0], [2e-5, -3e-5, 1.0]])


Row = tuple[str, str]  # what, figure


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--size", type=int, default=1024)
    options.add_argument("--calibrate", action="store_true")
    given = options.parse_args()
    for what, figure in rows(given.minutes, given.size, given.calibrate):
        print(f"{what:<52s} {figure}", flush=True)


def rows(minutes: float, size: int, live: bool) -> Iterator[Row]:
    """Run the loop; `live` says whether projector and latency are measured in it first."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        display = Display(folder)
        room = Room(twin_of(size), display, folder / "pictures", T_TRUE)
        room.start()
        try:
            with emulated_camera((size, size), folder / "pictures") as camera:
                port = free_port()
                scene = scene_of(folder, display, port, size)
                yield from calibrate(scene, room, camera, live)
                yield from run(scene, room, camera, Listener(port), 60 * minutes)
        finally:
            room.close()
            display.unplug()


def calibrate(scene: Path, room: Room, camera, live: bool) -> Iterator[Row]:
    """Keep the true lens and pose; measure projector and latency, or keep the truth there too."""
    path = store.beside(scene)
    keep_lens_and_pose(scene, room.camera)
    if not live:
        store.keep(path, Light(Screen(PROJECTOR, T_TRUE), 0.3, 0.1, 1.0, 1.0, 51.0))
        return
    for what in ("projector", "latency"):
        app = touchplate(camera, "calibrate", what, scene, "--json")
        out, said = app.communicate(timeout=300)
        if app.returncode:
            raise OSError(f"calibrate {what}: {said.strip().splitlines()[-1]}")
        yield f"calibrate {what}: error", f"{json.loads(out)['error']:.4g}"
    grid = np.stack(np.meshgrid(np.linspace(5, 249, 9), np.linspace(5, 249, 9)), -1).reshape(-1, 2)
    known = store.read(path)
    shown = project(known.screen().T_px_plate, grid)
    away = np.linalg.norm(project(np.linalg.inv(T_TRUE), shown) - grid, axis=1)
    latency = known.latency
    yield "projector off by, at most", f"{away.max():.3f} mm"
    yield "strength of the projector", f"{known.projector.strength:.3f} of 1"
    yield "latency", f"{1e3 * latency.median:.0f} ms, p95 {1e3 * latency.p95:.0f} ms"


def run(scene: Path, room: Room, camera, listener: Listener, seconds: float) -> Iterator[Row]:
    """Run the app while the tour of touches goes round, and tell the figures."""
    app = touchplate(camera, "run", scene, "--json")
    listener.start()
    while not listener.heard:
        if app.poll() is not None:
            raise OSError(app.stderr.read())
        time.sleep(0.1)
    time.sleep(2.0)
    room.begin(script.tour((254.0, 254.0)), script.TOUR_LENGTH)
    begun, memory = time.monotonic(), []
    room.late = 0
    while time.monotonic() - begun < seconds and app.poll() is None:
        memory.append((time.monotonic() - begun, resident(app.pid)))
        time.sleep(1.0)
    late = room.late
    if app.poll() is None:
        os.killpg(app.pid, signal.SIGINT)
    out, said = app.communicate(timeout=60)
    if app.returncode:
        raise OSError(f"the app has ended: {said}")
    yield from of_the_marks(room, listener, begun, seconds)
    yield from of_the_app(json.loads(out[out.index("{") :]), listener, begun)
    flat = np.array([size for at, size in memory if at > min(SETTLED, seconds / 3)])
    yield "memory", f"{flat[0] / 2**20:.0f} MB, {100 * (flat.max() / flat[0] - 1):+.1f} % at most"
    yield "frames that the renderer left out", f"{late} of {30 * seconds:.0f}"


def of_the_marks(room: Room, listener: Listener, begun: float, seconds: float) -> Iterator[Row]:
    """Tell where marks were lit."""
    frames = [one for one in room.seen if begun + 2 < one[0] < begun + seconds]
    phases = by_phase(frames)
    yield "mark to touch", quantiles(np.concatenate(list(phases.values())))
    for name, part in sorted(phases.items()):
        yield f"mark to touch, {name}", quantiles(np.array(part))
    found = [gap for heard in listener.heard for gap in missed(frames, *heard)]
    yield "touch as found, where it was when it was seen", quantiles(np.array(found))


def of_the_app(figures: dict, listener: Listener, begun: float) -> Iterator[Row]:
    """Tell how fast the app was."""
    ages = np.array([came - said["captured"] for came, said in listener.heard if came > begun])
    yield "frames a second", f"{figures['fps']:.1f}, {figures['dropped']} dropped"
    yield (
        "age of touches when sent",
        f"median {1e3 * np.median(ages):.0f} ms, {1e3 * ages.max():.0f} ms at most",
    )
    for name, value in figures["latency_ms"].items():
        yield f"capture to touches, {name}", f"{value:.1f} ms"


def by_phase(frames) -> dict[str, list[float]]:
    """Distances of marks from touches of 0.5 N or more, mm, by what the touches do."""
    times, found = np.array([one[0] for one in frames]), defaultdict(list)
    for now, touches, lit in frames:
        middle, early = (frames[np.searchsorted(times, now - age)][1] for age in (SPAN / 2, SPAN))
        for index, touch in enumerate(touches):
            if touch.force >= 0.5:
                gap = np.hypot(*(lit[index] - (touch.x, touch.y)))
                found[phase(index, early, middle, touches)].append(float(gap))
    return found


def phase(index: int, early, middle, now) -> str:
    """Say what a touch does, from the touches at three times `SPAN` / 2 apart."""
    if not len(early) == len(middle) == len(now):
        return "another has come or gone" if len(now) > 1 or len(early) > 1 else "just come"
    a, b, c = (np.array([at[index].x, at[index].y]) for at in (early, middle, now))
    if np.hypot(*(c - a)) < STILL:
        return "still"
    return "moving" if np.hypot(*(c - 2 * b + a)) < STILL else "turning"


def missed(frames, came: float, said: dict) -> list[float]:
    """Distances of the touches found in a frame from those that were there, mm."""
    times = np.array([one[0] for one in frames])
    # The stamp has whole microseconds.
    before = frames[max(int(np.searchsorted(times, said["captured"] + 1e-3)) - 1, 0)][1]
    marks = said["touches"]
    if said["captured"] < times[0] or len(before) != len(marks):
        return []
    return [
        min(float(np.hypot(mark["x"] - touch.x, mark["y"] - touch.y)) for mark in marks)
        for touch in before
        if touch.force >= 0.5
    ]


def quantiles(away: np.ndarray) -> str:
    there = away[np.isfinite(away)]
    missing = 1 - len(there) / max(len(away), 1)
    if not len(there):
        return "none lit"
    return (
        f"median {np.median(there):.2f} mm, p95 {np.percentile(there, 95):.2f} mm"
        f" ({missing:.1%} of {len(away)} not lit)"
    )


def resident(pid: int) -> int:
    """Memory of the app itself, bytes."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    main()
