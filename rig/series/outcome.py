"""What became of a whole test: frames that were left out, and how much of the others is valid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import dic
from rig.series.parts import read_part
from rig.system.arrays import F64, I64, AnyArray


@dataclass(frozen=True, eq=False)
class SeriesOutcome:
    """What became of a test.

    Attributes
    ----------
    names : tuple of str
        What each of the F frames is called.
    left_out : tuple of str
        Why each of them was left out; "" where it was not.
    counts : (F, S) int64
        Points of each frame by their `dic.Status`; none of a frame that was not compared.
    of_net : (F,) int64 or None
        Points of a net in each frame, 0 in one that was left out; None where no net is asked for.
    seconds : float
        Time that the correlation took.
    """

    names: tuple[str, ...]
    left_out: tuple[str, ...]
    counts: I64
    of_net: I64 | None
    seconds: float

    @property
    def by_net(self) -> float | None:
        """Fraction of the measured points of all frames that are those of the net."""
        if self.of_net is None:
            return None
        return int(self.of_net.sum()) / max(int(self.counts[:, dic.Status.OK].sum()), 1)

    @property
    def frames(self) -> int:
        """Frames of the test."""
        return len(self.names)

    @property
    def errors(self) -> tuple[tuple[str, str], ...]:
        """Names of the frames that were left out, and why."""
        pairs = zip(self.names, self.left_out, strict=True)
        return tuple((name, why) for name, why in pairs if why)

    @property
    def valid(self) -> F64:
        """Fraction of the points in the ROI that are valid, (F,); NaN where a frame is left out."""
        inside = self.counts.sum(axis=1) - self.counts[:, dic.Status.EXCLUDED]
        fraction = self.counts[:, dic.Status.OK] / np.maximum(inside, 1)
        return np.where([bool(why) for why in self.left_out], np.nan, fraction)

    @property
    def worst(self) -> tuple[str, float] | None:
        """Name of the frame of which the smallest fraction is valid; None if none is left."""
        valid = self.valid
        if np.isnan(valid).all():
            return None
        number = int(np.nanargmin(valid))
        return self.names[number], float(valid[number])

    @property
    def status(self) -> dict[str, float]:
        """Fraction of all points of the frames that were compared, by name of the status."""
        total = self.counts.sum(axis=0)
        fraction = total / max(int(total.sum()), 1)
        return {one.name.lower(): float(fraction[one]) for one in dic.Status}


def outcome(parts: Path, names: Sequence[str], seconds: float) -> SeriesOutcome:
    """Read from the parts of a test what became of it."""
    left_out = [""] * len(names)
    counts = np.zeros((len(names), len(dic.Status)), np.int64)
    of_net: list[int] = []
    for number in range(len(names)):
        part = read_part(parts, number)
        if part is not None:
            counts[number], left_out[number] = _counts(part[0]["status"]), part[1]
            of_net += [int(np.nansum(part[0]["by_net"]))] if "by_net" in part[0] else []
    own = np.array(of_net) if of_net else None
    return SeriesOutcome(tuple(names), tuple(left_out), counts, own, seconds)


def _counts(status: AnyArray) -> I64:
    """Points of each status, (S,)."""
    return np.bincount(status[status >= 0], minlength=len(dic.Status)).astype(np.int64)
