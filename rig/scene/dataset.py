"""Section for a data set on disk: which touches its samples have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field

from rig.scene.quantity import Count, Force, Length
from rig.scene.section import Section

if TYPE_CHECKING:
    import models
    from rig.scene.plate import PlateSection


class DatasetSection(Section):
    """Samples of touches and what the gauges read for them, without noise.

    The grid is that of the paper, and so are the places between; `dataset` says where they
    lie. Magnitudes are steps of the force there, and anything from 1 to as many times the force
    for random places.
    """

    touches: Count = Field(1, ge=1, le=3, description="touches of a sample")
    places: Literal["grid", "between", "random"] = Field("grid", description="where they press")
    spacing: Length = Field(5.0, gt=0, description="distance of neighbours on the grid, mm")
    margin: Length = Field(10.0, ge=0, description="distance kept from the edges, mm")
    midpoint_side: Count = Field(
        14, ge=2, le=1000, description="places a side between those of the grid"
    )
    force: Force = Field(1.0, gt=0, description="the smallest force, N")
    magnitudes: Count = Field(1, ge=1, description="the largest force in units of the smallest")
    samples: Count | None = Field(
        None, ge=1, description="number of samples [every combination on the grid once]"
    )
    order: Literal["canonical", "doubled"] = Field(
        "canonical", description="touches sorted by x, then y; or each sample twice, swapped too"
    )
    seed: Count = Field(0, ge=0, description="seed of what is drawn")

    @property
    def largest(self) -> float:
        """Sum of the forces of the hardest sample, N."""
        return self.touches * self.magnitudes * self.force

    def build(self, plate: PlateSection) -> models.SamplingPlan:
        """Return the plan of the samples on `plate`.

        Raises
        ------
        ValueError
            When the grid does not fit, or has not so many combinations.
        """
        import models

        source = self._box(plate) if self.places == "random" else self._lattice(plate)
        return models.SamplingPlan(source, self.touches, self.samples, self.seed, self.order)

    def _lattice(self, plate: PlateSection) -> models.TouchLattice:
        import numpy as np

        import models
        from models import grid_places, midpoint_places

        places = grid_places(plate.size, self.spacing, self.margin)
        if self.places == "between":
            places = midpoint_places(plate.size, self.spacing, self.margin, self.midpoint_side)
        return models.TouchLattice(places, self.force * np.arange(1.0, self.magnitudes + 1))

    def _box(self, plate: PlateSection) -> models.TouchBox:
        import models

        a, b = plate.size
        low = (self.margin, self.margin, self.force)
        high = (a - self.margin, b - self.margin, self.magnitudes * self.force)
        return models.TouchBox(low, high)
