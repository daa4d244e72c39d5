"""A line that is typed while a run goes on is a wish, or a sentence says what would be one."""

from types import SimpleNamespace

import pytest

from rig.commands.typed import obey, typed


@pytest.fixture
def loop():
    done = []

    def weigh(force):
        if not force > 0:
            raise ValueError("known weight must be 0.5 N or more")
        done.append(("weigh", force))

    return SimpleNamespace(done=done, tare=lambda: done.append("tare"), weigh=weigh, learned=None)


def test_lines_are_wishes(loop):
    assert [obey(line, loop) for line in ("w 2", "t\n", " w 0.75 ", "\n")] == ["", "", "", ""]
    assert loop.done == [("weigh", 2.0), "tare", ("weigh", 0.75)]


@pytest.mark.parametrize(
    ("line", "refused"),
    [("w", "'w' is no wish"), ("w two", "two"), ("w -1", "0.5 N or more"), ("x", "type 'w 2'")],
)
def test_what_is_no_wish_is_refused_in_a_sentence(loop, line, refused):
    assert refused in obey(line, loop)
    assert loop.done == []


def test_nobody_can_type_where_nothing_is_learned(loop):
    assert typed(loop, print) is None
