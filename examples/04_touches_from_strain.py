"""Find two touches, their forces and how sure they are, from the strain of 72 gauges."""

import numpy as np

import fe
import models
from models import gauge_layout

plate = fe.Plate(size=(100.0, 100.0), thickness=1.0, young=3000.0, poisson=0.3)
gauges = gauge_layout.gauges_on_edges(plate.size, spacing=5.0, margin=5.0)
influence = fe.influence(plate, gauges, fe.Mesh(plate.size, (40, 40)))

# What the gauges read: both touches, and noise of 0.5 µε on every channel.
truth = np.array([[31.0, 62.0, 0.4], [68.0, 35.0, 0.7]])  # x and y in mm, force in N
sigma = 0.5e-6
rng = np.random.default_rng(4)
strain = np.einsum("k,kmc->mc", truth[:, 2], influence.strain(truth[:, :2]))
strain += rng.normal(0.0, sigma, strain.shape)

# How many there are is not given.
estimate = models.solve(strain, influence, sigma=sigma)
print(f"{len(gauges)} gauges; {estimate.result.value}: {estimate.count}")
print(f"χ² {estimate.chi2:.0f} for {estimate.dof} degrees of freedom, p = {estimate.p_value:.2f}")
for n, (x, y, force) in enumerate(truth):
    sx, sy, sf = np.sqrt(np.diag(estimate.touch_covariance(n)))
    print(
        f"x {estimate.xy[n, 0]:.2f} ± {sx:.2f} mm (true {x:g}), "
        f"y {estimate.xy[n, 1]:.2f} ± {sy:.2f} mm (true {y:g}), "
        f"force {estimate.force[n]:.3f} ± {sf:.3f} N (true {force:g})"
    )

# A gauge that failed is NaN; the estimate goes on with the others.
strain[:18] = np.nan
without = models.solve(strain, influence, sigma=sigma)
farthest = np.hypot(*(without.xy - truth[:, :2]).T).max()
print(f"without one side of the ring: {without.count} touches, farthest {farthest:.2f} mm off")
