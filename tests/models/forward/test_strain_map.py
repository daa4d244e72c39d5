"""Touches from strain: the map of a frame, reduced to numbers whose noise is white."""

import numpy as np
import pytest

import dic
import models
from dic.tiles.tile_field import prepare_blocks, tile_displacement
from dic.tiles.tiles import tile_sums

NOISE = 2.0  # grey levels, as the bench of `conftest.py`
TOUCH = [(60.0, 70.0, 1.5)]
WINDOW = 5


@pytest.fixture(scope="module")
def blocks(bench):
    return prepare_blocks(bench.reference, 3)


@pytest.fixture(scope="module")
def strain_map(bench, blocks):
    return models.prepare_strain_map(bench.pattern, blocks, bench.camera, WINDOW)


@pytest.fixture(scope="module")
def measure(bench, blocks, strain_map):
    """Strain map of a frame, the reference moved by what a touch and a camera do."""

    def strain(frame, touches=(), camera=(0.0, 0.0, 0.0, 0.0)):
        motion = bench.pattern.still()
        if touches:
            x, y, force = np.array(touches).T
            motion[:-4] = force @ bench.modes.response(np.column_stack([x, y]))
        motion[-4:] = camera
        sums = tile_sums(bench.reference, frame, bench.pattern.motions.flow(motion))
        return strain_map.strain(tile_displacement(blocks, sums, NOISE))

    return strain


def test_strain_is_that_of_the_displacement_field(bench, blocks, strain_map):
    sums = tile_sums(bench.reference, bench.image(TOUCH))
    field = tile_displacement(blocks, sums, NOISE)
    strain, truth = strain_map.strain(field), dic.strain(field, window=WINDOW)
    np.testing.assert_array_equal(np.isfinite(strain).all(axis=1), truth.valid)
    np.testing.assert_allclose(strain[truth.valid, 0], truth.exx[truth.valid], atol=1e-12)
    np.testing.assert_allclose(strain[truth.valid, 2], truth.exy[truth.valid], atol=1e-12)


def test_a_pressed_plate_reads_as_stated(bench, strain_map, measure):
    measured = strain_map.whiten(measure(bench.image(TOUCH), TOUCH), NOISE)
    truth = 1.5 * strain_map.forward(NOISE).response(np.array([[60.0, 70.0]]))[0]
    assert measured.shape == truth.shape == (len(bench.modes.stiffness),)
    assert np.linalg.norm(measured - truth) < 0.03 * np.linalg.norm(truth)


@pytest.mark.parametrize(
    "drift", [{"shift": (0.3, -0.3)}, {"turn": 1e-3}, {"grow": 1e-3}, {"grow": -5e-4, "turn": 1e-3}]
)
def test_motion_of_the_camera_reads_as_nothing(bench, strain_map, measure, drift):
    seen_turn = -drift.get("turn", 0.0)  # the image's y runs down
    camera = (*drift.get("shift", (0, 0)), seen_turn, drift.get("grow", 0.0))
    strain = measure(bench.image(**drift), camera=camera)
    assert np.mean(strain_map.whiten(strain, NOISE) ** 2) < 0.2  # the noise of a frame gives 1


@pytest.mark.slow
def test_noise_of_the_numbers_is_white_and_sigma_is_that_of_the_strain(
    bench, blocks, strain_map, measure
):
    rng, still = np.random.default_rng(1), bench.image()
    numbers, strains = [], []
    for _ in range(500):
        strain = measure(still + rng.normal(0, NOISE, still.shape))
        strains.append(strain)
        numbers.append(strain_map.whiten(strain, NOISE))
    numbers = np.array(numbers) - np.mean(numbers, axis=0)
    assert numbers.var() == pytest.approx(1.0, abs=0.03)
    # Eigenvalues of a sample of white noise lie between (1 ∓ √(K/N))² (Marchenko and Pastur 1967).
    spread, edge = np.linalg.eigvalsh(np.cov(numbers.T)), np.sqrt(numbers.shape[1] / 500)
    assert spread[0] > 0.9 * (1 - edge) ** 2
    assert spread[-1] < 1.1 * (1 + edge) ** 2
    known = np.isfinite(strain_map.sigma[:, 0])
    ratio = np.std(np.array(strains)[:, known], axis=0, ddof=1) / (NOISE * strain_map.sigma[known])
    assert np.sqrt((ratio**2).mean(axis=0)) == pytest.approx([1.0] * 3, abs=0.03)


@pytest.mark.slow
def test_touches_from_strain_scatter_as_stated(bench, strain_map, measure):
    rng, truth = np.random.default_rng(2), bench.image(TOUCH)
    search = models.prepare_candidates(strain_map.forward(NOISE))
    deviations, pattern_sigma = [], np.sqrt(np.diag(bench.sense(truth).covariance))
    for _ in range(120):
        strain = measure(truth + rng.normal(0, NOISE, truth.shape), TOUCH)
        estimate = models.find(strain_map.whiten(strain, NOISE), search)
        assert estimate.count == 1
        sigma = np.sqrt(np.diag(estimate.covariance))
        deviations.append((np.append(estimate.xy[0], estimate.force) - TOUCH[0]) / sigma)
    assert np.sqrt(np.mean(np.square(deviations))) == pytest.approx(1.0, abs=0.15)
    # Strain throws away where the pattern is: it cannot know more than the pattern does.
    assert (sigma > 0.98 * pattern_sigma).all()
    assert (sigma < 2 * pattern_sigma).all()


def test_a_hand_over_the_plate_leaves_no_numbers_and_no_strain_near_it(bench, strain_map, measure):
    frame = bench.image()
    frame[100:160, 120:200] = 40.0
    strain = measure(frame)
    assert strain_map.whiten(strain, NOISE) is None
    lost = np.isnan(strain[:, 0])
    tiles = bench.reference.tiles.xy
    under = (np.abs(tiles - [160, 130]) < [30, 20]).all(axis=1)
    reach = 8 * (WINDOW // 2 + 2)
    beside = (np.abs(tiles - [160, 130]) > np.array([40, 30]) + reach).any(axis=1)
    assert lost[under].all()
    np.testing.assert_array_equal(lost[beside], np.isinf(strain_map.sigma[beside, 0]))


def test_an_image_that_is_flat_around_the_plate_has_no_strain_there(bench, strain_map):
    places = bench.camera.on_plate(bench.reference.tiles.xy, bench.height)
    size = np.array(bench.modes.plate.size)
    far = ((places < -12) | (places > size + 12)).any(axis=1)
    inner = ((places > 12) & (places < size - 12)).all(axis=1)
    assert np.isinf(strain_map.sigma[far]).all()
    assert np.isfinite(strain_map.sigma[inner]).all()


def test_the_window_must_be_odd(bench, blocks):
    with pytest.raises(ValueError, match=r"^strain window must be odd"):
        models.prepare_strain_map(bench.pattern, blocks, bench.camera, 4)
