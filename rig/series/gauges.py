"""What an extensometer and a gauge read in a frame, and where one reads nothing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import dic
from dic import export
from rig.series.between import Between, lay
from rig.series.invariants import STRAINS, invariants_of
from rig.series.regions import Extensometer, Gauge, Regions, filled
from rig.series.scale import SCALED
from rig.system.arrays import F64, AnyArray, Mask

UV, SIGMA_UV = ("u", "v"), ("sigma_u", "sigma_v")


def elongation(
    one: Extensometer, grid: dic.Grid, table: Mapping[str, AnyArray], places: F64 | None = None
) -> tuple[float, float]:
    """Change of length over length of an extensometer in a frame, and its σ; NaN where lost.

    With `places` (R·C, 2) mm of the points on the object, lengths are those on the object.

    σ takes the points between which an end lies for fully correlated: an upper bound.
    """
    ends = [lay(grid, np.array([place])) for place in (one.start, one.end)]
    known = table if places is None else dict(table) | {"X": places[:, 0], "Y": places[:, 1]}
    moved, loose = (UV, SIGMA_UV) if places is None else (SCALED[:2], SCALED[2:])
    first, second = (_pair(end, known, moved) for end in ends)
    loose_1, loose_2 = (_pair(end, known, loose) for end in ends)
    if places is None:
        apart = np.array(one.end) - np.array(one.start)
    else:
        apart = _pair(ends[1], known, ("X", "Y")) - _pair(ends[0], known, ("X", "Y"))
    length = float(np.linalg.norm(apart))
    along = apart / length
    after = float(np.linalg.norm(apart + second - first))
    spread = np.sqrt(np.sum(along**2 * (loose_1**2 + loose_2**2)))
    return after / length - 1, float(spread) / length


def _pair(between: Between, table: Mapping[str, AnyArray], names: tuple[str, ...]) -> F64:
    return np.array([between.read(table[name])[0] for name in names])


def gauge_strain(
    one: Gauge, grid: dic.Grid, table: Mapping[str, AnyArray], vsg: float
) -> dict[str, tuple[float, float]]:
    """Mean strain of the points inside a gauge, its invariants, and σ; NaN where there is none.

    Strains nearer than `vsg` px share their pixels: there are as many independent ones as squares
    of that side, and one at least. The invariants are those of the mean: noise does not add up in
    them as it does in the mean of the invariants.
    """
    here = _inside(one, grid)
    means = [
        _mean(table[name][here], table[f"sigma_{name}"][here], grid.step / vsg) for name in STRAINS
    ]
    values, sigma = np.array(means).T[:, :, None]
    found = {name: float(field[0]) for name, field in invariants_of(values, sigma).items()}
    more = {name: (found[name], found[f"sigma_{name}"]) for name in export.INVARIANTS}
    return dict(zip(STRAINS, means, strict=True)) | more


def _mean(values: AnyArray, sigma: AnyArray, apart: float) -> tuple[float, float]:
    """Mean of strains and its σ, their distance being `apart` of that at which they are free."""
    known = np.isfinite(values) & np.isfinite(sigma)
    if not known.any():
        return np.nan, np.nan
    free = max(np.count_nonzero(known) * apart**2, 1.0)
    squares = np.square(sigma[known], dtype=np.float64)
    return float(values[known].mean(dtype=np.float64)), float(np.sqrt(np.mean(squares) / free))


def _inside(one: Gauge, grid: dic.Grid) -> Mask:
    """Points (R·C,) of a grid inside a gauge."""
    inside = filled(one.points, (int(grid.ys[-1]) + 1, int(grid.xs[-1]) + 1))
    return inside[np.asarray(grid.ys, np.int64)][:, np.asarray(grid.xs, np.int64)].ravel()


def off_the_points(regions: Regions, grid: dic.Grid) -> list[str]:
    """Say of each extensometer and gauge that reads nothing on a grid where it lies."""
    corners = f"({grid.xs[0]}, {grid.ys[0]}) to ({grid.xs[-1]}, {grid.ys[-1]}) px"
    where = f"lies off the points, which reach from {corners}, and reads nothing; draw it there"
    ends = {one.name: np.array([one.start, one.end]) for one in regions.extensometer}
    lost = [n for n, places in ends.items() if np.isnan(lay(grid, places).weights).any()]
    bare = [one.name for one in regions.gauge if not _inside(one, grid).any()]
    said = [f"extensometer '{name}'" for name in lost] + [f"gauge '{name}'" for name in bare]
    return [f"{what} {where}" for what in said]
