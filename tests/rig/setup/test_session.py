"""A setup is left and resumed: its steps, its file, and what is damaged."""

import json

import pytest
from hypothesis import given, strategies as st

from rig.setup.answers import NOTHING_SAID
from rig.setup.desk import Answer, Go, Leave, Push
from rig.setup.rehearsal import RehearsedBench
from rig.setup.run import set_up
from rig.setup.session import keep_scene, read_state, state_beside
from rig.setup.steps import STEPS, after, can_enter, next_step, steps_of

NAMES = [step.name for step in STEPS]
DARK = NOTHING_SAID.model_copy(update={"projector": "no"})


@given(st.lists(st.sampled_from(NAMES)))
def test_no_step_stays_done_on_what_was_done_after_it(names):
    done = ()
    for name in names:
        if can_enter(NOTHING_SAID, done, name):
            done = after(done, name)
    order = {name: at for at, name in enumerate(done)}
    for step in STEPS:
        for other in step.after:
            if step.name in order:
                assert order[other] < order[step.name]


def test_the_steps_in_their_order_lead_to_the_end():
    for answers in (NOTHING_SAID, DARK):
        done = ()
        while step := next_step(answers, done):
            assert can_enter(answers, done, step.name)
            done = after(done, step.name)
        assert done == tuple(step.name for step in steps_of(answers))
    assert not {"output", "projector", "latency"} & set(done)


def test_another_lens_asks_for_pose_light_and_weight_again():
    done = after(tuple(NAMES), "lens")
    assert set(NAMES) - set(done) == {"pose", "projector", "presses", "verdict"}


@pytest.mark.slow
def test_a_closed_setup_is_resumed_where_it_was_left(tmp_path, desk):
    path = tmp_path / "my.toml"
    desk.begin(path)
    first = desk.Person(lambda view: Push("next") if view.name == "plate" else Leave())
    assert not set_up(path, RehearsedBench(1), first)
    assert first.seen == ["plate", "print"]
    assert path.exists()
    assert json.loads(state_beside(path).read_text())["done"] == ["plate"]
    assert list(tmp_path.glob("*.partial")) == []
    again = desk.Person(lambda view: Leave())
    assert not set_up(path, RehearsedBench(1), again)
    assert again.seen == ["print"]
    assert {one.name: one.state for one in again.steps}["plate"] == "done"


def test_every_answer_is_kept_before_the_step_is_done(tmp_path, desk):
    path = tmp_path / "my.toml"
    wishes = iter([Answer("thickness", "1.5"), Answer("width", "-3"), Leave()])
    person = desk.Person(lambda view: next(wishes))
    set_up(path, RehearsedBench(1), person)
    assert read_state(state_beside(path)).answers.thickness == 1.5
    assert not path.exists()
    assert "width is -3 mm; give more than 0 mm" in person.said


def test_a_step_that_stands_on_others_is_not_entered_before_them(tmp_path, desk):
    path = tmp_path / "my.toml"
    desk.begin(path, ("plate", "print"))
    wishes = iter([Go("presses"), Go("nonsense"), Go("plate"), Leave()])
    person = desk.Person(lambda view: next(wishes))
    set_up(path, RehearsedBench(1), person)
    assert person.seen == ["camera", "camera", "camera", "plate"]


class Real(RehearsedBench):
    """Play a real bench."""

    rehearsal = False


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "then", "says"),
    [
        (RehearsedBench, Real, "is a rehearsal on a twin, .*; pass --rehearse"),
        (Real, RehearsedBench, "is that of a real bench, .*; name another scene"),
    ],
)
def test_a_rehearsal_and_a_real_bench_do_not_go_on_with_each_other(
    tmp_path, desk, first, then, says
):
    path = tmp_path / "my.toml"

    def leave_after_plate():
        return desk.Person(lambda view: Push("next") if view.name == "plate" else Leave())

    set_up(path, first(1), leave_after_plate())
    before = {file: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(ValueError, match=says):
        set_up(path, then(1), leave_after_plate())
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == before
    again = desk.Person(lambda view: Leave())
    set_up(path, first(1), again)
    assert again.seen == ["print"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (b"", "it is no JSON"),
        (b"\xff\xfe\x00", "it is no JSON"),
        (b'{"version": 2}', "version is 2; give 1"),
        (b'{"version": 1, "done": ["plat"]}', "done"),
        (b'{"version": 1, "answers": {"width": 1e300}}', "answers.width is 1e+300 mm"),
        (b'{"version": 1, "anwsers": {}}', "unknown key 'anwsers'"),
    ],
)
def test_a_damaged_state_is_refused_in_a_sentence(tmp_path, desk, text, says):
    path = tmp_path / "my.toml"
    state_beside(path).write_bytes(text)
    with pytest.raises(ValueError, match=r"my\.setup\.json' is damaged") as error:
        set_up(path, RehearsedBench(1), desk.Person(lambda view: Leave()))
    assert says in str(error.value)
    assert "delete the file and begin anew" in str(error.value)


def test_no_cut_of_a_state_is_taken_for_another(tmp_path, desk):
    path = tmp_path / "my.toml"
    desk.begin(path, ("plate", "print"))
    whole = state_beside(path).read_bytes()
    for cut in range(1, len(whole.rstrip()), 7):
        state_beside(path).write_bytes(whole[:cut])
        with pytest.raises(ValueError, match="is damaged"):
            read_state(state_beside(path))


def test_a_scene_that_was_changed_by_hand_is_not_written_over(tmp_path, desk):
    path = tmp_path / "my.toml"
    state = desk.begin(path, ("plate",))
    path.write_text("# mine\n" + path.read_text())
    with pytest.raises(OSError, match="changed by hand"):
        keep_scene(path, state, "other = 1\n")
    assert path.read_text().startswith("# mine")
