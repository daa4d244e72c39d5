"""Film the page of the digital twin into page.webp, and take a still of the tutorial's own plate.

    python docs/images/page.py [--rate 4] [--width 900]

Runs `touchplate run` and looks at its page in headless Chromium. The twin makes 12 images a second
here, so that the browser, which has no GPU, finds time on two cores too.
"""

import argparse
import io
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import NamedTuple

from PIL import Image
from plate import own_scene
from playwright.sync_api import Browser, Page, expect, sync_playwright

IMAGES = Path(__file__).parent
SLOWER = ("page.port=0", "page.viewers=machine", "camera.rate=12", "dic.reference_frames=8")
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
VIEW = {"width": 1180, "height": 760}
BEFORE, AFTER = 4.5, 5.0  # s of the film around the moment when a second finger lands
PRESSED = re.compile("^(one|2) touch", re.IGNORECASE)
TWO = re.compile("^2 touch")


@contextmanager
def running(scene: str | Path) -> Iterator[str]:
    """Run a scene, and give the address of its page."""
    command = [Path(sys.executable).with_name("touchplate"), "run", scene]
    command += [word for setting in SLOWER for word in ("--set", setting)]
    loop = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        said = ""
        while not (address := re.search(r"http://\S+", said)):
            said = loop.stderr.readline() or sys.exit("the loop ended before its page was up")
        yield address[0]
    finally:
        loop.send_signal(signal.SIGINT)
        loop.communicate(timeout=30)


class Shot(NamedTuple):
    """What the page looked like: when, s; what it said of touches; the image."""

    time: float
    status: str
    image: Image.Image


def opened(browser: Browser, address: str) -> Page:
    """Open a page and wait for the first press."""
    page = browser.new_page(viewport=VIEW)
    page.goto(address)
    expect(page.locator("#status")).to_have_text(PRESSED, timeout=600_000)
    return page


def shots(page: Page, rate: float) -> Iterator[Shot]:
    """Look at the page so many times a second."""
    while True:
        now = time.monotonic()
        image = Image.open(io.BytesIO(page.screenshot(type="jpeg", quality=95)))
        yield Shot(now, page.locator("#status").inner_text(), image.convert("RGB"))
        page.wait_for_timeout(max(0.0, 1e3 * (now + 1 / rate - time.monotonic())))


def around_the_second(taken: Iterator[Shot]) -> list[Shot]:
    """Keep what was seen around the moment when a second finger lands."""
    kept: deque[Shot] = deque()
    landed = inf
    for shot in taken:
        kept.append(shot)
        if TWO.match(shot.status) and len(kept) > 1 and not TWO.match(kept[-2].status):
            landed = min(landed, shot.time)
        while kept[0].time < min(landed, shot.time) - BEFORE:
            kept.popleft()
        if shot.time > landed + AFTER:
            break
    return list(kept)


def film(path: Path, taken: list[Shot], width: int) -> None:
    """Write an animated image that runs as fast as what it shows."""
    size = width, round(width * VIEW["height"] / VIEW["width"])
    first, *others = [shot.image.resize(size, Image.Resampling.LANCZOS) for shot in taken]
    lasts = [round(1e3 * (after.time - before.time)) for before, after in pairwise(taken)]
    first.save(
        path, save_all=True, append_images=others, duration=[*lasts, lasts[-1]], loop=0,
        quality=55, method=6,
    )  # fmt: skip


def main() -> None:
    """Film the one, photograph the other."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--rate", type=float, default=4.0, help="frames a second of the film")
    options.add_argument("--width", type=int, default=900, help="of the film, px")
    given = options.parse_args()
    with sync_playwright() as play, tempfile.TemporaryDirectory() as folder:
        browser = play.chromium.launch(executable_path="/usr/bin/chromium", args=list(FLAGS))
        with running("twin") as address:
            taken = around_the_second(shots(opened(browser, address), given.rate))
        film(IMAGES / "page.webp", taken, given.width)
        with running(own_scene(folder)) as address:
            page = opened(browser, address)
            page.wait_for_timeout(6_000)  # into the tour's second press, which wanders
            still = next(shot for shot in shots(page, given.rate) if PRESSED.match(shot.status))
        still.image.save(IMAGES / "page-own.webp", quality=85)
        browser.close()


if __name__ == "__main__":
    main()
