"""The steps that only ask, the plate and the prints, and how all steps put their questions."""

from __future__ import annotations

import time
from typing import get_args

from rig.page.setup_view import Button, Question, StepView
from rig.setup.answers import Answers, text_of
from rig.setup.desk import Answer, Go, Leave, Next, Outcome, Push
from rig.setup.judgement import refusal
from rig.setup.scene_file import printed_board
from rig.setup.session import SetupSession
from rig.setup.steps import Step

IDLE = 0.02  # s between two looks at what the person wants
NEXT = Button("next", "Next", usual=True)
LATER = Button("leave", "Leave")
LABELS = {
    "width": "width, along x, mm",
    "height": "height, along y, mm",
    "thickness": "thickness, mm",
    "material": "material",
    "edges": "edges",
    "stand_off": "from the camera to the plate, mm",
    "side": "side of the camera",
    "pixels": "pixels of the camera",
    "rate": "images a second",
    "force": "largest force of a finger, N",
    "projector": "a projector lights the plate",
    "ruler": "100 mm of the printed ruler measure, mm",
    "camera": "camera",
    "exposure": "exposure, such as 8 ms",
    "output": "output of the desktop",
    "left": "board's left edge from the plate's, mm",
    "below": "board's lower edge from the plate's, mm",
    "grams": "known weight, g",
}
PLATE = (
    "width", "height", "thickness", "material", "edges", "stand_off", "side", "pixels", "rate",
    "force", "grams", "projector",
)  # fmt: skip


def questions(answers: Answers, keys: tuple[str, ...]) -> tuple[Question, ...]:
    """Return questions with the answers that they have now."""
    return tuple(Question(key, LABELS[key], text_of(answers, key), _choices(key)) for key in keys)


def _choices(key: str) -> tuple[str, ...]:
    found = get_args(Answers.model_fields[key].annotation)
    return tuple(found) if found and all(isinstance(one, str) for one in found) else ()


def ask_plate(setup: SetupSession, step: Step) -> Outcome:
    """Ask what the bench is, and write its scene unless it cannot work."""
    trouble, refused = "", dict[str, str]()
    while True:
        for wish in setup.desk.wishes():
            match wish:
                case Answer(key, text) if key in PLATE:
                    trouble = _answered(setup, key, text, refused)
                case Push("next") if not refused:
                    moment = StepView(step.name, step.title, "one moment: the bench is judged")
                    setup.desk.show(moment, None)
                    trouble = refusal(setup.state.answers) or setup.write_scene()
                    if not trouble:
                        return Next()
                case Go() | Leave():
                    return wish
                case _:
                    pass
        asked = questions(setup.state.answers, PLATE)
        view = StepView(step.name, step.title, step.says, trouble, asked, (NEXT, LATER))
        setup.desk.show(view, None)
        time.sleep(IDLE)


def _answered(setup: SetupSession, key: str, text: str, refused: dict[str, str]) -> str:
    """Take an answer; what was refused stands in the way until it is answered otherwise."""
    refused.pop(key, None)
    if trouble := setup.answer(key, text):
        refused[key] = trouble
    return next(iter(refused.values()), "")


def ask_prints(setup: SetupSession, step: Step) -> Outcome:
    """Print the board and the speckle beside the scene; take what the ruler measures."""
    refused = dict[str, str]()
    says, trouble = _print(setup, step)
    while True:
        for wish in setup.desk.wishes():
            match wish:
                case Answer("ruler" as key, text):
                    trouble = _answered(setup, key, text, refused)
                case Push("print"):
                    says, trouble = _print(setup, step)
                case Push("next") if not refused:
                    return Next()
                case Go() | Leave():
                    return wish
                case _:
                    pass
        asked = questions(setup.state.answers, ("ruler",))
        buttons = Button("print", "Write the PDF files again"), NEXT, LATER
        setup.desk.show(StepView(step.name, step.title, says, trouble, asked, buttons), None)
        time.sleep(IDLE)


def _print(setup: SetupSession, step: Step) -> tuple[str, str]:
    """Write both files; gives what to do with them, and what went wrong."""
    import synthetic
    from rig.calibration.board_print import print_board

    moment = StepView(step.name, step.title, "one moment: the files are written")
    setup.desk.show(moment, None)
    scene, stem = setup.scene, setup.path.with_suffix("")
    board, speckle = (stem.with_name(f"{stem.name}-{what}.pdf") for what in ("board", "speckle"))
    if scene.plate is None or scene.pattern is None:
        trouble = f"scene '{scene.title}' has no pattern; answer the questions about the plate"
        return step.says, trouble
    try:
        print_board(board, printed_board(setup.state.answers))
        synthetic.print_pattern(speckle, scene.pattern.build(scene.plate), 600.0)
    except OSError as error:
        return step.says, f"the files cannot be written: {error}"
    return (
        f"print {board.name} and {speckle.name}, which lie beside the scene, at 100 %, measure 100"
        " mm of the board's ruler, glue the speckle to the plate and the board to something flat"
    ), ""
