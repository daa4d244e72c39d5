"""The steps that a guide leads through: lens, pose, light, noise and delay."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np

from rig.calibration.board_guides import LensGuide, PoseGuide
from rig.calibration.guide import Guide
from rig.calibration.guided import PATIENCE, SLICE
from rig.calibration.light_guides import LatencyGuide, StripesGuide, settling_of
from rig.calibration.noise_guide import NoiseGuide
from rig.calibration.results import Part
from rig.calibration.steps import plate_of, posed, projector_of, seen_height
from rig.page.controls import UNITS
from rig.page.setup_view import Button, Question, StepView
from rig.projector.content import Content
from rig.projector.markers import Screen, fit_plate
from rig.setup.answers import Answers
from rig.setup.bench import NOTHING, PersonAct
from rig.setup.desk import Answer, Drop, Go, Leave, Next, Outcome, Push
from rig.setup.figures import advice_of
from rig.setup.forms import IDLE, LATER, NEXT, questions
from rig.setup.free_plate import FRAMES, in_the_way
from rig.setup.scene_file import board_for, corner_of_board, printed_corner
from rig.setup.session import SetupSession
from rig.setup.steps import Step
from rig.system.arrays import Grey
from rig.system.frame import Frame, Source

ACTS = {
    "lens": PersonAct("hold board"),
    "pose": PersonAct("lay board"),
    "noise": PersonAct("change light"),
}
"""What a person does in a step; nothing in the others."""

START = Button("start", "Start", usual=True)
LIES = Button("start", "It lies there", usual=True)
NOW = Button("start", "Start now")
AGAIN = Button("start", "Once more")
DROP_ALL = 0  # the number of any view: a guide of light takes all its images anew


def guide_for(setup: SetupSession, name: str) -> Guide:
    """Return the guide of a step, from the start.

    Raises
    ------
    ValueError
        If something that it stands on is missing.
    """
    answers, known = setup.state.answers, setup.calibration
    board, scene = board_for(answers), setup.scene
    match name:
        case "lens":
            return LensGuide(board)
        case "pose":
            corner = printed_corner(answers)
            return PoseGuide(known.known_lens(), board, corner, seen_height(scene))
        case "projector":
            size, settling = projector_of(scene).size, settling_of(known.latency)
            return StripesGuide(posed(known), plate_of(scene), size, settling)
        case "noise":
            return NoiseGuide(known.projector.black if known.projector else 0.0)
        case _:
            return LatencyGuide(np.random.default_rng(), setup.bench.clock)


def screen_of(setup: SetupSession) -> Screen:
    """Where the projector shows the plate, as far as that is known."""
    scene, known = setup.scene, setup.calibration
    return known.screen() or fit_plate(projector_of(scene).size, plate_of(scene).size)


@dataclass
class _Guided:
    """A guided step under way.

    Attributes
    ----------
    rest : list of (H, W) uint8, or None
        The last frames of a plate that is to lie free; None where that is not waited for.
    """

    setup: SetupSession
    step: Step
    guide: Guide | None = None
    part: Part | None = None
    trouble: str = ""
    rest: list[Grey] | None = None

    def enter(self) -> None:
        """Begin, or wait for what the step waits for."""
        match self.step.begins:
            case "at once":
                self.begin()
            case "free plate":
                self.rest = []
            case _:
                pass

    def hear(self) -> Outcome | None:
        """Do what the person wants; gives how the step ends, if it does."""
        for wish in self.setup.desk.wishes():
            match wish:
                case Push("start"):
                    self.begin()
                case Push("next") if self.part is not None:
                    return Next()
                case Answer("left" | "below" as key, text) if self.step.name == "pose":
                    self.trouble = self.setup.answer(key, text)
                    self.guide = self.part = None
                case Drop(view) if self.guide is not None:
                    self.guide.drop(view)
                case Go() | Leave():
                    return wish
                case _:
                    pass
        return None

    def begin(self) -> None:
        self.trouble, self.part, self.rest = "", None, None
        try:
            self.guide = guide_for(self.setup, self.step.name)
        except ValueError as error:
            self.trouble = str(error)

    def follow(self, frame: Frame | None, light_trouble: str) -> None:
        """Feed the guide, and keep its result once there is one."""
        if self.rest is not None and frame is not None:
            self._watch(self.rest, frame)
        if self.guide is None:
            return
        if light_trouble:
            self.trouble = light_trouble
            self.guide.drop(DROP_ALL)
            return
        if frame is not None:
            self.trouble = ""
            self.guide.add_frame(frame)
        try:
            self.part = self.guide.result()
        except ValueError as error:
            self.trouble, self.guide = str(error), None
            return
        if self.part is not None:
            self.guide = None
            self.setup.measured(self.part)
            known, answers = self.setup.calibration, self.setup.state.answers
            self.trouble = advice_of(self.step.name, known, answers)

    def _watch(self, rest: list[Grey], frame: Frame) -> None:
        """Begin once the plate lies free and still."""
        rest.append(frame.image)
        if len(rest) < FRAMES:
            return
        self.trouble = in_the_way(rest, board_for(self.setup.state.answers))
        rest.clear()
        if not self.trouble:
            self.begin()

    @property
    def is_good(self) -> bool:
        """Whether what was found needs nobody to look at it."""
        return self.part is not None and not self.trouble

    @property
    def shows(self) -> Content:
        return self.guide.shows if self.guide else ()

    def view(self) -> StepView:
        name, step = self.step.name, self.step
        asked, start = (), START if self.rest is None else NOW
        if name == "pose":
            asked, start = _where_it_lies(self.setup.state.answers), LIES
        view = StepView(name, step.title, step.says, self.trouble, asked, (start, LATER))
        if self.guide is not None:
            progress = self.guide.progress
            return replace(
                view,
                sentence=progress.sentence,
                progress=progress,
                buttons=(replace(AGAIN, label="Begin anew"), LATER),
                unit=UNITS.get(name, "mm"),
            )
        if self.part is not None:
            return replace(view, sentence=self._found(), buttons=(AGAIN, NEXT, LATER))
        return view

    def _found(self) -> str:
        part = "lens" if self.step.name == "lens" else self.step.name
        entry = getattr(self.setup.calibration, part)
        unit = UNITS.get(self.step.name, "mm")
        scale, text = {"s": (1e3, "ms"), "fraction": (100.0, "%")}.get(unit, (1.0, unit))
        return f"done, with an error of {scale * entry.error:.2g} {text}"


def _where_it_lies(answers: Answers) -> tuple[Question, ...]:
    left, below = corner_of_board(answers)
    there = answers.model_copy(update={"left": left, "below": below})
    return questions(there, ("left", "below"))


def be_guided(setup: SetupSession, step: Step) -> Outcome:
    """Lead through a step until what it finds is good, or the person takes it as it is."""
    guided = _Guided(setup, step)
    guided.enter()
    setup.bench.ask(ACTS.get(step.name, NOTHING))
    try:
        while True:
            try:
                return _on_bench(setup, step, guided)
            except (OSError, ValueError) as error:
                guided.trouble, guided.guide, guided.rest = str(error), None, None
                if (outcome := _wait(setup, guided)) is not None:
                    return outcome
    finally:
        setup.bench.ask(NOTHING)


def _wait(setup: SetupSession, guided: _Guided) -> Outcome | None:
    """Wait until the person has put right what is wrong; gives how the step ends, if it does."""
    while guided.guide is None:
        if (outcome := guided.hear()) is not None:
            return outcome
        setup.desk.show(guided.view(), None)
        time.sleep(IDLE)
    return None


def _on_bench(setup: SetupSession, step: Step, guided: _Guided) -> Outcome:
    with ExitStack() as parts:
        light: Callable[[Content], object] = _ignore
        window = None
        if step.lit:
            window = parts.enter_context(setup.bench.open_light(setup.scene, screen_of(setup)))
            light = window
        source = parts.enter_context(setup.bench.open_source(setup.scene))
        return _lead(setup, guided, source, light, lambda: window.trouble if window else "")


def _ignore(content: Content) -> None:
    """Show nothing: there is no projector in this step."""


def _lead(
    setup: SetupSession,
    guided: _Guided,
    source: Source,
    light: Callable[[Content], object],
    trouble: Callable[[], str],
) -> Outcome:
    heard, newest = time.monotonic(), None
    while True:
        if (outcome := guided.hear()) is not None:
            return outcome
        light(guided.shows)
        try:
            frame = source.grab(SLICE)
        except EOFError as end:
            raise OSError(f"{end}; the calibration needs more images") from None
        if frame is not None:
            heard, newest = time.monotonic(), frame
        elif time.monotonic() - heard > PATIENCE:
            raise OSError(f"no frame came for {PATIENCE:g} s; {source.status}")
        guided.follow(frame, trouble())
        if guided.is_good:
            return Next()
        setup.desk.show(guided.view(), newest)
        if guided.guide is None:
            time.sleep(IDLE)
