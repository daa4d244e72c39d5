"""The step of the camera: which it is, and what its image says of light, exposure and focus."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from rig.camera.noise import DARK, SATURATED
from rig.live.snapshot import Sign
from rig.page.setup_view import Question, StepView
from rig.setup.bench import NOTHING, CameraChoice
from rig.setup.desk import Answer, Go, Leave, Next, Outcome, Push
from rig.setup.forms import IDLE, LABELS, LATER, NEXT, questions
from rig.setup.scene_file import scene_of
from rig.setup.session import SetupSession
from rig.setup.steps import Step
from rig.system.arrays import Grey
from rig.system.frame import Frame, Source

PATIENCE = 0.5  # s for a frame
AGAIN = 2.0  # s before a camera that does not open is tried again
BINS = 32  # of the histogram
CLIPPED = 0.01  # of the pixels that may be too bright or too dark
BRIGHT, DIM = 99.0, 110.0  # percentile, and the grey levels that it must have
SPREAD = 20.0  # grey levels, standard deviation of the speckle
SHARP = 0.9  # of the best focus so far


@dataclass(frozen=True)
class CameraFigures:
    """Figures of one image.

    Attributes
    ----------
    histogram : tuple of int
        Pixels by grey level, from dark to bright.
    bright : float, grey levels
        Of its brightest parts, less the few that glint.
    clipped : float
        Fraction of the pixels that are too bright or too dark to say anything.
    contrast : float, grey levels
        Standard deviation over the image.
    focus : float
        Mean squared gradient over the variance, a px²: largest where edges are sharpest.
    """

    histogram: tuple[int, ...]
    bright: float
    clipped: float
    contrast: float
    focus: float


def figures_of(image: Grey) -> CameraFigures:
    """Measure an image, (H, W) uint8."""
    counts = np.bincount(image.ravel(), minlength=256)
    levels = image[::2, ::2].astype(np.float32)
    steps = (
        np.diff(image[::2].astype(np.float32), axis=1),
        np.diff(image[:, ::2].astype(np.float32), axis=0),
    )
    energy = sum(float(np.square(step).mean()) for step in steps)
    total = counts.cumsum() / image.size
    return CameraFigures(
        histogram=tuple(counts.reshape(BINS, -1).sum(axis=1).tolist()),
        bright=float(np.searchsorted(total, BRIGHT / 100)),
        clipped=float((counts[: DARK + 1].sum() + counts[SATURATED:].sum()) / image.size),
        contrast=float(levels.std()),
        focus=energy / max(float(levels.var()), 1.0),
    )


def signs_of(figures: CameraFigures, best: float) -> tuple[Sign, ...]:
    """Say what figures mean, beside the best focus so far."""
    part = figures.focus / max(best, figures.focus, 1e-9)
    if figures.clipped > CLIPPED:
        light = f"{figures.clipped:.0%} too bright or too dark: shorten the exposure"
    elif figures.bright < DIM:
        light = f"{figures.bright:.0f} grey levels at the brightest: more light, or expose longer"
    else:
        light = f"{figures.bright:.0f} grey levels at the brightest"
    return (
        Sign("exposure", light, figures.clipped > CLIPPED or figures.bright < DIM),
        Sign("contrast", f"{figures.contrast:.0f} grey levels", figures.contrast < SPREAD),
        Sign("focus", f"{part:.0%} of the best so far", part < SHARP),
    )


def choose_camera(setup: SetupSession, step: Step) -> Outcome:
    """Show what a camera sees until it is chosen, with what focus and light are worth."""
    found = setup.bench.cameras()
    if setup.state.answers.camera is None and found:
        setup.answer("camera", found[0].device)
    setup.bench.ask(NOTHING)
    look = _Look(setup, step)
    while True:
        if (outcome := look.through_camera()) is not None:
            return outcome


@dataclass
class _Look:
    """A look through the camera that is answered now, opened anew when that changes."""

    setup: SetupSession
    step: Step
    trouble: str = ""
    best: float = 0.0
    frame: Frame | None = None
    figures: CameraFigures | None = None

    def through_camera(self) -> Outcome | None:
        """Look until the step ends; gives None where another camera is to be opened."""
        self.best, self.frame, self.figures = 0.0, None, None
        with ExitStack() as parts:
            source, tried = self._opened(parts), time.monotonic()
            while source is not None or time.monotonic() - tried < AGAIN:
                heard = self._hear()
                if heard is not None:
                    return None if isinstance(heard, Answer) else heard
                if source is not None:
                    self._take(source)
                self.setup.desk.show(self._view(), self.frame)
                time.sleep(IDLE)
        return None

    def _opened(self, parts: ExitStack) -> Source | None:
        scene = scene_of(self.setup.state.answers, self.setup.bench.rehearsal)
        try:
            return parts.enter_context(self.setup.bench.open_source(scene))
        except (OSError, ValueError) as error:
            self.trouble = str(error)
        return None

    def _hear(self) -> Outcome | Answer | None:
        for wish in self.setup.desk.wishes():
            match wish:
                case Answer("camera" | "exposure" as key, text):
                    self.trouble = self.setup.answer(key, _device(self.setup, text))
                    return wish
                case Push("next") if self.frame is not None:
                    self.trouble = _other_size(self.setup, self.frame) or self.setup.write_scene()
                    if not self.trouble:
                        return Next()
                case Go() | Leave():
                    return wish
                case _:
                    pass
        return None

    def _take(self, source: Source) -> None:
        """Take the newest frame and its figures; where none comes the source says why."""
        try:
            frame = source.grab(PATIENCE)
        except (OSError, EOFError) as error:
            self.trouble = str(error)
            return
        if frame is None:
            self.trouble = source.status
            return
        self.frame, self.figures = frame, figures_of(frame.image)
        self.best = max(self.best, self.figures.focus)

    def _view(self) -> StepView:
        answers, last, step = self.setup.state.answers, self.figures, self.step
        listed = tuple(map(_called, self.setup.bench.cameras()))
        chosen = next((one for one in listed if one.startswith(f"{answers.camera},")), "")
        asked = Question(
            "camera", LABELS["camera"], chosen or answers.camera or "", listed, free=True
        )
        return StepView(
            step.name,
            step.title,
            step.says,
            self.trouble,
            (asked, *questions(answers, ("exposure",))),
            (NEXT, LATER) if last else (LATER,),
            signs=signs_of(last, self.best) if last else (),
            histogram=last.histogram if last else (),
        )


def _called(camera: CameraChoice) -> str:
    return f"{camera.device}, {camera.name}"


def _device(setup: SetupSession, text: str) -> str:
    """Device of a camera that was chosen by what it is called; else the text itself."""
    return next((one.device for one in setup.bench.cameras() if _called(one) == text), text)


def _other_size(setup: SetupSession, frame: Frame) -> str:
    height, width = frame.image.shape
    wanted = setup.state.answers.pixels
    if (width, height) == wanted:
        return ""
    return (
        f"camera gives {width} x {height} px, and {wanted[0]} x {wanted[1]} were said of it; set"
        f" its pixels to {width} x {height} in the step 'Plate'"
    )
