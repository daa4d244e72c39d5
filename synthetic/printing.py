"""A pattern on paper or film at true scale, with a measure to check the printer by."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from dic import export
from synthetic.pattern import Pattern

MM_PER_INCH = 25.4
# Paper around the plate for corner marks, measure and text, mm.
MARGIN = 15.0
_MARK = 8.0  # length of a corner mark, mm
_GAP = 1.0  # between a corner and its marks, so that a cut along the corner keeps the pattern, mm
_HAIR = 0.1  # width of a line, mm


def print_pattern(path: str | Path, pattern: Pattern, dpi: float = 600.0) -> None:
    """Draw the spots of a pattern with marks at the corners of the plate and a measure below it.

    A spot is printed as a sharp disc where its edge has half its depth: paint and lens make the
    edge. The page is the plate and 15 mm on each side; print it at 100 %.

    Parameters
    ----------
    path : file to write, ending in .pdf (spots are curves, exact at any size) or .png.
    dpi : dots per inch of a PNG.

    Raises
    ------
    ValueError
        The file is to be of another kind, or `dpi` gives a spot fewer than 4 dots.
    OSError
        The file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in (".pdf", ".png"):
        raise ValueError(
            f"a pattern is printed to .pdf or .png, got '{path.name}'; rename the file"
        )
    min_dpi = 4 * MM_PER_INCH / pattern.speckle.diameter
    if not min_dpi <= dpi < np.inf:
        raise ValueError(
            f"dots per inch must be at least {min_dpi:.0f} for spots of "
            f"{pattern.speckle.diameter:g} mm, got {dpi:g}"
        )
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    a, b = pattern.speckle.size
    page: Any = Figure(figsize=((a + 2 * MARGIN) / MM_PER_INCH, (b + 2 * MARGIN) / MM_PER_INCH))
    FigureCanvasAgg(page)
    axes = page.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set(xlim=(-MARGIN, a + MARGIN), ylim=(-MARGIN, b + MARGIN))
    _draw_spots(axes, pattern)
    _draw_marks(axes, a, b)
    content = BytesIO()  # not the file: a full disk leaves a PDF's writer in a fault of its own
    page.savefig(content, format=path.suffix[1:].lower(), dpi=dpi)
    with export.aside(path) as draft:
        draft.write_bytes(content.getvalue())


def _draw_spots(axes: Any, pattern: Pattern) -> None:
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    spots = [
        Circle(place, radius) for place, radius in zip(pattern.centres, pattern.radii, strict=True)
    ]
    ink = str(1 - pattern.speckle.contrast)
    axes.add_collection(PatchCollection(spots, facecolor=ink, edgecolor="none", linewidth=0))


def _draw_marks(axes: Any, a: float, b: float) -> None:
    """Two lines outside each corner, and below the plate a measure as long as tens of mm fit."""
    lines: list[list[tuple[float, float]]] = []
    for x, outwards_x in ((0.0, -1), (a, 1)):
        for y, outwards_y in ((0.0, -1), (b, 1)):
            lines.append([(x + outwards_x * s, y) for s in (_GAP, _GAP + _MARK)])
            lines.append([(x, y + outwards_y * s) for s in (_GAP, _GAP + _MARK)])
    length = max(10.0 * np.floor((a - 20) / 10), 10.0)
    left, low = (a - length) / 2, -MARGIN / 2
    lines.append([(left, low), (left + length, low)])
    lines += [[(x, low - 1.5), (x, low + 1.5)] for x in (left, left + length)]
    points_per_mm = 72 / MM_PER_INCH
    for line in lines:
        x, y = zip(*line, strict=True)
        axes.plot(x, y, color="black", linewidth=_HAIR * points_per_mm, solid_capstyle="butt")
    text = f"this line measures {length:g} mm; the plate measures {a:g} × {b:g} mm"
    axes.text(a / 2, low - 2, text, ha="center", va="top", fontsize=6)
