"""The compiled sums of moved tiles against a spline of SciPy, evaluated pixel by pixel."""

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.ndimage import gaussian_filter

import dic


@pytest.mark.parametrize("size", [7, 16])
@pytest.mark.parametrize("far", [0.4, 9.0])
def test_sums_of_moved_tiles_are_those_of_the_spline(size, far):
    """Beyond the border, too, where the nearest coefficient stands."""
    rng = np.random.default_rng(size)
    grey = 128.0 + 60.0 * gaussian_filter(rng.normal(size=(66, 83)), 1.5) / 0.19
    reference = dic.prepare_tiles(grey.astype(np.float32), size)
    image = rng.integers(0, 255, grey.shape).astype(np.uint8)
    tiles = reference.tiles
    flow = rng.uniform(-far, far, (len(reference.hessian), 2))
    found = dic.tile_sums(reference, image, flow)
    padded = np.pad(reference.coefficients.astype(np.float64), 20, mode="edge")
    knot = BSpline.basis_element(np.arange(-4.0, 5.0), extrapolate=False)
    slope = knot.derivative()
    for t, (x, y) in enumerate(tiles.xy):
        columns, rows = (c - (size - 1) / 2 + np.arange(size) for c in (x, y))
        weigh = {
            name: [
                np.nan_to_num(of(at[:, None] - moved - np.arange(-20.0, count + 20)))
                for at, moved, count in zip((columns, rows), flow[t], grey.shape[::-1], strict=True)
            ]
            for name, of in (("value", knot), ("slope", slope))
        }
        (vx, vy), (sx, sy) = weigh["value"], weigh["slope"]
        f, fx, fy = (down @ padded @ across.T for down, across in ((vy, vx), (vy, sx), (sy, vx)))
        e = image[np.ix_(rows.astype(int), columns.astype(int))] - f
        want = [(fx * e).sum(), (fy * e).sum(), e.sum(), (e * e).sum(), (e * f).sum()]
        have = [*found.gradient[t], found.e[t], found.ee[t], found.ef[t]]
        np.testing.assert_allclose(have, want, rtol=2e-4, atol=0.05 * size**2)
        light = [(fx * f).sum(), (fy * f).sum(), fx.sum(), fy.sum(), (f * f).sum(), f.sum()]
        np.testing.assert_allclose(found.light[t], light, rtol=2e-4, atol=0.05 * size**2)
        hessian = [(fx * fx).sum(), (fx * fy).sum(), (fy * fy).sum()]
        np.testing.assert_allclose(found.hessian[t], hessian, rtol=2e-4, atol=0.05 * size**2)
