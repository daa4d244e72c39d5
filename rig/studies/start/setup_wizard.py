"""The setup from nothing to a calibrated bench, by scripted clicks on its page, in the twin.

Parts: wizard. The bench that the twin is differs from what is said of it, by a seed: lens, pose,
stiffness, projector, and a person's presses. Only the page is worked on, in a headless browser.
What the calibration then says of the plate, of the projector and of a press is compared with the
truth: the farthest place over the plate, and the root mean square of the force. A camera of ten
images a second is said, so that the twin can be drawn on a busy machine. A person's time is that of
the page, and 5 seconds for each click.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fe
from rig.calibration import store
from rig.calibration.store import Calibration
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.page import serve
from rig.projector.markers import project
from rig.report.figure import Figure, at_least, at_most
from rig.scene import Scene, load
from rig.scene.load import with_overrides
from rig.setup.bench import NOTHING, PersonAct
from rig.setup.page_desk import PAGE, PageDesk
from rig.setup.rehearsal import RehearsedBench
from rig.setup.run import set_up
from rig.setup.session import read_state, state_beside
from rig.setup.steps import STEPS
from rig.setup.true_bench import TrueBench
from rig.studies.start.hand import with_hands
from rig.studies.study import line, part, rms, run
from rig.system.timing import Stopwatch

TABLE, CASE = "From the box to a calibrated bench", "wizard in the twin"
SEEDS = tuple(int(seed) for seed in os.environ.get("SETUP_SEEDS", "1,2,3").split(","))
CHROMIUM = "/usr/bin/chromium"
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
RATE = "10"  # images a second, said on the page
PATIENCE = 900_000  # ms from one click to the next: steps that need none go on by themselves
PRESSES = 5  # of known weight on each bench, elsewhere than it was laid for the calibration
RANGE = (0.25, 0.75)  # of the plate's sides
FRAMES = 16  # of a press: as long as the weight lies for the calibration
INSIDE = 5.0  # mm from the edges, to where places are compared


@dataclass(frozen=True)
class Done:
    """A setup that was done: its scene, the truth, and what it took."""

    scene: Path
    truth: TrueBench
    clicks: int
    pages: int
    seconds: float


def wizard(seeds: tuple[int, ...] = SEEDS) -> Iterator[Figure]:
    """Set benches up, and compare what was found with what is."""
    plates: list[float] = []
    lights: list[float] = []
    forces: list[float] = []
    places: list[float] = []
    minutes: list[float] = []
    pages = 0
    for seed in seeds:
        with tempfile.TemporaryDirectory() as name:
            bench = RehearsedBench(seed)
            done = by_clicks(Path(name) / "rehearsal.toml", bench)
            known = store.calibration_beside(done.scene)
            scene = load(done.scene)
            plates.append(plate_error(scene, known, done.truth))
            lights.append(light_error(scene, known, done.truth))
            for place, force in press_errors(scene, known, bench, done):
                places.append(place)
                forces.append(force)
            minutes.append(with_hands(done.seconds, done.clicks))
            pages = done.pages
    count = len(seeds)
    yield from line(
        TABLE,
        CASE,
        steps=(pages, "", at_least(len(STEPS)), count),
        **{"a person's time": (max(minutes), "min", at_most(10), count)},
        plate=(max(plates), "mm", at_most(0.15), count),
        projector=(max(lights), "mm", at_most(0.3), count),
        force_after_one_known_weight=(100 * rms(forces), "%", at_most(2), len(forces)),
    )
    yield from line(
        TABLE,
        "presses of the known weight, elsewhere",
        largest_error_of_force=(100 * float(np.abs(forces).max()), "%", None, len(forces)),
        place=(rms(places), "mm, rms", None, len(places)),
    )


def by_clicks(path: Path, bench: RehearsedBench) -> Done:
    """Go through the whole setup on its page; nothing else is touched."""
    from playwright.sync_api import sync_playwright

    addresses: SimpleQueue[str] = SimpleQueue()

    def work() -> None:
        with serve(0) as publisher:
            addresses.put(publisher.address(PAGE))
            set_up(path, bench, PageDesk(publisher))

    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(PATIENCE)
        threading.Thread(target=work, daemon=True).start()
        begun = time.monotonic()
        page.goto(addresses.get())
        page.locator("[name=rate]").fill(RATE)
        shown, clicks = click_through(page)
        seconds = time.monotonic() - begun
        browser.close()
    return Done(path, bench.prepare(read_state(state_beside(path)).answers), clicks, shown, seconds)


def click_through(page: Any) -> tuple[int, int]:
    """Press what is usual wherever it is asked for; gives the steps gone through, and clicks."""
    clicks = 0
    while True:
        page.locator("body[data-link=lost], #buttons .usual").first.wait_for()
        if page.locator("body[data-link=lost]").count():
            return page.locator("#steps .done, #steps .now").count(), clicks
        turn = page.locator("body").get_attribute("data-turn")
        page.locator("#buttons .usual").click()
        clicks += 1
        changed = f"body[data-link=lost], body:not([data-turn='{turn}'])"
        page.locator(changed).wait_for(state="attached")


def grid(scene: Scene) -> NDArray[np.float64]:
    """Places over the plate, (N, 2) mm."""
    a, b = part(scene.plate).size
    along = np.linspace(INSIDE, a - INSIDE, 9), np.linspace(INSIDE, b - INSIDE, 8)
    return np.stack(np.meshgrid(*along), -1).reshape(-1, 2)


def plate_error(scene: Scene, known: Calibration, truth: TrueBench) -> float:
    """Farthest that a place on the plate is taken for another, mm."""
    xy, height = grid(scene), truth.camera.face_height(part(scene.plate).thickness)
    seen = truth.camera.project(np.column_stack([xy, np.full(len(xy), height)]))
    away = part(known.camera()).on_plate(seen, height) - xy
    return float(np.linalg.norm(away, axis=1).max())


def light_error(scene: Scene, known: Calibration, truth: TrueBench) -> float:
    """Farthest from a place that a mark for it falls, mm."""
    xy = grid(scene)
    shown = project(part(known.screen()).T_px_plate, xy)
    fallen = project(np.linalg.inv(truth.screen.T_px_plate), shown)
    return float(np.linalg.norm(fallen - xy, axis=1).max())


def press_errors(
    scene: Scene, known: Calibration, bench: RehearsedBench, done: Done
) -> Iterator[tuple[float, float]]:
    """Press with the weight elsewhere: errors of place, mm, and of force, as a fraction."""
    answers = read_state(state_beside(done.scene)).answers
    live = build_bench(with_overrides(scene, {"touches.max_touches": 1}), _nobody, known)
    rng = np.random.default_rng(77)
    with bench.open_source(scene) as source:
        bench.ask(NOTHING)
        rest = [part(source.grab(1.0)).image for _ in range(live.reference_frames)]
        chain = live.prepare(average_reference(rest))[0]
        for _ in range(PRESSES):
            x, y = rng.uniform(*RANGE, 2) * np.array(answers.size)
            bench.ask(PersonAct("press", fe.Touch(float(x), float(y), answers.weight)))
            images = [part(source.grab(1.0)) for _ in range(4 * FRAMES)][-FRAMES:]
            mean = np.mean([one.image for one in images], axis=0)
            found = estimate_frame(chain, mean, at_rest(chain), Stopwatch(time.monotonic)).estimate
            bench.ask(NOTHING)
            there = bench.pressed
            if found.count != 1 or there is None:
                yield float("inf"), float("inf")
                continue
            away = np.hypot(found.xy[0, 0] - there.x, found.xy[0, 1] - there.y)
            yield float(away), float(found.force[0] / there.force - 1)


def _nobody(done: int, total: int) -> None:
    """Report to nobody."""


PARTS = {"wizard": wizard}

if __name__ == "__main__":
    run(PARTS, __doc__)
