"""Bad input ends in one sentence that names the quantity, the value and the remedy."""

import numpy as np
import pytest

import dic


def refused(sentence):
    return pytest.raises(ValueError, match=sentence)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"subset": 30}, "subset size must be odd, got 30 px; use 29 or 31"),
        ({"subset": 3}, "at least 5 px"),
        (
            {"subset": 201},
            "subset of 201 px is larger than the image of 190x150 px; use at most 149",
        ),
        ({"step": 0}, "step must be at least 1 px, got 0 px"),
        ({"order": 3}, "order of the shape function must be 0, 1 or 2, got 3"),
        ({"roi": np.zeros((150, 190), bool)}, "roi leaves no pixel"),
        ({"roi": np.ones((190, 150), bool)}, r"roi has shape \(190, 150\)"),
        ({"points": [[300.0, 5.0]]}, r"point \(300, 5\) px lies outside"),
        ({"points": [[np.nan, 5.0]]}, "lies outside"),
        (
            {"points": dic.Grid(np.arange(20, 90, 5), np.arange(20, 70, 5), 21, 5), "step": 9},
            "grid is laid for subset 21 px and step 5 px, got 21 and 9 px",
        ),
        (
            {"points": dic.Grid(np.arange(20, 90, 4), np.arange(20, 70, 5), 21, 5)},
            "lines of the grid must be whole px, 5 px apart",
        ),
        ({"points": [1.0, 2.0]}, r"points must be \(N, 2\)"),
        ({"points": np.zeros((0, 2))}, r"points must be \(N, 2\)"),
    ],
)
def test_prepare_refuses(reference, options, sentence):
    with refused(sentence) as refusal:
        dic.prepare(reference, **options)
    assert "\n" not in str(refusal.value)


SPOILT = [
    (
        lambda image: np.where(image > 200, np.nan, image),
        "image holds .* pixels that are not finite",
    ),
    (lambda image: np.stack([image] * 3, axis=-1), "image has 3 channels; convert it to grey"),
    (lambda image: image.astype(np.int32), "image must be uint8, uint16 or float, got int32"),
    (lambda image: image[0], r"image must be \(H, W\)"),
]


@pytest.mark.parametrize(("spoil", "sentence"), SPOILT)
def test_spoilt_images_are_refused_as_reference_and_as_frame(reference, spoil, sentence):
    with refused(f"^reference {sentence}"):
        dic.prepare(spoil(reference))
    with refused(f"^deformed {sentence}"):
        dic.correlate(dic.prepare(reference), spoil(reference))


def test_reference_without_a_pattern_is_refused(reference):
    with refused(r"^reference image is blank \(grey level 7 everywhere\); it needs a pattern"):
        dic.prepare(np.full_like(reference, 7))


def test_grid_off_the_image_is_refused(reference):
    with refused(r"^point \(190, 20\) px lies outside the image of 190x150 px"):
        dic.prepare(reference, points=dic.Grid(np.arange(20, 200, 5), np.arange(20, 70, 5), 21, 5))


def test_correlate_refuses_a_pair_of_different_size(reference):
    with refused("reference is 190x150 px, deformed is 180x150 px"):
        dic.correlate(dic.prepare(reference), reference[:, :180])


def test_correlate_refuses_a_guess_of_another_grid(reference):
    ref = dic.prepare(reference)
    other = dic.correlate(dic.prepare(reference, step=9), reference)
    for guess in (other, np.zeros((3, 2))):
        with refused("guess must be"):
            dic.correlate(ref, reference, guess=guess)


def test_sssig_refuses_a_subset_off_the_image(reference):
    with refused(r"subset of 21 px at \(3, 40\) px leaves the image"):
        dic.sssig(reference, 21, [[3.0, 40.0]])


def test_unknown_name_of_the_package():
    with pytest.raises(AttributeError, match="corelate"):
        _ = dic.corelate
