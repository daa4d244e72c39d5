"""What demos make of touches that are drawn: where the light is, how it goes on, what it spares."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from rig.live.snapshot import Mark
from rig.projector.content import draw
from rig.projector.demos.canvas import FINGERS, blank, laid
from rig.projector.demos.demo import begin_demo
from rig.projector.demos.moment import Load, Moment
from rig.projector.demos.painting import LEAP, MANY, Painting, painted, radius_of
from rig.projector.demos.ripples import AGAIN, LAST, PACE, WAVE, Ripples, profile
from rig.projector.demos.trails import LAST as FADED, Trails, broad
from rig.projector.markers import PEAK, Screen

NAMES = ("ripples", "trails", "scale", "painting", "keys")
RATE = 30.0


def played(demo, way, frames=60):
    """Let one finger go along `way(time)` -> (x, y, force)."""
    for number in range(frames):
        mark = Mark(*way(number / RATE), identity=1)
        demo = demo.after(Moment(number / RATE, (mark,), Load(mark.force, 0.05)))
    return demo


def circle(time):
    return 120 + 70 * np.cos(3 * time), 75 + 40 * np.sin(3 * time), 2.0 + np.sin(time)


@pytest.mark.parametrize("name", NAMES)
def test_a_demo_is_small_dim_and_soft_and_says_when_the_same_is_shown(name, plate, screen):
    resting = begin_demo(name, plate, 8.0)
    demo = played(resting, circle)
    assert len(pickle.dumps(demo)) < 65536  # what the link to the window takes at once
    fine = Screen((961, 601), np.diag([4.0, 4.0, 1.0]) @ screen.T_px_plate)
    image = draw(demo, fine)
    assert image.any()
    assert image.max() <= PEAK
    # An edge takes 0.5 mm or more from dark to full light.
    steps = max(np.abs(np.diff(image.astype(int), axis=axis)).max() for axis in (0, 1))
    assert steps <= 0.5 * PEAK
    np.testing.assert_array_equal(draw(pickle.loads(pickle.dumps(demo)), fine), image)
    assert pickle.loads(pickle.dumps(demo)) == demo != resting


@pytest.mark.parametrize("name", ["ripples", "trails", "painting"])
def test_what_rests_and_what_is_set_back_is_dark(name, plate, screen):
    demo = begin_demo(name, plate, 8.0)
    assert not draw(demo, screen).any()
    later = played(demo, circle).tared().after(Moment(10.0))
    assert not draw(later, screen).any()


def test_a_canvas_lies_on_the_plate_as_the_projector_is_turned(plate):
    on = blank(plate, 2.0)
    on.image[:30, :60] = 255  # upper left: 30 mm of x from 0 on, 15 mm of y down from 150
    T = np.array([[0.0, 1.2, 10.0], [0.9, 0.1, 20.0], [0.0, 0.0002, 1.0]])
    screen = Screen((220, 260), T)
    seen = laid(on, screen, 0.0)
    rows, columns = np.nonzero(seen[..., 0] > PEAK / 2)
    x, y, w = np.linalg.inv(T) @ np.stack([columns, rows, np.ones(len(rows))])
    x, y = x / w, y / w
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((0, 30, 135, 150), abs=1.0)


def test_a_landing_makes_rings_that_run_out_evenly_and_end(plate, screen):
    touch = Mark(100.0, 60.0, 2.0, identity=3)
    ripples = Ripples(plate).after(Moment(5.0, (touch,)))
    for wait in (0.2, 0.5, 0.8):
        later = ripples.after(Moment(5.0 + wait))
        reach = np.arange(0.0, 130.0)
        heights = later.heights(blank(plate, 1.0))
        along = heights[150 - 60, 100 : 100 + len(reach)]  # px of the row through the touch
        at = np.hypot(reach + 0.5, 0.5)
        np.testing.assert_allclose(along, profile(at, wait), atol=0.12)  # a table of 0.25 mm
        assert at[np.argmax(along)] == pytest.approx(PACE * wait, abs=WAVE / 4)
    assert ripples.after(Moment(5.0 + LAST)).trains == ()


def test_a_finger_that_stays_feeds_weaker_rings_and_a_hard_one_higher_ones(plate):
    soft, hard = Mark(60.0, 40.0, 0.5, identity=1), Mark(180.0, 40.0, 4.0, identity=2)
    ripples = Ripples(plate)
    for number in range(round(2 * AGAIN * RATE) + 2):
        ripples = ripples.after(Moment(number / RATE, (soft, hard)))
    of_soft = [train for train in ripples.trains if train.x == soft.x]
    of_hard = [train for train in ripples.trains if train.x == hard.x]
    assert [train.begun for train in of_soft] == pytest.approx([0, AGAIN, 2 * AGAIN], abs=1 / RATE)
    assert of_soft[0].height == pytest.approx(0.5)
    assert of_hard[0].height == 1.0
    assert of_soft[1].height < of_soft[0].height


def test_a_trail_is_as_wide_as_its_force_and_fades(plate, screen, light_at):
    def way(time):
        return 40 + 60 * time, 75.0, 4.0

    trails = played(Trails(plate), way, 60)
    image = draw(trails, screen)
    (x, y, force) = way(59 / RATE)
    across = [light_at(image, x - 12, y + step) for step in range(-15, 16)]
    assert sum(light > 0.5 * max(across) for light in across) == pytest.approx(
        broad(force), abs=2.0
    )
    lights = [light_at(image, way(time)[0], y) for time in (0.4, 0.8, 1.2, 1.6)]
    assert lights == sorted(lights)
    assert lights[0] < 0.3 * lights[-1]
    assert light_at(image, x, y + 30) == 0
    assert trails.after(Moment(59 / RATE + FADED + 0.01)).trails == ()


def test_fingers_keep_their_colours_and_trails_do_not_join(plate, screen):
    trails = Trails(plate)
    for number in range(40):
        far = 2.0 * number
        marks = (Mark(30 + far, 40, 2.0, identity=0), Mark(30 + far, 110, 2.0, identity=1))
        trails = trails.after(Moment(number / RATE, marks))
    image = draw(trails, screen).astype(float)
    for y, colour in ((40, FINGERS[0]), (110, FINGERS[1])):
        seen = image[150 - y, 90]
        np.testing.assert_allclose(seen / seen.max(), np.array(colour) / max(colour), atol=0.05)
    assert not image[150 - 75].any()


def test_a_stroke_is_as_broad_as_its_force_stays_and_a_slow_one_has_no_gap(plate, screen, light_at):
    def way(time):
        return 60 + 6.0 * time, 75.0, 1.0  # 0.2 mm a frame

    painting = played(Painting(plate), way, 300)
    clean = replace(painting.after(Moment(99.0)), touches=())
    image = draw(clean, screen)
    along = [light_at(image, x, 75) for x in range(60, 118)]
    assert min(along) > 0.8 * max(along)
    width = sum(light_at(image, 90, 75 + step) > 0.5 * max(along) for step in range(-20, 21))
    # Dabs whose edge covers a half count: 0.35 of the radius is soft.
    assert width == pytest.approx(2 * 0.9 * radius_of(1.0), abs=1.5)
    np.testing.assert_array_equal(draw(clean.after(Moment(200.0)), screen), image)


def test_paint_that_goes_on_is_what_is_painted_at_once(plate):
    dabs = (
        np.random.default_rng(4)
        .uniform((0, 0, 2, 0.5, 0), (*plate, 10, 1, 5.9), (300, 5))
        .astype(np.float32)
    )
    for count in (10, 11, 200, 300, 120):
        grown = painted(plate, dabs[:count]).image.copy()
        painted(plate, dabs[250:])  # another painting between
        np.testing.assert_array_equal(grown, painted(plate, dabs[:count]).image)


def test_a_finger_that_leaps_draws_no_stroke_and_the_oldest_paint_goes_first(plate):
    painting = Painting(plate)
    marks = [Mark(40, 40, 1.0, identity=1), Mark(40 + 2 * LEAP, 40, 1.0, identity=1)]
    for number, mark in enumerate(marks):
        painting = painting.after(Moment(number / RATE, (mark,)))
    assert len(painting.dabs) == 2
    for number in range(6000):
        x, y, force = circle(number / RATE)
        painting = painting.after(Moment(number / RATE, (Mark(x, y, force, identity=2),)))
    assert 0.8 * MANY < len(painting.dabs) <= MANY
    np.testing.assert_allclose(painting.dabs[-1, :2], circle(5999 / RATE)[:2], atol=2.0)
