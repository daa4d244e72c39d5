"""Draw what the projector shows in each demo, out of touches that are drawn here.

    python docs/images/demos.py

The images are brightened as on the page: on the plate they are a quarter as bright as the
projector can be.
"""

from collections.abc import Iterator
from math import cos, sin
from pathlib import Path
from typing import get_args

import cv2
import numpy as np

from rig.live.snapshot import Mark
from rig.page.packet import BRIGHTENED
from rig.projector.content import draw
from rig.projector.demos.demo import DemoName, begin_demo
from rig.projector.demos.keyboard import lay_keys
from rig.projector.demos.moment import Load, Moment
from rig.projector.markers import fit_plate

IMAGES = Path(__file__).parent
PLATE, FULL, RATE = (254.0, 180.0), 8.0, 30.0  # mm, N, frames a second
SIZE = (600, 430)  # px


def ripples(number: int) -> tuple[Mark, ...]:
    """Land three fingers, one after the other."""
    landings = ((78, 110, 3.0, 30), (188, 72, 1.5, 58), (140, 140, 3.5, 84))
    return tuple(
        Mark(x, y, force, identity=name)
        for name, (x, y, force, begun) in enumerate(landings)
        if begun < number < begun + 40
    )


def wander(number: int) -> tuple[Mark, ...]:
    """Let three fingers wander."""
    t = number / RATE
    return (
        Mark(127 + 85 * cos(1.7 * t), 92 + 60 * sin(2.3 * t), 2.2 + 1.8 * sin(3 * t), identity=1),
        Mark(80 + 50 * sin(1.9 * t), 70 + 45 * cos(2.6 * t), 1.3 + 0.9 * cos(2 * t), identity=2),
        Mark(190 + 30 * cos(2.9 * t), 60 + 30 * sin(2.1 * t), 1.0 + 0.6 * sin(4 * t), identity=3),
    )


def weight(number: int) -> tuple[Mark, ...]:
    """Let a weight rest."""
    return (Mark(118.0, 78.0, 2.03, identity=1),)


def chord(number: int) -> tuple[Mark, ...]:
    """Strike three keys, each faster than the one before."""
    if number < 6:
        return ()
    keys = {key.pitch: key for key in lay_keys(PLATE).keys}
    rises = {60: 6.0, 64: 16.0, 67: 45.0, 70: 80.0}
    return tuple(
        Mark(
            (keys[pitch].low[0] + keys[pitch].high[0]) / 2,
            keys[pitch].low[1] + 10.0,
            min(rise * (number - 5.5) / RATE, 4.0),
            identity=pitch,
        )
        for pitch, rise in rises.items()
    )


TOUCHES = {
    "ripples": (ripples, 98),
    "trails": (wander, 64),
    "scale": (weight, 30),
    "painting": (wander, 105),
    "keys": (chord, 9),
}


def moments(name: str) -> Iterator[Moment]:
    """Give the frames of a demo."""
    touches, count = TOUCHES[name]
    for number in range(count):
        marks = touches(number)
        yield Moment(number / RATE, marks, Load(sum(mark.force for mark in marks), 0.04))


def main() -> None:
    """Draw them all."""
    for name in get_args(DemoName):
        demo = begin_demo(name, PLATE, FULL)
        for moment in moments(name):
            demo = demo.after(moment)
        image = draw(demo, fit_plate(SIZE, PLATE, 0.02))[..., ::-1]
        bright = np.minimum(image.astype(int) * BRIGHTENED, 255).astype(np.uint8)
        png = [cv2.IMWRITE_PNG_COMPRESSION, 9]
        cv2.imwrite(str(IMAGES / f"demo-{name}.png"), bright, png)


if __name__ == "__main__":
    main()
