"""What extensometers and gauges read in a frame, each with its σ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import dic
from rig.series.measure import BLOCK
from rig.series.regions import Regions, elongation, gauge_strain
from rig.system.arrays import F64, AnyArray


@dataclass(frozen=True, eq=False)
class Reader:
    """Regions laid on the points of a test.

    Attributes
    ----------
    regions : Regions
    grid : dic.Grid
    vsg : float, px
        Distance from which the errors of two strains are free of each other.
    places : (R·C, 2) float64, mm, or None
        Where the points are on the object, which is what lengths are of; None for px.
    """

    regions: Regions
    grid: dic.Grid
    vsg: float
    places: F64 | None = None

    def read(self, table: Mapping[str, AnyArray]) -> dict[str, float]:
        """Read a frame, by name of extensometer and by name and strain of gauge; NaN where lost.

        Parameters
        ----------
        table : mapping of (R·C,)
            Displacement, strain and their σ by name.
        """
        row: dict[str, float] = {}
        for one in self.regions.extensometer:
            value = elongation(one, self.grid, table, self.places)
            row[one.name], row[f"sigma_{one.name}"] = value
        for gauge in self.regions.gauge:
            for field, value in gauge_strain(gauge, self.grid, table, self.vsg).items():
                row[f"{gauge.name}_{field}"], row[f"sigma_{gauge.name}_{field}"] = value
        return row


def reach(field: str, window: int, step: int, subset: int) -> float:
    """Distance from which the errors of two strains are free of each other, px."""
    return (window - 1) * step + subset if field == "subset" else BLOCK
