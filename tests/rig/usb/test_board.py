import pytest

from rig.usb import list_devices, open_board


@pytest.fixture
def opened(make_bus, light, tmp_path):
    """List the device and give it with its bus."""
    bus = make_bus(light)
    (device,) = list_devices(bus, tmp_path)
    return device, bus


def test_light_strobe_and_trigger_arrive_in_the_units_of_the_board(opened, light):
    with open_board(*opened) as board:
        assert board.outputs == 3
        board.light(0, 0.25)
        board.strobe(1, delay=0.0005, width=0.002)
        board.trigger(2, period=1 / 30, width=0.001, count=90)
        assert light.firmware.levels == {0: 250}
        assert light.firmware.strobes == {1: (500, 2000)}
        assert light.firmware.triggers == {2: (33333, 1000, 90)}


def test_the_board_says_what_it_has_done(opened, light):
    light.firmware.given = 42
    with open_board(*opened) as board:
        state = board.state()
    assert (state.given, state.missed, state.time) == (42, 2, 1.5)


def test_everything_is_off_when_the_block_ends_even_by_an_error(opened, light):
    def light_and_fail():
        with open_board(*opened) as board:
            board.light(0, 1.0)
            assert light.firmware.levels == {0: 1000}
            board.light(0, 7.0)

    with pytest.raises(ValueError, match="level"):
        light_and_fail()
    assert light.firmware.levels == {}


def test_what_does_not_fit_the_board_is_refused_before_it_is_sent(opened, light):
    with open_board(*opened) as board:
        with pytest.raises(ValueError, match=r"level must lie in 0\.\.1, got 2"):
            board.light(0, 2)
        with pytest.raises(ValueError, match=r"output must lie in 0\.\.2, got 3"):
            board.light(3, 1)
        with pytest.raises(ValueError, match=r"width must lie in 0\.\.4294 s, got 5000 s"):
            board.strobe(0, 0, 5000)
        with pytest.raises(ValueError, match="trigger width must lie between 0 and its period"):
            board.trigger(0, 0.01, 0.02)
    assert light.firmware.levels == light.firmware.strobes == light.firmware.triggers == {}


def test_another_device_or_another_version_is_no_board(make_bus, toy, light, tmp_path):
    bus = make_bus(light, toy(ports=(9,)))
    board, other = list_devices(bus, tmp_path)
    light.firmware.version = 2
    with pytest.raises(OSError, match="is no board of protocol version 1"), open_board(board, bus):
        pass
    with pytest.raises(OSError, match="refused the request"), open_board(other, bus):
        pass


def test_unplugged_hung_and_forbidden_are_one_sentence_each(opened, light):
    device, bus = opened
    with open_board(device, bus) as board:
        light.hangs = True
        with pytest.raises(OSError, match="Light 1209:0001 at 1-4 does not answer; reset it"):
            board.state()
        bus.toys = []
        with pytest.raises(OSError, match="was unplugged; plug it in again"):
            board.light(0, 1)
    bus.toys, light.hangs, light.denied = [light], False, True
    with pytest.raises(OSError, match="no permission to use Light"), open_board(device, bus):
        pass
