"""What is known of a bench: before presses, from them, and in the σ of a touch.

The plate is the modal plate itself here: these tests hold the inference, and prove nothing about
plates. What the modal plate is worth stands in tests/fe/modal.
"""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models
from models.bench import identify as identification, joint
from models.bench.marginal import own_error
from models.bench.scatter import weighed
from models.forward.bench_forward import ASTRAY
from models.inverse import marginal_search

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
PLATE_NUMBERS = len(fe.BENCH_PARAMETERS)
EVEN = [k for k, name in enumerate(NAMES) if f"{name}_slope" in NAMES]  # compliances of edges
SLOPES = [k + 1 for k in EVEN]
NOISE = 2e-3  # of an amplitude, mm²
PLACES = [(x, y) for x in (35.0, 75.0, 115.0) for y in (30.0, 55.0, 80.0)]


@pytest.fixture(scope="module")
def forward(modal_bench):
    return modal_bench(PLATE, NOISE)


def drawn_bench(rng):
    """Draw numbers of a bench from its prior; edges only give, and all along."""
    prior = models.prior_sigma(PLATE)[:PLATE_NUMBERS]
    drawn = rng.normal(0.0, prior)
    drawn[EVEN] = np.abs(drawn[EVEN])
    drawn[SLOPES] = rng.uniform(-0.7, 0.7, 8) * drawn[EVEN]
    return np.concatenate([drawn, np.zeros(len(models.CAMERA))])


@pytest.fixture(scope="module")
def true():
    return drawn_bench(np.random.default_rng(4))


def measure(forward, true, touches, rng):
    values = forward.on(true, None).read(np.asarray(touches, dtype=float))[0]
    return values + rng.standard_normal(len(values))


def presses(forward, true, places=PLACES, sigma=(0.1, 0.1, 0.01), seed=1):
    rng = np.random.default_rng(seed)
    made = []
    for x, y in places:
        touch = np.array([x, y, rng.uniform(1.0, 4.0)])
        label = touch + rng.normal(0.0, sigma)
        made.append(models.Press(measure(forward, true, [touch], rng), label, np.array(sigma)))
    return made


@pytest.fixture(scope="module")
def identified(forward, true):
    return models.identify(forward, presses(forward, true), models.bench_before(PLATE))


def test_numbers_are_found_within_their_sigma(identified, true):
    plate = slice(len(fe.BENCH_PARAMETERS))
    off = (identified.values - true)[plate] / identified.sigma[plate]
    assert np.sqrt(np.mean(off**2)) < 1.5
    assert np.abs(off).max() < 4.0


def test_presses_determine_some_numbers_and_name_the_others(identified):
    assert {"young", "sag"} <= set(NAMES) - set(identified.undetermined)
    assert {name for name, _ in models.CAMERA} <= set(identified.undetermined)
    assert (identified.sigma <= identified.prior * (1 + 1e-9)).all()


def test_held_out_presses_are_found_to_their_labels(identified):
    assert identified.held_out.count == len(PLACES)
    assert identified.held_out.place < 0.6
    assert identified.held_out.force < 0.03


def test_edges_of_a_plate_in_compression_do_not_push(forward):
    values = np.zeros(len(NAMES))
    values[[NAMES.index("tension_xx"), NAMES.index("tension_yy")]] = -0.25, -0.2
    found = models.identify(forward, presses(forward, values), models.bench_before(PLATE))
    for name in (name for name in NAMES if f"{name}_slope" in NAMES):
        (middle, _), (slope, _) = found[name], found[f"{name}_slope"]
        allowed = 0.1 * found.prior[NAMES.index(name)]
        assert middle - abs(slope) > -allowed, name
    assert found["tension_xx"][0] == pytest.approx(-0.25, abs=5 * found["tension_xx"][1])


@pytest.mark.parametrize(("left", "low", "high"), [(0.0, 0.0, 0.01), (0.05, 0.03, 0.08)])
def test_presses_show_what_the_plate_remembers(forward, true, left, low, high):
    made, before = list[models.Press](), 0.0
    for press in presses(forward, true):
        shown = forward.on(true, None).read(press.touch[None])[0]
        made.append(models.Press(press.measured + left * before, press.touch, press.sigma))
        before = shown
    found = models.identify(forward, made, models.bench_before(PLATE))
    assert low < found.memory < high


def test_a_bench_is_described_in_the_units_in_which_it_ended(forward, true, monkeypatch):
    """The last turn judges once more how wide each prior is; normal equations go with it."""
    ended, describe = list[identification._Stage](), identification._described

    def kept(stage, causes, limits):
        ended.append(stage)
        return describe(stage, causes, limits)

    monkeypatch.setattr(identification, "_described", kept)
    models.identify(forward, presses(forward, true), models.bench_before(PLATE))
    (stage,) = ended
    scales = stage.problem.scales / stage.problem.prior.prior[stage.problem.free]
    assert np.abs(np.log(scales)).max() > 0.3, "causes have turned out to be small"
    given = zip(stage.problem.factors, stage.problem.presses, stage.seen, strict=True)
    for (factor, press, on), touch, term in zip(
        given, stage.state.touches, stage.terms, strict=True
    ):
        _, own, shared = joint.whiten_all(stage.problem, on, factor, press, touch)
        np.testing.assert_allclose(term.bench, shared.T @ shared, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(term.mixed, shared.T @ own, rtol=1e-6, atol=1e-3)


def test_a_mislabelled_press_is_widened(forward, true, identified):
    given = presses(forward, true)
    given[4] = models.Press(
        given[4].measured, given[4].touch + np.array([30.0, 0.0, 0.0]), given[4].sigma
    )
    found = models.identify(forward, given, models.bench_before(PLATE))
    assert found.outliers == (4,)
    assert found.held_out.count == len(PLACES) - 1, "what is known to be wrong proves nothing"
    assert found.held_out.place < 1.5
    off = (found.values - true)[:2] / found.sigma[:2]
    assert np.abs(off).max() < 5.0


@pytest.mark.slow
def test_a_list_says_what_its_labels_are_worth(forward, true, identified):
    place, force = identified.label_sigma
    assert 0.05 < place < 0.3
    assert 0.002 < force < 0.02
    given = presses(forward, true)
    made = np.array([one.touch for one in given])
    assert np.abs(identified.touches - made)[:, :2].max() < 1.0
    for k, factor in enumerate([0.6, 1.6] * 4 + [0.6]):
        touch = given[k].touch * (1.0, 1.0, factor)
        given[k] = replace(given[k], touch=touch, sigma=given[k].sigma * (1.0, 1.0, factor))
    found = models.identify(forward, given, models.bench_before(PLATE))
    assert found.label_sigma[1] > 0.2, "forces that contradict each other are believed less"


def test_a_descent_that_has_not_ended_goes_on_in_another_turn(forward, true, monkeypatch):
    def descend(*given):
        state, terms, _ = joint.descend(*given)
        turns.append(len(turns) + 1)
        return state, terms, len(turns) != 3

    turns = []
    monkeypatch.setattr(identification, "descend", descend)
    given = presses(forward, true, PLACES[:3])
    found = models.identify(forward, given, models.bench_before(PLATE), None, ("young", "sag"))
    assert found.converged
    assert turns == [1, 2, 3, 4]


FRAMES, REFERENCES = 12, 16


def of_one_reference(forward, true, rng):
    """Give presses of twelve frames against one reference of sixteen, whose noise all share."""
    one = 1.0 + 1.0 / REFERENCES
    still = rng.normal(0.0, np.sqrt(1.0 / REFERENCES / one), len(forward.whitening))
    made = []
    for x, y in PLACES:
        touch = np.array([x, y, rng.uniform(0.3, 1.0)])
        seen = forward.on(true, None).read(touch[None])[0] + still
        seen = seen + rng.normal(0.0, np.sqrt(1.0 / FRAMES / one), len(seen))
        sigma = np.array([np.inf, np.inf, 0.01 * touch[2]])
        start = touch + np.array([3.0, -2.0, rng.normal(0.0, sigma[2])])
        made.append(models.Press.of_frames(seen, start, sigma, (FRAMES, REFERENCES), None))
    return made


@pytest.mark.slow
def test_the_noise_of_one_reference_is_found_and_enters_the_sigma(forward):
    """Eight benches; their edges apart, which give and never push, as no normal law has it."""
    rng, prior = np.random.default_rng(8), models.bench_before(PLATE)
    inner, within, errors = slice(NAMES.index("rotation_west")), [], []
    for _ in range(8):
        true = drawn_bench(rng)
        shared = of_one_reference(forward, true, rng)
        apart = [replace(one, noise=one.total_noise, reference=0.0) for one in shared]
        off = [models.identify(forward, each, prior) for each in (shared, apart)]
        known = off[0].known[inner]
        off = [((one.values - true)[inner] / off[0].sigma[inner])[known] for one in off]
        within.append(np.abs(off[0]))
        errors.append([np.median(np.abs(one)) for one in off])
    assert 0.58 < np.mean(np.concatenate(within) < 1.0) < 0.78
    assert np.mean(np.concatenate(within) < 2.0) > 0.9
    found, left = np.mean(errors, axis=0)
    assert found < 0.9 * left


class Slanted:
    """A look of a camera whose motions leave something, whatever its numbers are."""

    def __init__(self, forward, uneven):
        seeing = forward.fields.seeing
        none = np.zeros((len(models.CAMERA), *seeing.shape)), np.zeros(seeing.shape)
        self.seen = models.Seen(seeing, *none, uneven)

    def at(self, values, thicker=0.0, near=None):
        return self.seen


def test_what_a_camera_that_moved_leaves_is_no_bench(forward, true, identified):
    rng = np.random.default_rng(6)
    uneven = 0.05 * rng.standard_normal((forward.whitening.shape[1], 4))
    moved = rng.standard_normal((len(PLACES), 4))
    made = [
        replace(press, measured=press.measured + forward.whitening @ (uneven @ by), moved=by)
        for press, by in zip(presses(forward, true), moved, strict=True)
    ]
    prior = models.bench_before(PLATE)
    found = models.identify(forward, made, prior, Slanted(forward, uneven))
    unknown = models.identify(forward, made, prior)
    sigma = np.sqrt(np.diag(identified.covariance))[:PLATE_NUMBERS]
    known = sigma > 0
    off, without = (
        (np.abs(each.values - identified.values)[:PLATE_NUMBERS] / sigma)[known]
        for each in (found, unknown)
    )
    assert off.max() < 0.05
    assert without.max() > 1.0


def test_an_error_of_the_model_says_nothing_of_what_touches_of_unknown_force_take(forward):
    """Light touches take a stiffer plate for less force, whatever all of them leave out alike."""
    unknown, rng = np.full(3, np.inf), np.random.default_rng(3)
    touches = [np.array([x, y, rng.uniform(0.01, 0.04)]) for x, y in PLACES]
    made = [models.Press(forward.read(one[None])[0], one, unknown) for one in touches]
    prior = models.bench_before(PLATE)
    problem = joint.pose(made, prior, None, ["young", "thickness_x"], forward)
    state = joint.start(problem)
    seen = joint.views(forward, problem)
    problem = replace(weighed(problem, seen, state, 0.0), discrepancy=0.0)
    young, uneven = np.diag(identification._shared_slope(problem, seen, state, 0.5))
    assert 0.0 <= young < 1e-6 * uneven


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.0, 0.005, 0.03])
def test_what_the_model_leaves_out_widens_the_sigma_and_the_covariance_stays_one(
    forward, true, size
):
    rng, prior = np.random.default_rng(10), models.bench_before(PLATE)
    given = of_one_reference(forward, true, rng)
    made = []
    for one in given:
        error = size * np.sqrt(own_error(one.measured)) * rng.normal(size=len(one.measured))
        made.append(replace(one, measured=one.measured + error))
    found, right = (models.identify(forward, each, prior) for each in (made, given))
    used = found.prior > 0
    scaled = (found.covariance / np.outer(found.prior, found.prior).clip(1e-300))[used][:, used]
    assert np.linalg.eigvalsh(scaled).min() > 0.0
    assert found.discrepancy > size / 2
    wider = found.sigma[right.known] / right.sigma[right.known]
    assert np.median(wider) > 2.0 if size else np.all(wider == 1.0)


def test_a_press_that_a_hand_hid_a_part_of_shows_the_same_reference(forward, true):
    given = of_one_reference(forward, true, np.random.default_rng(9))
    prior = models.bench_before(PLATE)
    whole = models.identify(forward, given, prior)
    seen = np.ones(len(forward.whitening))
    seen[::9] = 0.0
    hidden = [replace(one, measured=seen * one.measured) for one in given[:4]]
    hidden = [replace(one, whitening=seen[:, None] * forward.whitening) for one in hidden]
    found = models.identify(forward, [*hidden, *given[4:]], prior)
    far = np.abs(found.values - whole.values)[whole.known] / whole.sigma[whole.known]
    assert far.max() < 2.5


def test_a_press_states_the_noise_of_its_frames_and_of_its_reference():
    zero = np.zeros(3)
    press = models.Press.of_frames(zero, zero, np.ones(3), (4, 4), None)
    assert press.noise == pytest.approx(press.reference) == pytest.approx(np.sqrt(0.2))
    assert models.Press.of_frames(zero, zero, np.ones(3), (1, 16), None).total_noise == 1.0
    half_pixels = models.MotionErrors(0.5, 0.2)  # and what aliasing leaves, the same in all frames
    press = models.Press.of_frames(zero, zero, np.ones(3), (4, 4), None, None, half_pixels)
    assert press.noise == pytest.approx(np.sqrt(0.1 + 0.2))
    assert press.reference == pytest.approx(np.sqrt(0.1))
    with pytest.raises(ValueError, match=r"reference must lie in 0 to 1, got 2; use 1/√n"):
        models.Press(zero, zero, np.ones(3), reference=2.0)


def test_places_need_not_be_known(forward, true):
    given = [
        models.Press(
            one.measured, one.touch + np.array([3.0, -2.0, 0.0]), np.array([np.inf, np.inf, 0.02])
        )
        for one in presses(forward, true)
    ]
    found = models.identify(forward, given, models.bench_before(PLATE))
    assert found.held_out is None
    # Stiffness is what all forces share.
    stiffness = found.values[0] + 3 * found.values[1]
    assert abs(stiffness - (true[0] + 3 * true[1])) < 0.08


def test_touches_on_an_unknown_bench_scatter_as_stated(forward):
    prior = models.bench_before(PLATE)
    estimator = models.Estimator(forward, bench=prior, max_touches=3)
    rng, squares, counts = np.random.default_rng(7), [], []
    for _ in range(12):
        touch = np.array([rng.uniform(25, 125), rng.uniform(25, 85), rng.uniform(1, 3)])
        bench = rng.normal(0.0, 0.5 * prior.prior)
        bench[EVEN] = np.abs(bench[EVEN])
        bench[SLOPES], bench[PLATE_NUMBERS:] = 0.0, 0.0
        estimate = estimator.fit_whitened(measure(forward, bench, [touch], rng))
        counts.append(estimate.count)
        if estimate.count == 1:
            off = np.append(estimate.xy[0] - touch[:2], estimate.force[0] - touch[2])
            squares.append(off @ np.linalg.solve(estimate.covariance, off) / 3)
    assert counts.count(1) >= 11
    assert np.mean(squares) < 2.0


def test_noise_scatters_from_frame_to_frame_and_what_is_not_known_of_the_bench_does_not(forward):
    prior, touch = models.bench_before(PLATE), np.array([62.0, 48.0, 2.0])
    estimator = models.Estimator(forward, bench=prior, max_touches=1)
    rng, scattered, shifted = np.random.default_rng(11), [], []
    for _ in range(10):
        bench = rng.normal(0.0, 0.5 * prior.prior)
        bench[EVEN] = np.abs(bench[EVEN])
        bench[SLOPES], bench[PLATE_NUMBERS:] = 0.0, 0.0
        start, errors = touch[None], []
        for _ in range(16):
            found = estimator.fit_whitened(measure(forward, bench, [touch], rng), start, count=1)
            start = np.column_stack([found.xy, found.force])
            errors.append(start[0] - touch)
        mean = np.mean(errors, axis=0)
        systematic = found.touch_systematic(0)
        noise = found.touch_covariance(0) - systematic
        scattered += [off @ np.linalg.solve(noise, off) / 3 for off in errors - mean]
        shifted.append(mean @ np.linalg.solve(systematic + noise / 16, mean) / 3)
        assert np.linalg.eigvalsh(systematic).min() > 0.0
        assert np.trace(systematic[:2, :2]) > np.trace(noise[:2, :2])  # the bench errs most here
    assert np.mean(scattered) == pytest.approx(15 / 16, rel=0.15)
    assert np.mean(shifted) < 2.0


def test_without_a_bench_all_of_the_covariance_is_noise(forward):
    touch = np.array([62.0, 48.0, 2.0])
    measured = measure(forward, np.zeros(len(NAMES)), [touch], np.random.default_rng(1))
    found = models.Estimator(forward, max_touches=1).fit_whitened(measured)
    assert found.systematic is None
    assert (found.touch_systematic(0) == 0.0).all()


def test_a_touch_that_is_followed_is_that_of_its_frame_alone(forward, identified, true):
    """What was whitened about the touch before serves only where it is right for this one."""
    followed = models.Estimator(forward, bench=identified, max_touches=2)
    start, rng = np.empty((0, 3)), np.random.default_rng(8)
    for step in (0.0, 0.1, 0.1, 12.0, 0.1):
        touch = np.array([[60.0 + step, 40.0, 2.0 + 0.05 * step]])
        measured = measure(forward, true, touch, rng)
        along = followed.fit_whitened(measured, start)
        alone = models.Estimator(forward, bench=identified, max_touches=2).fit_whitened(measured)
        assert along.count == alone.count == 1
        sigma = np.sqrt(np.diag(alone.covariance))
        off = np.append(along.xy[0] - alone.xy[0], along.force[0] - alone.force[0])
        assert (np.abs(off) < 0.15 * sigma).all()
        assert np.allclose(np.sqrt(np.diag(along.covariance)), sigma, rtol=0.05)
        start = np.column_stack([along.xy, along.force])


@pytest.mark.parametrize("seed", range(4))
def test_what_the_last_state_tells_of_a_touch_near_by_is_what_the_touch_shows(forward, seed):
    rng, (after, alone) = np.random.default_rng(seed), (unread(forward), unread(forward))
    last = np.array([[rng.uniform(20, 130), rng.uniform(20, 90), rng.uniform(0.5, 4)]])
    _, jacobian = after.read(last)
    step = rng.standard_normal(3)
    step *= 0.1 / np.abs(step[:2]).max()
    touch = last + step * min(1.0, 1.9 / np.linalg.norm(step @ jacobian))
    assert after.fields.beside(touch) is not None
    assert np.linalg.norm(after.read(touch)[0] - alone.read(touch)[0]) < 0.03
    moved, pressed = (on.fields.amplitudes(touch[:, :2], touch[:, 2]) for on in (after, alone))
    np.testing.assert_allclose(moved, pressed, atol=3e-5 * np.abs(pressed).max())


def unread(forward):
    """Return the same forward model, which has read nothing yet."""
    return forward.on(forward.fields.values, None)


@pytest.mark.parametrize("force", [0.0, 1e-6, 1e-3, 0.1, 2.0])
def test_a_touch_elsewhere_is_read_as_if_there_had_been_none_before(forward, force):
    """However weak both are: a weak touch changes little wherever it goes."""
    after, there = unread(forward), np.array([[95.0, 70.0, force]])
    after.read(np.array([[40.0, 35.0, force]]))
    values, jacobian = unread(forward).read(there)
    seen = after.read(there)
    np.testing.assert_allclose(seen[0], values, atol=1e-5)
    np.testing.assert_allclose(seen[1], jacobian, atol=1e-6 * np.abs(jacobian).max())


def test_frames_of_one_touch_each_are_found_one_after_the_other(forward, identified, true):
    estimator = models.Estimator(forward, bench=identified, max_touches=2)
    rng = np.random.default_rng(12)
    for _ in range(8):
        touch = np.array([[rng.uniform(30, 120), rng.uniform(25, 85), rng.uniform(0.5, 4)]])
        found = estimator.fit_whitened(measure(forward, true, touch, rng))
        assert found.count == 1
        sigma = np.sqrt(np.diag(found.covariance))[:2]
        assert (np.abs(found.xy[0] - touch[0, :2]) < 5 * sigma).all()


def test_nothing_on_an_unknown_bench_is_no_touch(forward):
    estimator = models.Estimator(forward, bench=models.bench_before(PLATE))
    noise = np.random.default_rng(3).standard_normal(len(forward.whitening))
    assert estimator.fit_whitened(noise).result is models.Result.NO_TOUCH


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_frame_that_nothing_explains_is_given_up_soon(forward, monkeypatch, seed):
    """A plate of another kind: no touch on any usual bench comes near what is measured."""
    estimator = models.Estimator(forward, max_touches=2, bench=models.bench_before(forward.plate))
    searches = []

    def counted(*given, **more):
        searches.append(find(*given, **more))
        return searches[-1]

    find = marginal_search.find
    monkeypatch.setattr(marginal_search, "find", counted)
    strange = 100.0 * np.random.default_rng(seed).standard_normal(forward.freedom)
    found = estimator.fit_whitened(strange)
    assert found.result is models.Result.UNRESOLVABLE
    assert found.p_value < 1e-12
    assert len(searches) < 5


@pytest.fixture(scope="module")
def keeping(identified):
    """Say of the bench that its plate keeps some of a touch, which its presses do not show."""
    return replace(identified, memory=0.02)


def test_what_an_ended_touch_left_is_no_touch_and_hides_none_elsewhere(forward, keeping, true):
    estimator = models.Estimator(forward, bench=keeping, max_touches=2)
    ended, rng = np.array([[60.0, 40.0, 1.0]]), np.random.default_rng(6)
    still = 0.04 * forward.on(true, None).read(ended)[0]
    noise = rng.standard_normal(len(still))
    alone = estimator.fit_whitened(still + noise)
    assert alone.result is models.Result.FOUND, "it looks like a weak touch"
    assert (
        estimator.fit_whitened(still + noise, left=models.left_by(ended)).result
        is not models.Result.FOUND
    )
    touch = np.array([[100.0, 70.0, 2.0]])
    together = still + measure(forward, true, touch, rng)
    estimate = estimator.fit_whitened(together, left=models.left_by(ended))
    assert estimate.count == 1
    off = np.append(estimate.xy[0] - touch[0, :2], estimate.force[0] - touch[0, 2])
    assert off @ np.linalg.solve(estimate.covariance, off) < 16.0


def test_what_a_sliding_touch_left_further_on_is_no_touch(forward, keeping, true):
    """It was seen last 15 mm before where it ended, as in a loop of five frames a second."""
    estimator, rng = models.Estimator(forward, bench=keeping), np.random.default_rng(6)
    seen, way = np.array([[60.0, 40.0, 1.0]]), np.array([[12.0, 9.0]])
    ended = seen + np.array([12.0, 9.0, 0.0])
    measured = 0.02 * forward.on(true, None).read(ended)[0]
    measured += rng.standard_normal(len(measured))
    rested, moved = (models.left_by(seen, each) for each in (None, way))
    assert estimator.fit_whitened(measured, left=rested).count == 1
    assert estimator.fit_whitened(measured, left=moved).count == 0


def test_a_touch_that_slid_may_have_ended_anywhere_up_to_as_far_again():
    """Compared with touches drawn along the way, each keeping a part of its own."""
    rng, way = np.random.default_rng(11), np.array([24.0, -8.0])
    part, further = rng.standard_normal((200_000, 1)), rng.uniform(-0.5, 0.5, (200_000, 1))
    place = rng.standard_normal((200_000, 2)) + part * further * way / ASTRAY
    drawn = np.cov(np.column_stack([part, place]).T)
    stated = models.left_by(np.array([[60.0, 40.0, 1.0]]), way[None])
    np.testing.assert_allclose(stated.touches, [[72.0, 36.0, 1.0]])
    np.testing.assert_allclose(stated.covariance, drawn, atol=0.05)


def test_a_touch_that_slid_on_from_an_edge_has_its_trace_on_the_plate(forward):
    off, on = np.array([[-3.0, 40.0, 1.0]]), np.array([[0.0, 40.0, 1.0]])
    np.testing.assert_allclose(forward.left(off), forward.left(on))


KEPT = 0.6  # of what the bench usually keeps: the part of a touch that the plate still shows
ENDED = np.array([[60.0, 40.0, 2.0]])


def still_shown(forward, true, identified, rng):
    """Measurement of a plate that nothing touches any more."""
    still = KEPT * identified.memory * forward.on(true, None).read(ENDED)[0]
    return still, still + rng.standard_normal(len(still))


def test_a_frame_shows_how_much_of_a_touch_is_left(forward, identified, true):
    estimator = models.Estimator(forward, bench=identified)
    none = np.empty((0, 3))
    pulls = []
    for seed in range(12):
        measured = still_shown(forward, true, identified, np.random.default_rng((8, seed)))[1]
        updated = estimator.traces_after(measured, none, models.left_by(ENDED))
        sigma = np.sqrt(np.diag(updated.covariance))
        pulls.append((2.0 * updated.part[0] - KEPT) / (2.0 * sigma[0]))
        assert 0.2 * KEPT < sigma[0] < KEPT, "it may have faded since"
    assert np.abs(pulls).max() < 2.0


def test_a_trace_has_the_shape_of_a_bench_that_is_not_known(forward, true):
    """Bench and part are drawn; what they show beyond the likeliest trace scatters as stated."""
    before, traces = models.bench_before(PLATE), models.left_by(ENDED)
    rng, seen = np.random.default_rng(12), forward.left_by_bench(ENDED)[0]
    part = rng.standard_normal((20_000, 1))
    drawn = before.memory * part * (rng.normal(0.0, before.prior, (20_000, len(NAMES))) @ seen)
    stated = traces.misshapen(forward, before)
    assert np.trace(drawn.T @ drawn) / 20_000 == pytest.approx(np.trace(stated), rel=0.1)


def test_what_an_unknown_bench_shows_of_a_touch_that_ended_is_no_misfit(forward, true):
    before, traces = models.bench_before(PLATE), models.left_by(ENDED)
    estimator = models.Estimator(forward, bench=before)
    still = 1.5 * before.memory * forward.on(true, None).read(ENDED)[0]
    p_values: list[float] = []
    for seed in range(10):
        noise = np.random.default_rng((13, seed)).standard_normal(len(still))
        estimate = estimator.fit_whitened(still + noise, left=traces)
        assert not estimate.count
        p_values.append(estimate.p_value)
    assert np.median(p_values) > 0.05


def test_what_is_left_is_known_beside_a_touch_too_and_makes_the_next_one_surer(
    forward, identified, true
):
    estimator, rng = models.Estimator(forward, bench=identified), np.random.default_rng(9)
    still, _ = still_shown(forward, true, identified, rng)
    first = np.array([[100.0, 70.0, 3.0]])
    fresh = models.left_by(ENDED)
    updated = estimator.traces_after(still + measure(forward, true, first, rng), first, fresh)
    assert abs(updated.part[0] - 0.5 * KEPT) < 2.0 * np.sqrt(updated.covariance[0, 0])
    weak, off = np.array([[75.0, 55.0, 0.5]]), []
    for seed in range(10):
        draw = np.random.default_rng((10, seed))
        measured = 0.5 * still + measure(forward, true, weak, draw)
        sure = estimator.fit_whitened(measured, weak, left=updated)
        unsure = estimator.fit_whitened(measured, weak, left=fresh)
        assert np.trace(sure.covariance[:2, :2]) < np.trace(unsure.covariance[:2, :2])
        off.append((sure.xy[0] - weak[0, :2]) / np.sqrt(np.diag(sure.covariance)[:2]))
    assert np.abs(off).max() < 4.0


def test_what_is_known_of_older_ones_stays_when_another_ends():
    updated = models.Traces(ENDED, np.array([0.5, 0.1, 0.0]), np.diag([0.1, 0.2, 0.3]))
    both = models.left_by(np.array([[20.0, 20.0, 1.0]])).and_older(updated)
    assert both.of(np.array([False, True])).same(updated)
    np.testing.assert_allclose(both.covariance[:3, :3], np.eye(3))
    np.testing.assert_allclose(both.covariance[3:, :3], 0.0)


def test_a_bench_known_exactly_changes_nothing(forward):
    exact = models.bench_before(PLATE, **dict.fromkeys(NAMES, 0.0))
    known = models.BenchEstimate(exact.values, exact.covariance, 0.0, exact.prior)
    touch = [(60.0, 40.0, 2.0)]
    measured = measure(forward, exact.values, touch, np.random.default_rng(5))
    with_bench = models.Estimator(forward, bench=known, max_touches=2).fit_whitened(measured)
    without = models.Estimator(forward, max_touches=2).fit_whitened(measured)
    assert np.allclose(with_bench.xy, without.xy, atol=1e-3)
    assert np.allclose(with_bench.covariance, without.covariance, rtol=0.02)


@pytest.mark.parametrize(
    ("sigma", "says"),
    [({"sagging": 1.0}, "no bench has a 'sagging'"), ({"sag": -1.0}, "sigma of sag must be 0")],
)
def test_priors_that_make_no_sense_are_refused(sigma, says):
    with pytest.raises(ValueError, match=says):
        models.bench_before(PLATE, **sigma)


def test_a_bench_for_a_model_without_one_is_refused(forward):
    gauges = models.gauge_forward(fe.influence(PLATE, [(40.0, 50.0), (90.0, 60.0)]), 1e-6)
    with pytest.raises(ValueError, match="a bench needs the forward model of a bench, got a Lin"):
        models.Estimator(gauges, bench=models.bench_before(PLATE))
    candidates = models.prepare_candidates(gauges, 5)
    with pytest.raises(ValueError, match="candidates are those of another forward model"):
        models.Estimator(forward, grid=candidates)


def test_presses_that_make_no_sense_are_refused(forward):
    with pytest.raises(ValueError, match="a bench needs presses, got none"):
        models.identify(forward, [], models.bench_before(PLATE))
    with pytest.raises(ValueError, match="finite start and positive σ"):
        models.Press(np.zeros(3), np.array([1.0, 2.0, np.nan]), np.ones(3))
    with pytest.raises(ValueError, match="noise of a press must lie in 0 to 1"):
        models.Press(np.zeros(3), np.ones(3), np.ones(3), noise=2.0)


def test_bounding_a_force_leaves_the_next_frame_as_it_was(forward):
    """The search goes on from the touches of this frame, not from those of a bound."""
    estimator = models.Estimator(forward, max_touches=1, bench=models.bench_before(PLATE))
    rng, touch = np.random.default_rng(6), np.array([[14.0, 50.0, 2.0]])
    measured = measure(forward, np.zeros(len(NAMES)), touch, rng)
    found = estimator.fit_whitened(measured, touch)
    known = estimator.forward.fields.state(np.column_stack([found.xy, found.force]))
    (interval,) = estimator.with_force_intervals(found, measured).force_intervals
    assert interval.level_95[0] < found.force[0] < interval.level_95[1]
    assert estimator.forward.fields.state(known.touches) is known
