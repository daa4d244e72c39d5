"""The stopwatch: quantiles of the last durations on a clock that the caller gives."""

import math

import pytest

from rig.system.timing import Stopwatch


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_a_stage_is_timed_on_the_given_clock_in_milliseconds():
    clock = Clock()
    watch = Stopwatch(clock)
    for seconds in (0.001, 0.002, 0.009):
        with watch.stage("sums"):
            clock.now += seconds
    assert watch.quantiles("sums")[0] == pytest.approx(2.0)
    assert 2.0 < watch.quantiles("sums")[1] <= 9.0


def test_what_was_never_timed_is_not_a_number():
    assert all(math.isnan(value) for value in Stopwatch(Clock()).quantiles("nothing"))


def test_only_the_last_durations_count():
    watch = Stopwatch(Clock(), kept=20)
    for _ in range(50):
        watch.add("slow once", 1.0)
    for _ in range(20):
        watch.add("slow once", 0.003)
    assert watch.quantiles("slow once") == pytest.approx((3.0, 3.0))


def test_the_table_keeps_the_order_of_first_use():
    watch = Stopwatch(Clock())
    for name in ("b", "a", "b", "c"):
        watch.add(name, 0.01)
    assert [row[0] for row in watch.table()] == ["b", "a", "c"]
    assert watch.table()[0][1:] == pytest.approx((10.0, 10.0))
