"""The noise test of a still camera, with what its figures mean for a bench."""

from __future__ import annotations

from collections.abc import Iterator

from rig.camera import Controls, LiveCamera
from rig.camera.noise import CameraNoise, measure_noise
from rig.camera.opencv import open_camera
from rig.doctor.finding import Finding, good, wrong

SETTLE = 10  # frames that are left out while the camera takes its fixed values
MAX_NOISE = 4.0  # grey levels; position error grows with it, 1.7 mm at 2 on the 2 mm plate
MAX_FLICKER = 0.005
MIN_CONTRAST = 20.0  # grey levels
MAX_CLIPPED = 0.01
MAX_AGE = 0.1  # s


def examine(
    device: str, size: tuple[int, int], rate: float, frames: int
) -> tuple[CameraNoise, list[Finding]]:
    """Hold the controls of a camera and measure the noise of `frames` images.

    Raises
    ------
    OSError
        If the camera does not open or gives no images.
    """
    with LiveCamera(lambda: open_camera(device, size, rate, Controls())) as camera:
        for _ in range(SETTLE):
            camera.grab(1.0)
        findings = [
            good("control", setting.sentence)
            if setting.held
            else wrong("control", setting.sentence, "hold it with v4l2-ctl or the maker's program")
            for setting in camera.settings
        ]
        dropped = camera.dropped
        noise = measure_noise(camera, frames)
    findings += [*_judge(noise), _judge_drops(noise.dropped - dropped, frames)]
    return noise, findings


def _judge(noise: CameraNoise) -> Iterator[Finding]:
    figures = (
        (f"noise {noise.sigma:.2f} grey levels", noise.sigma <= MAX_NOISE,
         "give it more light and less gain, and see that nothing moves"),
        (f"brightness changes by {noise.flicker:.2%}", noise.flicker <= MAX_FLICKER,
         "use a light on direct current, or an exposure of whole periods of the mains"),
        (f"contrast {noise.contrast:.0f} grey levels", noise.contrast >= MIN_CONTRAST,
         "focus on the pattern and light it evenly"),
        (f"{noise.clipped:.1%} of the pixels too bright or too dark", noise.clipped <= MAX_CLIPPED,
         "change the exposure"),
        (f"{noise.rate:.1f} frames a second, {1e3 * noise.age:.0f} ms old", noise.age <= MAX_AGE,
         "take another format or USB socket"),
    )  # fmt: skip
    for text, fine, remedy in figures:
        yield good("image", text) if fine else wrong("image", text, remedy)


def _judge_drops(dropped: int, frames: int) -> Finding:
    if dropped:
        text = f"{dropped} frames were lost while {frames} were taken"
        return wrong("image", text, "take the camera off the hub, or lower its rate")
    return good("image", f"none of {frames} frames was lost")
