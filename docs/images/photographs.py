"""Draw the images of the tutorial on photographs, by the commands and code that stand in it.

python docs/images/photographs.py
"""

import os
import runpy
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

import dic

IMAGES = Path(__file__).parent
EXAMPLE = IMAGES.parents[1] / "examples/10_photographs.py"
SHOWN = (0, 0), (2, 0), (0, 1), (1, 1)
"""Columns and rows of the sheet where u, status, exx and eyy stand."""

WINDOWS = {5: "#0a8f78", 13: "#b3541e"}
"""Strain windows, points, and the colours in which their strain is drawn."""


def pair() -> None:
    """Put both photographs beside each other, at half their size."""
    before, after = (Image.open(f"{name}.png") for name in ("before", "after"))
    width, height = before.width // 2, before.height // 2
    both = Image.new("L", (2 * width + 10, height), 255)
    for place, image in ((0, before), (width + 10, after)):
        small = image.resize((width, height), Image.Resampling.LANCZOS)
        both.paste(small, (place, 0))
    both.save(IMAGES / "photographs-pair.webp", quality=85)


def fields(*options: str, name: str) -> None:
    """Take four plots out of the sheet that `touchplate correlate` draws, two beside two."""
    command = [Path(sys.executable).with_name("touchplate"), "correlate", "before.png", "after.png"]
    subprocess.run([*command, *options, "--out", name], check=True, stdout=subprocess.DEVNULL)
    sheet = Image.open(Path(name) / "fields.png").convert("RGB")
    width, height = sheet.width // 3, sheet.height // 2
    four = Image.new("RGB", (2 * width, 2 * height))
    for number, (column, row) in enumerate(SHOWN):
        box = (column * width, row * height, (column + 1) * width, (row + 1) * height)
        four.paste(sheet.crop(box), (number % 2 * width, number // 2 * height))
    four.save(IMAGES / f"photographs-{name}.webp", quality=85)


def profile(sheet: dict) -> None:
    """Draw strain along the line above the hole, by two gauge lengths, beside the exact one."""
    hole, camera = sheet["hole"], sheet["camera"]
    before, after, roi = (dic.read_image(f"{name}.png") for name in ("before", "after", "roi"))
    field = dic.correlate(dic.prepare(before, roi=roi > 0), after)
    columns, y = field.xy[:, 0], camera.on_plate(field.xy)[:, 1]
    middle = columns == columns[np.argmin(abs(columns - before.shape[1] / 2))]
    figure, axes = plt.subplots(figsize=(7.5, 3.6), layout="constrained")
    for window, colour in WINDOWS.items():
        strain = dic.strain(field, window=window)
        line = strain.valid & middle & (y > hole.centre[1])
        axes.errorbar(
            y[line] - hole.centre[1], 1e6 * strain.exx[line], 2e6 * strain.sigma[line, 0],
            fmt="o", markersize=3, linewidth=1, color=colour,
            label=f"--window {window}: gauge length {strain.vsg:g} px, with 2σ",
        )  # fmt: skip
    above = np.linspace(hole.radius, 44.0, 300)
    points = np.column_stack([np.full_like(above, hole.centre[0]), hole.centre[1] + above])
    axes.plot(above, 1e6 * hole.gradient(points)[:, 0, 0], "k", linewidth=1, label="exact (Kirsch)")
    axes.set(xlabel="distance from the middle of the hole, mm", ylabel="exx, µε")
    axes.legend(frameon=False)
    figure.savefig(IMAGES / "photographs-profile.png", dpi=120)


def main() -> None:
    """Draw all of them."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        sys.argv[1:] = ["."]  # where the example writes to
        sheet = runpy.run_path(str(EXAMPLE))
        pair()
        fields(name="whole")
        fields("--roi", "roi.png", name="roi")
        profile(sheet)


if __name__ == "__main__":
    main()
