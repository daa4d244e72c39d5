"""The step of the known weight: where to lay it, what was seen, and the bench that it shows."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace

from rig.calibration.bench_presses import Listed, identify_by_images, usual_bench
from rig.calibration.bench_refusal import require_sound
from rig.calibration.guide import Progress
from rig.calibration.guided import PATIENCE
from rig.live.baseline import average_reference
from rig.live.bench import Bench
from rig.live.chain import Chain, ChainState, at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.snapshot import Mark
from rig.live.view import marks, plate_view
from rig.page.setup_view import Button, StepView
from rig.setup.bench import NOTHING, LightWindow, PersonAct
from rig.setup.desk import Answer, Go, Leave, Next, Outcome, Push
from rig.setup.figures import advice_of
from rig.setup.forms import IDLE, LATER, NEXT, questions
from rig.setup.free_plate import in_the_way
from rig.setup.guided_steps import START, screen_of
from rig.setup.scene_file import board_for
from rig.setup.session import SetupSession
from rig.setup.steps import Step
from rig.setup.weight_guide import WeightGuide, targets
from rig.system.arrays import AnyArray
from rig.system.frame import Frame, Source
from rig.system.timing import Stopwatch


@dataclass
class _Weighing:
    """The step under way."""

    setup: SetupSession
    step: Step
    bench: Bench | None = None
    chain: Chain | None = None
    state: ChainState | None = None
    guide: WeightGuide | None = None
    reference: list[AnyArray] = field(default_factory=list[AnyArray])
    found: str = ""
    trouble: str = ""

    def hear(self) -> Outcome | None:
        for wish in self.setup.desk.wishes():
            match wish:
                case Answer("grams", text):
                    self.trouble, self.guide = self.setup.answer("grams", text), None
                    if not self.trouble:
                        self.begin()
                case Push("start"):
                    self.begin()
                case Push("next") if self.found:
                    return Next()
                case Go() | Leave():
                    return wish
                case _:
                    pass
        return None

    def begin(self) -> None:
        """Build the bench as it is usual, and wait for the reference."""
        self.trouble, self.found, self.chain = "", "", None
        answers = self.setup.state.answers
        report = self._work("the plate is computed")
        try:
            self.bench = usual_bench(self.setup.scene, self.setup.calibration, report)
        except ValueError as error:
            self.trouble = str(error)
            return
        self.reference = []
        self.guide = WeightGuide(targets(answers.size, answers.weight))

    def follow(self, frame: Frame) -> None:
        """Take the reference first, then press after press, then find the bench."""
        if self.guide is None or self.bench is None:
            return
        if self.chain is None or self.state is None:
            self._refer(frame, self.bench)
            return
        result = estimate_frame(
            self.chain, frame.image, self.state, Stopwatch(self.setup.bench.clock)
        )
        self.state = result.state
        self.guide.add_frame(frame, marks(result.estimate))
        self._ask()
        if self.guide.target is None:
            self._identify(self.bench, self.chain, self.guide)

    def _refer(self, frame: Frame, bench: Bench) -> None:
        self.reference.append(frame.image)
        if len(self.reference) < bench.reference_frames:
            return
        self.trouble = in_the_way(self.reference, board_for(self.setup.state.answers))
        if not self.trouble:
            self.chain = bench.prepare(average_reference(self.reference))[0]
            self.state = at_rest(self.chain)
        self.reference = []

    def _ask(self) -> None:
        """Ask for the next press, once the plate was let go of."""
        guide = self.guide
        act = NOTHING
        if guide and guide.target and not guide.progress.sentence.startswith("take the weight"):
            act = PersonAct("press", guide.target)
        self.setup.bench.ask(act)

    def _identify(self, bench: Bench, chain: Chain, guide: WeightGuide) -> None:
        self.guide = None
        self.setup.bench.ask(NOTHING)
        report = self._work("the bench is found from the presses")
        seen = [
            (Listed(str(one), (0, frames - 1), (press.x, press.y), press.force), image)
            for one, (press, frames, image) in enumerate(guide.taken, start=1)
        ]
        try:
            part = identify_by_images(bench, chain, seen, (), report)
            require_sound(part, bench.plate.size)
        except ValueError as error:
            self.trouble = str(error)
            return
        if part.outliers:
            names = ", ".join(str(one + 1) for one in part.outliers)
            self.trouble = f"press {names} contradicts the others; press once more, on the marks"
        self.setup.measured(part)
        known, answers = self.setup.calibration, self.setup.state.answers
        self.trouble = self.trouble or advice_of(self.step.name, known, answers)
        held = part.held_out
        self.found = (
            f"done; presses held out are off by {held.place:.2g} mm and {100 * held.force:.2g} %"
            if held
            else "done"
        )

    def _work(self, what: str) -> Callable[[int, int], None]:
        """Show that something is computed, and how far it is."""

        def report(done: int, total: int) -> None:
            progress = Progress(f"one moment: {what}", done, total)
            view = StepView(self.step.name, self.step.title, progress.sentence, progress=progress)
            self.setup.desk.show(view, None)

        report(0, 1)
        return report

    @property
    def is_good(self) -> bool:
        """Whether what was found needs nobody to look at it."""
        return bool(self.found) and not self.trouble

    def view(self) -> StepView:
        step = self.step
        asked = questions(self.setup.state.answers, ("grams",))
        view = StepView(step.name, step.title, step.says, self.trouble, asked, (START, LATER))
        if self.guide is not None:
            waits = self.chain is None
            progress = self.guide.progress
            says = "take your hands off the plate" if waits else progress.sentence
            anew = Button("start", "Begin anew")
            return replace(
                view, sentence=says, progress=progress, buttons=(anew, LATER), mark=self._mark()
            )
        if self.found:
            again = Button("start", "Once more")
            return replace(view, sentence=self.found, buttons=(again, NEXT, LATER))
        return view

    def _mark(self) -> tuple[float, float] | None:
        """Where the mark is in the image, px."""
        target = self.guide.target if self.guide and self.chain else None
        if target is None or self.bench is None:
            return None
        view = plate_view(self.bench.plate, self.bench.camera)
        x, y, w = view.T_px_plate @ (target.x, target.y, 1.0)
        return float(x / w), float(y / w)

    @property
    def shows(self) -> tuple[Mark, ...]:
        """The mark on the plate."""
        target = self.guide.mark if self.guide and self.chain else None
        return (Mark(target.x, target.y, target.force),) if target else ()


def press_known_weight(setup: SetupSession, step: Step) -> Outcome:
    """Ask for presses until they show a good bench, or the person takes it as it is."""
    weighing = _Weighing(setup, step)
    setup.bench.ask(NOTHING)
    try:
        while True:
            try:
                return _on_bench(setup, weighing)
            except (OSError, ValueError) as error:
                weighing.trouble, weighing.guide = str(error), None
                while weighing.guide is None:
                    if (outcome := weighing.hear()) is not None:
                        return outcome
                    setup.desk.show(weighing.view(), None)
                    time.sleep(IDLE)
    finally:
        setup.bench.ask(NOTHING)


def _on_bench(setup: SetupSession, weighing: _Weighing) -> Outcome:
    with ExitStack() as parts:
        light: LightWindow | None = None
        if setup.scene.projector:
            light = parts.enter_context(setup.bench.open_light(setup.scene, screen_of(setup)))
        source = parts.enter_context(setup.bench.open_source(setup.scene))
        return _follow(setup, weighing, source, light)


def _follow(
    setup: SetupSession, weighing: _Weighing, source: Source, light: LightWindow | None
) -> Outcome:
    newest: Frame | None = None
    if weighing.guide is None:
        weighing.begin()
    while True:
        if (outcome := weighing.hear()) is not None:
            return outcome
        if light is not None:
            light(weighing.shows)
        frame = source.grab(PATIENCE)
        if frame is None:
            raise OSError(f"no frame came for {PATIENCE:g} s; {source.status}")
        newest = frame
        weighing.follow(frame)
        if weighing.is_good:
            return Next()
        setup.desk.show(weighing.view(), newest)
        if weighing.guide is None:
            time.sleep(IDLE)
