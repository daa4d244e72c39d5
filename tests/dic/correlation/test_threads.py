"""Several frames at a time: the same numbers, and nothing of the size of an image set aside."""

import tracemalloc
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import dic

PARTS = "u", "v", "sigma_u", "sigma_v", "zncc", "status", "iterations"
PLACES = np.stack(np.meshgrid(np.arange(30, 160, 9), np.arange(30, 120, 9)), axis=-1).reshape(-1, 2)


def assert_same(one, other):
    for part in PARTS:
        np.testing.assert_array_equal(getattr(one, part), getattr(other, part))


@pytest.mark.parametrize("points", [None, PLACES], ids=["grid", "points"])
def test_threads_find_bit_by_bit_what_one_finds(pattern, reference, points):
    ref = dic.prepare(reference, points=points)
    frames = [pattern.draw((0.3 * k, -0.2 * k)) for k in range(6)]
    alone = [dic.correlate(ref, frame) for frame in frames]
    with ThreadPoolExecutor(3) as pool:
        for _ in range(2):
            for one, other in zip(
                alone, pool.map(lambda f: dic.correlate(ref, f), frames), strict=True
            ):
                assert_same(one, other)


def test_reference_is_not_changed_by_its_frames(pattern, reference):
    ref = dic.prepare(reference)
    kept = {k: v.copy() for k, v in vars(ref).items() if isinstance(v, np.ndarray)}
    dic.correlate(ref, pattern.draw((1.3, 0.4)))
    for name, value in kept.items():
        np.testing.assert_array_equal(getattr(ref, name), value)


def test_tracker_sets_aside_no_image(speckle):
    large = np.clip(np.rint(speckle((700, 800), seed=2).draw()), 0, 255).astype(np.uint8)
    places = np.random.default_rng(0).uniform(40, 660, (72, 2))
    ref = dic.prepare(large, 31, points=places)
    last = dic.correlate(ref, large)
    tracemalloc.start()
    dic.correlate(ref, large, guess=last)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < large.nbytes / 2  # measured 0.19 MB of 0.56 MB
