"""The board of a calibration on paper, at true scale, with a ruler to check the printer by."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from dic import export
from rig.calibration.board import CharucoBoard

MM_PER_INCH, POINTS_PER_INCH = 25.4, 72.0
MARGIN = 15.0  # mm of paper round the board
SCALE = 20  # dots per mm of the board's image: edges are right to 0.05 mm
HAIR = 0.1  # width of a line, mm
LONG, SHORT = 4.0, 2.0  # ticks of the ruler, every 10 mm and every mm


def print_board(path: str | Path, board: CharucoBoard) -> None:
    """Draw a board with a ruler below it; the page is the board and 15 mm on each side.

    Parameters
    ----------
    path : file to write, ending in .pdf or .png
    board : CharucoBoard

    Raises
    ------
    ValueError
        If the file is to be of another kind.
    OSError
        If it cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in (".pdf", ".png"):
        raise ValueError(f"a board is printed to .pdf or .png, got '{path.name}'; rename the file")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    a, b = board.size
    page: Any = Figure(figsize=((a + 2 * MARGIN) / MM_PER_INCH, (b + 2 * MARGIN) / MM_PER_INCH))
    FigureCanvasAgg(page)
    axes = page.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    image = board.draw(SCALE)
    axes.imshow(image, "gray", vmin=0, vmax=255, extent=(0, a, 0, b), interpolation="none")
    axes.set(xlim=(-MARGIN, a + MARGIN), ylim=(-MARGIN, b + MARGIN))
    _draw_ruler(axes, board)
    content = BytesIO()  # not the file: a full disk leaves a PDF's writer in a fault of its own
    page.savefig(content, format=path.suffix[1:].lower(), dpi=SCALE * MM_PER_INCH)
    with export.aside(path) as draft:
        draft.write_bytes(content.getvalue())


def _draw_ruler(axes: Any, board: CharucoBoard) -> None:
    """Ticks in mm along the lower edge of the board, as long as the board."""
    from matplotlib.collections import LineCollection

    a, _ = board.size
    marks = np.arange(0.0, np.floor(a) + 0.5)
    top = -MARGIN / 4
    lines = [[(x, top), (x, top - (LONG if x % 10 == 0 else SHORT))] for x in marks]
    wide = HAIR * POINTS_PER_INCH / MM_PER_INCH
    axes.add_collection(LineCollection(lines, colors="black", linewidths=wide))
    for x in marks[::10]:
        axes.text(x, top - LONG - 0.5, f"{x:g}", ha="center", va="top", fontsize=5)
    said = (
        f"ruler in mm; {board.squares[0]} × {board.squares[1]} squares of {board.square:g} mm,"
        f" markers of {board.marker:g} mm, DICT_4X4_1000 from {board.first}; print at 100 %"
    )
    axes.text(a / 2, top - LONG - 4, said, ha="center", va="top", fontsize=6)
