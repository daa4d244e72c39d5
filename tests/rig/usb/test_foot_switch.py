"""The board in the loop: a lamp that follows the touches, and a foot switch that acts."""

import logging
from contextlib import nullcontext
from dataclasses import replace
from itertools import count

import pytest

import rig
from rig.calibration.learned import Known
from rig.commands import run as command
from rig.live.snapshot import Mark
from rig.scene import SceneError
from rig.scene.board import BoardSection
from rig.sources import bench_board, board_sink, twin_source
from rig.sources.bench_board import board_at_work
from rig.sources.board_sink import BoardSink, lamp_level
from rig.sources.twin import build_twin
from rig.usb.link import ROUND, BoardLink
from tests.rig.page.conftest import draw_snapshot
from tests.waiting import wait_for


def frame(*forces):
    marks = tuple(Mark(50.0 + 10 * k, 40.0, force) for k, force in enumerate(forces))
    return draw_snapshot(1, touches=marks)


def test_presses_are_counted_from_the_start_and_each_is_given_once(make_bus, light):
    light.firmware.presses = [0, 7]
    section = BoardSection(foot_switch="tare", foot_switch_input=1)
    acted = []
    with board_at_work(section, 30.0, make_bus(light)) as link:
        sink = BoardSink(section, link, 4.0, acted.append)
        sink(frame())
        assert acted == []
        light.firmware.presses[1] += 2
        wait_for(lambda: link._counted == 9)
        shown = frame(1.0)
        sink(shown)
        assert acted == [shown, shown]
        sink(frame())
        assert len(acted) == 2
        assert sink.trouble == ""


def test_the_count_of_the_board_goes_round():
    class Counter:
        number = ROUND - 1

        def presses(self, switch):
            return self.number

    counter = Counter()
    with BoardLink(counter, switch=0) as link:
        counter.number = 1
        wait_for(lambda: link._counted == 1)
        assert link.pressed() == 2


@pytest.mark.parametrize(
    ("follows", "forces", "level"),
    [
        ("touch", (), 0.0),
        ("touch", (0.1,), 0.8),
        ("force", (), 0.0),
        ("force", (1.0, 1.0), 0.4),
        ("force", (3.0, 3.0), 0.8),
    ],
)
def test_a_lamp_follows_the_touches_up_to_its_light(follows, forces, level):
    section = BoardSection(lamp=0.8, lamp_follows=follows)
    assert lamp_level(section, frame(*forces), 4.0) == pytest.approx(level)


def test_the_lamp_of_the_board_is_lit_as_the_touches_are_and_dark_after(make_bus, light):
    section = BoardSection(lamp=1, lamp_output=2, lamp_follows="force")
    with board_at_work(section, 30.0, make_bus(light)) as link:
        sink = BoardSink(section, link, 4.0, lambda snapshot: None)
        assert light.firmware.levels == {}
        sink(frame(1.0))
        wait_for(lambda: light.firmware.levels == {2: 250})
        sink(frame())
        wait_for(lambda: light.firmware.levels == {2: 0})
    assert light.firmware.levels == {}


def test_a_board_that_is_unplugged_is_said_and_holds_nothing_up(make_bus, light):
    section = BoardSection(foot_switch="record")
    bus = make_bus(light)
    with board_at_work(section, 30.0, bus) as link:
        sink = BoardSink(section, link, 4.0, lambda snapshot: None)
        bus.toys.remove(light)
        wait_for(lambda: sink.trouble)
        sink(frame())
        assert "Light" in sink.trouble


def test_a_board_without_such_an_input_is_refused(make_bus, light):
    section = BoardSection(foot_switch="tare", foot_switch_input=5)
    with pytest.raises(OSError, match="Light"), board_at_work(section, 30.0, make_bus(light)):
        pass


def test_a_lamp_that_follows_needs_its_light():
    with pytest.raises(SceneError, match=r"board\.lamp_follows is 'touch', .* set board\.lamp"):
        rig.load("twin", {"board.lamp_follows": "touch"})
    with pytest.raises(SceneError, match=r"board\.foot_switch"):
        rig.load("twin", {"board.foot_switch": "dance"})


SMALL = {
    "plate.size": [254.0, 203.0], "camera.pixels": [192, 160], "pattern.diameter": 7.0,
    "dic.tile": 8, "dic.reference_frames": 4, "estimator.modes": 40, "source.script": "empty",
    "page": None,
}  # fmt: skip


@pytest.fixture
def plugged_in(make_bus, light, in_hand, monkeypatch, tmp_path):
    """Give every run a board on a bus that is written in Python, in a folder of its own.

    Frames come from this process: what acts on them asks no other.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        twin_source, "open_twin", lambda scene: nullcontext(in_hand(build_twin(scene), count()))
    )
    bus, at_work = make_bus(light), bench_board.board_at_work
    monkeypatch.setattr(
        bench_board, "board_at_work", lambda section, rate: at_work(section, rate, bus)
    )
    return bus


def small(**board):
    settings = {key: value for key, value in SMALL.items() if value is not None}
    scene = rig.load("twin", settings | {f"board.{key}": value for key, value in board.items()})
    return scene.model_copy(update={"page": None, "comparison": None})


DOES = [("snapshot", [".csv", ".png"]), ("record", [".h5"]), ("tare", [])]
SAID = {"snapshot": "snapshot kept in", "record": "recording to", "tare": "tare:"}


@pytest.mark.parametrize(("does", "left"), DOES)
def test_a_press_does_in_a_run_what_the_scene_says(
    does, left, plugged_in, monkeypatch, tmp_path, capsys
):
    """The command itself."""
    scene, (light,) = small(foot_switch=does), plugged_in.toys
    followed = command._follow

    def press_and_follow(loop, sinks, frames, alarms):
        light.firmware.presses[0] += 1
        followed(loop, sinks, 3, alarms)
        (board,) = [sink for sink in sinks if isinstance(sink, BoardSink)]
        wait_for(lambda: board._link._counted)
        followed(loop, sinks, 40, alarms)

    monkeypatch.setattr(command, "_follow", press_and_follow)
    command.live(scene, Known(rig.Calibration(), ()), 40, True, None, True)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == left
    said = capsys.readouterr().err
    assert SAID[does] in said


@pytest.mark.parametrize(("does", "left"), DOES)
def test_a_press_does_in_a_program_what_the_scene_says(does, left, plugged_in, tmp_path, caplog):
    """Frames are taken until the press has had its effect, and some more."""
    said = set()

    def acted():
        said.update(caplog.messages, (next(run).notice,))
        return any(sentence.startswith(SAID[does]) for sentence in said)

    with caplog.at_level(logging.INFO, "touchplate"), rig.run(small(foot_switch=does)) as run:
        next(run)
        plugged_in.toys[0].firmware.presses[0] += 1
        wait_for(acted)
        for _ in range(20):
            next(run)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == left


def test_the_lamp_follows_in_a_program_too_and_a_board_that_goes_is_one_warning(
    plugged_in, monkeypatch, caplog
):
    monkeypatch.setattr(board_sink, "lamp_level", lambda *_: 0.5)
    (light,) = plugged_in.toys
    with rig.run(small(lamp=1, lamp_follows="touch", foot_switch="tare")) as run:
        next(run)
        wait_for(lambda: light.firmware.levels == {0: 500})
        plugged_in.toys.remove(light)
        wait_for(lambda: next(run) and any("Light" in said for said in caplog.messages))
        for _ in range(5):
            next(run)
    assert sum("Light" in said for said in caplog.messages) == 1


def test_a_still_is_the_image_and_the_touches_of_its_frame(tmp_path):
    import cv2
    import numpy as np

    from models import Estimate, Result
    from rig.recording.stills import write_still

    found = Estimate(
        np.array([[100.0, 60.0]]), np.array([2.0]), np.eye(3), 1.0, 1, 0.5, Result.FOUND
    )
    shown = replace(frame(2.0), estimate=found)
    path = write_still(shown, tmp_path / "one")
    np.testing.assert_array_equal(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), shown.image)
    head, row = (tmp_path / "one.csv").read_text(encoding="utf-8").splitlines()
    assert dict(zip(head.split(","), row.split(","), strict=False))["force_n"] == "2.000000"
    assert len(list(tmp_path.iterdir())) == 2
