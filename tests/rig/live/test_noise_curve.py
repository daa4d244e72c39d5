"""Noise by grey level, and tiles that count by their own."""

import time
from dataclasses import replace

import numpy as np
import pytest

import synthetic
from dic import lay_tiles
from rig.live.baseline import MIN_NOISE, average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.noise_curve import COUNT, grey_levels, tile_weights
from rig.live.registration import register
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

SHOT = synthetic.Sensor(noise=0.5, black=0.02, white=0.9, full_well=1000.0)
"""Its noise has a standard deviation of 1 grey level in the dark, and of 8 in the light."""


@pytest.mark.parametrize("grey", [1, 16])  # of 8 bit and of 12
def test_variance_goes_with_the_grey_level(rng, grey):
    light = grey * rng.uniform(20.0, 220.0, (180, 260))
    frames = [light + rng.normal(0, grey * np.sqrt(2.0 + 0.05 * light / grey)) for _ in range(16)]
    found = average_reference(frames)
    levels = grey_levels(found.image) / grey
    inside = (levels >= 32) & (levels <= 208)
    expected = grey**2 * (2.0 + 0.05 * levels[inside]) * (1 + 1 / 16)
    np.testing.assert_allclose(found.curve[inside], expected, rtol=0.05)
    assert found.curve[0] == pytest.approx(found.curve[1], rel=0.2)  # no pixel is so dark


def test_images_without_noise_weigh_all_tiles_alike():
    image = np.tile(np.arange(0, 250, dtype=np.uint8), (200, 1))
    found = average_reference([image] * 4)
    tiles = lay_tiles(image.shape, 16)
    assert found.curve.tolist() == [MIN_NOISE**2] * COUNT
    np.testing.assert_allclose(tile_weights(found.image, found.noise, found.curve, tiles), 1.0)


def test_a_tile_counts_less_by_its_own_variance(rng):
    light = np.where(np.arange(260) < 130, 60.0, 180.0) + 20.0 * rng.random((180, 260))
    frames = [light + rng.normal(0, np.where(light < 120, 1.0, 3.0)) for _ in range(16)]
    found, tiles = average_reference(frames), lay_tiles(light.shape, 16)
    weight = tile_weights(found.image, found.noise, found.curve, tiles).reshape(tiles.shape)
    assert weight[:, 1] / weight[:, -2] == pytest.approx(9.0, rel=0.1)


def scatter(chain, frames):
    """Variance of frames at rest in the unit of a touch at the dark and at the bright end, (2,)."""
    watch, still = Stopwatch(time.monotonic), at_rest(chain).motion
    seen = [register(chain, frame, still, watch) for frame in frames]
    white = np.array([one.pattern.whiten(one.right, chain.noise) for one in seen])
    touch = chain.estimator.forward.response(np.array([[35.0, 100.0], [220.0, 100.0]]))
    return np.var(white @ (touch / np.linalg.norm(touch, axis=1)[:, None]).T, axis=0)


def test_touches_in_the_dark_and_in_the_light_have_the_variance_that_is_stated(small):
    """One noise for all tiles states too much in the dark, and too little in the light."""
    scene = small({"estimator.modes": 100, "comparison": None})
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    twin.warper.render(np.zeros((len(twin.warper.points), 3)), None, None)
    light = twin.warper.light * np.linspace(0.1, 1.0, twin.warper.light.shape[1])
    rng = np.random.default_rng(3)
    frames = [np.asarray(SHOT.capture(light, rng)) for _ in range(16 + 150)]
    reference = average_reference(frames[:16])
    own = scatter(bench.prepare(reference)[0], frames[16:])
    even = scatter(bench.prepare(replace(reference, curve=None))[0], frames[16:])
    np.testing.assert_allclose(own, 1.0, atol=0.3)  # 0.12 is a standard deviation
    assert even[0] < 0.8
    assert even[1] > 1.3
