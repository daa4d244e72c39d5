"""A person's ten minutes: photographs, ROI, field, extensometer, table and image, on one page.

Parts: way. It needs Chromium and Playwright. The command is run as it is installed, on photographs
of a sheet with a hole that is pulled; a script has the hands. Time is that of the machine, and with
5 seconds for each click, key and drag of a person who must look and think.
"""

from __future__ import annotations

import csv
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

from rig.report.figure import Figure, at_most
from rig.studies.start.hand import with_hands
from rig.studies.start.pulled_sheet import PIXELS, RADIUS, PulledSheet, draw_sheet
from rig.studies.study import line, rms, run

FRAMES = 12
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
OUTER = ((20, 20), (779, 20), (779, 579), (20, 579))  # px, corners of the ROI
ENDS = (150, 300), (650, 300)  # px, of the extensometer: left and right of the hole
TABLE = "A person's ten minutes on the page"
_LONG = 120_000  # ms that the slowest step may take
Seen = Callable[[str], None]
"""Is called after each step with its name."""


class Hands:
    """Clicks, keys and drags on the image of a page, counted."""

    def __init__(self, page: Page) -> None:
        self.page, self.actions = page, 0

    def key(self, name: str) -> None:
        """Press a key."""
        self.page.keyboard.press(name)
        self.actions += 1

    def button(self, where: str) -> None:
        """Click on a control."""
        self.page.locator(where).click()
        self.actions += 1

    def click(self, place: tuple[float, float]) -> None:
        """Click on a px of the image."""
        self.page.mouse.click(*self._at(place))
        self.actions += 1

    def point(self, place: tuple[float, float]) -> None:
        """Bring the pointer over a px of the image."""
        self.page.mouse.move(*self._at(place))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from one px of the image to another."""
        self.point(start)
        self.page.mouse.down()
        self.page.mouse.move(*self._at(end), steps=12)
        self.page.mouse.up()
        self.actions += 1

    def save(self, where: str, folder: Path) -> Path:
        """Click on an export, and return the file that the browser has saved."""
        with self.page.expect_download() as found:
            self.button(where)
        path = folder / found.value.suggested_filename
        found.value.save_as(path)
        return path

    def _at(self, place: tuple[float, float]) -> tuple[float, float]:
        box = self.page.locator("#view-canvas").bounding_box()
        if box is None:
            raise OSError("the page shows no image; look at it in a browser")
        scale = min(box["width"] / PIXELS[0], box["height"] / PIXELS[1])
        left, top = box["width"] - PIXELS[0] * scale, box["height"] - PIXELS[1] * scale
        x, y = place
        return box["x"] + left / 2 + (x + 0.5) * scale, box["y"] + top / 2 + (y + 0.5) * scale


def walk(hands: Hands, address: str, sheet: PulledSheet, folder: Path, seen: Seen) -> list[Path]:
    """Go the whole way on a page; returns the table of the extensometer and the image."""
    page = hands.page
    page.goto(address)
    expect(page.locator("body")).to_have_attribute("data-ready", "yes", timeout=_LONG)
    seen("page")
    _draw_roi(hands, sheet)
    hands.button("#suggest")
    expect(page.locator("#setup-note")).to_have_text("", timeout=_LONG)
    hands.point((330, 180))
    seen("ROI and noise floor")
    hands.button("#correlate")
    expect(page.locator("body")).to_have_attribute("data-mode", "result", timeout=_LONG)
    seen("field")
    hands.key("e")
    hands.drag(*ENDS)
    expect(page.locator("#lengths-card")).to_be_visible(timeout=_LONG)
    seen("extensometer")
    table = hands.save('[data-file="readings.csv"]', folder)
    image = hands.save('[data-file="screen.png"]', folder)
    seen("table and image")
    return [table, image]


def _draw_roi(hands: Hands, sheet: PulledSheet) -> None:
    hands.key("r")
    for corner in OUTER:
        hands.click(corner)
    hands.key("Enter")
    hands.button("#hole")
    for x, y in sheet.circle(RADIUS + 0.6, 16).tolist():
        hands.click((x, y))
    hands.key("Enter")


@contextmanager
def served(images: Path, out: Path) -> Generator[str]:
    """Run `touchplate view` on a folder of images, and give the address of its page."""
    program = "from rig.cli import main; main()"
    words = [sys.executable, "-c", program, "view", str(images), "--out", str(out)]
    command = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    try:
        yield _address(command)
    finally:
        command.send_signal(signal.SIGINT)
        command.communicate(timeout=30)


def _address(command: subprocess.Popen[str]) -> str:
    for said in command.stderr or ():
        found = re.search(r"http://\S+", said)
        if found:
            return found[0]
    raise OSError("touchplate view ended before its page was up")


def way() -> Iterator[Figure]:
    """Time each step, and compare the curve with the exact lengths."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        sheet = draw_sheet(folder / "images", FRAMES)
        steps: dict[str, float] = {}
        clock = [time.perf_counter()]

        def seen(step: str) -> None:
            now = time.perf_counter()
            steps[step], clock[0] = now - clock[0], now

        with (
            served(folder / "images", folder / "test") as address,
            sync_playwright() as play,
            play.chromium.launch(executable_path=which("chromium"), args=list(FLAGS)) as browser,
        ):
            hands = Hands(browser.new_page(viewport={"width": 1440, "height": 900}))
            table, image = walk(hands, address, sheet, folder, seen)
        yield from _figures(steps, hands.actions)
        yield from _curve(table, image, sheet)


def _figures(steps: dict[str, float], actions: int) -> Iterator[Figure]:
    machine = sum(steps.values())
    for step, seconds in steps.items():
        yield from line(TABLE, step, time=(seconds, "s of the machine"))
    yield from line(
        TABLE,
        f"photographs → ROI → field → curve → table and image, {FRAMES + 1} images of 800 × 600",
        machine=(machine, "s"),
        actions=(actions, "of the hand"),
        with_5_s_an_action=(with_hands(machine, actions), "min", at_most(10), 1),
    )


def _curve(table: Path, image: Path, sheet: PulledSheet) -> Iterator[Figure]:
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    read = np.array([[float(row["E1"]), float(row["sigma_E1"])] for row in rows])
    off = read[:, 0] - sheet.lengths(*ENDS)
    with Image.open(image) as drawn:
        scatter = float(np.asarray(drawn.convert("L"), dtype=np.float64).std())
    yield from line(
        TABLE,
        "the extensometer's curve beside the exact one",
        error=(1e6 * rms(off), "µε, rms", None, len(off)),
        error_over_σ=rms(off / read[:, 1]),
        largest=(1e6 * float(sheet.lengths(*ENDS)[-1]), "µε"),
        image=(scatter, "grey levels, scatter"),
    )


PARTS = {"way": way}

if __name__ == "__main__":
    run(PARTS, __doc__)
