"""Changes of a bench that money or work can make."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from rig.design.focus import sharpest
from rig.design.setup import Setup, as_thick, at_distance, changed, focused

STEP = 1.25  # by which a change changes something, unless it says otherwise
AVERAGED = 4  # frames
Row = tuple[str, str, str, Setup]
"""A change: what, before, after, and the setup after it."""


def changes(given: Setup) -> Iterator[Row]:
    """List changes that money or work can make."""
    camera, plate, pattern = given.camera, given.plate, given.pattern

    def row(what: str, unit: str, before: float, after: float, **update: Any) -> Row:
        old, new = (f"{value:.4g} {unit}".rstrip() for value in (before, after))
        return what, old, new, replace(given, **update)

    width, height = camera.pixels
    wide, high = round(width * STEP), round(height * STEP)
    finer = replace(given, camera=changed(camera, pixels=(wide, high)))
    yield "camera pixels", f"{width} × {height}", f"{wide} × {high}", finer
    near = camera.stand_off / STEP
    yield row("stand-off", "mm", camera.stand_off, near, camera=at_distance(camera, near))
    if camera.lens is not None and (sharp := sharpest(given)) != camera.lens.focus:
        refocused = focused(given, sharp).camera
        yield row("focus distance", "mm", camera.lens.focus, sharp, camera=refocused)
    thin = plate.thickness / STEP
    yield row("thickness", "mm", plate.thickness, thin, plate=as_thick(plate, thin))
    for diameter in (pattern.diameter / STEP, pattern.diameter * STEP):
        other = changed(pattern, diameter=diameter)
        yield row("speckle diameter", "mm", pattern.diameter, diameter, pattern=other)
    contrast = min(1.0, pattern.contrast * STEP)
    if contrast > pattern.contrast:
        strong = changed(pattern, contrast=contrast)
        yield row("speckle contrast", "", pattern.contrast, contrast, pattern=strong)
    if given.sensor.noise:
        low = given.sensor.noise / STEP
        quiet = changed(given.sensor, noise=low)
        yield row("sensor noise", "grey levels", given.sensor.noise, low, sensor=quiet)
    yield row("mean of frames", "", given.frames, AVERAGED, frames=AVERAGED)
    count = given.dic.reference_frames
    more = changed(given.dic, reference_frames=AVERAGED * count)
    yield row("reference frames", "", count, AVERAGED * count, dic=more)
