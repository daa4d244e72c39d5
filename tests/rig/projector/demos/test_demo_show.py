"""A demo in the loop: one step a frame, in the light of the reference, set back by a tare."""

from dataclasses import replace

import numpy as np
import pytest

import rig
from models import Estimate, Result
from rig.calibration.store import Calibration
from rig.live.snapshot import Mark
from rig.page.operator import Operator
from rig.page.server import Publisher
from rig.projector.demos.demo import begin_demo
from rig.projector.display_log import DisplayLog
from rig.projector.markers import fit_plate
from rig.projector.show import OLDEST, Show
from rig.recording.control import Switch
from rig.scene import SceneError
from rig.web.access import Access
from tests.rig.page.conftest import draw_snapshot

PLATE = (254.0, 200.0)
SCREEN = fit_plate((640, 400), PLATE)
DEMOS = ("ripples", "trails", "scale", "painting", "keys")


class Window:
    """A window that opens when it is waited for."""

    alive, status = True, "open"

    def __init__(self):
        self.given, self.shown, self.waited = [], DisplayLog(), False

    def __call__(self, content):
        self.given.append(content)

    def wait(self, patience):
        self.waited = True


class Absent(Window):
    alive = False

    def wait(self, patience):
        raise OSError("no display")


def show_of(name, window=None, mode="on", age=0.0):
    demo = begin_demo(name, PLATE, 8.0)
    return Show(window or Window(), SCREEN, mode, PLATE, 0.02, lambda: 100.0 + age, demo)


def weighed(force=2.0):
    found = Estimate(
        np.array([[100.0, 60.0]]), np.array([force]), np.eye(3) / 400, 1.0, 1, 0.5, Result.FOUND
    )
    mark = Mark(100.0, 60.0, force, identity=1)
    return draw_snapshot(1, captured=100.0, touches=(mark,), estimate=found)


def test_a_frame_moves_a_demo_on_once_whoever_asks_for_it():
    show, frame = show_of("painting"), weighed()
    show(frame)
    assert show.content(frame) is show.content(frame)
    assert len(show.content(frame).dabs) == 1
    show(replace(frame, captured=100.01))
    assert show.content(frame) is not None


def test_what_is_too_old_is_not_drawn_and_still_weighed():
    show = show_of("scale", age=OLDEST + 0.01)
    content = show.content(weighed())
    assert content.touches == ()
    assert content.lines == ("2.00 N", "± 0.05 N")


@pytest.mark.parametrize("name", DEMOS)
def test_the_reference_is_taken_in_the_light_of_the_plate_at_rest(name):
    window = Window()
    show = show_of(name, window)
    show.rest()
    assert window.waited
    assert window.given[-1] == begin_demo(name, PLATE, 8.0)


def test_a_window_that_blinks_or_does_not_open_or_shows_marks_holds_nothing_up():
    for show in (
        show_of("keys", Absent()),
        show_of("keys", Window(), mode="dark"),
        Show(Window(), SCREEN, "on", PLATE, 0.02),
    ):
        show.rest()
        assert not show._window.given


def operator_of(show, asked):
    publisher = Publisher(0, SCREEN, Access())
    switch = Switch(lambda file: None, None)
    operator = Operator(
        publisher, switch, Calibration(), (), show, tare=lambda: asked.append("tare")
    )
    return publisher, operator


def test_the_tare_key_sets_the_scale_to_nothing_under_its_load_and_leaves_the_reference():
    asked = []
    show = show_of("scale")
    publisher, operator = operator_of(show, asked)
    operator(weighed())
    publisher.ask({"do": "tare"})
    operator(replace(weighed(), sequence=2))
    assert asked == []
    shown = publisher.packets._newest.shown
    assert shown.lines == ("0.00 N", "± 0.07 N net")


@pytest.mark.parametrize("name", [name for name in DEMOS if name != "scale"])
def test_the_tare_key_sets_others_back_and_renews_the_reference(name):
    asked = []
    show = show_of(name)
    publisher, operator = operator_of(show, asked)
    operator(weighed())
    publisher.ask({"do": "tare"})
    operator(draw_snapshot(2, captured=100.0, touches=()))
    assert asked == ["tare"]
    assert show.content(draw_snapshot(3, captured=101.0, touches=())) is not None


def test_the_page_gets_the_image_of_a_demo():
    publisher, operator = operator_of(show_of("keys"), [])
    operator(weighed())
    packet = publisher.packets._newest
    assert packet.parts("projector")["projector"][:2] == b"\xff\xd8"


@pytest.mark.parametrize("name", DEMOS)
def test_every_demo_is_a_scene_of_the_twin(name):
    scene = rig.load(f"demo-{name}")
    assert scene.projector.content == name
    assert scene.source.kind == "twin"


@pytest.mark.parametrize("mode", ["beside", "outside"])
def test_a_demo_lies_where_it_is_touched_and_no_mode_moves_it(mode):
    with pytest.raises(SceneError, match=r"projector\.mode .* set projector\.mode to 'on' or"):
        rig.load("demo-keys", {"projector.mode": mode})
