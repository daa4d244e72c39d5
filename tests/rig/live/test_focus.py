"""A camera that is out of focus since the reference was taken: blurred, and not moved."""

import time

import cv2
import numpy as np
import pytest

import fe
from rig.live import registration
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

PRESS = fe.Touch(150.0, 80.0, 3.0)


@pytest.fixture(scope="module")
def seen(small):
    """Return the chain of the small twin, and its images blurred by σ px before their noise."""
    scene = small()
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    chain = bench.prepare(average_reference([twin.frame(n, ()) for n in range(16)]))[0]

    def blurred(sigma, number, touches=()):
        clean = np.mean([twin.frame(n, touches) for n in range(40, 104)], axis=0)
        noise = np.random.default_rng(number).normal(0.0, scene.sensor.noise, clean.shape)
        image = cv2.GaussianBlur(clean, (0, 0), sigma) + noise
        return np.clip(np.rint(image), 0, 255).astype(np.uint8)

    return chain, blurred


def whitened(chain, image):
    """Amplitudes of the plate that nobody touches, in their noise."""
    found = registration.register(chain, image, chain.pattern.still(), Stopwatch(time.monotonic))
    assert not found.unusable_reason
    assert found.hidden_fraction < 0.02
    return found.pattern.whiten(found.right, chain.noise)


@pytest.mark.parametrize(("sigma", "most"), [(0.5, 1.3), (0.8, 2.2), (1.0, 3.0)])
def test_a_blur_moves_nothing(seen, monkeypatch, sigma, most):
    chain, blurred = seen
    image = blurred(sigma, 3)
    assert np.mean(whitened(chain, image) ** 2) < most
    monkeypatch.setattr(registration, "sums_without_blur", lambda blur, sums, *_: sums)
    assert np.mean(whitened(chain, image) ** 2) > 1.3 * most


def test_a_sharp_image_keeps_its_noise(seen):
    chain, blurred = seen
    square = np.mean([np.mean(whitened(chain, blurred(0.2, n)) ** 2) for n in range(5)])
    assert 0.8 < square < 1.15


def test_a_press_is_found_in_a_blurred_image(seen):
    chain, blurred = seen
    watch, state, errors = Stopwatch(time.monotonic), at_rest(chain), []
    for number in range(8):
        found = estimate_frame(chain, blurred(0.8, number, (PRESS,)), state, watch)
        state = found.state
        assert found.estimate.count == 1
        errors.append(found.estimate.xy[0] - (PRESS.x, PRESS.y))
    sigma = np.sqrt(np.diag(found.estimate.covariance)[:2])
    assert (np.abs(np.mean(errors[2:], axis=0)) < 3 * sigma).all()
