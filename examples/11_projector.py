"""Write to the projector from Python, and have functions called with each frame of the loop."""

import numpy as np

import rig

# The twin with a small camera, so that it keeps pace on any machine; a window of 320 × 200 px.
small = {
    "plate.size": [254, 203],
    "camera.pixels": [384, 320],
    "pattern.diameter": 3.5,
    "dic.tile": 8,
    "estimator.modes": 60,
    "touches.force": [1, 2],
    "projector.size": [320, 200],
    "projector.full_screen": False,
}
run = rig.run(rig.load("twin", overrides=small))
run.open_projector()
loads = []


@run.on_frame
def weigh(frame):
    """Add up the forces of a frame."""
    loads.append(sum(touch.force for touch in frame.touches))


@run.on_frame
def divide(frame):
    """Fail where nothing touches: that is logged once, and frames go on."""
    return frame.sequence / len(frame.touches)


# An image, (H, W) grey or (H, W, 3) RGB, is lit until something else is shown.
grey = np.linspace(0, 64, 320, dtype=np.uint8)
ramp = np.tile(grey, (200, 1))

with run:
    for frame in run:
        if frame.touches:
            beside = [rig.Mark(touch.x + 30, touch.y, touch.force) for touch in frame.touches]
            run.show(beside)  # marks, in mm on the plate
        else:
            run.show(ramp)
        if sum(load > 0 for load in loads) == 5:
            break

print(f"frames: {len(loads)}, of which {sum(load > 0 for load in loads)} with a touch")
print(f"largest load: {max(loads):.2f} N")
