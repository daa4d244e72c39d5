"""Draw what a camera sees of a pressed plate, and what of it is bending and what is distance."""

from pathlib import Path

import cv2
import numpy as np

import fe
import synthetic

plate = fe.Plate(size=(254.0, 190.0), thickness=2.0, young=3000.0, poisson=0.38)
bent = fe.deflect(plate, [fe.Touch(x=110.0, y=80.0, force=2.0)], fe.Mesh(plate.size, (56, 42)))
TOP = plate.thickness / 2  # mm, height of the touched face over the middle plane

pattern = synthetic.speckle(plate.size, diameter=1.25, softness=0.6)
camera = synthetic.pinhole_above(plate.size, stand_off=500.0, pixels=(640, 480))
image = synthetic.render(
    pattern, camera, bent.displacement, synthetic.Sensor(noise=2.0), np.random.default_rng(5), TOP
)
path = Path("results") / "pressed_plate.png"
path.parent.mkdir(exist_ok=True)
cv2.imwrite(str(path), image)
print(f"{path}: {image.shape[1]}x{image.shape[0]} px, spread {image.std():.0f} grey levels")

# The same motion without an image: the camera says how far it sees each plate point move.
x, y = np.meshgrid(np.linspace(10.0, 244.0, 79), np.linspace(10.0, 180.0, 69))
points = np.column_stack([x.ravel(), y.ravel()])
moved = bent.displacement(points)
in_plane = moved * (1.0, 1.0, 0.0)
seen = synthetic.image_motion(camera, points, moved, TOP)
of_bending = synthetic.image_motion(camera, points, in_plane, TOP)
largest, bending = (np.linalg.norm(d, axis=1).max() for d in (seen, of_bending))
print(f"plate moves by up to {np.abs(moved[:, 2]).max():.3f} mm away from the camera")
print(f"image moves by up to {largest:.3f} px; by bending alone {bending:.3f} px")

# Most of the strain that such a camera measures is distance: it is signal, and it is modelled.
pitch = x[0, 1] - x[0, 0]
apparent, true = (
    np.gradient(d[:, 0].reshape(x.shape), pitch, axis=1) * camera.scale for d in (seen, of_bending)
)
ratio = np.sqrt(np.mean(apparent**2) / np.mean(true**2))
print(f"exx that the camera shows ÷ exx of the plate: {ratio:.1f} (rms)")
