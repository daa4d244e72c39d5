"""Places of the gauges: a ring of points along the edges of the plate.

The paper draws 72 grey blocks "on the boundary of the plate" and gives no coordinates. Two readings
give 72 points at a spacing of 5 mm on its 100 x 100 plate, and 360 at a spacing of 1 mm:

* reading B, `gauges_on_edges`: the middles of equal steps ON the edges. Along a clamped edge two of
  the three strains vanish, so one input in three is live: 360 at 1 mm, as the paper prints.
* reading A, `gauges_inside_edges`: a closed rectangle 5 mm inside, where all three are live.

B reproduces what the paper reports and is what the scenes take by default.
"""

import math

import numpy as np


def gauges_on_edges(
    size: tuple[float, float], spacing: float = 5.0, margin: float = 5.0
) -> np.ndarray:
    """Return gauge places on the four edges, reading B of the paper.

    Each edge is cut into steps of `spacing`, from `margin` to its length less `margin`;
    a gauge stands in the middle of each step.

    Parameters
    ----------
    size
        (a, b) of the plate, mm.
    spacing
        Distance of neighbours, mm; must divide both spans.
    margin
        Distance from the corners where the steps begin, mm.

    Returns
    -------
    (M, 2) float64, mm, edge after edge around the plate, y = 0 first.

    Raises
    ------
    ValueError
        When no whole number of steps fits.
    """
    a, b = size
    x = even_steps(a, spacing, margin)[:-1] + spacing / 2.0
    y = even_steps(b, spacing, margin)[:-1] + spacing / 2.0
    return _around(x, y, size, inset=0.0)


def gauges_inside_edges(
    size: tuple[float, float], spacing: float = 5.0, margin: float = 5.0
) -> np.ndarray:
    """Return gauge places on a closed rectangle inside the edges, reading A of the paper.

    Parameters
    ----------
    size
        (a, b) of the plate, mm.
    spacing
        Distance of neighbours, mm; must divide both sides of the rectangle.
    margin
        Distance of the rectangle from the edges, mm.

    Returns
    -------
    (M, 2) float64, mm, side after side around the rectangle, each corner once.

    Raises
    ------
    ValueError
        When no whole number of steps fits.
    """
    a, b = size
    x = even_steps(a, spacing, margin)[:-1]
    y = even_steps(b, spacing, margin)[:-1]
    return _around(x, y, size, inset=margin)


def even_steps(length: float, spacing: float, margin: float) -> np.ndarray:
    """Return the places from `margin` to `length - margin`, both included, `spacing` apart.

    Parameters
    ----------
    length, spacing, margin
        mm.

    Returns
    -------
    (N,) float64, mm, N at least 2.

    Raises
    ------
    ValueError
        When no whole number of steps fits.
    """
    span = length - 2.0 * margin
    if not (margin >= 0.0 and span > 0.0):
        raise ValueError(
            f"margin must leave room on an edge of {length:g} mm, got {margin:g} mm; "
            f"use 0 or more and less than {length / 2.0:g} mm"
        )
    count = round(span / spacing) if spacing > 0.0 and math.isfinite(spacing) else 0
    if count < 1 or abs(count * spacing - span) > 1e-9 * length:
        raise ValueError(
            f"spacing must divide the {span:g} mm between the margins, got {spacing:g} mm; "
            f"use {span / max(count, 1):g} mm"
        )
    return np.linspace(margin, length - margin, count + 1)


def _around(x: np.ndarray, y: np.ndarray, size: tuple[float, float], inset: float) -> np.ndarray:
    """Walk once around the rectangle `inset` mm inside; the last two sides run backwards."""
    bottom = np.column_stack([x, np.full_like(x, inset)])
    right = np.column_stack([np.full_like(y, size[0] - inset), y])
    return np.concatenate([bottom, right, size - bottom, size - right])
