"""The grab thread, on devices that the test plays."""

import threading
import time
from queue import Empty, Queue

import numpy as np
import pytest

from rig.camera import InOrder, LiveCamera
from rig.system.frame import Frame
from tests.waiting import wait_for

SECONDS = 10.0


class Played:
    """A device that reads what the test puts into its queue: frames, and errors to raise."""

    name = "played"
    settings = ()

    def __init__(self):
        self.queue = Queue()
        self.closed = False

    def put(self, number, shape=(4, 6)):
        self.queue.put(Frame(number, time.monotonic(), np.full(shape, number % 256, np.uint8)))

    def read(self, timeout):
        try:
            item = self.queue.get(timeout=timeout)
        except Empty:
            return None
        if isinstance(item, Exception):
            raise item
        return item

    def close(self):
        self.closed = True


def let_time_pass(seconds, condition):
    """Let the clock of a camera run quickly until something has happened."""

    def later():
        seconds[0] += 0.3
        return condition()

    wait_for(later)


def test_each_grab_gives_a_frame_that_was_not_given_before():
    device = Played()
    with LiveCamera(lambda: device) as camera:
        device.put(0)
        assert camera.grab(SECONDS).sequence == 0
        assert camera.grab(0.05) is None
        device.put(1)
        assert camera.grab(SECONDS).sequence == 1
    assert device.closed


@pytest.mark.parametrize(("waited", "taken", "dropped"), [(0.0, [1, 2, 5], 2), (1.0, [5], 4)])
def test_what_the_device_lost_and_what_waited_too_long_both_count_as_dropped(
    waited, taken, dropped
):
    device, times = Played(), [0.0]
    with LiveCamera(lambda: device, clock=lambda: times[0]) as camera:
        device.put(10)
        camera.grab(SECONDS)
        came = time.monotonic()
        for number in (11, 12, 15):  # 13 and 14 were lost before they came here
            device.put(number)
        wait_for(lambda: len(camera._waiting) == 3)
        times[0] = came + waited
        assert [camera.grab(SECONDS).sequence for _ in taken] == taken
        assert camera.dropped == dropped
        assert not camera._waiting


def test_an_image_of_another_size_is_left_out_and_said():
    device = Played()
    with LiveCamera(lambda: device) as camera:
        device.put(0)
        device.put(1, shape=(6, 4))
        wait_for(lambda: camera.refused == 1)
        assert camera.status == ("an image of 4 × 6 px came instead of 6 × 4 px; it is left out")
        device.put(2)
        wait_for(lambda: camera.status == "played is open")


def test_numbers_go_on_when_the_device_comes_back():
    devices = [Played(), Played()]
    first, second = devices
    with LiveCamera(lambda: devices.pop(0)) as camera:
        first.put(7)
        first.put(8)
        wait_for(lambda: first.queue.empty())
        first.queue.put(OSError("the cable is out"))
        wait_for(lambda: camera.outages == 1)
        second.put(0)
        wait_for(lambda: camera.status == "played is open again")
        grabbed = [camera.grab(SECONDS).sequence]
        while grabbed[-1] < 2:
            grabbed.append(camera.grab(SECONDS).sequence)
        assert grabbed == sorted(set(grabbed))
        assert grabbed[-1] == 2
        assert first.closed


def test_the_reason_why_it_does_not_open_again_is_the_status():
    device = Played()
    opened = iter([device])

    def opening():
        for it in opened:
            return it
        raise OSError("there is no camera any more")

    with LiveCamera(opening) as camera:
        device.queue.put(OSError("the cable is out"))
        wait_for(lambda: camera.status == "there is no camera any more")
        assert camera.outages == 1


def test_a_camera_that_does_not_open_at_first_is_an_error():
    def opening():
        raise OSError("no camera at /dev/video0")

    with pytest.raises(OSError, match="no camera at /dev/video0"):
        LiveCamera(opening)


def test_a_silent_device_is_opened_anew_by_the_clock():
    seconds = [0.0]
    devices = [Played(), Played()]
    first, second = devices
    with LiveCamera(lambda: devices.pop(0), lambda: seconds[0]) as camera:
        first.put(0)
        assert camera.grab(SECONDS) is not None
        seconds[0] = 1.5
        wait_for(lambda: camera.outages == 1)
        assert first.closed
        second.put(0)
        assert camera.grab(SECONDS).sequence == 1


def test_a_device_that_stays_silent_is_rescued_before_it_is_opened_again():
    seconds, rescued = [0.0], []
    devices = [Played(), Played(), Played()]
    last = devices[-1]

    def rescue():
        rescued.append(len(devices))

    with LiveCamera(lambda: devices.pop(0), lambda: seconds[0], rescue) as camera:
        let_time_pass(seconds, lambda: len(devices) == 1)
        assert rescued == []  # opening it anew is tried first
        let_time_pass(seconds, lambda: not devices)
        assert rescued == [1]
        last.put(0)
        assert camera.grab(SECONDS) is not None


def test_a_rescue_that_fails_is_said_and_tried_again():
    seconds, tries = [0.0], []
    devices = [Played(), Played()]

    def rescue():
        tries.append(1)
        raise OSError("no permission to reset it")

    with LiveCamera(lambda: devices.pop(0), lambda: seconds[0], rescue) as camera:
        let_time_pass(seconds, lambda: camera.status == "no permission to reset it")
        wait_for(lambda: len(tries) > 1)
        assert not devices


def test_the_end_of_a_source_comes_after_its_last_frame():
    device = Played()
    device.put(0)
    device.queue.put(EOFError("the film is over"))
    with LiveCamera(lambda: device) as camera:
        wait_for(lambda: camera.status == "the film is over")
        assert camera.grab(SECONDS).sequence == 0
        with pytest.raises(EOFError, match="the film is over"):
            camera.grab(SECONDS)


def test_who_waits_is_woken_by_each_frame_and_by_the_end():
    device, given = Played(), Queue()

    def take(camera):
        try:
            while True:
                given.put(camera.grab(3600.0).sequence)
        except EOFError as error:
            given.put(str(error))

    with LiveCamera(lambda: device) as camera:
        threading.Thread(target=take, args=(camera,), daemon=True).start()
        for number in range(20):  # each when the last one was given, so that somebody waits for it
            device.put(number)
            assert given.get(timeout=SECONDS) == number
        device.queue.put(EOFError("the film is over"))
        assert given.get(timeout=SECONDS) == "the film is over"


def test_numbers_go_on_over_an_outage_and_what_was_lost_is_counted():
    devices = [Played(), Played()]
    first, second = devices
    with LiveCamera(lambda: devices.pop(0)) as camera:
        for number in (5, 6, 9):  # the device numbers what it lost as well
            first.put(number)
            assert camera.grab(SECONDS).sequence == number - 5
        assert camera.dropped == 2
        first.queue.put(OSError("unplugged"))
        second.put(0)
        assert camera.grab(SECONDS).sequence == 5
        assert camera.dropped == 2
        assert camera.outages == 1


def test_closing_ends_the_thread():
    camera = LiveCamera(Played)
    assert any(thread.name == "camera" for thread in threading.enumerate())
    camera.close()
    assert not any(thread.name == "camera" for thread in threading.enumerate())


def test_in_order_leaves_nothing_out():
    device = Played()
    for number in range(3):
        device.put(number)
    device.queue.put(EOFError("over"))
    source = InOrder(device)
    assert [source.grab(1.0).sequence for _ in range(3)] == [0, 1, 2]
    with pytest.raises(EOFError, match="over"):
        source.grab(1.0)
