"""A twin whose bench is otherwise than its scene says: by how much, and its states in time."""

import multiprocessing
from dataclasses import replace
from itertools import repeat

import numpy as np
import pytest

import fe
import rig
import synthetic
from rig.calibration.store import calibration_beside
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.scene.departure import DepartureSection
from rig.sources import real_twin
from rig.sources.real_twin import true_camera, true_plate
from rig.sources.script import RAMP, ScriptedPress
from rig.sources.scripted_states import pieces, scripted_states
from rig.sources.twin import open_play
from rig.sources.twin_source import TwinSource
from rig.studies.real_bench.demo import Seen, TourSource

SAID = fe.Plate((254.0, 203.0), 1.0, 3000.0, 0.38)
PRESSES = (
    ScriptedPress(1.0, 2.0, ((0.5, 0.4),), (3.0, 3.0)),
    ScriptedPress(2.2, 2.0, ((0.2, 0.7), (0.5, 0.7), (0.5, 0.3)), (1.0, 2.5)),
)


def test_each_departure_has_its_size():
    found = true_plate(
        SAID,
        DepartureSection(
            young=-0.1, thickness=0.02, sag=0.2, tension=(0.1, "0.05 N/mm"), uneven=0.04,
            west={"rotation": "2000 N", "membrane": 60}, north={},
        ),
    )  # fmt: skip
    assert found.young == pytest.approx(2700.0)
    assert found.thickness == pytest.approx(1.02)
    thickness, _ = found.material(np.array([[20.0, 100.0], [200.0, 100.0]]))
    np.testing.assert_allclose(thickness, [1.02, 1.02 * 1.04])
    assert found.shape == fe.Shape(sag=0.2)
    assert found.tension == pytest.approx((0.1, 0.05, 0.0))
    assert found.sides.west.springs[1:] == (2000.0, 60.0)
    assert found.sides.north.springs == fe.Clamped().springs
    assert found.sides.east == SAID.sides.east


def test_tension_and_sag_are_added_to_those_of_the_scene():
    said = replace(SAID, tension=(0.2, 0.3, 0.05), shape=fe.Shape(0.1, ((0.0, 0.02),)))
    found = true_plate(said, DepartureSection(sag=-0.3, tension=(0.1, -0.1)))
    assert found.tension == pytest.approx((0.3, 0.2, 0.05))
    assert found.shape == fe.Shape(0.1 - 0.3, ((0.0, 0.02),))
    assert true_plate(said, DepartureSection()).shape == said.shape


def test_a_warm_plate_is_pushed_by_its_frame():
    found = true_plate(SAID, DepartureSection(warmer="0.5 K", expansion=6e-5))
    assert found.tension[0] == pytest.approx(-3000.0 * 6e-5 * 0.5 / 0.62)
    assert true_plate(SAID, DepartureSection()) == replace(SAID, edges=found.edges)


def test_the_camera_is_turned_about_the_middle_of_the_plate():
    said = synthetic.pinhole_above(SAID.size, 500.0, (384, 320))
    middle = np.array([[127.0, 101.5, 0.0]])
    turned = true_camera(said, SAID, DepartureSection(turned=("1 deg", 0, 0), k1=-0.03))
    np.testing.assert_allclose(turned.project(middle), said.project(middle), atol=1e-6)
    assert np.abs(turned.project(np.zeros((1, 3))) - said.project(np.zeros((1, 3)))).max() > 0.5
    nearer = true_camera(said, SAID, DepartureSection(focal=0.02))
    assert nearer.focal == pytest.approx(1.02 * said.focal)
    assert true_camera(said, SAID, DepartureSection()) is said
    far = synthetic.telecentric_above(SAID.size, (384, 320))
    with pytest.raises(ValueError, match=r'set camera\.kind to "pinhole"'):
        true_camera(far, SAID, DepartureSection(focal=0.02))


@pytest.fixture(scope="module")
def plate():
    x, y = np.meshgrid(np.linspace(10.0, 240.0, 7), np.linspace(10.0, 190.0, 6))
    true = true_plate(SAID, DepartureSection(sag=0.2, young=-0.1, west={"membrane": 60}))
    return fe.WholePlate(true, fe.grid(true, 16), np.column_stack([x.ravel(), y.ravel()]))


def played(time):
    return tuple(touch for press in PRESSES if (touch := press.at(time, SAID.size)))


@pytest.fixture(scope="module")
def states(plate, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TOUCHPLATE_CACHE", str(tmp_path_factory.mktemp("cache")))
        done = []
        found = scripted_states(plate, PRESSES, played, 6.0, lambda *now: done.append(now))
        again = scripted_states(plate, PRESSES, played, 6.0, lambda *now: pytest.fail("solved"))
    assert done[-1][0] == done[-1][1] > 10
    np.testing.assert_array_equal(again.parts[0][1], found.parts[0][1])
    return found


def test_pieces_end_where_a_press_lands_turns_or_leaves():
    found = pieces(PRESSES, SAID.size)
    edges = sorted({round(edge, 6) for piece in found for edge in (piece.start, piece.end)})
    wanted = [1.0, 1.0 + RAMP, 3.0 - RAMP, 3.0, 2.2, 2.2 + RAMP, 3.2, 4.2 - RAMP, 4.2]
    assert edges == pytest.approx(sorted(wanted))
    assert len(next(piece for piece in found if piece.start == 1.0 + RAMP).times) == 1


def test_states_between_nodes_are_those_of_the_whole_plate(plate, states):
    for time in np.random.default_rng(1).uniform(1.0, 4.2, 25).tolist():
        touches = played(time)
        true = plate.pressed(touches)
        off = np.abs(states.displacement(time + 6.0, touches) - true).max()
        assert off < 2e-3 * max(np.abs(true).max(), 0.05), time
        linear = np.abs(plate.linear(touches) - true).max()
        assert off < 0.2 * linear + 1e-5, time


def test_touches_that_are_not_of_the_script_are_solved(plate, states):
    other = (fe.Touch(60.0, 60.0, 2.0),)
    np.testing.assert_array_equal(states.displacement(2.0, other), plate.pressed(other))
    assert not states.displacement(0.5, ()).any()


@pytest.mark.slow
def test_a_whole_plate_is_the_shell():
    touch = fe.Touch(100.0, 80.0, 3.0)
    flat = replace(SAID, thickness=1.5)
    points = np.array([[127.0, 101.5], [80.0, 60.0], [180.0, 150.0]])
    whole = fe.WholePlate(flat, fe.grid(flat, 24), points).pressed([touch])
    shell = fe.solve(flat, [touch], mesh=fe.grid(flat, 24)).displacement(points)
    assert np.abs(whole[:, 2] - shell[:, 2]).max() < 0.01 * np.abs(shell[:, 2]).max()
    assert np.abs(whole[:, :2] - shell[:, :2]).max() < 0.03 * np.abs(shell[:, :2]).max()


SMALL = {
    "camera.pixels": [192, 160],
    "pattern.diameter": 7.0,
    "plate.size": [254, 203],
    "source.script": "random",
}


@pytest.fixture
def small_real(monkeypatch, tmp_path):
    """Build the twin of `bench-real` with a small camera and a coarse mesh, changed as asked."""
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(tmp_path))
    monkeypatch.setattr(real_twin, "ELEMENTS", 12)

    def build(**departure):
        changed = {f"source.departure.{name}": value for name, value in departure.items()}
        return open_play(rig.load("bench-real", SMALL | changed))

    return build


def test_light_falls_off_to_the_corners_and_grey_levels_bend(small_real):
    even, bent, dark = (
        small_real(**given).frame(0, ()).astype(float)
        for given in (
            {"gamma": 1.0, "vignetting": 0.0},
            {"gamma": 2.0, "vignetting": 0.0},
            {"gamma": 1.0, "vignetting": 0.4},
        )
    )
    np.testing.assert_allclose(bent, np.rint(255.0 * np.sqrt(even / 255.0)), atol=0.51)
    middle, corner = np.s_[70:90, 86:106], np.s_[8:28, 8:28]
    lost = [
        (even[part].mean() - dark[part].mean()) / even[part].mean() for part in (middle, corner)
    ]
    assert lost[0] < 0.02 < 0.15 < lost[1]


def test_a_touch_leaves_a_part_that_fades(small_real):
    twin = small_real(leftover=0.05, fading=2.0)
    plate = twin.states.plate
    presses = (PRESSES[0],)
    states = scripted_states(plate, presses, lambda time: (), 6.0, lambda *now: None)
    twin = replace(twin, states=states)
    field = plate.pressed([fe.Touch(127.0, 0.4 * 203.0, 3.0)])
    at_rest = plate.at_rest
    faded = 0.05 * np.exp(-0.2)
    for seconds, size in ((2.8, 0.0), (3.0, 0.05), (3.4, faded), (9.0, 0.05), (9.4, faded)):
        moved = twin.displacement(round(seconds * twin.rate), ()) - at_rest
        np.testing.assert_allclose(moved, size * field, atol=2e-4)


def test_a_plate_gives_more_under_a_touch_that_is_held(small_real):
    twin = small_real(creep=0.05, fading=2.0, leftover=0.0)
    plate = twin.states.plate
    twin = replace(
        twin, states=scripted_states(plate, PRESSES[:1], lambda time: (), 6.0, lambda *now: None)
    )
    field = plate.pressed([fe.Touch(127.0, 0.4 * 203.0, 3.0)])
    for seconds, held in ((0.9, False), (1.4, True), (2.9, True), (3.1, False)):
        number = round(seconds * twin.rate)
        age = number / twin.rate - 1.0
        size = 0.05 * (1.0 - np.exp(-age / 2.0)) if held else 0.0
        moved = twin.displacement(number, ()) - plate.at_rest
        np.testing.assert_allclose(moved, size * field, atol=2e-4)


def test_nothing_creeps_under_a_finger_that_glides(small_real):
    twin = small_real(creep=0.05, fading=2.0, leftover=0.0)
    plate, presses = twin.states.plate, PRESSES[1:]
    assert len(presses[0].path) > 1
    states = scripted_states(plate, presses, lambda time: (), 6.0, lambda *now: None)
    twin = replace(twin, states=states)
    for seconds in (2.3, 3.2, 4.1):
        moved = twin.displacement(round(seconds * twin.rate), ())
        np.testing.assert_array_equal(moved, plate.at_rest)


def test_a_stand_that_gives_turns_the_plate_under_its_camera(small_real):
    twin = small_real(tilting=("0.02 deg", "-0.03 deg"), leftover=0.0)
    points = twin.warper.points
    moved = twin.displacement(round(30.0 * twin.rate), ()) - twin.states.plate.at_rest
    x, y = (points - (127.0, 101.5)).T
    about_x, about_y = np.radians([0.01, -0.015])
    np.testing.assert_allclose(moved[:, 2], about_x * y - about_y * x, atol=1e-9)
    assert not moved[:, :2].any()


def test_rows_of_a_real_bench_are_read_one_after_the_other(small_real, monkeypatch):
    monkeypatch.setitem(SMALL, "camera.row_time", "300 µs")
    twin = small_real(leftover=0.0)
    states = replace(twin.states, pressed=played, parts=())
    twin = replace(twin, states=states, script=played)
    number = round(1.1 * twin.rate)
    time, plate = number / twin.rate, states.plate
    moved = twin.displacement(number, twin.touches(number)) - plate.at_rest
    fraction, half = twin.warper.read_at, twin.readout / 2
    assert twin.readout == pytest.approx(300e-6 * 159)
    for row in (-0.5, 0.0, 0.5):
        here = np.abs(fraction - row) < 1e-3
        if here.any():
            true = plate.pressed(played(time + 2 * row * half))
            np.testing.assert_allclose(moved[here], true[here], atol=2e-4)
    steady = twin.displacement(number, (fe.Touch(60.0, 60.0, 2.0),)) - plate.at_rest
    np.testing.assert_allclose(steady, plate.pressed([fe.Touch(60.0, 60.0, 2.0)]), atol=1e-9)


def test_a_pad_is_as_wide_as_the_bench_has_it(small_real):
    assert small_real(pad="5.5 mm").radius == 5.5
    assert small_real().radius == 0.0


def test_a_loop_hears_how_far_the_bench_is_prepared():
    here, there = multiprocessing.Pipe()
    source = TwinSource(here, np.zeros((6, 3, 4), np.uint8), np.full(6, -1))
    heard = []
    with here, there:
        for message in ((0, 2), (1, 2), (2, 2), None):
            there.send(message)
        source.prepare(lambda *now: heard.append(now))
        assert heard == [(0, 2), (1, 2), (2, 2)]
        source.prepare(lambda *now: pytest.fail("it was ready"))


@pytest.mark.slow
def test_the_shipped_calibration_finds_the_touches_of_its_twin():
    scene = rig.load("bench-real")
    twin = open_play(scene)
    bench = build_bench(scene, lambda done, total: None, calibration_beside("bench-real"))
    twin = replace(twin, rest=bench.reference_frames)
    source, seen = TourSource(twin, bench.reference_frames, 7.5, repeat(1)), Seen()
    for shot in Loop(bench, source, lambda: source.now):
        seen.add(shot.estimate, twin.touches(shot.sequence))
    within = np.abs(np.concatenate(seen.within))
    assert len(seen.place) > 60
    assert np.median(seen.place) < 0.5  # mm
    assert np.median(np.abs(seen.force)) < 0.015
    assert np.mean(within > 4.0) < 0.01
    assert (seen.missed, seen.phantoms, seen.false) == (0, 0, 0)
