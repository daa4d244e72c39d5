"""Whatever theory bends the plate, its displacement is rendered through the same door."""

import numpy as np
import pytest

import fe
import synthetic

PLATE = fe.Plate((60.0, 48.0), thickness=0.6, young=3000.0, poisson=0.38, edges=fe.Clamped())
TOP = PLATE.thickness / 2
MESH = fe.grid(PLATE, 12)
CAMERA = synthetic.pinhole_above(PLATE.size, 150.0, (200, 160))
PATTERN = synthetic.speckle(PLATE.size, diameter=1.5, softness=0.6, seed=2)


def touch(force):
    return [fe.Touch(36.0, 21.0, force, radius=4.0)]


# They deflect by 0.4, 1.4 and 3.4 mm: by up to six times the thickness.
STATES = {
    "linear": lambda: fe.deflect(PLATE, touch(2.0), MESH),
    "reduced": lambda: fe.reduced_plate(PLATE, MESH, force=20.0).solve(touch(20.0)),
    "shell": lambda: fe.solve(PLATE, touch(200.0), mesh=MESH),
}


def seen_at(displacement, px):
    """Plate points seen at pixels, by steps with the slopes of the plate at rest."""
    points = CAMERA.on_plate(px, TOP)
    back = np.linalg.inv(
        CAMERA.jacobian(np.column_stack([points, np.full(len(px), TOP)]))[:, :, :2]
    )
    for _ in range(60):
        moved = np.column_stack([points, np.full(len(px), TOP)]) + displacement(points)
        points = points + np.einsum("nab,nb->na", back, px - CAMERA.project(moved))
    return points


@pytest.mark.parametrize("theory", STATES)
def test_a_bent_plate_shows_the_points_that_its_displacement_moves_into_a_pixel(theory):
    state = STATES[theory]()
    image = synthetic.render(PATTERN, CAMERA, state.displacement, None, None, TOP, samples=1)
    x, y = np.meshgrid(np.arange(12, 190, 7), np.arange(12, 150, 7))
    px = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    light = 255 * PATTERN.intensity(seen_at(state.displacement, px))
    # 1e-4 px at the steepest edge of a spot is 0.015 grey levels; measured 3e-6.
    assert np.abs(image[y, x].ravel() - light).max() < 1e-3
