"""The losses of a training, drawn over its steps or epochs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rig.system.arrays import F64

_MEANS = 100  # over the way of a training: a step says little, for each has data of its own


def draw_steps(path: Path, parts: Mapping[str, F64]) -> None:
    """Draw the loss of each step, and its mean over a hundredth of the way, a panel a part.

    Parameters
    ----------
    path : Path
        A PNG file.
    parts : dict of (S,) float64
        What was trained one after another: its name and the loss of its steps, of either sign.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    from matplotlib.figure import Figure

    plot: Any = Figure(figsize=(5, 3 * len(parts) + 1), layout="constrained")
    panels: Any = plot.subplots(len(parts), 1, squeeze=False)[:, 0]
    for axes, (name, loss) in zip(panels, parts.items(), strict=True):
        steps, mean = block_means(loss)
        axes.plot(1 + np.arange(len(loss)), loss, color="0.75", linewidth=0.6, label="a step")
        axes.plot(steps, mean, label="mean")
        axes.set(xscale="log", xlabel="step", ylabel="loss", title=name)
        # Single steps may lie far out: the means and the middle of the rest are what is looked at.
        low, high = np.quantile(loss, [0.01, 0.99])
        axes.set_ylim(*_span(min(low, mean.min()), max(high, mean.max())))
        axes.legend()
    save_curves(path, plot)


def save_curves(path: Path, plot: Any) -> None:
    """Write drawn losses.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    try:
        plot.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise OSError(
            f"curves {path} cannot be drawn ({error}); give a PNG file in a folder that exists"
        ) from error


def block_means(loss: F64) -> tuple[F64, F64]:
    """Mean loss of a hundred blocks of steps, (M,), and the middle step of each, (M,), from 1."""
    blocks = np.array_split(np.arange(len(loss)), min(_MEANS, len(loss)))
    middle = np.array([1 + block.mean() for block in blocks])
    return middle, np.array([loss[block].mean() for block in blocks])


def _span(low: float, high: float) -> tuple[float, float]:
    room = 0.05 * (high - low) or 0.5
    return low - room, high + room
