"""What only linuxpy tells, an extra that is not in the lock: run where it is installed."""

import pytest

from tests.rig.camera.test_real_clients import script
from tests.rig.emulation.clients import nudge

pytestmark = pytest.mark.devices


def test_frames_that_the_driver_lost_or_damaged_are_counted_where_it_numbers_them(emulation):
    body = """
    with LiveCamera(device) as camera:
        frames = [camera.grab(5.0) for _ in range(5)]
        say(ready=True)
        sys.stdin.readline()
        frames += [camera.grab(5.0) for _ in range(15)]
        starts = [int(frame.image[0, 0]) for frame in frames]
        say(
            dropped=camera.dropped,
            given=len(frames),
            sent=(starts[-1] - starts[0]) * pow(7, -1, 256) % 256 + 1,
            whole=[
                bool((frame.image == (image(0) + start) % 256).all())
                for frame, start in zip(frames, starts)
            ],
        )
    """
    with emulation.client(script("v4l2", body)) as client:
        client.stdout.readline()
        emulation.say("skip")
        emulation.say("tear")
        said = nudge(client)
    assert said["dropped"] == said["sent"] - said["given"]  # what the pixels say was sent
    assert said["dropped"] >= 6  # five that the driver lost, one that was torn
    assert all(said["whole"])
