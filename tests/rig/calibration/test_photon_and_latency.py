"""Noise and gain of a camera, and how late a flash is seen, against what was drawn."""

import numpy as np
import pytest

import synthetic
from rig.calibration.latency import measure_latency
from rig.calibration.photon import photon_transfer


def exposures(rng, full_well=9000.0, noise=1.5, frames=12):
    sensor = synthetic.Sensor(noise=noise, black=0.0, white=1.0, full_well=full_well)
    texture = rng.uniform(0.3, 1.0, (120, 160))
    return [
        [sensor.capture(level * texture, rng) for _ in range(frames)] for level in (0.15, 0.4, 0.8)
    ]


def test_gain_and_read_noise_are_those_of_the_sensor(rng):
    found = photon_transfer(exposures(rng))
    assert found.gain == pytest.approx(255 / 9000, rel=0.05)  # grey levels per electron
    assert found.read == pytest.approx(np.hypot(1.5, 12**-0.5), rel=0.05)  # rounding included
    assert found.residual < 0.05


def test_their_uncertainty_is_honest(rng):
    draws = [photon_transfer(exposures(rng, frames=6)) for _ in range(15)]
    errors = np.array([(one.gain - 255 / 9000) / one.sigma_gain for one in draws])
    assert abs(errors.mean()) < 2.0
    assert 0.4 < errors.std() < 2.0


def test_one_brightness_tells_no_gain(rng):
    with pytest.raises(ValueError, match="need images of several brightnesses"):
        photon_transfer([[rng.normal(100, 2, (60, 80)) for _ in range(5)]])
    with pytest.raises(ValueError, match="need 4 still images or more"):
        photon_transfer([[np.zeros((4, 4))] * 3])


def flashes(rng, delay, rate=30.0, count=25):
    """Frames of a camera that sees each flash `delay` s after it was asked for."""
    asked = 1.0 + np.arange(count) * 0.61 + rng.uniform(0, 1 / rate, count)
    captured = np.arange(0, asked[-1] + 2, 1 / rate) + rng.normal(0, 1e-4)
    lit = ((captured[:, None] > asked + delay) & (captured[:, None] < asked + delay + 0.15)).any(1)
    return asked, captured, 40 + 60 * lit + rng.normal(0, 0.5, len(captured))


@pytest.mark.parametrize("delay", [0.02, 0.055, 0.14])
def test_the_delay_is_that_of_the_light_and_half_a_frame(rng, delay):
    found = measure_latency(*flashes(rng, delay))
    assert found.median == pytest.approx(delay + 0.5 / 30, abs=4 * found.sigma)
    assert found.p95 <= delay + 1.1 / 30
    assert (found.flashes, found.missed) == (25, 0)


def test_flashes_that_nobody_sees_are_refused_and_some_are_counted(rng):
    asked, captured, brightness = flashes(rng, 0.05)
    with pytest.raises(ValueError, match="sees 0 of 25 flashes"):
        measure_latency(asked, captured, 40 + rng.normal(0, 0.5, len(captured)))
    brightness[(captured > asked[3]) & (captured < asked[3] + 0.5)] = 40
    assert measure_latency(asked, captured, brightness).missed == 1
