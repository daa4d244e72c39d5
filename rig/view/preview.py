"""What to expect of a subset and a step before anything is correlated: points, and their σ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import dic
from rig.series.noise import ImageNoise
from rig.series.regions import mask_of
from rig.system.arrays import F32, F64, AnyArray
from rig.view.asked import AskedSettings
from rig.view.viewed import ViewedTest

_HIGH = 95  # percentile of σ that is shown beside the median


@dataclass(frozen=True, eq=False)
class Preview:
    """Points of a reference, and σ to expect of them.

    Attributes
    ----------
    grid : dic.Grid
        R rows and C columns.
    status : (R·C,) int8
    sigma : (R·C,) float32, px
        The larger one of u and v; NaN where a point will not be measured.
    strain_sigma : float
        Median of the largest of exx, eyy and exy; NaN where the window does not fit.
    gauge_length : int, px
    noise : ImageNoise
        Of the images, from which σ follows.
    prefilter : str
        What the images pass first, and why.
    """

    grid: dic.Grid
    status: AnyArray
    sigma: F32
    strain_sigma: float
    gauge_length: int
    noise: ImageNoise
    prefilter: str

    @property
    def measured(self) -> int:
        """Points that will be measured."""
        return int(np.isfinite(self.sigma).sum())

    @property
    def levels(self) -> tuple[float, float]:
        """Median of σ, and what 95 % of the points stay below, px; NaN where there is none."""
        known = self.sigma[np.isfinite(self.sigma)]
        if not len(known):
            return np.nan, np.nan
        return float(np.median(known)), float(np.percentile(known, _HIGH))


def prepared(test: ViewedTest, asked: AskedSettings) -> dic.Reference:
    """Prepare the reference that a page asks for.

    Raises
    ------
    OSError, ValueError
        The image, its ROI or the settings cannot be used.
    """
    image = test.image(asked.reference)
    mask = mask_of(asked.roi, (int(image.shape[0]), int(image.shape[1])))
    return dic.prepare(image, asked.subset, asked.step, asked.order, mask)


def preview(test: ViewedTest, asked: AskedSettings) -> Preview:
    """Say what the settings of a page will give.

    Raises
    ------
    OSError, ValueError
        As `prepared`; or the strain window is not odd.
    """
    ref = prepared(test, asked)
    if ref.grid is None:
        raise ValueError("a preview needs a grid; leave out the points")
    noise = test.noise(asked.reference)
    spread = dic.expected_sigma(ref, noise.level)
    length = (asked.window - 1) * ref.grid.step + ref.subset
    return Preview(
        ref.grid,
        ref.status,
        spread.max(axis=1).astype(np.float32),
        _strain_sigma(ref, spread, asked),
        length,
        noise,
        ref.prefilter.reason,
    )


def _strain_sigma(ref: dic.Reference, spread: F64, asked: AskedSettings) -> float:
    """Take the strain of a surface at rest whose displacements have the σ expected."""
    count = len(ref.xy)
    still, flat = np.where(np.isfinite(spread[:, 0]), 0.0, np.nan), np.zeros((count, 2, 2))
    rest = dic.DisplacementField(
        xy=ref.xy,
        u=still,
        v=still,
        sigma_u=spread[:, 0],
        sigma_v=spread[:, 1],
        gradient=flat,
        sigma_gradient=flat,
        zncc=np.ones(count),
        iterations=np.zeros(count, np.int16),
        valid_fraction=np.ones(count),
        status=np.where(np.isfinite(still), ref.status, dic.Status.FLAT).astype(np.int8),
        subset=ref.subset,
        order=ref.order,
        grid=ref.grid,
    )
    sigma = dic.strain(rest, asked.window, asked.kind).sigma.max(axis=1)
    known = sigma[np.isfinite(sigma)]
    return float(np.median(known)) if len(known) else float("nan")


def recommended(test: ViewedTest, reference: str) -> dic.SettingsAdvice:
    """Recommend subset and step for the pattern and the noise of the images.

    Raises
    ------
    OSError, ValueError
        The image cannot be used, or no subset is good enough.
    """
    return dic.recommend_settings(test.image(reference), test.noise(reference).level)
