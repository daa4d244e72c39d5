"""Write two photographs to try things with: a sheet with a round hole, before and after a pull.

Give a folder to write to; it is results/photographs if none is given. With the two comes roi.png,
black where no pattern is.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import synthetic
from synthetic.closed_forms import Hole

SIZE, PIXELS = (120.0, 90.0), (800, 600)  # mm, px
PULL = 4e-3  # strain along x, far from the hole
FINER = 4  # the rim is drawn so many times finer than the pixels
hole = Hole(radius=9.0, centre=(60.0, 45.0), strain=PULL)
pattern = synthetic.speckle(SIZE, diameter=0.75, softness=0.6)
camera = synthetic.pinhole_above(SIZE, stand_off=500.0, pixels=PIXELS)
sensor = synthetic.Sensor(noise=2.0)
rng = np.random.default_rng(9)
turn = np.linspace(0, 2 * np.pi, 361)
circle = np.column_stack([np.cos(turn), np.sin(turn)])


def still(points):
    """Displacement (K, 3) mm of a sheet at rest."""
    return np.zeros((len(points), 3))


def within(points, motion=still):
    """Draw what lies within points (K, 2) mm of the moved sheet white, the rest black."""
    moved = np.column_stack([points, np.zeros(len(points))]) + motion(points)
    drawn = Image.new("L", [FINER * side for side in PIXELS])
    outline = FINER * (camera.project(moved) + 0.5)
    ImageDraw.Draw(drawn).polygon([tuple(xy) for xy in outline], fill=255)
    return drawn.resize(PIXELS, Image.Resampling.BOX)


folder = Path(sys.argv[1] if len(sys.argv) > 1 else "results/photographs")
folder.mkdir(parents=True, exist_ok=True)
room = Image.new("L", PIXELS, 20)  # what is seen through the hole
for name, motion in (("before", still), ("after", hole)):
    image = Image.fromarray(synthetic.render(pattern, camera, motion, sensor, rng))
    image.paste(room, mask=within(hole.centre + hole.radius * circle, motion))
    image.save(folder / f"{name}.png")

corners = np.array([(1.0, 1.0), (SIZE[0] - 1, 1.0), (SIZE[0] - 1, SIZE[1] - 1), (1.0, SIZE[1] - 1)])
roi = within(corners)
roi.paste(0, mask=within(hole.centre + (hole.radius + 0.5) * circle))
roi.point(lambda grey: 255 * (grey == 255)).save(folder / "roi.png")

top = hole.gradient(hole.centre + hole.radius * circle[90:91])[0, 0, 0]
print(f"{folder}: pull {1e6 * PULL:.0f} µε; on the rim of the hole {1e6 * top:.0f} µε")
