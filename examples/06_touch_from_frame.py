"""The whole way once, without devices: frames of a pressed plate in, touches with σ out."""

import numpy as np

import dic
import fe
import models
import synthetic

plate = fe.Plate(size=(254.0, 190.0), thickness=2.0, young=3000.0, poisson=0.38)
top, noise = plate.thickness / 2, 2.0  # mm, grey levels
camera = synthetic.pinhole_above(plate.size, stand_off=500.0, pixels=(800, 600))
rng = np.random.default_rng(6)

# The bench: a speckled plate, warped to what the camera sees of it. The edges of the spots are as
# soft as a lens makes them: between the pixels of sharper ones a spline would guess.
linear = fe.Linear(plate, fe.Mesh(plate.size, (64, 48)))
spots = synthetic.speckle(plate.size, diameter=1.6, softness=0.6)
warper = synthetic.prepare_warp(spots, camera, top)
sensor = synthetic.Sensor(noise=noise)


def frame(*touches):
    """Image of the plate under touches, by a camera that has moved by a third of a pixel."""
    displacement = linear.deflect(touches).displacement(warper.points)
    shift = (0.3, -0.2) if touches else (0.0, 0.0)
    return warper.render(displacement, sensor, rng, shift=shift)


# Prepared once: the mean of some frames at rest, and how every part of it responds to plate modes.
rest = np.mean([frame() for _ in range(16)], axis=0)
reference = dic.prepare_tiles(rest, size=8)
motions = models.prepare_motions(fe.modes(plate, 150, linear.mesh), camera, top, reference.tiles)
pattern = models.prepare_pattern(motions, reference)
sigma = noise * np.sqrt(1 + 1 / 16)  # of a frame against the mean of 16
search = models.prepare_candidates(pattern.forward(sigma))

# A frame: the reference is moved to the last estimate, summed against it and solved; twice is
# enough to begin from nothing, once while the touch is followed.
truth = fe.Touch(x=170.0, y=70.0, force=3.0)
image, moved = frame(truth), pattern.still()
for _ in range(2):
    sums = dic.tile_sums(reference, image, *motions.flow_and_gradient(moved))
    right = pattern.gradient(sums, moved)
    estimate = models.find(pattern.whiten(right, sigma), search)
    moved = pattern.amplitudes(estimate, right)

print(f"{estimate.result.value}: {estimate.count}, p = {estimate.p_value:.2f}")
(x, y), force = estimate.xy[0], estimate.force[0]
sx, sy, sf = np.sqrt(np.diag(estimate.touch_covariance(0)))
print(f"x {x:.2f} ± {sx:.2f} mm (true {truth.x:g})")
print(f"y {y:.2f} ± {sy:.2f} mm (true {truth.y:g})")
print(f"force {force:.3f} ± {sf:.3f} N (true {truth.force:g})")
shift_x, shift_y = moved[pattern.count :][:2]
print(f"camera has moved by ({shift_x:+.3f}, {shift_y:+.3f}) px (true +0.300, -0.200)")
