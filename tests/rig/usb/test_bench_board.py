"""The board of a scene: lit and triggering while frames are taken, dark after."""

import pytest

import rig
from rig.scene.board import BoardSection
from rig.sources import bench_board
from rig.sources.bench_board import board_at_work


def test_lamp_and_trigger_run_while_frames_are_taken(make_bus, light):
    section = BoardSection(lamp=0.4, trigger_width=0.001)
    with board_at_work(section, 30.0, make_bus(light)):
        assert light.firmware.levels == {0: 400}
        assert light.firmware.triggers == {1: (33333, 1000, 0)}
    assert light.firmware.levels == light.firmware.triggers == {}


def test_a_lamp_alone_leaves_the_trigger_alone(make_bus, light):
    with board_at_work(BoardSection(lamp=1, lamp_output=2), 30.0, make_bus(light)):
        assert light.firmware.levels == {2: 1000}
        assert light.firmware.triggers == {}


def test_a_board_that_is_not_there_or_not_the_only_one_is_said(make_bus, light, toy):
    with (
        pytest.raises(OSError, match=r"no USB boards with serial number 'X' are .*serial number"),
        board_at_work(BoardSection(serial="X"), 30.0, make_bus(light)),
    ):
        pass
    with (
        pytest.raises(OSError, match=r"no USB boards are plugged in; plug in one .*are: none"),
        board_at_work(BoardSection(), 30.0, make_bus()),
    ):
        pass
    with (
        pytest.raises(OSError, match=r"2 USB boards are plugged in; .*or set board\.serial"),
        board_at_work(BoardSection(), 30.0, make_bus(light, toy(ports=(9,)))),
    ):
        pass


def test_a_pulse_that_is_longer_than_a_frame_is_refused_and_nothing_stays_lit(make_bus, light):
    with (
        pytest.raises(ValueError, match="trigger width must lie between 0 and its period"),
        board_at_work(BoardSection(lamp=1, trigger_width=0.5), 30.0, make_bus(light)),
    ):
        pass
    assert light.firmware.levels == {}


def test_a_scene_has_its_board_at_work_while_its_source_is_open(make_bus, light, monkeypatch):
    from rig.sources.open_source import open_input

    bus = make_bus(light)
    at_work = bench_board.board_at_work
    monkeypatch.setattr(
        bench_board, "board_at_work", lambda section, rate: at_work(section, rate, bus)
    )
    scene = rig.load("twin", {"board.lamp": 0.5})
    with open_input(scene, lambda said: None):
        assert light.firmware.levels == {0: 500}
    assert light.firmware.levels == {}
