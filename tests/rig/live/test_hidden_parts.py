"""What hides the pattern is named by its size and place; a worn place is no hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, strategies as st

import dic
import synthetic
from rig.calibration.bench_causes import occlusion
from rig.live.hidden_parts import FRAMES, MEMORY, HiddenParts

PLATE, PIXELS = (254.0, 203.0), (320, 256)


@pytest.fixture(scope="module")
def camera():
    return synthetic.pinhole_above(PLATE, 500.0, PIXELS)


@pytest.fixture(scope="module")
def tiles():
    return dic.lay_tiles(PIXELS[::-1], 16)


@pytest.fixture(scope="module")
def parts(tiles, camera):
    return HiddenParts.of(tiles, camera, 0.5)


@pytest.fixture(scope="module")
def box(tiles, camera):
    """Tiles whose middles lie in a box on the plate, mm."""
    middles = camera.on_plate(tiles.xy, 0.5)

    def hide(low, high):
        return ((middles > low) & (middles < high)).all(axis=1)

    return hide


HAND = (100.0, 60.0), (180.0, 120.0)
SCRATCH = (20.0, 150.0), (50.0, 180.0)


def test_where_nothing_is_hidden_nothing_is_said(parts):
    assert parts.sentence(np.zeros(len(parts.fraction), dtype=bool)) == ""


def numbers(said):
    return [float(part) for part in said.translate(str.maketrans("×(),", "    ")).split()
            if part.replace(".", "").replace("-", "").isdigit()]  # fmt: skip


def test_what_is_in_the_way_is_named_with_its_size_and_place(parts, box):
    said = parts.followed(box(*HAND)).sentence(box(*HAND))
    assert said.startswith("something of ")
    wide, high, x, y = numbers(said)
    assert (wide, high) == pytest.approx((80.0, 60.0), abs=16.0)  # a tile is 13 mm wide
    assert (x, y) == pytest.approx((140.0, 90.0), abs=8.0)


def test_what_is_hidden_in_every_frame_is_worn_and_a_hand_is_not(parts, box):
    for _ in range(FRAMES - 1):
        parts = parts.followed(box(*SCRATCH))
    assert "in the way" in parts.sentence(box(*SCRATCH))
    parts = parts.followed(box(*SCRATCH) | box(*HAND))
    said = parts.sentence(box(*SCRATCH) | box(*HAND))
    passing, worn = said.split(" and the pattern is worn")
    assert numbers(passing)[2:] == pytest.approx((140.0, 90.0), abs=8.0)
    assert numbers(worn)[2:] == pytest.approx((35.0, 165.0), abs=8.0)


def test_a_hand_that_has_gone_is_worn_no_longer(parts, box):
    for _ in range(2 * FRAMES):
        parts = parts.followed(box(*HAND))
    assert parts.worn.any()
    for _ in range(FRAMES):
        parts = parts.followed(np.zeros(len(parts.fraction), dtype=bool))
    assert not parts.worn.any()


def test_what_wears_in_a_long_run_is_known_however_long_it_was(parts, box):
    none = np.zeros(len(parts.fraction), dtype=bool)
    for _ in range(5 * MEMORY):
        parts = parts.followed(none)
    for _ in range(3 * MEMORY):
        parts = parts.followed(box(*SCRATCH))
    np.testing.assert_array_equal(parts.worn, box(*SCRATCH))


@given(st.integers(0, 2**32 - 1))
def test_each_hidden_tile_is_in_the_way_or_worn(parts, seed):
    rng = np.random.default_rng(seed)
    often = rng.uniform(size=len(parts.fraction)) < 0.1
    for _ in range(FRAMES):
        parts = parts.followed(often)
    now = rng.uniform(size=len(often)) < 0.2
    said = parts.sentence(now)
    assert ("worn" in said) == bool((now & often).any())
    assert ("in the way" in said) == bool((now & ~often).any())


def test_images_of_touches_say_what_hides_the_pattern(parts, box):
    none = np.zeros(len(parts.fraction), dtype=bool)

    def shown(*hidden):
        return occlusion(parts, [SimpleNamespace(hidden=one) for one in hidden])

    assert shown(*[none] * 8) == ""
    assert shown(*[box(*SCRATCH)] * 8).startswith("the pattern is worn, or something lies on it")
    said = shown(*[none] * 6, box(*HAND), box(*HAND))
    assert said.startswith("in 2 of 8 images something of")
