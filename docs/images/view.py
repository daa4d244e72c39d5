"""Photograph the page of a test: the ROI with its noise floor, and the field with marks on it.

python docs/images/view.py
"""

import io
import tempfile
from contextlib import chdir
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

from rig.studies.start.pulled_sheet import RADIUS, draw_sheet
from rig.studies.start.ten_minutes import FLAGS, FRAMES, Hands, served, walk

IMAGES = Path(__file__).resolve().parent
VIEW = {"width": 1380, "height": 1010}
WIDE = 1150  # px of the images


def still(page: Page, name: str) -> None:
    """Write what the page shows."""
    page.wait_for_timeout(600)  # until curves and image are drawn
    shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    size = WIDE, round(WIDE * shot.height / shot.width)
    shot.resize(size, Image.Resampling.LANCZOS).save(IMAGES / name, quality=88, method=6)


def main() -> None:
    """Walk the way of a person, and look at the page on it."""
    with tempfile.TemporaryDirectory() as name, chdir(name), sync_playwright() as play:
        folder = Path()  # the page shows names as they are given
        sheet = draw_sheet(folder / "images", FRAMES)
        browser = play.chromium.launch(executable_path="/usr/bin/chromium", args=list(FLAGS))
        page = browser.new_page(viewport=VIEW)
        hands = Hands(page)

        def seen(step: str) -> None:
            if step == "ROI and noise floor":
                still(page, "view-roi.webp")

        with served(folder / "images", folder / "test") as address:
            walk(hands, address, sheet, folder, seen)
            above = sheet.circle(RADIUS + 3, 4)[1]
            hands.key("p")
            hands.click((float(above[0]), float(above[1])))
            hands.key("g")
            hands.drag((170, 60), (270, 120))
            hands.key("l")
            hands.drag((400, 40), (400, 220))
            expect(page.locator("#lines-card")).to_be_visible()
            hands.button("#frame-limits")
            hands.point((330, 160))
            still(page, "view-field.webp")
            page.emulate_media(color_scheme="dark")
            hands.key("s")
            hands.key("d")
            hands.button("#frame-limits")
            hands.point((330, 160))
            still(page, "view-dark.webp")
        browser.close()


if __name__ == "__main__":
    main()
