"""Correlate two images of a plate whose motion is known, and see how far off the result is."""

import numpy as np

import dic
import synthetic

SIZE = (120.0, 90.0)  # mm
rng = np.random.default_rng(1)
pattern = synthetic.speckle(SIZE, diameter=1.25, softness=0.6)
camera = synthetic.pinhole_above(SIZE, stand_off=500.0, pixels=(480, 360))
sensor = synthetic.Sensor(noise=2.0)


def stretch(xy):
    """Displacement (K, 3) mm of plate points (K, 2) mm: 2000 µε along x and a shift."""
    x, y = xy.T
    return np.column_stack([0.11 + 2e-3 * x, -0.07 - 6e-4 * y, np.zeros_like(x)])


before = synthetic.render(pattern, camera, None, sensor, rng)
after = synthetic.render(pattern, camera, stretch, sensor, rng)

reference = dic.prepare(before, subset=21, step=5)
measured = dic.correlate(reference, after)

# The camera says exactly how far it saw every point of the plate move.
ok = measured.valid
points = camera.on_plate(measured.xy[ok])
true_u, true_v = synthetic.image_motion(camera, points, stretch(points), z=0.0).T

print(f"points measured: {ok.sum()} of {len(ok)}")
for status in dic.Status:
    if status != dic.Status.OK and (count := np.count_nonzero(measured.status == status)):
        print(f"  left out as {status.name}: {count}")
print(f"motion seen: {true_u.min():.2f} to {true_u.max():.2f} px along x")
for name, found, sigma, true in (
    ("u", measured.u[ok], measured.sigma_u[ok], true_u),
    ("v", measured.v[ok], measured.sigma_v[ok], true_v),
):
    error = found - true
    print(
        f"{name}: bias {1e3 * error.mean():+.2f} mpx, scatter {1e3 * error.std():.2f} mpx, "
        f"predicted {1e3 * np.sqrt(np.mean(sigma**2)):.2f} mpx"
    )
