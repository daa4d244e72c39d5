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
from pathlib import Path

import numpy as np
from emulated_bench import (
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

from rig import script
from rig.calibration import store
from rig.calibration.projector import Light
from rig.markers import Screen, project

SETTLED = 20.0  # s after which memory must be flat
SPAN, STILL = 0.3, 1.0  # s and mm: a touch that has gone less far is still, less round moves on
# The projector hangs a little askew.
T_TRUE = np.array([[2.82, 0.06, 268.0], [0.03, -2.80, 752.0], [2e-5, -3e-5, 1.0]])


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--size", type=int, default=1024)
    options.add_argument("--calibrate", action="store_true")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        display = Display(folder)
        room = Room(twin_of(given.size), display, folder / "pictures", T_TRUE)
        room.start()
        try:
            with emulated_camera((given.size, given.size), folder / "pictures") as camera:
                port = free_port()
                scene = scene_of(folder, display, port, given.size)
                calibrate(scene, room, camera, given.calibrate)
                run(scene, room, camera, Listener(port), 60 * given.minutes)
        finally:
            room.close()
            display.unplug()


def calibrate(scene: Path, room: Room, camera, live: bool) -> None:
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
        figures = json.loads(out)
        print(f"calibrate {what}: error {figures['error']:.4g}")
    grid = np.stack(np.meshgrid(np.linspace(5, 249, 9), np.linspace(5, 249, 9)), -1).reshape(-1, 2)
    known = store.read(path)
    shown = project(known.screen().T_px_plate, grid)
    away = np.linalg.norm(project(np.linalg.inv(T_TRUE), shown) - grid, axis=1)
    latency = known.latency
    print(
        f"projector off by {away.max():.3f} mm at most, strength {known.projector.strength:.3f}"
        f" of 1, latency {1e3 * latency.median:.0f} ms, p95 {1e3 * latency.p95:.0f} ms"
    )


def run(scene: Path, room: Room, camera, listener: Listener, seconds: float) -> None:
    """Run the app while the tour of touches goes round, and print the figures."""
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
    report(json.loads(out[out.index("{") :]), room, listener, begun, seconds, memory)
    print(f"frames that the renderer was late with: {late} of {30 * seconds:.0f}")


def report(figures, room, listener, begun, seconds, memory) -> None:
    """Print what a run has shown."""
    frames = [one for one in room.seen if begun + 2 < one[0] < begun + seconds]
    phases = by_phase(frames)
    away = np.concatenate(list(phases.values()))
    print(f"mark to touch: {quantiles(away)} mm of {len(away)}")
    for name, part in sorted(phases.items()):
        print(f"  {name}: {quantiles(np.array(part))} mm of {len(part)}")
    found = [gap for heard in listener.heard for gap in missed(frames, *heard)]
    print(f"touch as found, where it was when it was seen: {quantiles(np.array(found))} mm")
    ages = np.array([came - said["captured"] for came, said in listener.heard if came > begun])
    print(
        f"app: {figures['fps']:.1f} frames a second, {figures['dropped']} dropped;"
        f" touches {1e3 * np.median(ages):.0f} ms old when sent, {1e3 * ages.max():.0f} at most"
    )
    print(f"capture to touches {figures['latency_ms']}")
    flat = np.array([size for at, size in memory if at > min(SETTLED, seconds / 3)])
    print(f"memory {flat[0] / 2**20:.0f} MB, {100 * (flat.max() / flat[0] - 1):+.1f} % at most"
          f" afterwards; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")  # fmt: skip


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
        f"median {np.median(there):.2f}, p95 {np.percentile(there, 95):.2f} ({missing:.1%} not lit)"
    )


def resident(pid: int) -> int:
    """Memory of the app itself, bytes."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    main()
