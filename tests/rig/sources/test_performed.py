"""What is done on the twin's plate for demos: within its forces, on its keys, over and over."""

import numpy as np
import pytest

from rig.projector.demos.keyboard import lay_keys
from rig.sources.performed import BEAT, BEATS, BEGINS, REST, ROUND, TUNE, melody, weights
from rig.sources.script import STILL

SIZE, FORCE = (254.0, 180.0), (0.5, 4.0)


@pytest.mark.parametrize("script", [melody(SIZE, FORCE), weights(SIZE, FORCE)])
def test_nothing_touches_at_first_and_at_most_two_do_within_the_forces_after(script):
    times = np.arange(0.0, 40.0, 1 / 30)
    played = [script(time) for time in times]
    assert not any(touches for time, touches in zip(times, played, strict=True) if time < STILL)
    counts = [len(touches) for touches in played]
    assert 0 in counts
    assert max(counts) <= 2
    assert max(touch.force for touches in played for touch in touches) == FORCE[1] * (
        1.0 if max(counts) == 1 else 0.5
    )


def test_weights_lie_still_and_come_again():
    script = weights(SIZE, FORCE)
    early, late = script(BEGINS + 2.0), script(BEGINS + 3.0)
    assert early == late
    assert early[0].force == 2.0
    assert script(BEGINS + 2.0 + ROUND) == early


def test_the_tune_is_played_on_its_keys():
    script, keys = melody(SIZE, FORCE), lay_keys(SIZE)
    start, struck = BEGINS, []
    for beats in BEATS:
        (touch,) = script(start + 0.3 * beats * BEAT)
        struck.append(keys.pitch_at(touch.x, touch.y) - 60)
        start += beats * BEAT
    assert struck == list(TUNE)
    assert script(start + REST / 2) == ()
