"""The sensor: noise of the stated size, unbiased, rounded and clipped."""

import numpy as np
import pytest
from scipy.stats import norm

import synthetic


def captured(sensor: synthetic.Sensor, light: float, seed: int = 0) -> np.ndarray:
    flat = np.full((300, 403), light)
    return sensor.capture(flat, np.random.default_rng(seed)).astype(float)


def test_noise_has_the_stated_spread_and_no_mean():
    levels = captured(synthetic.Sensor(noise=2.0), 0.5)
    exact = 255 * 0.46
    error = 2.0 / np.sqrt(levels.size)
    assert abs(levels.mean() - exact) < 4 * error
    assert levels.std() == pytest.approx(np.hypot(2.0, np.sqrt(1 / 12)), rel=0.01)


def test_noise_is_normal_and_white():
    noise = captured(synthetic.Sensor(noise=1000.0, bits=16), 0.5)
    noise = (noise - 65535 * 0.46) / 1000
    for level in (-3.0, -1.0, 0.5, 2.0, 3.5):
        expected = norm.cdf(level)
        scatter = np.sqrt(expected * (1 - expected) / noise.size)
        assert abs(np.mean(noise < level) - expected) < 5 * scatter
    for shift in ((0, 1), (0, 2), (0, 4), (1, 0)):
        neighbour = np.roll(noise, shift, axis=(0, 1))
        assert abs(np.mean(noise * neighbour)) < 5 / np.sqrt(noise.size)


def test_frames_of_one_generator_differ_and_a_seed_repeats_them():
    sensor, light = synthetic.Sensor(), np.full((20, 30), 0.5)
    rng, again = np.random.default_rng(7), np.random.default_rng(7)
    first, second = sensor.capture(light, rng), sensor.capture(light, rng)
    assert not np.array_equal(first, second)
    assert np.array_equal(first, sensor.capture(light, again))


def test_without_noise_light_is_rounded_to_the_nearest_level():
    light = np.linspace(0, 1, 600).reshape(20, 30)
    sensor = synthetic.Sensor(black=0.1, white=0.9)
    levels = sensor.capture(light, None)
    assert levels.dtype == np.uint8
    assert np.abs(levels - 255 * (0.1 + 0.8 * light)).max() < 0.5 + 1e-4


@pytest.mark.parametrize("light", [0.0, 0.2, 0.7, 1.0])
def test_shot_noise_grows_as_the_root_of_the_light(light):
    sensor = synthetic.Sensor(noise=3.0, bits=12, full_well=9000.0)
    levels, mean = captured(sensor, light), 4095 * (0.2 + 0.52 * light)
    electrons = 9000 * 0.52 * light
    expected = np.sqrt(9 + electrons * (4095 / 9000) ** 2 + 1 / 12)
    assert levels.std() == pytest.approx(expected, rel=0.01)
    assert abs(levels.mean() - mean) < 4 * expected / np.sqrt(levels.size)


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_every_depth_uses_its_whole_range(bits):
    sensor = synthetic.Sensor(noise=0.0, bits=bits, black=0.0, white=1.0)
    levels = sensor.capture(np.array([[0.0, 0.5, 1.0]]), None)
    assert levels.dtype == (np.uint8 if bits == 8 else np.uint16)
    assert levels[0, 0] == 0
    assert abs(int(levels[0, 1]) - (2**bits - 1) / 2) <= 0.5
    assert levels[0, 2] == 2**bits - 1


def test_light_beyond_full_scale_is_clipped():
    sensor = synthetic.Sensor(black=0.0, white=1.0, noise=30.0, bits=12)
    levels = sensor.capture(np.array([[-1.0, 0.0, 1.0, 2.0]]), np.random.default_rng(0))
    assert levels.dtype == np.uint16
    assert levels[0, 0] == 0
    assert levels[0, 3] == 4095


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: synthetic.Sensor(noise=-1.0), "at least 0, got -1.0 grey levels"),
        (lambda: synthetic.Sensor(bits=7), "got 7 bits"),
        (lambda: synthetic.Sensor(full_well=0.0), "full well must be positive, got 0.0 electrons"),
        (lambda: synthetic.Sensor(black=0.8, white=0.2), "black < white"),
        (
            lambda: synthetic.Sensor().capture(np.ones((2, 3)), None, np.empty((3, 2), np.uint8)),
            "out must be",
        ),
    ],
)
def test_bad_sensor_is_named_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()
