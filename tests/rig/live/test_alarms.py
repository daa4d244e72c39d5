"""Alarms of a run: they begin where a bound is crossed, and stay a while after."""

import shutil
from dataclasses import replace
from unittest.mock import Mock

import pytest

import rig
from rig.live.alarms import LOOKS, MB, MINUTE, STAYS, Alarms, free_space, says_new, watched
from rig.live.snapshot import Mark
from rig.scene import SceneError
from rig.scene.alarms import AlarmsSection
from tests.rig.page.conftest import draw_snapshot


class Bench:
    """A clock and a disk that the test sets."""

    def __init__(self, **bounds):
        self.now, self.free = 50.0, 10**12
        self._alarms = Alarms(AlarmsSection(**bounds), lambda: self.now, lambda: self.free)

    def kinds(self, **changes):
        """Kinds of the alarms that stand in a frame."""
        return [alarm.kind for alarm in self.frame(**changes)]

    def frame(self, **changes):
        shot = draw_snapshot(1, captured=self.now, **{"touches": (), "dropped": 0} | changes)
        return self._alarms(shot).alarms


def pressed(*forces):
    return tuple(Mark(20.0, 30.0, force) for force in forces)


def test_a_force_beyond_the_bound_is_one_alarm_that_stays_a_while():
    bench = Bench(force=3.0)
    assert bench.kinds(touches=pressed(1.0, 2.9)) == []
    (alarm,) = bench.frame(touches=pressed(1.0, 4.5))
    assert (alarm.kind, alarm.time) == ("force", 50.0)
    assert alarm.sentence == "a touch presses with 4.50 N, more than 3 N; lift it"
    bench.now += 1.0
    (harder,) = bench.frame(touches=pressed(6.0))
    assert harder == alarm
    assert harder.sentence.startswith("a touch presses with 6.00 N")
    bench.now += STAYS - 0.1
    assert bench.frame() == (alarm,)
    bench.now += 0.2
    assert bench.frame() == ()


def test_silence_is_counted_from_the_last_new_frame():
    bench = Bench(silence=2.0)
    assert bench.kinds() == []
    bench.now += 1.9
    assert bench.kinds(fresh=False) == []
    bench.now += 0.2
    assert bench.kinds(fresh=False) == ["silence"]
    bench.now += STAYS + 0.1
    assert bench.kinds() == []


def test_a_folder_that_is_gone_has_no_space_and_ends_no_run(monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", Mock(side_effect=OSError("stale file handle")))
    assert free_space() == 0


def test_the_disk_is_looked_at_now_and_then():
    bench = Bench(disk=100)
    bench.free = 101 * MB
    assert bench.kinds() == []
    bench.free = 99 * MB
    assert bench.kinds() == []  # not at each frame
    bench.now += LOOKS
    (alarm,) = bench.frame()
    assert alarm.sentence == "99 MB are free, less than 100 MB; free space"


def test_dropped_frames_are_counted_over_a_minute():
    bench = Bench(dropped=5)
    assert bench.kinds(dropped=40) == []  # before it was watched
    bench.now += 10.0
    assert bench.kinds(dropped=45) == []
    bench.now += 10.0
    assert bench.kinds(dropped=46) == ["dropped"]
    bench.now += MINUTE + 20.0
    assert bench.kinds(dropped=46) == []
    assert bench.kinds(dropped=50) == []


def test_a_bound_that_the_scene_does_not_name_is_not_watched():
    bench = Bench()
    bench.free = 0
    bench.frame()
    bench.now += 1e4
    assert bench.kinds(touches=pressed(1e3), dropped=10**6, fresh=False) == []


def test_an_alarm_is_said_when_it_begins():
    said, bench = [], Bench(force=3.0)
    say = says_new(said.append)
    for force in (4.0, 5.0, 0.0, 6.0):
        say(draw_snapshot(1, alarms=bench.frame(touches=pressed(force))))
        bench.now += STAYS if force else STAYS + 0.1
    assert [sentence.split(",")[0] for sentence in said] == [
        "a touch presses with 4.00 N",
        "a touch presses with 6.00 N",
    ]


def test_frames_are_as_they_are_without_bounds():
    shots = [draw_snapshot(1), draw_snapshot(2)]
    assert list(watched(shots, None)) == shots
    hard = replace(shots[0], touches=pressed(9.0))
    (seen,) = watched([hard], AlarmsSection(force=2.0))
    assert [alarm.kind for alarm in seen.alarms] == ["force"]


@pytest.mark.parametrize("bound", [{"force": 0}, {"silence": -1}, {"disk": 0}, {"dropped": -1}])
def test_a_bound_that_is_none_is_refused(bound):
    with pytest.raises(SceneError, match=f"alarms.{next(iter(bound))}"):
        rig.load("twin", {"alarms": bound})
