"""Base and touches of a bent plate from images rendered of a shell on another mesh."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import fe
import models
import synthetic

TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PLATE = fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.3, TWO)
SHELL = fe.Shell(PLATE, fe.Mesh(PLATE.size, (14, 12)))
FINER = fe.Shell(PLATE, fe.Mesh(PLATE.size, (22, 18)))
TRUTH = fe.Shell(PLATE, fe.Mesh(PLATE.size, (18, 15)))
CAMERA = synthetic.pinhole_above(PLATE.size, 400.0, (352, 288))
PATTERN = synthetic.speckle(PLATE.size, diameter=1.2, softness=0.75, seed=4)
NOISE = 1.0
SENSOR = synthetic.Sensor(noise=NOISE)
TOUCH = fe.Touch(62.0, 31.0, 1.5)


def image(state, rng):
    moved = None if state is None else lambda xy: state.displacement(xy, "top")
    return synthetic.render(PATTERN, CAMERA, moved, SENSOR, rng, 0.5, samples=2)


@cache
def watched():
    rng = np.random.default_rng(0)
    reference = np.mean([image(None, rng) for _ in range(12)], axis=0)
    return models.Watched(CAMERA, reference, FINER, 12)


@cache
def frame(bend, twist, pressed):
    state = TRUTH.at(fe.Base(bend, twist))
    state = state.touch([TOUCH]) if pressed else state
    return image(state, np.random.default_rng(1))


@cache
def fitted(bend, twist, pressed):
    start = SHELL.at(fe.Base(1.3 * bend, 0.6 * twist))
    return models.fit_shape(watched(), frame(bend, twist, pressed), start)


@cache
def prepared():
    return models.prepare_shape(watched(), fitted(2.5, 1.0, False).state, NOISE)


@pytest.mark.slow
@pytest.mark.parametrize(("bend", "twist"), [(2.5, 1.0), (5.0, 0.0)])
def test_bend_and_twist_are_those_of_the_clamps(bend, twist):
    fit = fitted(bend, twist, False)
    assert fit.converged
    assert fit.state.base.bend == pytest.approx(bend, rel=5e-3)
    assert fit.state.base.twist == pytest.approx(twist, abs=0.05)
    assert fit.misfit < 2 * NOISE**2
    np.testing.assert_allclose(fit.camera[:2], 0.0, atol=0.02)


@pytest.mark.slow
def test_a_touch_is_found_on_the_base_within_its_sigma():
    said = models.estimate_on_shape(watched(), frame(2.5, 1.0, True), fitted(2.5, 1.0, True), NOISE)
    assert said.surface is models.Surface.SEEN
    assert said.estimate.result is models.Result.FOUND
    off = [*(said.estimate.xy[0] - [TOUCH.x, TOUCH.y]), said.estimate.force[0] - TOUCH.force]
    sigma = np.sqrt(np.diag(said.estimate.covariance))
    assert (np.abs(off) < 4 * sigma).all()
    assert sigma[0] < 1.0
    assert said.base.bend == pytest.approx(2.5, rel=3e-3)
    assert abs(said.base.bend - 2.5) < 6 * np.sqrt(said.covariance[0, 0])


@pytest.mark.slow
def test_an_untouched_base_has_no_touch_and_one_that_moves_on_says_so():
    none = np.empty((0, 3))
    said = prepared().read(frame(2.5, 1.0, False), prepared().still(np.zeros(4)), none)
    assert said.surface is models.Surface.SEEN
    assert said.estimate.result is models.Result.NO_TOUCH
    moved = image(TRUTH.at(fe.Base(2.58, 1.0)), np.random.default_rng(2))
    further = prepared().read(moved, said.motion, none)
    assert further.surface is models.Surface.MOVED_ON
    assert further.base.bend == pytest.approx(2.58, abs=0.02)
    assert further.estimate.result is models.Result.UNRESOLVABLE


@pytest.mark.slow
def test_what_the_elements_leave_is_taken_out_by_frames_at_rest():
    prepare, none = prepared(), np.empty((0, 3))
    pattern, motion = prepare.pattern, prepare.still(np.zeros(4))
    state, rng = TRUTH.at(fe.Base(2.5, 1.0)), np.random.default_rng(5)

    def moved(xy):
        return state.displacement(xy, "top")

    light = synthetic.render(PATTERN, CAMERA, moved, None, None, 0.5, samples=2) / 255
    shown = [prepare.read(SENSOR.capture(light, rng), motion, none) for _ in range(16)]
    mean = np.mean([said.measured for said in shown], axis=0)
    rest = NOISE * np.linalg.solve(pattern.factor.T, mean)
    again = prepare.read(frame(2.5, 1.0, False), motion, none, rest)
    # 1.4 before, 1.1 after: noise alone leaves 1.
    assert np.mean(again.measured**2) < 0.85 * np.mean([said.measured**2 for said in shown])
    carried = prepare.carried(rest, prepare)
    np.testing.assert_allclose(carried, rest, atol=0.02 * np.abs(rest).max())
    pressed = prepare.read(frame(2.5, 1.0, True), motion, none, rest)
    off = [*(pressed.estimate.xy[0] - [TOUCH.x, TOUCH.y]), pressed.estimate.force[0] - TOUCH.force]
    assert (np.abs(off) < 4 * np.sqrt(np.diag(pressed.estimate.covariance))).all()


@pytest.mark.slow
def test_firm_touches_are_starts_and_two_are_not_taken_for_one():
    prepare = prepared()
    forward = prepare.estimator.forward
    for touch in ([70.0, 22.0, 1.4], [33.0, 60.0, 0.7], [51.0, 40.0, 2.3]):
        measured, _ = forward.read(np.array([touch]))
        nearest = prepare._table.nearest(measured)[0]
        assert np.hypot(*(nearest[:2] - touch[:2])) < 5.0  # places lie 4.8 and 3.8 mm apart
    two = [fe.Touch(25.0, 20.0, 1.5), fe.Touch(75.0, 60.0, 1.5)]
    both = image(TRUTH.at(fe.Base(2.5, 1.0)).touch(two), np.random.default_rng(4))
    said = prepare.read(both, prepare.still(np.zeros(4)), np.empty((0, 3)))
    assert said.surface in (models.Surface.STRANGE, models.Surface.MOVED_ON)
    assert said.estimate.result is models.Result.UNRESOLVABLE


@pytest.mark.slow
def test_what_no_base_explains_is_no_touch_but_a_sentence():
    other = synthetic.speckle(PLATE.size, diameter=1.2, softness=0.75, seed=9)
    strange = synthetic.render(other, CAMERA, None, SENSOR, np.random.default_rng(3), 0.5)
    lost = replace(fitted(2.5, 1.0, False), converged=False)
    for said in (
        prepared().read(strange, prepared().still(np.zeros(4)), np.empty((0, 3))),
        models.estimate_on_shape(watched(), strange, lost, NOISE),
    ):
        assert said.surface in (models.Surface.NO_FIT, models.Surface.MOVED_ON)
        assert said.estimate.result is models.Result.UNRESOLVABLE
    assert "no bend and twist explain the image" in models.Surface.NO_FIT.value


def test_near_a_limit_no_touch_is_stated():
    soft = replace(prepared().state.stability, eigenvalue=0.05)
    near = replace(prepared(), state=replace(prepared().state, stability=soft))
    said = near.read(frame(2.5, 1.0, True), near.still(np.zeros(4)), np.empty((0, 3)))
    assert said.surface is models.Surface.NEAR_LIMIT
    assert said.estimate.result is models.Result.UNRESOLVABLE
    assert "near a limit point" in said.surface.value


@pytest.mark.slow
def test_a_base_may_move_as_far_as_a_touch_bends_it_alike():
    """A twist of 0.1 degrees leaves a firm base alone, and makes a soft one a tenth softer."""
    place, light = np.array([[62.0, 31.0]]), fe.Touch(62.0, 31.0, 0.02)

    def given(state):
        return (state.touch([light]).displacement(place) - state.displacement(place))[0, 2]

    for twist, reached in ((0.0, 0.1), (3.2, 0.02)):
        state = SHELL.at(fe.Base(2.5, twist))
        ready = models.prepare_shape(watched(), state, NOISE)
        reach = ready.reach[1]
        assert reach == pytest.approx(reached, rel=0.2)
        before = given(state)
        for side in (-reach, reach):
            after = given(SHELL.moved(state, fe.Base(2.5, twist + side)))
            assert after == pytest.approx(before, rel=0.03)
    far = given(SHELL.moved(state, fe.Base(2.5, twist + 0.1)))
    assert abs(far / before - 1.0) > 0.05
    further = image(TRUTH.at(fe.Base(2.5, twist + 0.06)), np.random.default_rng(6))
    said = ready.read(further, ready.still(np.zeros(4)), np.empty((0, 3)))
    assert said.surface is models.Surface.MOVED_ON
    assert said.base.twist == pytest.approx(twist + 0.06, abs=0.02)


def test_the_image_says_which_of_the_shapes_it_shows():
    shapes = models.turned_shapes(SHELL.at(fe.Base(2.5, 1.0)))
    assert len(shapes) == 2
    agrees = models.agreement(watched(), frame(2.5, 1.0, True), shapes)
    assert agrees[0] > 0.98
    assert agrees[1] < 0.9


@pytest.mark.slow
def test_a_shape_is_found_by_an_image_alone():
    known = models.with_images(models.known_shapes(SHELL, (1.8,), (0.0, 2.0)))
    fit = models.identify_shape(watched(), frame(2.5, 1.0, True), known)
    assert fit.state.base.bend == pytest.approx(2.5, rel=0.02)
    assert fit.state.deflection([[50.0, 40.0]])[0] > 5.0
