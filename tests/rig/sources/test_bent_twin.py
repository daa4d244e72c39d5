"""The twin of a bent plate: flat, then bent, then pressed on a base that may move."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import rig
from rig.sources import bent_states, bent_twin
from rig.sources.bent_twin import MOVES, splines
from rig.sources.script import STILL
from rig.sources.twin import open_play

SMALL = {
    "plate.size": [100, 80],
    "camera.pixels": [160, 128],
    "pattern.diameter": 4.0,
    "base": {"bend": 2.0},
    "source.shape": 1,
    "source.bend_speed": "0.6 mm/min",
    "source.twist_speed": 0.0,
    "sensor.noise": 0.0,
}
FLAT, REST = 3, 5


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    """Build a twin on few elements, pressed at one place."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TOUCHPLATE_CACHE", str(tmp_path_factory.mktemp("cache")))
        for module in (bent_states, bent_twin):
            patch.setattr(module, "ELEMENTS", 8)
        patch.setattr(bent_states, "BASES", 2)
        patch.setattr("rig.sources.script.PLACES", 1)
        built = open_play(rig.load("bent-base", SMALL))
        yield replace(built, flat_frames=FLAT, rest=REST)


def test_the_plate_is_flat_then_at_rest_on_its_base_and_then_the_script_begins(twin):
    assert twin.touches(0) == twin.touches(REST) == ()
    flat, bent = twin.frame(FLAT - 1, ()), twin.frame(FLAT, ())
    np.testing.assert_array_equal(flat, twin.frame(0, ()))
    np.testing.assert_array_equal(bent, twin.frame(REST, ()))
    assert np.abs(flat.astype(float) - bent).mean() > 5
    assert replace(twin, flat_frames=None).frame(50, ()).tolist() == flat.tolist()
    pressed = REST + round((STILL + 2.5) * twin.rate)
    (touch,) = twin.touches(pressed)
    assert touch.force == twin.states.presses[0].force


def test_a_press_that_is_held_is_the_shell_s_and_others_are_solved(twin):
    (press,) = twin.states.presses
    state, points = twin.untouched.touch([press]), twin.warper.points
    held = twin.states.displacement(0.0, [press])
    np.testing.assert_allclose(held, state.displacement(points, "top"), atol=1e-5)
    lighter = replace(press, force=0.6 * press.force)
    between = twin.states.displacement(0.0, [lighter])
    exact = twin.untouched.touch([lighter]).displacement(points, "top")
    assert (
        np.abs(between - exact).max()
        < 0.01 * np.abs(held - splines(twin.untouched, "top")(points)).max()
    )
    assert twin.states.displacement(0.0, [fe.Touch(1.0, 2.0, 1.0)]) is None


def test_the_base_moves_on_and_comes_back(twin):
    at = [twin.base(REST + round(part * MOVES * twin.rate)) for part in (0.0, 0.5, 1.0, 2.0)]
    assert [base.bend for base in at] == pytest.approx([2.0, 2.15, 2.3, 2.0])
    there = twin.states.displacement(1.0, [])
    moved = twin.untouched.shell.moved(twin.untouched, at[2])
    np.testing.assert_allclose(there, moved.displacement(twin.warper.points, "top"), atol=1e-5)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"source.script": "tour"}, "a bent plate is pressed by 'presses' or 'empty'"),
        ({"source.departure": {"sag": 1.0}}, "source.departure makes the twin's bench another"),
        ({"camera.row_time": "1e-5 s"}, "shows all rows at once"),
    ],
)
def test_what_this_twin_does_not_do_is_refused(changes, sentence):
    with pytest.raises(ValueError, match=sentence):
        open_play(rig.load("bent-base", SMALL | changes))


def test_a_shape_that_is_not_there_is_refused():
    plate = rig.load("bent-base", SMALL).plate.build()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bent_states, "ELEMENTS", 8)
        with pytest.raises(ValueError, match=r"source\.shape is 9, and a base of 2 mm"):
            bent_states.twin_shape(plate, fe.Base(2.0), 9)
