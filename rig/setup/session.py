"""One run of the setup, and how far it is: a small checked file beside the scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError

from rig.calibration import store
from rig.calibration.results import Part
from rig.calibration.store import Calibration
from rig.scene import Scene, load
from rig.scene.refusal import SceneError, sentence
from rig.scene.section import Section
from rig.setup.answers import NOTHING_SAID, Answers, with_answer
from rig.setup.bench import SetupBench
from rig.setup.desk import Desk
from rig.setup.scene_file import scene_text, write_text
from rig.setup.steps import StepName, after


class SetupState(Section):
    """What was said and done so far."""

    version: Literal[1] = Field(1, description="of this file")
    rehearsal: bool = Field(False, description="whether it is of a twin, and of no real bench")
    answers: Answers = Field(NOTHING_SAID, description="what was said of the bench")
    done: tuple[StepName, ...] = Field((), description="steps that are done")
    written: str = Field("", description="the scene as it was last written")

    def after(self, name: StepName) -> SetupState:
        """Return the state once a step was done."""
        return self.model_copy(update={"done": after(self.done, name)})

    def with_answers(self, answers: Answers) -> SetupState:
        """Return the state with other answers."""
        return self.model_copy(update={"answers": answers})


def state_beside(scene: Path) -> Path:
    """Where the state of a scene lies."""
    return scene.with_suffix(".setup.json")


def read_state(path: Path) -> SetupState:
    """Read a state, that of a beginning where there is no file.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds no state.
    """
    if not path.exists():
        return SetupState.model_validate({})
    try:
        return SetupState.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]["type"]
        said = "it is no JSON" if first == "json_invalid" else sentence(error, SetupState)
        raise ValueError(
            f"state of the setup '{path}' is damaged: {said}; correct it there, or delete the file"
            " and begin anew"
        ) from error


def resume_state(scene: Path, rehearsal: bool) -> SetupState:
    """Read how far the setup of a scene is, or begin one.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds no state, or that of a rehearsal where none is meant, or the other way round.
    """
    path = state_beside(scene)
    state = read_state(path)
    if not path.exists():
        return state.model_copy(update={"rehearsal": rehearsal})
    if state.rehearsal and not rehearsal:
        raise ValueError(
            f"setup of '{scene}' is a rehearsal on a twin, and a real bench does not go on with it;"
            " pass --rehearse, or name another scene"
        )
    if rehearsal and not state.rehearsal:
        raise ValueError(
            f"setup of '{scene}' is that of a real bench, and a rehearsal would write over its"
            " calibration; name another scene, or leave --rehearse out"
        )
    return state


def keep_state(path: Path, state: SetupState) -> None:
    """Write a state whole or not at all."""
    write_text(path, state.model_dump_json(indent=2, exclude_none=True) + "\n")


def keep_scene(path: Path, state: SetupState, text: str) -> SetupState:
    """Write the scene of a state, unless somebody else has written there.

    Raises
    ------
    OSError
        If there is a file that the setup did not write, or that was changed since.
    """
    there = path.read_text(encoding="utf-8", errors="replace") if path.exists() else text
    if there not in (state.written, text):
        raise OSError(
            f"scene '{path}' was written or changed by hand, and the setup does not write over it;"
            " change it there, or move it away"
        )
    write_text(path, text)
    return state.model_copy(update={"written": text})


@dataclass
class SetupSession:
    """A setup under way.

    Attributes
    ----------
    path : Path
        Of the scene.
    bench : SetupBench
    desk : Desk
    state : SetupState
        As it lies on disk too.
    """

    path: Path
    bench: SetupBench
    desk: Desk
    state: SetupState

    @property
    def scene(self) -> Scene:
        """The scene as it was written."""
        return load(self.path.resolve())

    @property
    def calibration(self) -> Calibration:
        """What was measured so far."""
        return store.calibration_beside(self.path)

    def keep(self, state: SetupState) -> None:
        """Go on from another state, on disk first."""
        keep_state(state_beside(self.path), state)
        self.state = state

    def answer(self, key: str, text: str) -> str:
        """Take an answer; gives a sentence where it is none."""
        try:
            answers = with_answer(self.state.answers, key, text)
        except SceneError as error:
            return str(error)
        self.keep(self.state.with_answers(answers))
        return ""

    def write_scene(self) -> str:
        """Write the scene anew from what was said; gives a sentence where that may not be."""
        text = scene_text(self.state.answers, self.bench.rehearsal)
        try:
            self.keep(keep_scene(self.path, self.state, text))
        except OSError as error:
            return str(error)
        return ""

    def measured(self, part: Part) -> None:
        """Keep what was measured."""
        store.keep(store.beside(self.path), part, self.scene)
