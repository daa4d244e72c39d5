"""Whether the bench that was described can work, before it is built."""

from __future__ import annotations

from rig.design import limits
from rig.setup.answers import Answers
from rig.setup.scene_file import scene_of


def refusal(answers: Answers) -> str:
    """Say in a sentence why a bench cannot work and what to change; empty where it can."""
    try:
        return limits.refusal(scene_of(answers))
    except ValueError as error:
        return str(error)
