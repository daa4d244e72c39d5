"""Run the live loop from Python: touches of the twin as they come, and figures of the run."""

import rig

# The twin with a small camera, so that it keeps pace on any machine.
small = {
    "plate.size": [254, 203],
    "camera.pixels": [384, 320],
    "pattern.diameter": 3.5,
    "dic.tile": 8,
    "estimator.modes": 60,
    "touches.force": [1, 2],
}
scene = rig.load("twin", overrides=small)

# The loop takes three lines; source and recording are closed however it ends.
with rig.run(scene) as run:
    for frame in run:
        for touch in frame.touches:
            print(
                f"{frame.time:.2f} s, frame {frame.sequence}: touch {touch.identity} at"
                f" x {touch.x:.1f} ± {touch.sigma_x:.1f} mm,"
                f" y {touch.y:.1f} ± {touch.sigma_y:.1f} mm,"
                f" force {touch.force:.2f} ± {touch.sigma_force:.2f} N"
            )
        scored = run.summary()["pattern"]["scored"]
        if scored == 10:
            break

height, width = frame.image.shape
print(f"{frame.status} in the last of {run.summary()['frames']} frames, {width} × {height} px")
figures = run.summary()["pattern"]
print(f"median error: {figures['position_median_mm']:.2f} mm, {figures['force_median_n']:.3f} N")
print(f"missed: {figures['misses']}, false: {figures['false_touches']}")
