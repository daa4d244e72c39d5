"""What the projector was given: right for a second, and no more of it is held."""

from rig.projector.content import Plain
from rig.projector.display_log import KEPT, DisplayLog


def test_what_was_shown_in_the_last_second_is_known_and_the_rest_forgotten():
    log, rate = DisplayLog(), 50
    for number in range(4 * rate):
        log.add(number / rate, Plain(number))
    newest = (4 * rate - 1) / rate
    for back in (0.0, 0.3, KEPT):
        assert log.at(newest - back + 1e-9) == Plain(round((newest - back) * rate))
    assert len(log) == KEPT * rate + 1  # an image of a program is some megabytes


def test_a_content_that_stays_is_known_however_long():
    log = DisplayLog()
    assert log.at(5.0) == ()
    log.add(5.0, Plain(7))
    assert (log.at(4.9), log.at(500.0)) == ((), Plain(7))
