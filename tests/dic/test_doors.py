"""Every public function, given what does not fit: a result or one sentence, and nothing else."""

import functools
import warnings
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import dic

SHAPES = [(), (0,), (3,), (0, 2), (1, 2), (4, 2), (2, 2), (5, 6), (7, 40), (40, 48), (40, 48, 3)]
KINDS = [
    "?",
    "i1",
    "i8",
    "u1",
    "u2",
    ">u2",
    "f2",
    "f4",
    "f8",
    ">f8",
    "g",
    "c16",
    "O",
    "U3",
    "M8[s]",
]
FITTING = ("adapted", "image", "ref", "disp", "eps", "tiles", "blocks", "sums", "pixels", "frames",
           "stills")  # fmt: skip
FILLS = [0, 1, 3, -5, 0.5, 255, np.nan, np.inf, 1e20, 1e300]


def array(shape, kind, fill, seed):
    """Array of one number, or of noise about it if there is a seed."""
    values = np.full(shape, fill)
    if seed:
        values = values + 20 * np.random.default_rng(seed).random(shape)
    with warnings.catch_warnings(action="ignore"), np.errstate(all="ignore"):
        return values.astype(kind)


NUMBERS = st.one_of(
    st.integers(-9, 60),
    st.integers(-(2**80), 2**80),
    st.just(10**400),
    st.floats(),
    st.complex_numbers(),
    st.booleans(),
    st.sampled_from([np.int64(5), np.uint8(7), np.float32(5), np.float64(2.5), np.bool_(True)]),
)
JUNK = st.one_of(
    st.none(),
    NUMBERS,
    st.text(max_size=4),
    st.lists(NUMBERS, max_size=3),
    st.sampled_from([{}, object(), [[1, 2], [3]], [[1.0, 2.0]], ((4, 4), 3), (40, 48), b"x"]),
    st.builds(
        array,
        st.sampled_from(SHAPES),
        st.sampled_from(KINDS),
        st.sampled_from(FILLS),
        st.integers(0, 3),
    ),
)


@functools.cache
def fit():
    """Arguments that fit, by name."""
    image = np.random.default_rng(0).integers(0, 255, (40, 48), dtype=np.uint8)
    ref = dic.prepare(image, 11, 6)
    disp = dic.correlate(ref, image)
    eps = dic.strain(disp, 3)
    tiles = dic.prepare_tiles(image, 8)
    blocks = dic.prepare_blocks(tiles)
    pixels = np.array([[20, 20], [22, 18]])
    return {
        "image": image,
        "ref": ref,
        "disp": disp,
        "eps": eps,
        "tiles": tiles,
        "adapted": dic.adaptive_tiles(ref, image, disp),
        "blocks": blocks,
        "sums": dic.tile_sums(tiles, image),
        "pixels": pixels,
        "frames": [image],
        "stills": [image, image],
    }


GENERAL = {  # functions that are given no more than numbers and arrays, with what fits
    "prepare": {"image": "image", "subset": 11, "step": 6, "order": 1, "roi": None, "points": None,
                "device": None},
    "prepare_stills": {"images": "stills", "subset": 11, "step": 6, "order": 1, "roi": None},
    "correlate": {"ref": "ref", "image": "image", "guess": "disp"},
    "correlate_split": {"ref": "ref", "image": "image", "guess": "disp"},
    "expected_sigma": {"ref": "ref", "noise": 2.0},
    "adaptive_field": {"ref": "ref", "image": "image", "guess": "disp"},
    "adaptive_tiles": {"ref": "ref", "image": "image", "found": "disp"},
    "denoised_tiles": {"seen": np.ones((2, 9, 8)), "noise": np.ones((2, 9, 8)),
                       "valid": np.ones((9, 8), bool)},
    "tiles_at_points": {"found": "disp", "tiles": "adapted"},
    "correlate_sequence": {"ref": "ref", "frames": "frames"},
    "follow_frame": {"ref": "ref", "base": "ref", "state": dic.SequenceState(), "frame": "image"},
    "renewed_reference": {"ref": "ref", "start": "disp", "image": "image"},
    "compose_displacements": {"first": "disp", "second": "disp"},
    "strain": {"disp": "disp", "window": 3, "kind": "small", "slopes": None},
    "strain_invariants": {"eps": "eps"},
    "strain_measure": {"gradient": np.eye(2), "kind": "logarithmic"},
    "strain_operator": {"valid": np.ones((5, 6), bool), "step": 5, "window": 3},
    "smooth": {"disp": "disp", "window": 3, "degree": 1},
    "clipped_status": {"image": "image"},
    "check_image": {"image": "image", "name": "reference"},
    "read_image": {"path": "none.png"},
    "sssig": {"image": "image", "subset": 11, "xy": "pixels"},
    "noise_floor": {"sigma": 2.0, "sssig": [5.0, 6.0]},
    "box_sums": {"plane": "image", "centres": "pixels", "half": 3},
    "lies_inside": {"centres": "pixels", "half": 3, "shape": (40, 48)},
    "spline_coefficients": {"image": "image"},
    "spline_gradient": {"spline": np.ones((40, 48), np.float32)},
    "warp_image": {"spline": np.ones((40, 48), np.float32), "motion": np.ones((2, 34, 42))},
    "mean_intensity_gradient": {"image": "image"},
    "speckle_size": {"image": "image"},
    "sub_pixel_bias": {"image": "image", "subset": 11, "shifts": [0.5]},
    "recommend_settings": {"image": "image", "noise": 2.0, "sigma": 0.1},
    "lay_tiles": {"shape": (40, 48), "size": 8},
    "prepare_tiles": {"image": "image", "size": 8, "prefilter": 0.8},
    "tile_prefilter": {"image": "image", "size": 8, "noise": 2.0},
    "tile_sums": {"reference": "tiles", "image": "image", "flow": None, "flow_gradient": None},
    "prepare_blocks": {"reference": "tiles", "block": 3},
    "tile_gradient": {"blocks": "blocks", "sums": "sums"},
    "tile_displacement": {"blocks": "blocks", "sums": "sums", "noise": 2.0},
    "unbiased_gradient": {"reference": "tiles", "sums": "sums"},
    "fixed_pattern_sums": {"reference": "tiles", "flow": np.ones((12, 2))},
    "aliasing_left": {"flow": np.ones((4, 2))},
    "gain_left": {"flow": np.ones((4, 2))},
}  # fmt: skip


def refusal_of(call):
    """Sentence with which a call refuses; None if it gives a result."""
    try:
        result = call()
        if isinstance(result, Iterator):
            list(result)
    except (ValueError, OSError) as refusal:
        return str(refusal)
    return None


@pytest.mark.parametrize("name", GENERAL)
@settings(max_examples=100, suppress_health_check=list(HealthCheck))
@given(data=st.data(), junk=JUNK)
def test_what_does_not_fit_is_one_sentence(name, data, junk):
    arguments = GENERAL[name] | {
        k: fit()[v] for k, v in GENERAL[name].items() if isinstance(v, str) and v in FITTING
    }
    argument = data.draw(st.sampled_from(sorted(set(arguments) - {"name"})))
    sentence = refusal_of(lambda: getattr(dic, name)(**(arguments | {argument: junk})))
    assert sentence is None or (sentence and "\n" not in sentence)


@pytest.mark.parametrize("write", ["write_hdf5", "write_csv", "draw_overview", "draw_fields"])
@settings(max_examples=40, suppress_health_check=list(HealthCheck))
@given(data=st.data(), junk=JUNK)
def test_what_cannot_be_written_is_one_sentence(tmp_path_factory, write, data, junk):
    path = tmp_path_factory.getbasetemp() / "field"
    images = {"image": fit()["image"]} if write.startswith("draw") else {}
    arguments = images | {"disp": fit()["disp"], "eps": fit()["eps"]}
    argument = data.draw(st.sampled_from(sorted(arguments)))
    arguments |= {argument: junk}
    sentence = refusal_of(lambda: getattr(dic.export, write)(path, *arguments.values()))
    assert sentence is None or (sentence and "\n" not in sentence)


def test_every_public_function_is_tried():
    functions = {name for name in dir(dic) if name.islower()} - {"export"}
    assert functions <= set(GENERAL)


NOISE = 100 + 50 * np.random.default_rng(1).random((40, 48))
UNFIT = {
    "bool": NOISE > 125,
    "int64": NOISE.astype(np.int64),
    "complex": NOISE + 1j,
    "three channels": np.stack([NOISE] * 3, axis=-1),
    "a line": NOISE[0],
    "NaN": np.where(NOISE > 140, np.nan, NOISE),
    "infinite": np.where(NOISE > 140, np.inf, NOISE),
    "huge": NOISE * 1e12,
    "too small": NOISE[:7],
    "text": NOISE.astype(str),
    "nothing": None,
}


def takers(image):
    """Yield calls that take the image as a reference, and two that take it as a frame."""
    a = fit()
    yield lambda: dic.prepare(image, 11, 6)
    yield lambda: dic.prepare_tiles(image, 8)
    yield lambda: dic.recommend_settings(image, noise=1.0, sigma=1.0)
    yield lambda: dic.speckle_size(image)
    yield lambda: dic.sssig(image, 5, [[20, 20]])
    yield lambda: dic.correlate(a["ref"], image)
    yield lambda: dic.tile_sums(a["tiles"], image)


@pytest.mark.parametrize("kind", UNFIT)
def test_every_door_refuses_the_same_images_with_the_same_words(kind):
    sentences = set()
    for call in takers(UNFIT[kind]):
        with pytest.raises(ValueError, match=r"^(reference|deformed) image ") as refusal:
            call()
        sentences.add(str(refusal.value).split(" ", 1)[1])
    assert len(sentences) == 1


@pytest.mark.parametrize("kind", ["u1", "u2", ">u2", "f2", "f4", ">f4", "f8", "g"])
def test_every_door_takes_the_same_images(kind):
    spots = cv2.GaussianBlur(np.random.default_rng(2).normal(0, 1, (40, 48)), (0, 0), 1.5)
    grey = np.rint(128 + 25 * spots / spots.std()).astype(kind)
    for image in (grey, np.asfortranarray(grey), grey[::-1, ::-1]):
        for call in takers(image):
            call()


def test_a_blank_image_is_no_reference_but_a_frame():
    *references, correlate, tile_sums = takers(np.full((40, 48), 7, np.uint8))
    for call in references:
        with pytest.raises(ValueError, match=r"^reference image is blank \(grey level 7 every"):
            call()
    assert not correlate().valid.any()
    assert np.isfinite(tile_sums().ee).all()


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda a: dic.prepare(a["image"], subset=21.0), "subset size .* of px, got 21.0; use 21"),
        (lambda a: dic.prepare(a["image"], 11, step=2.5), "step .* of px, got 2.5; use 2"),
        (lambda a: dic.prepare(a["image"], 11, order=True), "order .*, got True; use an integer"),
        (lambda a: dic.prepare_tiles(a["image"], size=8.0), "tile size .* got 8.0; use 8"),
        (lambda a: dic.lay_tiles((40, 48), np.float32(8)), "tile size .* got 8.0; use 8"),
        (lambda a: dic.lay_tiles((40, 48.0), 8), "side of shape .* got 48.0; use 48"),
        (lambda a: dic.prepare_blocks(a["tiles"], 3.0), "block .* of tiles, got 3.0; use 3"),
        (lambda a: dic.strain(a["disp"], window=5.0), "strain window .* points, got 5.0; use 5"),
        (lambda a: dic.strain_operator(np.ones((5, 6), bool), 5, 3.0), "strain window .* use 3"),
        (lambda a: dic.smooth(a["disp"], window=3.0, degree=1), "smoothing window .* use 3"),
        (lambda a: dic.smooth(a["disp"], 3, degree="1"), "degree .* got '1'; use an integer"),
        (lambda a: dic.sssig(a["image"], 11.0, a["pixels"]), "subset size .* use 11"),
    ],
)
def test_a_number_that_is_no_integer_is_one_sentence(call, sentence):
    with pytest.raises(ValueError, match=f"must be a whole number.*|{sentence}") as refusal:
        call(fit())
    assert "whole number" in str(refusal.value)
    assert refusal.match(sentence)


def test_integers_of_numpy_are_integers():
    a = fit()
    field = dic.correlate(
        dic.prepare(a["image"], np.int32(11), np.uint8(6), np.int64(1)), a["image"]
    )
    np.testing.assert_array_equal(field.u, a["disp"].u)


@settings(max_examples=60)
@given(
    st.sampled_from(["png", "tif", "bmp", "jpg"]),
    st.lists(st.tuples(st.integers(0, 5000), st.integers(0, 255)), max_size=6),
    st.floats(0, 1),
)
def test_any_spoilt_file_is_read_or_one_sentence(tmp_path_factory, suffix, changes, kept):
    from PIL import Image

    path = tmp_path_factory.mktemp("spoilt") / f"a.{suffix}"
    Image.fromarray(fit()["image"]).save(path)
    data = bytearray(path.read_bytes())
    for place, value in changes:
        data[place % len(data)] = value
    path.write_bytes(data[: int(np.ceil(kept * len(data)))])
    sentence = refusal_of(lambda: dic.read_image(path))
    assert sentence is None or "\n" not in sentence
