import pytest

from rig.usb import Watch, list_devices
from rig.usb.devices import find_device, owner_of
from rig.usb.watch import reset, wait_for


@pytest.fixture
def system(tmp_path):
    """Describe the camera at 1-2.3 as the kernel does, which has another name for it."""
    place = tmp_path / "1-2.3"
    place.mkdir()
    (place / "product").write_text("Speckle Cam\n")
    for node in ("video4linux/video2", "video4linux/video3", "tty/ttyACM0"):
        (tmp_path / "1-2.3:1.0" / node).mkdir(parents=True)
    return tmp_path


def test_devices_are_listed_with_numbers_names_place_and_nodes(make_bus, webcam, light, system):
    camera, board = list_devices(make_bus(light, webcam), system)
    assert camera.code == "1209:0001"
    assert (camera.name, camera.serial) == ("Speckle Cam", "E7")
    assert camera.place == "1-2.3"
    assert camera.camera
    assert camera.nodes == ("/dev/ttyACM0", "/dev/video2", "/dev/video3")
    assert board.label == "Light 1209:0001 at 1-4"
    assert not board.camera
    assert board.nodes == ()


def test_a_node_leads_to_its_device(make_bus, webcam, light, system):
    bus = make_bus(light, webcam)
    assert owner_of("/dev/video3", bus, system).code == "1209:0001"
    assert owner_of("/dev/video3", bus, system).serial == "E7"
    with pytest.raises(OSError, match="no USB device has the node /dev/video9"):
        owner_of("/dev/video9", bus, system)


def test_a_device_that_we_may_not_open_is_listed_without_its_names(make_bus, toy, tmp_path):
    closed = toy()
    closed.denied = True
    (device,) = list_devices(make_bus(closed), tmp_path)
    assert (device.name, device.serial) == (None, None)
    assert device.label == "device 1209:0001 at 1-4"


def test_plugging_in_and_out_is_seen_in_order(make_bus, toy, light, tmp_path):
    bus = make_bus(light)
    watch = Watch(lambda: list_devices(bus, tmp_path))
    assert watch.changes() == ()
    other = toy(name="Other", ports=(1,))
    bus.toys = [other]
    assert [change.sentence for change in watch.changes()] == [
        "Light 1209:0001 at 1-4 was unplugged",
        "Other 1209:0001 at 1-1 was plugged in",
    ]
    assert watch.changes() == ()


def test_a_replug_between_two_looks_shows_as_both(make_bus, light, tmp_path):
    bus = make_bus(light)
    watch = Watch(lambda: list_devices(bus, tmp_path))
    light.address += 1
    assert [change.kind for change in watch.changes()] == ["unplugged", "plugged"]


def test_a_hung_device_is_reset_and_found_again(make_bus, light, tmp_path):
    bus = make_bus(light)
    (device,) = list_devices(bus, tmp_path)
    light.hangs = True
    again = reset(device, backend=bus)
    assert light.resets == 1
    assert not light.hangs
    assert again.serial == "S1"
    assert again.address != device.address


def test_a_device_that_went_is_one_sentence(make_bus, light, tmp_path):
    bus = make_bus(light)
    (device,) = list_devices(bus, tmp_path)
    bus.toys = []
    for act in (find_device, lambda device, bus: reset(device, backend=bus)):
        with pytest.raises(OSError, match="Light 1209:0001 at 1-4 was unplugged; plug it in"):
            act(device, bus)
    with pytest.raises(OSError, match=r"no device 1209:0001 came within 0 s; plug it in"):
        wait_for(0x1209, 1, 0.0, lambda: list_devices(bus, tmp_path))


def test_one_of_several_is_waited_for_by_its_serial_number(make_bus, toy, tmp_path):
    bus = make_bus(toy(serial="A", ports=(1,)), toy(serial="B", ports=(2,)))
    found = wait_for(0x1209, 1, 0.0, lambda: list_devices(bus, tmp_path), serial="B")
    assert found.place == "1-2"
