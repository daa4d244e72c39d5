"""The operator page in headless Chromium: frames drawn, how old they are, what the server costs.

Parts: page. It needs Chromium and Playwright. Frames of noise over speckle with a strain map, as
the scene `twin` has them, 30 a second. A frame's age is the time from its capture to the first
paint after it was drawn.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from shutil import which

import numpy as np
from playwright.sync_api import sync_playwright

from rig.live.snapshot import Mark, Snapshot, StrainOverlay
from rig.page import serve
from rig.page.server import Publisher
from rig.projector.markers import fit_plate, project
from rig.report.figure import Figure, at_least, at_most
from rig.studies.study import line, run

RATE = 30.0
SECONDS, SIZE = 20.0, 1024
PLATE = (254.0, 254.0)
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
WATCH = """
window.ages = [];
(function look(last) {
  const drawn = document.body?.dataset.drawn;
  if (drawn && drawn !== last) {
    window.ages.push(performance.timeOrigin + performance.now() - 1000 * (Number(drawn) + %f));
  }
  requestAnimationFrame(() => look(drawn));
})();
"""


def snapshots(size: int) -> list[Snapshot]:
    """Draw a second of frames."""
    rng = np.random.default_rng(0)
    coarse = rng.normal(size=(size // 4, size // 4)).repeat(4, 0).repeat(4, 1)
    T = fit_plate((size, size), PLATE, 0.02).T_px_plate
    corners = np.array([[0.0, 0.0], [PLATE[0], 0.0], PLATE, [0.0, PLATE[1]]])
    at = np.arange(16.0, size - 16, 16)
    shots: list[Snapshot] = []
    for number in range(int(RATE)):
        image = np.clip(128 + 45 * coarse + rng.normal(0, 2, coarse.shape), 0, 255)
        exx, eyy, exy = rng.normal(0, 2e-5, (3, len(at), len(at))).astype(np.float32)
        mark = Mark(100.0 + number, 120.0, 2.0, (1.0, 0.6, 0.3), 0.03)
        shots.append(Snapshot(
            number, 0.0, image.astype(np.uint8), PLATE, project(T, corners), T, (mark,), (), None,
            StrainOverlay(at, at, exx, eyy, exy, (2e-5, 2e-5, 2e-5)), "one touch", None, None, None,
            None, RATE, 0, (("correlate", 5.0, 7.0),), (8.0, 12.0), 2.0,
        ))  # fmt: skip
    return shots


def feed(publisher: Publisher, shots: list[Snapshot], end: threading.Event) -> None:
    """Publish frames at their rate, each stamped with the time."""
    start = time.monotonic()
    for number in range(10**9):
        if end.wait(max(0.0, start + number / RATE - time.monotonic())):
            return
        shot = shots[number % len(shots)]
        publisher.publish(replace(shot, sequence=number, captured=time.monotonic()))


def cpu_of(thread: str) -> float:
    """CPU seconds of a thread of this process, by its name."""
    found = next(one for one in threading.enumerate() if one.name == thread)
    stat = Path(f"/proc/self/task/{found.native_id}/stat").read_text().rpartition(")")[2].split()
    return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")


def page() -> Iterator[Figure]:
    """Watch the page for some time."""
    shots, end = snapshots(SIZE), threading.Event()
    with serve(0) as publisher, sync_playwright() as play:
        feeder = threading.Thread(target=feed, args=(publisher, shots, end))
        feeder.start()
        browser = play.chromium.launch(executable_path=which("chromium"), args=list(FLAGS))
        tab = browser.new_page(viewport={"width": 1400, "height": 900})
        tab.add_init_script(WATCH % (time.time() - time.monotonic()))
        tab.goto(publisher.url)
        tab.wait_for_timeout(3000)  # the first frames compile and lay out
        tab.evaluate("window.ages = []")
        began, cost = time.monotonic(), cpu_of("page")
        tab.wait_for_timeout(1000 * SECONDS)
        ages = np.array(tab.evaluate("window.ages"))
        taken, cost = time.monotonic() - began, cpu_of("page") - cost
        end.set()
        feeder.join()
        browser.close()
    yield from line(
        f"The page at {SIZE}² in headless Chromium",
        f"{RATE:g} frames a second for {SECONDS:g} s",
        drawn=(len(ages) / taken, "frames/s", at_least(25.0), len(ages)),
        age=(float(np.median(ages)), "ms, median", at_most(50.0), len(ages)),
        late_frame=(float(np.percentile(ages, 95)), "ms, p95"),
        oldest=(float(ages.max()), "ms", at_most(100.0), len(ages)),
        server=(100 * cost / taken, "% of a core", at_most(40.0)),
    )


PARTS = {"page": page}

if __name__ == "__main__":
    run(PARTS, __doc__)
