"""The setup in a terminal, and the command that writes a scene alone."""

import json
import subprocess
import sys

import pytest

from rig.cli import main
from rig.page.setup_view import Button, Question, StepLine, StepView
from rig.scene import load
from rig.setup.desk import Answer, Drop, Go, Leave, Push
from rig.setup.terminal_desk import HELP, TerminalDesk

COMMAND = [sys.executable, "-c", "from rig.cli import main; main()"]
VIEW = StepView(
    "plate", "Plate", "describe it", "",
    (
        Question("width", "width, mm", "254"),
        Question("edges", "edges", "clamped", ("clamped", "supported")),
    ),
    (Button("next", "Next", usual=True), Button("leave", "Leave")),
)  # fmt: skip


def desk_with(*lines):
    said, waiting = [], list(lines)

    def given():
        while waiting:
            yield waiting.pop(0)

    desk = TerminalDesk(said.append, given)
    desk.enter((StepLine("plate", "Plate", "now"), StepLine("print", "Print", "closed")))
    desk.show(VIEW, None)
    return desk, said


def test_a_view_is_said_once_and_what_is_new_again():
    desk, said = desk_with()
    text = "\n".join(said)
    assert "[>] plate  [ ] print" in text
    assert "Plate: describe it" in text
    assert "  1  width, mm: 254" in said
    assert "clamped | supported" in text
    before = len(said)
    desk.show(VIEW, None)
    assert len(said) == before


@pytest.mark.parametrize(
    ("line", "wish"),
    [
        ("", Push("next")),
        ("1 = 30 cm", Answer("width", "30 cm")),
        ("2=supp", Answer("edges", "supported")),
        ("step print", Go("print")),
        ("drop 3", Drop(3)),
        ("leave", Leave()),
        ("next", Push("next")),
    ],
)
def test_a_line_is_a_wish(line, wish):
    assert list(desk_with(line)[0].wishes()) == [wish]


@pytest.mark.parametrize("line", ["9 = 1", "what?", "drop x", "= 3"])
def test_a_line_that_is_none_is_said(line):
    desk, said = desk_with(line)
    assert list(desk.wishes()) == []
    assert f"'{line}' is nothing that can be done here" in said[-1]


def test_help_is_given_and_not_refused():
    desk, said = desk_with(" help ")
    before = len(said)
    assert list(desk.wishes()) == []
    assert said[before:] == [f"  {HELP}"]


@pytest.mark.slow
def test_the_setup_is_left_and_resumed_in_a_terminal(tmp_path):
    def run(lines):
        call = [*COMMAND, "setup", "desk.toml", "--rehearse", "--terminal", "--json"]
        return subprocess.run(
            call, input=lines, capture_output=True, text=True, cwd=tmp_path, check=True, timeout=120
        )

    first = run("3 = two\n3 = 1.9 mm\nstep verdict\nleave\n")
    assert json.loads(first.stdout) == {"scene": "desk.toml", "complete": False, "steps": []}
    assert "thickness is 'two'; give a number in mm" in " ".join(first.stderr.split())
    again = run("")  # the end of the input leaves too
    assert "3  thickness, mm: 1.9" in again.stderr


def test_new_writes_a_scene_once_and_refuses_what_cannot_work(tmp_path, monkeypatch, capsys):
    def new(*words):
        monkeypatch.setattr(sys, "argv", ["touchplate", "new", *words])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code, capsys.readouterr()

    monkeypatch.chdir(tmp_path)
    small = "--pixels", "480", "384"
    words = *small, "--size", "300", "220", "--thickness", "1.8", "--projector", "1024", "768"
    code, said = new("a.toml", *words, "--json")
    assert code == 0, said.err
    assert json.loads(said.out)["file"] == "a.toml"
    scene = load(tmp_path / "a.toml")
    assert (scene.plate.size, scene.projector.size) == ((300, 220), (1024, 768))
    again, thick = new("a.toml"), new("b.toml", *small, "--thickness", "30")
    assert (again[0], thick[0]) == (2, 2)
    assert "'a.toml' exists; name another" in again[1].err
    assert "plate thickness must stay below" in thick[1].err
    assert not (tmp_path / "b.toml").exists()
