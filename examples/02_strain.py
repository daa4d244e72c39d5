"""Strain of a plate that is stretched and turned, by three definitions, each with its σ."""

import numpy as np
from scipy.linalg import logm

import dic
import synthetic

SIZE = (120.0, 90.0)  # mm
rng = np.random.default_rng(2)
pattern = synthetic.speckle(SIZE, diameter=1.25, softness=0.6)
camera = synthetic.pinhole_above(SIZE, stand_off=500.0, pixels=(480, 360))
sensor = synthetic.Sensor(noise=2.0)

# The gradient of the motion F = 1 + ∇u in the image, where y runs down: 1 % longer along x,
# 0.3 % shorter along y, then turned by 3 degrees.
angle = np.radians(3.0)
turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
F = turn @ np.diag([1.01, 0.997])

# The plate's y runs up in this image, so its shear components change their sign.
flip = np.diag([1.0, -1.0])
gradient = flip @ (F - np.eye(2)) @ flip


def stretch_and_turn(xy):
    """Displacement (K, 3) mm of plate points (K, 2) mm, about the middle of the plate."""
    moved = (xy - np.array(SIZE) / 2) @ gradient.T
    return np.column_stack([moved, np.zeros(len(xy))])


before = synthetic.render(pattern, camera, None, sensor, rng)
after = synthetic.render(pattern, camera, stretch_and_turn, sensor, rng)
measured = dic.correlate(dic.prepare(before, subset=21, step=5), after)

truth = {
    "small": (F + F.T) / 2 - np.eye(2),
    "green-lagrange": (F.T @ F - np.eye(2)) / 2,
    "logarithmic": logm(F.T @ F) / 2,
}
for kind, tensor in truth.items():
    strain = dic.strain(measured, window=5, kind=kind)
    found = np.column_stack([strain.exx, strain.eyy, strain.exy])[strain.valid]
    sigma = np.sqrt(np.mean(strain.sigma[strain.valid] ** 2, axis=0))
    print(f"{kind}, gauge length {strain.vsg} px")
    for n, (name, true) in enumerate(
        {"exx": tensor[0, 0], "eyy": tensor[1, 1], "exy": tensor[0, 1]}.items()
    ):
        mean, scatter = found[:, n].mean(), found[:, n].std()
        print(
            f"  {name} {1e6 * mean:+9.1f} µε, true {1e6 * true:+9.1f}; "
            f"scatter {1e6 * scatter:.0f}, predicted {1e6 * sigma[n]:.0f}"
        )
