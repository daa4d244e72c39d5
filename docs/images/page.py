"""Film the page of the digital twin into page.webp, and take a still of the tutorial's own plate.

    python docs/images/page.py [--seconds 10] [--rate 4] [--width 900]

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
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

from PIL import Image
from plate import own_scene
from playwright.sync_api import Browser, Page, expect, sync_playwright

IMAGES = Path(__file__).parent
SLOWER = ("page.port=0", "camera.rate=12", "dic.reference_frames=8")
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
VIEW = {"width": 1400, "height": 900}
TO_THE_RAMP = 8_800  # ms from the tour's first press to shortly before its third
PRESSED = re.compile(r"^[12] touch")


@contextmanager
def running(scene: str | Path, *settings: str) -> Iterator[str]:
    """Run a scene, and give the address of its page."""
    command = [Path(sys.executable).with_name("touchplate"), "run", scene]
    command += [word for setting in (*SLOWER, *settings) for word in ("--set", setting)]
    loop = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        said = ""
        while not (address := re.search(r"http://\S+", said)):
            said = loop.stderr.readline() or sys.exit("the loop ended before its page was up")
        yield address[0]
    finally:
        loop.send_signal(signal.SIGINT)
        loop.communicate(timeout=30)


def opened(browser: Browser, address: str) -> Page:
    """Open a page and wait for the first press."""
    page = browser.new_page(viewport=VIEW)
    page.goto(address)
    expect(page.locator("#status")).to_have_text(PRESSED, timeout=600_000)
    return page


def shots(page: Page, seconds: float, rate: float) -> Iterator[tuple[float, Image.Image]]:
    """Give what the page looks like, and when, so many times a second."""
    began = time.monotonic()
    while (now := time.monotonic() - began) < seconds:
        yield now, Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        page.wait_for_timeout(max(0.0, 1e3 * (began + now + 1 / rate - time.monotonic())))


def film(path: Path, taken: list[tuple[float, Image.Image]], width: int) -> None:
    """Write an animated image that runs as fast as what it shows."""
    times, shown = zip(*taken, strict=True)
    size = width, round(width * VIEW["height"] / VIEW["width"])
    first, *others = [image.resize(size, Image.Resampling.LANCZOS) for image in shown]
    lasts = [round(1e3 * (after - before)) for before, after in pairwise(times)]
    first.save(
        path, save_all=True, append_images=others, duration=[*lasts, lasts[-1]], loop=0,
        quality=55, method=6,
    )  # fmt: skip


def main() -> None:
    """Film the one, photograph the other."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=10.0)
    options.add_argument("--rate", type=float, default=4.0, help="frames a second of the film")
    options.add_argument("--width", type=int, default=900, help="of the film, px")
    given = options.parse_args()
    with sync_playwright() as play, tempfile.TemporaryDirectory() as folder:
        browser = play.chromium.launch(executable_path="/usr/bin/chromium", args=list(FLAGS))
        with running("twin") as address:
            page = opened(browser, address)
            page.wait_for_timeout(TO_THE_RAMP)
            film(IMAGES / "page.webp", list(shots(page, given.seconds, given.rate)), given.width)
        with running(own_scene(folder), "source.script=random") as address:
            page = opened(browser, address)
            page.wait_for_timeout(6_000)
            ((_, still),) = shots(page, 0.01, given.rate)
            still.save(IMAGES / "page-own.webp", quality=85)
        browser.close()


if __name__ == "__main__":
    main()
