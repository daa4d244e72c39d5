"""A camera that is out of focus since the reference was taken: blurred, and not moved."""

import time

import cv2
import numpy as np
import pytest

import fe
import synthetic
from rig.live import registration
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.focus import FoundBlur
from rig.live.frame_estimate import estimate_frame
from rig.live.quality import signs
from rig.live.reported import reported
from rig.live.strain_chain import with_strain
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

PRESS = fe.Touch(150.0, 80.0, 3.0)


@pytest.fixture(scope="module")
def seen(small):
    """Return the chains of the small twin, and its images blurred by σ px before their noise."""
    scene = small()
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    prepared = bench.prepare(average_reference([twin.frame(n, ()) for n in range(16)]))

    clean_images = {
        touches: np.mean([twin.frame(n, touches) for n in range(40, 104)], axis=0)
        for touches in ((), (PRESS,))
    }

    def blurred(sigma, number, touches=(), gain=1.0, noise=scene.sensor.noise):
        clean = clean_images[touches]
        image = gain * (cv2.GaussianBlur(clean, (0, 0), sigma) if sigma else clean)
        image += np.random.default_rng(number).normal(0.0, noise, clean.shape)
        return np.clip(np.rint(image), 0, 255).astype(np.uint8)

    return *prepared, blurred


def compared(chain, image):
    """Register the plate that nobody touches; its amplitudes in their noise, (m,), too."""
    found = registration.register(chain, image, chain.pattern.still(), Stopwatch(time.monotonic))
    assert not found.unusable_reason
    assert found.hidden_fraction < 0.1
    return found, found.pattern.whiten(found.right, chain.noise)


@pytest.mark.parametrize("sigma", [0.5, 0.8, 1.0, 1.3, 1.6])
def test_a_blur_moves_nothing_and_is_known_by_its_width(seen, monkeypatch, sigma):
    chain, _, blurred = seen
    image = blurred(sigma, 3)
    found, amplitudes = compared(chain, image)
    assert 0.6 < np.mean(amplitudes**2) / found.pixel_variance(chain.noise) < 1.4
    assert found.blur_width == pytest.approx(sigma, rel=0.1)
    assert found.pixel_variance(chain.noise) > 1.2
    none = FoundBlur(chain.blurs[0], 0.0)
    monkeypatch.setattr(registration, "find_blur", lambda *_: none)
    _, blurred_amplitudes = compared(chain, image)
    assert np.mean(blurred_amplitudes**2) > 1.5 * np.mean(amplitudes**2)


@pytest.mark.parametrize("radius", [1.0, 2.0])
def test_the_disc_of_a_lens_moves_nothing_either(seen, radius):
    chain, _, blurred = seen
    ratios = []
    for number in range(4):
        clean = blurred(0.0, number, noise=0.0).astype(np.float64)
        image = synthetic.Optics(disc=2 * radius).blur(clean, 1)
        image += np.random.default_rng(number).normal(0.0, 2.0, image.shape)
        found, amplitudes = compared(chain, np.clip(np.rint(image), 0, 255).astype(np.uint8))
        ratios.append(np.mean(amplitudes**2) / found.pixel_variance(chain.noise))
    assert 0.5 < np.mean(ratios) < 1.5


def test_a_sharp_image_keeps_its_noise(seen):
    chain, _, blurred = seen
    every = [compared(chain, blurred(0.2, n)) for n in range(5)]
    assert np.mean([np.mean(one**2) for _, one in every]) == pytest.approx(1.0, abs=0.17)
    assert max(abs(found.blur_width) for found, _ in every) < 0.2
    assert max(found.pixel_variance(chain.noise) for found, _ in every) < 1.05


@pytest.mark.parametrize(
    ("gain", "sigma", "noise"),
    [
        (0.5, 0.0, 2.0),
        (0.38, 0.0, 2.0),
        (0.7, 0.5, 2.0),
        (1.0, 1.0, 2.0),
        (1.0, 1.5, 2.0),
        (1.0, 0.0, 4.0),
        (1.0, 0.6, 4.0),
    ],
)
def test_a_press_errs_by_the_noise_and_the_contrast_of_its_frame(seen, gain, sigma, noise):
    chain, _, blurred = seen
    watch, errors, spread = Stopwatch(time.monotonic), [], []
    for number in range(16):
        image = blurred(sigma, number, (PRESS,), gain, noise)
        found = reported(chain, estimate_frame(chain, image, at_rest(chain), watch))
        assert found.estimate.count == 1
        assert found.estimate.p_value > 1e-4
        errors.append([*found.estimate.xy[0] - (PRESS.x, PRESS.y), found.estimate.force[0] - 3.0])
        spread.append(np.sqrt(np.diag(found.estimate.covariance)))
    z = np.array(errors) / np.array(spread)
    assert z.std(axis=0).mean() == pytest.approx(1.0, abs=0.25)
    assert np.abs(z.mean(axis=0)).max() < 1.5


def test_a_frame_out_of_focus_says_so_on_the_page_and_in_its_sentence(seen):
    chain, strain, blurred = seen
    found = estimate_frame(chain, blurred(1.0, 3), at_rest(chain), Stopwatch(time.monotonic))
    (sign,) = (one for one in signs(chain, found) if one.name == "focus")
    assert (sign.says, sign.warns) == ("blurred by 1.0 px", True)
    assert not found.whole_and_clear  # and teaches nothing of the bench
    assert with_strain(strain, found, Stopwatch(time.monotonic)).from_strain is None
    sharp = estimate_frame(chain, blurred(0.0, 3), at_rest(chain), Stopwatch(time.monotonic))
    (sign,) = (one for one in signs(chain, sharp) if one.name == "focus")
    assert (sign.says, sign.warns) == ("as at rest", False)
    assert sharp.whole_and_clear
    assert with_strain(strain, sharp, Stopwatch(time.monotonic)).from_strain is not None
