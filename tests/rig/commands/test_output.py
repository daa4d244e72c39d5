import io
import json

import pytest
from rich.console import Console
from rich.table import Table

from rig.commands import output


@pytest.fixture
def screen(monkeypatch):
    written = io.StringIO()
    monkeypatch.setattr(output, "console", lambda: Console(file=written, width=80))
    return written


def test_a_result_is_a_text_or_one_json_object(capsys):
    output.emit("two points", {"points": 2}, as_json=False)
    output.emit("two points", {"points": 2}, as_json=True)
    text, line = capsys.readouterr().out.splitlines()
    assert text == "two points"
    assert json.loads(line) == {"points": 2}


def test_json_holds_no_number_that_json_does_not_have():
    with pytest.raises(ValueError, match="JSON"):
        output.emit("", {"error": float("nan")}, as_json=True)


def test_a_bar_shows_what_was_done_and_a_note(screen):
    with output.progress("training") as report:
        report(1, 4)
        report(4, 4, "loss 0.5 mm")
    assert "training" in screen.getvalue()
    assert "4/4" in screen.getvalue()
    assert "loss 0.5 mm" in screen.getvalue()


def test_no_bar_is_drawn_for_what_is_already_there(screen):
    with output.progress("influence"):
        pass
    assert screen.getvalue() == ""


def test_brackets_are_no_markup_in_a_result(capsys):
    table = Table("of [camera]", title="[results/SCENE/model.h5]")
    table.add_row("[those of the grid] :bug:")
    output.emit("add [camera] or leave it out", {}, as_json=False)
    output.emit(table, {}, as_json=False)
    text = capsys.readouterr().out
    for part in ("add [camera] or", "of [camera]", "[results/SCENE/model.h5]"):
        assert part in text
    assert "[those of the grid] :bug:" in text


def test_brackets_are_no_markup_in_running_text(capsys):
    output.console.cache_clear()
    output.console().print("one: [camera] is known")
    output.say("two: [camera] is known")
    output.warn("three: [camera] is known")
    with output.progress("[grid]") as report:
        report(1, 1, "four: [camera] is known")
    text = capsys.readouterr().err
    output.console.cache_clear()
    for count in ("one", "two", "three", "four"):
        assert f"{count}: [camera] is known" in text
    assert "[grid]" in text


def test_the_console_writes_on_stderr(capsys):
    output.console.cache_clear()
    output.console().print("hello")
    assert capsys.readouterr() == ("", "hello\n")
    output.console.cache_clear()
