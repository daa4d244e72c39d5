"""States of a setup, changed."""

from pathlib import Path

from rig.setup.scene_file import corner_of_board, scene_of
from rig.setup.session import SetupState, keep_state, read_state
from rig.setup.steps import next_step
from rig.studies.files.kind import Kind, Wrong
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutation import mutate_text


def make_setup(path: Path) -> None:
    """Write how far a setup is, with every answer that there is."""
    said = {
        "camera": "/dev/video2",
        "exposure": 8e-3,
        "output": "HDMI-1",
        "left": 15.0,
        "below": 22.0,
    }
    done = "plate", "print", "camera", "output", "lens"
    keep_state(path, SetupState.model_validate({"answers": said, "done": done}))


def read_setup(path: Path) -> Wrong:
    """Read a state, and make of it what the setup makes."""
    state = read_state(path)
    yield from out_of_range(state.answers.model_dump())
    next_step(state.answers, state.done)
    corner_of_board(state.answers)
    scene_of(state.answers)


SETUP = Kind(".setup.json", make_setup, mutate_text, read_setup)
