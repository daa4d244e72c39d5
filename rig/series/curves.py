"""Curves with their σ: profiles along a line, and readings over time."""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false
from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.series.profile import Profile
from rig.system.arrays import F64

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DRAWN = 8  # frames of a profile; more look alike
_SIZE = 8.0, 4.5  # in


def draw_profile(path: Path, names: Sequence[str], profile: Profile, length: str) -> None:
    """Draw a field along a line for up to eight frames, evenly chosen, ± σ about each."""
    from matplotlib.figure import Figure

    figure = Figure(_SIZE, layout="constrained")
    axes = figure.add_subplot()
    numbers = np.unique(np.linspace(0, len(names) - 1, min(len(names), _DRAWN)).astype(int))
    for place, number in zip(np.linspace(0, 0.9, len(numbers)), numbers.tolist(), strict=True):
        curve = profile.values[number], profile.sigma[number]
        _band(axes, profile.distance, curve, str(names[number]), _shade(float(place)))
    axes.set_xlabel(f"along the line, {length}")
    axes.set_ylabel(_titled(profile.field, profile.unit))
    _finish(axes)
    figure.savefig(path, dpi=120)


def draw_readings(
    path: Path,
    time: F64,
    axis: str,
    readings: Mapping[str, tuple[F64, F64]],
    quantity: str = "strain, 1",
) -> None:
    """Draw readings (F,) and their σ (F,) by name over the frames or over time."""
    from matplotlib.figure import Figure

    figure = Figure(_SIZE, layout="constrained")
    axes = figure.add_subplot()
    for index, (name, curve) in enumerate(readings.items()):
        _band(axes, time, curve, name, f"C{index % 10}")
    axes.set_xlabel(axis)
    axes.set_ylabel(quantity)
    _finish(axes)
    figure.savefig(path, dpi=120)


def _band(axes: Axes, along: F64, curve: tuple[F64, F64], name: str, colour: str) -> None:
    values, sigma = curve
    axes.plot(along, values, color=colour, label=name, marker=".", markersize=3)
    axes.fill_between(along, values - sigma, values + sigma, color=colour, alpha=0.25, lw=0)


def _shade(place: float) -> str:
    """Return a colour between dark blue, 0, and yellow, 1."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return to_hex(colormaps.get_cmap("viridis")(place))


def _titled(field: str, unit: str) -> str:
    return f"{field.replace('_', ' ')}, {unit}"


def _finish(axes: Axes) -> None:
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
