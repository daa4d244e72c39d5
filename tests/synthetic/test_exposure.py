"""Blur, light, dark corners and a hand: what each does to an exact image."""

from itertools import product

import numpy as np
import pytest

import synthetic

PLATE = (50.0, 36.0)
Z = 0.5
PATTERN = synthetic.Speckle(PLATE, seed=5).draw()
CAMERA = synthetic.pinhole_above(PLATE, stand_off=200.0, pixels=(208, 156))
# A camera that stands nearer, so that the pattern fills the image to its sides.
NEAR = synthetic.Camera((60, 45), 800.0, (30.0, 22.0), CAMERA.T_cam_plate)


def rendered(exposure=None, camera=CAMERA, displacement=None, rng=None):
    return synthetic.render(PATTERN, camera, displacement, None, rng, Z, exposure=exposure)


def bent(points):
    x, y = (np.pi * points / PLATE).T
    return np.column_stack([0.1 * np.sin(y), -0.05 * np.sin(x), -0.5 * np.sin(x) * np.sin(y)])


def blurred(nodes, weights, displacement=None):
    """Weighted mean of exact images, each moved by a node of the spot, px."""
    total = 0.0
    for place, weight in zip(nodes, weights, strict=True):
        aside = synthetic.Camera(NEAR.size, NEAR.focal, NEAR.centre - place, NEAR.T_cam_plate)
        total = total + weight * rendered(None, aside, displacement)
    return total


def gaussian(sigma):
    """Trapezoidal rule, which converges faster than any power for a Gaussian."""
    x = 0.5 * np.arange(-9, 10)
    w = np.exp(-(x**2) / 2) / np.exp(-(x**2) / 2).sum()
    return sigma * np.array(list(product(x, x))), np.outer(w, w).ravel()


def disc(diameter):
    """Product rule of Gauss in r² and evenly spaced angles."""
    t, w = np.polynomial.legendre.leggauss(7)
    angles = 2 * np.pi * np.arange(24) / 24
    r = diameter / 2 * np.sqrt((t + 1) / 2)
    nodes = r[:, None, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return nodes.reshape(-1, 2), np.repeat(w / 2 / 24, 24)


def streak(dx, dy):
    t, w = np.polynomial.legendre.leggauss(15)
    return t[:, None] / 2 * (dx, dy), w / 2


@pytest.mark.parametrize(
    ("optics", "spot"),
    [
        (synthetic.Optics(gaussian=0.4), gaussian(0.4)),
        (synthetic.Optics(gaussian=0.9), gaussian(0.9)),
        (synthetic.Optics(disc=1.5), disc(1.5)),
        (synthetic.Optics(disc=4.0), disc(4.0)),
        (synthetic.Optics(streak=(0.8, -0.5)), streak(0.8, -0.5)),
        (synthetic.Optics(streak=(-3.0, 4.0)), streak(-3.0, 4.0)),
    ],
)
def test_a_point_becomes_the_spot_of_the_lens(optics, spot):
    error = rendered(synthetic.Exposure(optics), NEAR) - blurred(*spot)
    # Measured at most 0.016 grey levels of 255 and 0.002 as standard deviation.
    assert np.abs(error).max() < 0.03
    assert error.std() < 0.005


def test_a_plate_that_moves_is_blurred_where_it_has_gone():
    exposure = synthetic.Exposure(synthetic.Optics(streak=(2.0, 1.0)))
    error = rendered(exposure, NEAR, bent) - blurred(*streak(2.0, 1.0), bent)
    assert np.abs(error).max() < 0.03


def test_blurs_of_several_causes_add_up():
    spots = [{"gaussian": 0.8}, {"disc": 2.0}, {"streak": (1.0, 2.0)}]
    contrast = np.std(rendered())
    for count in (1, 2, 3):
        parts = {name: width for spot in spots[:count] for name, width in spot.items()}
        softer = np.std(rendered(synthetic.Exposure(synthetic.Optics(**parts))))
        assert softer < 0.97 * contrast
        contrast = softer


def test_light_varies_over_the_plate_and_the_projector_adds_its_own():
    lamp = synthetic.polynomial_light([[0.7, 0.1], [0.4, 0.0]], PLATE)
    discs = synthetic.projected_discs([(20.0, 25.0)], radius=5.0, level=0.5)
    lit = rendered(synthetic.Exposure(light=synthetic.Light(lamp, discs)))
    x, y = np.meshgrid(np.arange(208.0), np.arange(156.0))
    points = CAMERA.on_plate(np.column_stack([x.ravel(), y.ravel()]), Z)
    r = np.hypot(*(points - (20.0, 25.0)).T).reshape(156, 208)
    even = (0.7 + 0.1 * points[:, 1] / 36 + 0.4 * points[:, 0] / 50).reshape(156, 208)
    expected = rendered() * (even + 0.5 * (r < 5))
    away = np.abs(r - 5) > 0.3
    assert np.allclose(lit[away], expected[away], atol=1e-9)


def test_corners_lose_their_light_and_the_middle_none():
    dark, plain = rendered(synthetic.Exposure(synthetic.Optics(vignetting=0.3))), rendered()
    assert dark[0, 0] == pytest.approx(0.7 * plain[0, 0])
    assert dark[155, 207] == pytest.approx(0.7 * plain[155, 207])
    assert np.allclose(dark[77:79, 103:105], plain[77:79, 103:105], rtol=1e-4)
    assert dark[78, 0] == pytest.approx(0.85 * plain[78, 0], rel=1e-4)


def test_flicker_changes_the_whole_image_from_frame_to_frame():
    flicker = synthetic.Exposure(light=synthetic.Light(flicker=0.05))
    rng, light = np.random.default_rng(3), np.full((156, 208), 0.5)
    frames = [flicker.apply(light, CAMERA, Z, rng) for _ in range(100)]
    assert all(np.ptp(frame) == 0 for frame in frames)
    gain = np.array([frame[0, 0] / 0.5 for frame in frames])
    assert gain.std() == pytest.approx(0.05, rel=0.25)
    assert abs(gain.mean() - 1) < 4 * 0.05 / np.sqrt(100)
    assert np.array_equal(flicker.apply(light, CAMERA, Z, None), light)


def test_a_hand_hides_what_lies_inside_its_outline():
    outline = np.array([[60.0, 40.0], [150.0, 30.0], [120.0, 80.0], [150.0, 145.0], [70.0, 130.0]])
    hand = synthetic.Occluder(outline, shade=0.25, border=6.0)
    hidden, hidden_part = rendered(synthetic.Exposure(occluder=hand)), hand.coverage((156, 208))
    plain = rendered()
    assert np.allclose(hidden[hidden_part == 1], 255 * 0.25)
    assert np.array_equal(hidden[hidden_part == 0], plain[hidden_part == 0])
    assert hidden_part[90, 100] == 1
    assert hidden_part[90, 145] == 0  # in the hollow of the outline
    assert hidden_part[85, 65] == pytest.approx(0.5, abs=0.2)
    x, y = outline.T
    area = abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2
    # A soft border hides as much outside as it shows inside, but for the corners.
    assert hidden_part.sum() == pytest.approx(area, rel=0.005)


def test_the_border_of_a_hand_is_as_wide_as_stated_about_its_outline():
    outline = np.array([[20.0, -50.0], [300.0, -50.0], [300.0, 300.0], [20.0, 300.0]])
    row = synthetic.Occluder(outline, border=8.0).coverage((30, 60))[15]
    t = np.clip((np.arange(60.0) - 20.0) / 8.0 + 0.5, 0, 1)
    assert np.allclose(row, t * t * (3 - 2 * t), atol=1e-12)


def test_what_is_absent_changes_nothing():
    empty = synthetic.Exposure(synthetic.Optics(), synthetic.Light())
    assert np.array_equal(rendered(empty), rendered())


def test_more_light_saturates_the_sensor():
    bright = synthetic.Exposure(light=synthetic.Light(lambda points: np.full(len(points), 2.0)))
    image = synthetic.render(PATTERN, CAMERA, None, synthetic.Sensor(), None, Z, exposure=bright)
    assert np.mean(image == 255) > 0.2


def square(**parts):
    return synthetic.Occluder(np.array([[0, 0], [9, 0], [9, 9.0]]), **parts)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: synthetic.Optics(gaussian=-1), "gaussian of the blur must be at least 0"),
        (lambda: synthetic.Optics(disc=np.nan), "disc of the blur"),
        (lambda: synthetic.Optics(streak=(0, np.inf)), "streak of the blur must be finite"),
        (lambda: synthetic.Optics(vignetting=1.5), "vignetting must lie in 0 to 1"),
        (lambda: synthetic.Light(flicker=-0.1), "flicker must be at least 0"),
        (lambda: synthetic.polynomial_light([1.0], PLATE), "coefficients of the light"),
        (lambda: synthetic.projected_discs([(0, 0)], 0, 1), "radius and border of a disc"),
        (lambda: square(border=0), "border of the hand must be positive"),
        (lambda: square(shade=-1), "shade of the hand"),
        (lambda: synthetic.Occluder(np.zeros((2, 2))), "needs 3 corners or more, got 2"),
        (
            lambda: rendered(synthetic.Exposure(light=synthetic.Light(lambda p: p))),
            r"light of the lamp must be \(32448,\)",
        ),
        (
            lambda: rendered(
                synthetic.Exposure(light=synthetic.Light(None, lambda p: -p[:, 0] - 9))
            ),
            "light of the projector must be at least 0",
        ),
    ],
)
def test_bad_input_is_named_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()
