"""A board through the real libusb, on control transfers that umockdev answers."""

import json
from textwrap import dedent

import pytest

from tests.rig.emulation.clients import emulate, nudge

pytestmark = pytest.mark.devices

OPENING = """
import json, sys
from dataclasses import asdict
from rig.usb import list_devices, open_board
from rig.usb.watch import reset, wait_for

def say(*what):
    print(json.dumps(what), flush=True)
    sys.stdin.readline()

(device,) = list_devices()
"""


@pytest.fixture
def board():
    with emulate("board") as emulation:
        yield emulation


def test_light_strobe_and_trigger_reach_the_board_and_all_is_off_at_the_end(board):
    body = """
    with open_board(device) as board:
        board.light(0, 0.25)
        board.strobe(1, delay=0.0005, width=0.002)
        board.trigger(2, period=1 / 30, width=0.001, count=90)
        say(board.outputs, asdict(board.state()))
    say("closed")
    """
    with board.client(OPENING + dedent(body)) as client:
        said = json.loads(client.stdout.readline())
        assert said == [3, {"given": 0, "missed": 2, "time": 1.5}]
        assert json.loads(board.ask("state")) == [
            {"0": 250}, {"1": [500, 2000]}, {"2": [33333, 1000, 90]},
        ]  # fmt: skip
        assert nudge(client) == ["closed"]
        assert json.loads(board.ask("state")) == [{}, {}, {}]
        client.stdin.close()


def test_a_hung_board_times_out_is_reset_and_goes_on(board):
    body = """
    with open_board(device) as light:
        say("open")
        try:
            light.state()
        except OSError as error:
            say(str(error))
    again = reset(device)
    with open_board(again) as light:
        say(again.name, light.outputs)
    """
    with board.client(OPENING + dedent(body)) as client:
        assert json.loads(client.stdout.readline()) == ["open"]
        board.say("hang")
        (sentence,) = nudge(client)
        assert sentence == ("Light 1209:0001 at 1-5 does not answer; reset it or plug it in again")
        assert nudge(client) == ["Light", 3]
        client.stdin.close()


def test_a_board_that_is_pulled_out_is_one_sentence_and_is_found_when_it_is_back(board):
    body = """
    with open_board(device) as light:
        say("open")
        try:
            light.light(0, 1)
        except OSError as error:
            say(str(error))
    say(wait_for(device.vendor, device.product, 10.0).place)
    """
    with board.client(OPENING + dedent(body)) as client:
        assert json.loads(client.stdout.readline()) == ["open"]
        board.say("unplug")
        assert nudge(client) == ["Light 1209:0001 at 1-5 was unplugged; plug it in again"]
        board.say("plug")
        assert nudge(client) == ["1-5"]
        client.stdin.close()


def test_presses_of_the_foot_switch_are_counted_and_an_input_that_is_not_there_is_refused(board):
    body = """
    with open_board(device) as light:
        say(light.presses(0))
        say(light.presses(0), light.presses(1))
        try:
            light.presses(2)
        except OSError as error:
            say(str(error))
    """
    with board.client(OPENING + dedent(body)) as client:
        assert json.loads(client.stdout.readline()) == [0]
        board.say("press")
        assert nudge(client) == [1, 0]
        (sentence,) = nudge(client)
        assert "Light 1209:0001" in sentence
        client.stdin.close()
