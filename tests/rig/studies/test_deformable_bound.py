"""Errors over their bound are scored as they were drawn, and what was not found is counted."""

import numpy as np

from rig.studies.deformable.bound import CASE, score
from rig.studies.deformable.truth import slope

RATIOS = np.array([0.5, 0.75, 1.0, 1.25, 1.5])
LIMITS = np.array([0.09, 0.04, 0.03, 0.02, 0.01])  # mm²


def drawn(spread, frames=400):
    """Errors whose root mean square is `spread` bounds, alike along x and y."""
    rng = np.random.default_rng(7)
    off = rng.normal(size=(len(RATIOS), frames, 3))
    off[:, :, :2] *= spread * np.sqrt(LIMITS / 2)[:, None, None]
    off[:, :, 2] *= 0.01 * RATIOS[:, None]
    return off


def figures(off):
    return {(f.case, f.quantity): f for f in score(off, RATIOS, LIMITS)}


def test_the_ratio_is_that_of_each_bound_whatever_the_load():
    found = figures(drawn(1.05))
    ratio = found[CASE, "÷ CRB"]
    assert abs(ratio.value - 1.05) < 0.03
    assert (ratio.samples, ratio.verdict) == (2000, "met")
    for load in RATIOS:
        assert abs(found[f"{CASE}, {load:g} Δ0", "÷ CRB"].value - 1.05) < 0.08
    assert abs(found[CASE, "force"].value - 0.67) < 0.05


def test_what_was_not_found_is_counted_apart():
    off = drawn(1.3, frames=20)
    off[2] = np.nan
    found = figures(off)
    assert found[CASE, "not found"].value == 20
    assert found[CASE, "÷ CRB"].samples == 80
    assert found[CASE, "÷ CRB"].verdict == "missed"
    assert np.isnan(found[f"{CASE}, 1 Δ0", "÷ CRB"].value)


def test_the_slope_of_a_fine_pattern_is_that_of_its_waves():
    y, x = np.mgrid[0:60, 0:84].astype(float)
    across, down = 2 * np.pi / 3.5, 2 * np.pi / 5.0  # of waves of 3.5 and 5 px
    image = np.cos(across * (x + 0.5)) + np.cos(down * (y + 0.5))
    along_x, along_y = -across * np.sin(across * (x + 0.5)), -down * np.sin(down * (y + 0.5))
    np.testing.assert_allclose(slope(image, 1), along_x, atol=1e-10)
    np.testing.assert_allclose(slope(image, 0), along_y, atol=1e-10)
    central = np.gradient(image)[1]
    assert np.mean(central**2) < 0.5 * np.mean(along_x**2)
