"""A person for the setup, and small benches that are set up fast."""

from types import SimpleNamespace

import pytest

from rig.setup.desk import Leave
from rig.setup.session import SetupState, keep_state, state_beside

SMALL = {"pixels": (480, 384), "rate": 10, "width": 254.0, "height": 203.0}


class Person:
    """A desk at which `acts(view)` gives the next wish, or None to wait."""

    def __init__(self, acts, patience=3000):
        self.acts, self.patience = acts, patience
        self.view, self.frame, self.steps = None, None, ()
        self.seen, self.said = [], []

    def enter(self, steps):
        self.steps, self.view = steps, None
        self.seen.append(next(one.name for one in steps if one.state == "now"))

    def show(self, view, frame):
        self.view, self.frame = view, frame
        for text in (view.sentence, view.trouble):
            if text and text not in self.said:
                self.said.append(text)

    def wishes(self):
        self.patience -= 1
        if self.patience < 0:
            yield Leave()
        elif self.view is not None and (wish := self.acts(self.view)) is not None:
            yield wish


def begin(path, done=(), **answers):
    """Leave a rehearsal at `path` as if these steps were done, with its scene if it has a plate."""
    from rig.setup.scene_file import scene_text

    given = {"answers": SMALL | answers, "done": done, "rehearsal": True}
    state = SetupState.model_validate(given)
    if "plate" in done:
        text = scene_text(state.answers, rehearsal=True)
        path.write_text(text)
        state = state.model_copy(update={"written": text})
    keep_state(state_beside(path), state)
    return state


@pytest.fixture
def desk():
    """Give Person, begin and the answers of a small bench."""
    return SimpleNamespace(Person=Person, begin=begin, small=SMALL)
