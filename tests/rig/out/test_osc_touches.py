"""OSC of touches, gestures and notes, as python-osc reads it."""

import socket

import pytest
from pythonosc.osc_bundle import OscBundle

import rig
from rig.live.gestures import Gesture
from rig.live.snapshot import Alarm, Mark
from rig.live.tracks import Event
from rig.out.osc_touches import OscTouches
from rig.projector.demos.keyboard import lay_keys
from rig.projector.demos.notes import Playing
from rig.scene import SceneError
from tests.rig.page.conftest import draw_snapshot

PLATE = (240.0, 150.0)


@pytest.fixture
def receiver():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(10)
        yield listener


def read(receiver):
    """Address and arguments of each message of the next bundle."""
    return [(one.address, one.params) for one in OscBundle(receiver.recv(65536))]


def snapshot(captured, *marks, **changes):
    return draw_snapshot(1, captured=captured, touches=marks, **changes)


def test_each_touch_goes_out_with_its_force_and_both_sigmas(receiver):
    mark = Mark(100.0, 40.5, 2.25, (1.5, 0.5, 0.3), 0.125, identity=7)
    with OscTouches("127.0.0.1", receiver.getsockname()[1], "/plate") as send:
        send(snapshot(1.0, mark))
        send(snapshot(1.1))
    assert read(receiver) == [
        ("/plate/count", [1]),
        ("/plate/touch", [7, 100.0, 40.5, 2.25, 1.5, 0.125]),
    ]
    assert read(receiver) == [("/plate/count", [0])]
    assert send.lost == 0


def test_events_go_out_and_each_gesture_once(receiver):
    event = Event("appear", 3, 1.0, 10.0, 20.0, 0.5)
    tap = Gesture("tap", 0.9, 10.0, 20.0, 1.5, 0.0, (3,))
    with OscTouches("127.0.0.1", receiver.getsockname()[1], "/plate") as send:
        send(snapshot(1.0, events=(event,), gestures=(tap,)))
        send(snapshot(1.1, gestures=(tap,)))
    assert read(receiver)[1:] == [
        ("/plate/event", ["appear", 3, 10.0, 20.0, 0.5]),
        ("/plate/gesture", ["tap", 10.0, 20.0, 1.5, 0.0]),
    ]
    assert read(receiver) == [("/plate/count", [0])]


def test_notes_of_the_keys_go_out_and_end_with_the_run(receiver):
    keyboard = lay_keys(PLATE)
    key = next(key for key in keyboard.keys if key.pitch == 65)
    x, y = (key.low[0] + key.high[0]) / 2, key.low[1] + 5.0
    with OscTouches("127.0.0.1", receiver.getsockname()[1], "/p", Playing(keyboard)) as send:
        for number, force in enumerate((None, 0.5, 1.5, 2.0)):
            marks = () if force is None else (Mark(x, y, force, identity=1),)
            send(snapshot(1.0 + number / 30, *marks))
    notes = [one for _ in range(5) for one in read(receiver) if one[0] == "/p/note"]
    assert [pitch for _, (pitch, _) in notes] == [65, 65]
    assert notes[0][1][1] == round(127 * 0.6923)  # 30 N/s: ln(30 / 2) over ln(100 / 2)
    assert notes[1][1][1] == 0


def test_a_host_that_is_not_known_is_refused_and_so_is_an_address_that_is_none():
    with pytest.raises(OSError, match=r"OSC host 'no\.such\.host\.invalid' is not known"):
        OscTouches("no.such.host.invalid", 9000, "/p")
    with pytest.raises(SceneError, match=r"outputs\.osc\.prefix"):
        rig.load("twin", {"outputs.osc.prefix": "plate x"})


def test_an_alarm_goes_out_once_while_it_stands(receiver):
    alarm = Alarm("disk", 1.0, "99 MB are free")
    with OscTouches("127.0.0.1", receiver.getsockname()[1], "/plate") as send:
        for alarms in ((alarm,), (alarm,), (), (alarm,)):
            send(snapshot(1.0, alarms=alarms))
    sent = [[one for one in read(receiver) if one[0] == "/plate/alarm"] for _ in range(4)]
    assert sent == [[("/plate/alarm", ["disk", "99 MB are free"])], [], [], sent[0]]
