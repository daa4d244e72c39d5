"""The camera on the USB through the real libusb: name, node, comings and goings."""

import json

import pytest

from tests.rig.emulation.clients import nudge

pytestmark = pytest.mark.devices

WATCHING = """
import json, sys, time
from dataclasses import asdict
from rig.usb import Watch, list_devices
watch = Watch()
print(json.dumps([asdict(device) for device in list_devices()]), flush=True)
for line in sys.stdin:
    changes, end = (), time.monotonic() + 10
    while not changes and time.monotonic() < end:
        changes = watch.changes()
    print(json.dumps([change.sentence for change in changes]), flush=True)
"""


def test_its_socket_leads_to_its_device_node_and_a_replug_is_seen(emulation):
    with emulation.client(WATCHING) as client:
        (camera,) = json.loads(client.stdout.readline())
        assert (camera["vendor"], camera["product"]) == (0x1209, 2)
        assert (camera["name"], camera["serial"]) == ("Speckle Cam", "E7")
        assert (camera["bus"], camera["ports"]) == (1, [4])
        assert camera["camera"]
        assert camera["nodes"] == ["/dev/video0"]
        for word, said in (("unplug", "was unplugged"), ("plug", "was plugged in")):
            emulation.say(word)
            (sentence,) = nudge(client)
            assert sentence.endswith(f"1209:0002 at 1-4 {said}")
        client.stdin.close()
