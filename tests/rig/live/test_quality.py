"""Quality of a frame: what an operator reads, and what warns him."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.fixed_pattern import FixedPattern
from rig.live.frame_estimate import estimate_frame
from rig.live.quality import signs
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

PRESS = (fe.Touch(90.0, 120.0, 3.0),)


@pytest.fixture
def look(small):
    """Sense a frame of a twin, changed by a function; gives its signs by name."""
    scene = small({"source.shift": [0.0, 1.5]})
    twin = build_twin(scene)
    zero = average_reference([twin.frame(k, ()) for k in range(16)])
    chain, _ = build_bench(scene, lambda done, total: None).prepare(zero)

    def look(touches=(), change=lambda image: image, sequence=20):
        image = change(twin.frame(sequence, touches).astype(float)).clip(0, 255).astype(np.uint8)
        frame_estimate = estimate_frame(chain, image, at_rest(chain), Stopwatch(time.monotonic))
        return {sign.name: sign for sign in signs(chain, frame_estimate)}

    return look


def warned(found):
    return {name for name, sign in found.items() if sign.warns}


def test_a_frame_at_rest_gives_no_warning(look):
    found = look()
    assert warned(found) == set()
    assert found["visible pattern"].says == "100%"
    assert found["light"].says == "100% of that at rest"
    assert found["touch, σ"].says == "–"
    assert found["sensor"].says == "not known yet"


def test_a_touch_says_how_sure_it_is(look):
    place, force = look(PRESS)["touch, σ"].says.split(", ")
    assert 0.2 < float(place.removesuffix(" mm")) < 2.0
    assert 0.002 < float(force.removesuffix(" N")) < 0.2


def test_half_the_light_is_said(look):
    found = look(change=lambda image: 0.5 * image)
    assert found["light"].says == "50% of that at rest"
    assert found["light"].warns


def test_a_camera_that_has_moved_is_said(look):
    found = look(sequence=60)
    assert found["camera moved"].says == "1.50 px"
    assert warned(found) == {"camera moved"}


def test_a_hand_is_said(look):
    def hand(image):
        image[100:180, 120:200] = 0.0
        return image

    assert "visible pattern" in warned(look(change=hand))


def test_noise_is_said(look):
    rng = np.random.default_rng(0)
    found = look(change=lambda image: image + rng.normal(0, 3.0, image.shape))
    assert "noise" in warned(found)
    noise, rest = found["noise"].says.removesuffix(" at rest").split(" grey levels, ")
    assert float(noise) ** 2 == pytest.approx(float(rest) ** 2 + 9.0, rel=0.1)


def test_a_image_without_a_pattern_tells_no_misfit(look):
    found = look(change=lambda image: np.full_like(image, 90.0))
    assert found["misfit"].says == "–"
    assert found["misfit"].warns


def test_a_pattern_too_fine_for_the_pixels_is_said(small):
    chain, image = chain_and_image(small())
    references = replace(chain.reference, aliasing=1.0), replace(chain.reference, aliasing=0.0)
    for reference, warns in zip(references, (True, False), strict=True):
        fine = replace(chain, reference=reference)
        assert pattern_sign(fine, image, at_rest(fine)).warns == warns


@pytest.mark.parametrize(("level", "warns"), [(0.0, True), (3.0, False)])
def test_what_stands_on_the_sensor_is_not_blurred_by_a_lens(small, level, warns):
    chain, image = chain_and_image(small())
    left = chain.pixel_noise / chain.reference.steepness(chain.pattern.motions.on_plate)
    fine = replace(chain, reference=replace(chain.reference, aliasing=1.2 * left))
    known = FixedPattern.of(level**2, 0.01)
    state = replace(at_rest(fine), fixed_pattern=known)
    assert pattern_sign(fine, image, state).warns == warns


def chain_and_image(scene):
    """Prepare a chain, and a frame of the plate at rest."""
    twin = build_twin(scene)
    zero = average_reference([twin.frame(k, ()) for k in range(16)])
    chain, _ = build_bench(scene, lambda done, total: None).prepare(zero)
    return chain, twin.frame(20, ())


def pattern_sign(chain, image, state):
    """Give what a frame says of the fineness of the pattern."""
    frame_estimate = estimate_frame(chain, image, state, Stopwatch(time.monotonic))
    (sign,) = (each for each in signs(chain, frame_estimate) if each.name == "pattern")
    return sign
