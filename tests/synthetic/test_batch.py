"""Images by the batch on torch: against the exact renderer, in grey levels and in pixels."""

import subprocess
import sys

import numpy as np
import pytest
import torch

import synthetic

PLATE = (60.0, 46.0)
Z = 0.5
PATTERN = synthetic.Speckle(PLATE, seed=6).draw()
CAMERA = synthetic.pinhole_above(PLATE, stand_off=150.0, pixels=(253, 196))
WARPER = synthetic.prepare_warp(PATTERN, CAMERA, Z)
BATCH = synthetic.prepare_batch(WARPER)


def pressed(points):
    x, y = (np.pi * points / PLATE).T
    w = -1.5 * np.sin(x) ** 2 * np.sin(y) ** 2
    return np.column_stack([0.02 * w, -0.03 * w, w])


def stretched(points):
    moved = (points - (30.0, 23.0)) @ [[0.08, 0.03], [-0.05, -0.06]]
    return np.column_stack([moved, np.zeros(len(points))])


def waved(points):
    x, y = (2 * np.pi * points / (30.0, 25.0)).T
    return np.column_stack([0.1 * np.sin(y), 0.08 * np.cos(x), 0 * x])


def tile_bias(exact, error, side=21):
    """Displacement, px, that least squares on each tile reads out of the error."""
    slopes, found = np.stack(np.gradient(exact)[::-1], axis=-1), []
    for top in range(10, exact.shape[0] - 10 - side, side):
        for left in range(10, exact.shape[1] - 10 - side, side):
            tile = np.s_[top : top + side, left : left + side]
            A, b = slopes[tile].reshape(-1, 2), -error[tile].ravel()
            found.append(np.linalg.lstsq(A, b, rcond=None)[0])
    return np.array(found)


# Bounds: grey levels of 255 (standard deviation), px a tile (worst), px on average.
DISPLACEMENTS = {
    "rest": (lambda points: np.zeros((len(points), 3)), 0.05, 2e-4, 1e-5),
    # Measured 0.14 grey levels, 0.6 mpx, 0.02 mpx.
    "pressed": (pressed, 0.2, 1e-3, 5e-5),
    # Measured 0.21 grey levels, 0.6 mpx, 0.03 mpx; strain of 2 %.
    "waved": (waved, 0.3, 1e-3, 1e-4),
    # Measured 0.70 grey levels, 1.2 mpx, 0.05 mpx: the square of a pixel is not strained.
    "stretched": (stretched, 1.0, 2e-3, 1e-4),
}


@pytest.mark.gpu
def test_a_gpu_draws_what_a_cpu_draws():
    there = synthetic.prepare_batch(WARPER, "cuda")
    fields = np.stack([WARPER.forward(each(WARPER.points)) for each in (pressed, waved)])
    drawn, expected = there.render(fields).cpu(), BATCH.render(fields)
    assert (drawn - expected).abs().max() < 0.05  # grey levels


@pytest.mark.parametrize("name", DISPLACEMENTS)
def test_a_batch_shows_the_exact_image_within_a_stated_error(name):
    displacement, grey, worst, mean = DISPLACEMENTS[name]
    exact = synthetic.render(PATTERN, CAMERA, displacement, None, None, Z)
    fields = np.stack([WARPER.forward(displacement(WARPER.points))] * 2)
    images = BATCH.render(fields).numpy()
    assert images.shape == (2, 1, 196, 253)
    error = images[1, 0] - exact
    bias = tile_bias(exact, error)
    assert error.std() < grey
    assert np.abs(bias).max() < worst
    assert np.abs(bias.mean(axis=0)).max() < mean


def test_the_stated_displacement_is_that_of_what_a_pixel_sees_at_rest():
    field = WARPER.forward(waved(WARPER.points))[None]
    x, y = np.meshgrid(np.arange(253.0), np.arange(196.0))
    points = CAMERA.on_plate(np.column_stack([x.ravel(), y.ravel()]), Z)
    truth = np.full((len(points), 2), np.nan)
    on = ((points > 0) & (points < PLATE)).all(axis=1)
    truth[on] = synthetic.image_motion(CAMERA, points[on], waved(points[on]), Z)
    stated = BATCH.displacement(field)[0].numpy().reshape(2, -1).T
    error = np.abs(stated - truth).reshape(196, 253, 2)
    # Measured 0.2 mpx, and 2.8 mpx at the edge of the plate, where the field is reflected.
    assert np.nanmax(error[24:-24, 24:-24]) < 1e-3
    assert np.nanmax(error) < 5e-3


def test_the_images_of_a_batch_do_not_know_each_other():
    rng = np.random.default_rng(0)
    rows, columns = WARPER.grid
    fields = rng.normal(0, 0.5, (3, rows, columns, 2))
    together = BATCH.render(fields)
    alone = torch.cat([BATCH.render(fields[i : i + 1]) for i in range(3)])
    assert torch.allclose(together, alone, atol=1e-3)


def test_a_part_of_a_batch_is_that_part_of_its_images():
    part = BATCH.part((40, 24), (120, 96))
    rest = np.zeros((1, *part.controls.shape))
    whole = BATCH.render(np.zeros((1, *BATCH.controls.shape)))
    assert torch.allclose(part.render(rest), whole[..., 24:120, 40:160], atol=2e-2)


def test_controls_that_lie_closer_carry_shorter_waves():
    fine = synthetic.prepare_batch(WARPER, spacing=4)
    y = np.arange(196.0)[:, None]
    errors = []
    for batch in (fine, BATCH):
        wave = 0.3 * np.sin(2 * np.pi * batch.controls[..., 1] / 20)
        field = np.stack([wave, 0 * wave], axis=-1)[None]
        stated = batch.displacement(field)[0, 0].numpy()
        errors.append(np.abs(stated - 0.3 * np.sin(2 * np.pi * y / 20))[40:-40, 40:-40].max())
    # Measured 2.7 and 97 mpx.
    assert errors[0] < 4e-3
    assert errors[1] > 20e-3


def test_places_between_pixels_have_a_displacement_too():
    field = WARPER.forward(waved(WARPER.points))[None]
    x, y = np.meshgrid(np.arange(252.0) + 0.5, np.arange(196.0))
    between = BATCH.displacement(field, np.stack([x, y], axis=-1))[0].numpy()
    pixels = BATCH.displacement(field)[0].numpy()
    assert np.abs(between - (pixels[..., 1:] + pixels[..., :-1]) / 2).max() < 5e-3


def test_gradients_flow_back_to_the_field():
    field = torch.zeros((1, *WARPER.grid, 2), requires_grad=True)
    BATCH.render(field)[0, 0, 100, 100].backward()
    assert field.grad is not None
    assert torch.isfinite(field.grad).all()
    assert field.grad.abs().max() > 0


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: BATCH.render(np.zeros((1, 3, 3, 2))), r"must have shape \(B, 28, 35, 2\)"),
        (lambda: BATCH.render(np.full((1, 28, 35, 2), np.nan)), "smaller than the image, 253 px"),
        (lambda: BATCH.displacement(np.full((1, 28, 35, 2), 900.0)), "got 900 px"),
        (lambda: synthetic.prepare_batch(WARPER, device="nonsense"), "device 'nonsense' cannot"),
        (lambda: synthetic.prepare_batch(WARPER, spacing=9), "spacing of control pixels .* 9 px"),
        (lambda: BATCH.part((200, 0), (60, 20)), "part must lie in the image"),
    ],
)
def test_bad_input_is_named_in_one_sentence(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()


def test_torch_is_not_imported_before_a_batch_is_prepared():
    code = "import sys, synthetic; synthetic.BatchWarper; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
