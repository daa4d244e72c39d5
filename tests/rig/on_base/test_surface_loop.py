"""The loop on a bent plate: what it says from the flat plate to a touch on a base that moved on."""

from concurrent.futures import Future
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import fe
import models
import rig
import synthetic
from rig.on_base.base_bench import BaseBench, build_base_bench
from rig.on_base.loop import SurfaceLoop
from rig.on_base.shapes import ListedShapes
from rig.scene.sensing import DicSection
from rig.sources.bent_states import BaseWay, lagrange
from rig.sources.bent_twin import splines
from rig.system.frame import Frame

TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PLATE = fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.3, TWO)
CAMERA = synthetic.pinhole_above(PLATE.size, 400.0, (264, 216))
PATTERN = synthetic.speckle(PLATE.size, diameter=1.6, softness=0.75, seed=4)
SENSOR = synthetic.Sensor(noise=1.0)
TOUCH = fe.Touch(62.0, 31.0, 1.5)
BASE, MOVED = fe.Base(2.5, 1.0), fe.Base(2.56, 1.0)
FLAT, UNTIL = 4, 28  # frames of the flat plate, and all before something touches


def elements(across, down):
    return fe.Shell(PLATE, fe.Mesh(PLATE.size, (across, down)))


@cache
def bench():
    shell = elements(12, 10)
    known = models.known_shapes(shell, (2.2,), (0.0,))
    dic = DicSection(tile=12, reference_frames=FLAT)
    return BaseBench(PLATE, CAMERA, shell, elements(20, 16), known, dic, 1, 0.5)


@cache
def light(base, pressed):
    """Image of the plate without noise, of a shell on elements of its own."""
    moved = None
    if base is not None:
        state = elements(16, 13).at(base)
        moved = splines(state.touch([TOUCH]) if pressed else state, "top")
    return synthetic.render(PATTERN, CAMERA, moved, None, None, 0.5, samples=2) / 255


@cache
def strange():
    other = synthetic.speckle(PLATE.size, diameter=1.6, softness=0.75, seed=9)
    return synthetic.render(other, CAMERA, None, None, None, 0.5, samples=2) / 255


class Staged:
    """A source of given images, ten a second: (light, touches) of each."""

    status = "no frames come"

    def __init__(self, images):
        self._images, self.number = iter(images), 0

    def grab(self, timeout):
        image = next(self._images, None)
        if image is None:
            raise EOFError("the frames are over")
        self.number += 1
        rng = np.random.default_rng(self.number)
        return Frame(self.number, self.number / 10, SENSOR.capture(image[0], rng), tuple(image[1]))


def at_once(work):
    result = Future()
    result.set_result(work())
    return result


def never(work):
    return Future()


def loop_on(images, background=at_once, **options):
    source = Staged([(light(None, False), ())] * FLAT + images)
    return SurfaceLoop(
        bench(), source, lambda: source.number / 10, background=background, **options
    )


@cache
def story():
    """Snapshots of a plate that is bent, pressed, and moved on while it is pressed."""
    rested = []
    images = [(light(BASE, False), ())] * (UNTIL - FLAT)
    images += [(light(BASE, True), (TOUCH,))] * 8
    images += [(light(MOVED, True), (TOUCH,))] * 8
    loop = loop_on(images, on_rest=lambda: rested.append(loop.pace.frames))
    return list(loop), loop, rested


def outcomes(shots):
    return [shot.base.outcome if shot.base else "SEARCHING" for shot in shots]


@pytest.mark.slow
def test_first_the_shape_is_identified_then_the_plate_at_rest_is_taken_and_no_touch_invented():
    shots, loop, rested = story()
    before = shots[: UNTIL - FLAT]
    said = outcomes(before)
    assert said == ["SEARCHING"] + ["RESTING"] * 16 + ["NO_TOUCH"] * (UNTIL - FLAT - 17)
    assert not any(shot.touches for shot in before)
    assert "the shape of the base is being identified" in before[0].status
    assert "at rest is being taken (3 of 16 frames)" in before[3].status
    assert rested == [17]
    assert loop.summary()["base"]["outcomes"]["SEARCHING"] == 1


@pytest.mark.slow
def test_bend_twist_shapes_and_energies_are_stated():
    shots, _, _ = story()
    base = shots[UNTIL - FLAT - 1].base
    assert base.bend == pytest.approx(BASE.bend, rel=0.01)
    assert base.twist == pytest.approx(BASE.twist, abs=0.05)
    assert 0 < base.sigma_bend < 0.01
    assert base.eigenvalue > 0.5
    assert base.verdict == "STABLE"
    assert [shape.shown for shape in base.shapes].count(True) == 1
    shown = next(shape for shape in base.shapes if shape.shown)
    assert shown.name.startswith("up")
    assert shown.energy == pytest.approx(elements(16, 13).at(BASE).energy, rel=0.02)
    assert any(shape.name.startswith("down") for shape in base.shapes)


@pytest.mark.slow
def test_a_touch_is_shown_where_it_is_and_as_hard():
    shots, loop, _ = story()
    last = shots[UNTIL - FLAT + 7]
    (mark,) = last.touches
    # 0.2 mm and 1 % measured.
    assert np.hypot(mark.x - TOUCH.x, mark.y - TOUCH.y) < 1.0
    assert mark.force == pytest.approx(TOUCH.force, rel=0.05)
    assert last.status == "one touch"
    assert loop.summary()["pattern"]["false_touches"] == 0


@pytest.mark.slow
def test_a_base_that_moves_on_is_followed_with_its_touch():
    shots, loop, _ = story()
    moved = shots[UNTIL - FLAT + 8 : UNTIL - FLAT + 16]
    assert moved[0].base.outcome == "MOVED_ON"
    assert not moved[0].touches or moved[0].estimate.count == 0
    assert "the base has moved further" in moved[0].status
    assert moved[-1].base.outcome == "FOUND"
    assert moved[-1].base.bend == pytest.approx(MOVED.bend, abs=0.01)
    (mark,) = moved[-1].touches
    assert np.hypot(mark.x - TOUCH.x, mark.y - TOUCH.y) < 1.5
    assert mark.force == pytest.approx(TOUCH.force, rel=0.08)
    assert loop.summary()["base"]["shapes_prepared"] >= 2


@cache
def hidden():
    """Snapshots of a bent plate before which something stands, and then no more."""
    ready = story()[1].get_ready().ready
    bent = (light(MOVED, False), ())
    loop = loop_on([bent] * 2 + [(strange(), ())] * 2 + [bent] * 2, background=never)
    begin_with(loop, ready)
    return list(loop), loop


def begin_with(loop, ready):
    """Let a loop know a shape from its first frame on."""
    loop.get_ready().use(ready, 0.0)


@pytest.mark.slow
def test_what_no_base_explains_is_no_touch_and_the_plate_is_seen_again_after_it():
    shots, _ = hidden()
    for shot in shots[2:4]:
        assert shot.base.outcome == "NO_FIT"
        assert shot.estimate.count == 0
        assert "no bend and twist explain the image" in shot.status
    assert outcomes(shots[:2] + shots[4:]) == ["RESTING"] * 4


def looked_at(**changes):
    """Snapshots of a bent plate that is known, with another stability."""
    ready = story()[1].get_ready().ready
    shape = ready.shape
    stability = replace(shape.state.stability, **changes)
    other = replace(shape, state=replace(shape.state, stability=stability))
    loop = loop_on([(light(MOVED, False), ())] * 2, background=never)
    begin_with(loop, replace(ready, shape=other))
    return list(loop)


@pytest.mark.slow
def test_near_a_limit_point_the_reason_is_named():
    for shot in looked_at(eigenvalue=0.05):
        assert shot.base.outcome == shot.base.verdict == "NEAR_LIMIT"
        assert "near a limit point" in shot.status
        assert not shot.touches
        assert all(shape.verdict == "NEAR_LIMIT" for shape in shot.base.shapes)


@pytest.mark.slow
def test_a_base_beyond_what_the_material_bears_says_so():
    for shot in looked_at(verdict=fe.Verdict.OVERSTRAINED):
        assert shot.base.verdict == "OVERSTRAINED"
        assert "strained beyond its limit" in shot.status


@pytest.mark.slow
def test_what_is_left_in_front_is_looked_for_anew_and_not_believed():
    _, before = hidden()
    follower = before.get_ready()
    assert follower.preparation.busy
    follower.search()
    assert follower.ready is None
    assert not follower.knows_rest


def test_while_a_shape_is_prepared_frames_say_so():
    shots = list(loop_on([(light(BASE, True), (TOUCH,))] * 3, background=never))
    assert outcomes(shots) == ["SEARCHING"] * 3
    assert all(shot.estimate.result is models.Result.UNRESOLVABLE for shot in shots)
    assert not any(shot.touches for shot in shots)


def test_a_shape_that_is_none_of_the_listed_ones_joins_them():
    state = bench().shell.at(BASE)
    other = fe.half_turned(state.values, 2)
    up = fe.BaseShape(state, state.energy, "up")
    assert [s.shown for s in ListedShapes(BASE, (up,)).marked(state)] == [True]
    listed = ListedShapes(BASE, (up,)).marked(replace(state, values=-other))
    assert [shape.shown for shape in listed] == [False, True]


def test_a_known_weight_is_refused_and_a_tare_identifies_anew():
    loop = loop_on([(light(BASE, False), ())] * 2, background=never)
    shots = iter(loop)
    next(shots)
    loop.tare()
    assert "identified anew" in next(shots).notice
    with pytest.raises(ValueError, match="a known weight of 2 N says nothing of a plate"):
        loop.weigh(2.0)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("camera.row_time", "1e-5 s"),
        ("estimator.bench", "usual"),
        ("estimator.start", "net"),
        ("projector", {}),
        ("dynamics", {"density": 1400}),
        ("comparison", {"kind": "strain"}),
    ],
)
def test_what_only_a_flat_plate_knows_is_refused(key, value):
    scene = rig.load("bent-base", {key: value})
    with pytest.raises(ValueError, match=f"has a bent plate and names {key}"):
        build_base_bench(scene, lambda done, total: None)


def test_weights_of_a_polynomial_give_it_back():
    nodes = BaseWay(fe.Base(1.0), fe.Base(2.0)).nodes
    weights = lagrange(nodes, 0.3)
    assert weights @ nodes**3 == pytest.approx(0.3**3)
    assert lagrange(nodes, nodes[1])[1] == pytest.approx(1.0)
    assert BaseWay(fe.Base(1.0), fe.Base(1.0)).nodes.tolist() == [0.0]
