"""Photograph the page of `touchplate setup --rehearse`: the camera's step, and a weight's mark.

    python docs/images/setup.py

Works on the page in headless Chromium as a person would, which takes some minutes.
"""

import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

IMAGES = Path(__file__).parent
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
VIEW = {"width": 1280, "height": 720}
PATIENCE = 400_000  # ms for a step
SETTLED = 1500  # ms
FOURTH = "#taken:text-is('4 of 9')"


def photograph(page: Page) -> None:
    """Press what is usual where it is asked for, to the fourth mark of the weight."""
    usual, fourth = page.locator("#buttons .usual"), page.locator(FOURTH)
    while True:
        usual.or_(fourth).first.wait_for()
        if fourth.is_visible():
            keep(page, "setup-weight.png")
            return
        step, turn = (page.locator("body").get_attribute(f"data-{of}") for of in ("step", "turn"))
        if step == "camera":
            page.locator("#signs div").first.wait_for()
            keep(page, "setup-camera.png")
        usual.click()
        page.locator(f"body:not([data-turn='{turn}'])").wait_for(state="attached")


def keep(page: Page, name: str) -> None:
    """Photograph the page once it is quiet."""
    page.wait_for_timeout(SETTLED)
    page.screenshot(path=IMAGES / name)


def main() -> None:
    """Run the setup in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        command = [
            Path(sys.executable).with_name("touchplate"),
            "setup",
            "--rehearse",
            "--port",
            "0",
        ]
        setup = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=folder)
        address = re.search(r"http://\S+", setup.stderr.readline()) or sys.exit(
            "no page was served"
        )
        browser = play.chromium.launch(executable_path="/usr/bin/chromium", args=list(FLAGS))
        page = browser.new_page(viewport=VIEW)
        page.set_default_timeout(PATIENCE)
        page.goto(address[0])
        page.locator("[name=rate]").fill("10")
        photograph(page)
        browser.close()
        setup.send_signal(signal.SIGINT)
        setup.communicate(timeout=30)


if __name__ == "__main__":
    main()
