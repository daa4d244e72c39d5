"""Touches and presses on a bench whose camera boards have shown, a pattern alike in all tiles."""

import numpy as np
import pytest

import fe
import models
import rig
from models.bench.deviation import deviation
from rig.design.prediction import equal_pattern, fields, image_motions
from rig.design.setup import setup_of

NAMES = [name for name, _ in models.BENCH]
CAMERA = slice(len(fe.BENCH_PARAMETERS), None)
# What boards leave at a stand-off of 500 mm, in one drawing.
SIGMA = np.array([2e-3, 2e-3, 3e-3, 0.3, 0.3, 1.1, 1e-3, 4e-3, 2e-2])
SIZE = (254.0, 254.0)
PLATE = fe.Plate(SIZE, 1.0, 3000.0, 0.38)


def after_boards():
    """Give a bench before presses, its distance tied to its focal length and k1 to k2."""
    even = np.eye(9)
    even[5, 6] = even[6, 5] = 0.6
    even[7, 8] = even[8, 7] = -0.8
    return models.with_camera(models.bench_before(PLATE), even * np.outer(SIGMA, SIGMA))


@pytest.fixture(scope="module")
def watched():
    """Forward model of a plate of 1 mm, and what its camera sees where it stands otherwise."""
    changes = {"plate.thickness": "1 mm", "camera.pixels": [512, 410], "dic.tile": 32}
    given = setup_of(rig.load("twin", changes))
    flat, view = given.plate.build(), given.camera.build(given.plate)
    modal = fe.modal_plate(flat, 40, fe.grid(flat, 16))
    motions = image_motions(given.plate, given.camera, given.tile, modal)
    pattern, whole = equal_pattern(given, motions, 300.0), fields(modal, flat)
    look = models.CameraChange(pattern, whole.whole, view, view.face_height(flat.thickness))
    described = np.zeros(len(models.CAMERA))
    through = whole.through(look.at(described), described)
    return through.forward(pattern.factor / given.noise), look


def test_the_prior_weighs_deviations_by_its_correlations(rng):
    bench = after_boards()
    free = np.ones(len(NAMES), dtype=bool)
    values = np.zeros(len(NAMES))
    values[CAMERA] = SIGMA * rng.normal(size=9)
    beside, derivatives = deviation(values, bench, free)
    known = bench.covariance[CAMERA, CAMERA]
    assert beside @ beside == pytest.approx(values[CAMERA] @ np.linalg.solve(known, values[CAMERA]))
    square = (derivatives.T @ derivatives)[CAMERA, CAMERA]
    sigma = bench.sigma[CAMERA]
    np.testing.assert_allclose(square, np.linalg.inv(known / np.outer(sigma, sigma)), rtol=1e-8)


def drawn_numbers(rng, bench):
    """Draw a camera from what is known of it, and what else is wrong by a half of its σ."""
    values = 0.5 * rng.normal(0.0, bench.prior)
    even = [k for k, name in enumerate(NAMES) if f"{name}_slope" in NAMES]
    values[even] = np.abs(values[even])
    values[[k + 1 for k in even]] = 0.0
    camera = bench.covariance[CAMERA, CAMERA]
    values[CAMERA] = np.linalg.cholesky(camera) @ rng.normal(size=9)
    return values


def on_bench(watched, values):
    forward, look = watched
    return forward.on(values, look.at(values[CAMERA], float(values[1])))


def touches(rng, count):
    return np.column_stack([rng.uniform(0.15, 0.85, (count, 2)) * SIZE, rng.uniform(1, 3, count)])


@pytest.mark.slow
def test_touches_before_presses_are_better_known_after_boards(watched):
    rng, usual, known = np.random.default_rng(3), models.bench_before(PLATE), after_boards()
    estimators = [models.Estimator(watched[0], bench=b, max_touches=1) for b in (usual, known)]
    place, off = [], []
    for _ in range(6):
        values = drawn_numbers(rng, known)
        on = on_bench(watched, values)
        for touch in touches(rng, 4):
            shown = on.read(touch[None])[0]
            shown = shown + rng.standard_normal(len(shown))
            found = [one.fit_whitened(shown, touch[None], count=1) for one in estimators]
            relevant = estimators[1].by_relevance(found[1], shown)
            place.append([np.sqrt(np.trace(one.covariance[:2, :2])) for one in (*found, relevant)])
            error = np.append(relevant.xy[0], relevant.force[0]) - touch
            whole = np.append(found[1].xy[0], found[1].force[0]) - touch
            stated = [np.sqrt(np.diag(one.covariance)) for one in (found[1], relevant)]
            off.append([np.abs(whole / stated[0]), np.abs(error / stated[1])])
    before, after, by_relevance = np.median(place, axis=0)
    assert after < 0.8 * before
    assert by_relevance <= after
    off = np.array(off)
    assert (np.mean(off < 2.0, axis=(0, 2)) > 0.85).all()


@pytest.mark.slow
def test_presses_go_on_from_what_boards_have_shown(watched):
    rng, known = np.random.default_rng(4), after_boards()
    values = drawn_numbers(rng, known)
    on, sigma = on_bench(watched, values), np.array([0.3, 0.3, 0.03])
    made = []
    for touch in touches(rng, 6):
        shown = on.read(touch[None])[0]
        shown = shown + rng.standard_normal(len(shown))
        made.append(models.Press(shown, touch + rng.normal(0.0, sigma), sigma))
    found = models.identify(watched[0], made, known, watched[1])
    usual = models.identify(watched[0], made, models.bench_before(PLATE), watched[1])
    camera = (found.values - values)[CAMERA] / found.sigma[CAMERA]
    assert np.abs(camera).max() < 3.5
    assert (found.sigma[CAMERA] < 1.1 * known.sigma[CAMERA]).all()
    assert (found.sigma[CAMERA][5:] < 0.6 * usual.sigma[CAMERA][5:]).all()
    assert found.measured == known.measured
    one = models.identify(watched[0], made[:1], known, watched[1]).covariance[CAMERA, CAMERA]
    lenses = one[7, 8] / np.sqrt(one[7, 7] * one[8, 8])
    assert lenses < -0.6, "what boards tie together stays tied"


@pytest.mark.slow
def test_a_camera_that_was_knocked_after_boards_is_named(watched):
    rng, known = np.random.default_rng(5), after_boards()
    values = np.zeros(len(NAMES))
    values[NAMES.index("turn_x")] = 0.03
    unknown, made = np.full(3, np.inf), {"knocked": [], "right": []}
    for touch in touches(rng, 8):
        for name, numbers in (("knocked", values), ("right", np.zeros(len(NAMES)))):
            shown = on_bench(watched, numbers).read(touch[None])[0]
            shown = shown + rng.standard_normal(len(shown))
            made[name].append(models.Press(shown, touch, unknown))
    knocked, right = (models.diagnose(watched[0], made[name], known, watched[1]) for name in made)
    assert "the camera's pose" in [cause.name for cause in knocked.named]
    assert not right.named
