"""Calibration: what a bench does not know of itself, each with its error in mm and its date.

`board` and `lens` see through the camera, `pose` finds the plate, `gray` and `projector` the light,
`photon` the noise, `latency` the delay; `presses` and `alignment` correct what is left from touches
whose place and force are known. `store` keeps results beside the scene.
"""
