"""TUIO as receivers that others wrote understand it: python-osc, and python-tuio on top of it."""

import select
import socket
import subprocess

import pytest
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_message import OscMessage
from pythonosc.osc_server import BlockingOSCUDPServer
from pythontuio import TuioClient, TuioListener

from rig.live.snapshot import Mark
from rig.out import Cursor, Tuio, across_plate
from rig.out.osc import message
from rig.out.tuio import MAX_CURSORS, frame_bundle

PLATE = (200.0, 100.0)


def read(packet):
    """Arguments of each message in a bundle."""
    assert all(one.address == "/tuio/2Dcur" for one in OscBundle(packet))
    return [one.params for one in OscBundle(packet)]


@pytest.fixture
def receiver():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(10)
        yield listener


@pytest.fixture
def sender(receiver):
    with Tuio(across_plate(PLATE), port=receiver.getsockname()[1]) as tuio:
        yield tuio


def test_a_frame_says_who_sends_who_is_there_where_each_is_and_its_number():
    packet = frame_bundle([Cursor(3, 0.25, 0.5, 0.125, -2, 0.75), Cursor(9, 1, 0)], 17, "plate@pc")
    assert read(packet) == [
        ["source", "plate@pc"],
        ["alive", 3, 9],
        ["set", 3, 0.25, 0.5, 0.125, -2.0, 0.75],
        ["set", 9, 1.0, 0.0, 0.0, 0.0, 0.0],
        ["fseq", 17],
    ]


@pytest.mark.parametrize("text", ["", "a", "abc", "abcd", "abcdefg"])
def test_texts_of_every_length_are_read_back(text):
    assert OscMessage(message("/a", text, 5, text, 0.5)).params == [text, 5, text, 0.5]


def test_frames_are_numbered_and_a_lifted_finger_is_no_longer_alive(receiver, sender):
    said = []
    for number, marks in enumerate([[Mark(50, 50, 1.0)], [Mark(54, 50, 1.0)], []]):
        sender(marks, 10 + number / 10)
        said.append(read(receiver.recv(2000)))
    assert [one[1] for one in said] == [["alive", 1], ["alive", 1], ["alive"]]
    assert [one[-1] for one in said] == [["fseq", 1], ["fseq", 2], ["fseq", 3]]
    assert said[1][2][:2] == ["set", 1]
    assert said[1][2][2:] == pytest.approx([0.27, 0.5, 0.2, 0.0, 2.0], rel=1e-6)
    assert sender.lost == 0


def test_all_fingers_are_lifted_at_the_end(receiver):
    with Tuio(across_plate(PLATE), port=receiver.getsockname()[1]) as tuio:
        tuio([Mark(50, 50, 1.0)], 0.0)
    receiver.recv(2000)
    assert read(receiver.recv(2000))[1] == ["alive"]


def test_of_too_many_touches_the_hardest_are_sent_in_one_packet(receiver, sender):
    sender([Mark(i, i, float(i)) for i in range(40)], 0.0)
    packet = receiver.recv(65536)
    assert len(packet) < 1500
    assert len(read(packet)[1]) == 1 + MAX_CURSORS
    assert min(one[2] for one in read(packet)[2:-1]) == pytest.approx((40 - MAX_CURSORS) / 200)


def test_nobody_who_listens_is_no_error():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
    with Tuio(across_plate(PLATE), port=port) as tuio:
        for number in range(20):
            tuio([Mark(50, 50, 1.0)], number / 30)
    assert tuio.lost == 0


class Fingers(TuioListener):
    """Writes down what a client of python-tuio hears."""

    def __init__(self):
        self.heard = []

    def add_tuio_cursor(self, cur):
        self.heard.append(("add", cur.session_id, cur.position))

    def update_tuio_cursor(self, cur):
        self.heard.append(("update", cur.session_id, cur.position))

    def remove_tuio_cursor(self, cur):
        self.heard.append(("remove", cur.session_id))


@pytest.fixture
def client():
    """Open a client of python-tuio that takes one packet a call of `handle_request`."""
    client = TuioClient(("127.0.0.1", 0))
    BlockingOSCUDPServer.__init__(client, client.server_address, client)
    client.timeout = 10
    with client:
        yield client


@pytest.mark.usefixtures("capsys")  # the client prints each bundle
def test_a_tuio_client_sees_fingers_come_move_and_go(client):
    fingers = Fingers()
    client.add_listener(fingers)
    frames = [
        [Mark(50, 25, 1.0, identity=1)],
        [Mark(60, 25, 1.0, identity=1), Mark(150, 75, 2.0, identity=2)],
        [Mark(152, 75, 2.0, identity=2)],
        [],
    ]
    with Tuio(across_plate(PLATE), port=client.server_address[1]) as tuio:
        for number, marks in enumerate(frames):
            tuio(marks, number / 10)
            client.handle_request()
    assert fingers.heard == [
        ("add", 1, pytest.approx((0.25, 0.75))),
        ("add", 2, pytest.approx((0.75, 0.25))),
        ("update", 1, pytest.approx((0.30, 0.75))),
        ("update", 2, pytest.approx((0.76, 0.25))),
        ("remove", 1),
        ("remove", 2),
    ]


@pytest.mark.devices
def test_liblo_reads_every_frame(receiver):
    port = receiver.getsockname()[1]
    receiver.close()  # its port is free for another program now
    with subprocess.Popen(["oscdump", "-L", str(port)], stdout=subprocess.PIPE, text=True) as other:
        with Tuio(across_plate(PLATE), port=port) as tuio:
            while not select.select([other.stdout], [], [], 0.05)[0]:
                tuio([], 0.0)  # nobody was listening yet
            tuio([Mark(50, 25, 1.0, identity=1)], 1.0)
            tuio([Mark(60, 25, 1.0, identity=1)], 1.1)
        lines = (line.split(" ", 1)[1].strip() for line in other.stdout)
        sets = [next(line for line in lines if '"set"' in line) for _ in range(2)]
        assert next(line for line in lines if '"alive"' in line) == '/tuio/2Dcur s "alive"'
        other.terminate()
    assert sets == [
        '/tuio/2Dcur sifffff "set" 1 0.250000 0.750000 0.000000 0.000000 0.000000',
        '/tuio/2Dcur sifffff "set" 1 0.300000 0.750000 0.500000 0.000000 5.000000',
    ]


def test_a_host_or_port_that_is_none_is_one_sentence():
    with pytest.raises(OSError, match=r"TUIO host 'no\.such\.host\.invalid' is not known"):
        Tuio(across_plate(PLATE), host="no.such.host.invalid")
    with pytest.raises(ValueError, match=r"TUIO port must lie in 1\.\.65535, got 0"):
        Tuio(across_plate(PLATE), port=0)
