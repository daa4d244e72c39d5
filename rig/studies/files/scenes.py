"""Scene files, changed."""

from pathlib import Path

import rig
from rig.studies.files.kind import Kind, Wrong
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutation import mutate_text

MORE = """
[[plate.patches]]
x = [10, 90]
y = [20, "5 cm"]
young = "2 GPa"

[gauges]
kind = "lattice"
spacing = 4
margin = 5
subset = 31

[training]
spacing = 4
margin = 11
samples = 1000
force = [0.5, "2000 mN"]

[dataset]
touches = 2
spacing = 4
margin = 11
samples = 500

[outputs.tuio]
port = 3333
"""


def make_scene(path: Path) -> None:
    """Write a scene with numbers of all sections."""
    scenes = Path(rig.__file__).parent / "scenes"
    text = (scenes / "twin.toml").read_text(encoding="utf-8")
    path.write_text(text + MORE, encoding="utf-8")


def read_scene(path: Path) -> Wrong:
    """Load a scene and build what is cheap to build."""
    scene = rig.load(path)
    yield from out_of_range(scene.model_dump())
    if scene.plate is None:
        return
    scene.plate.build()
    for section in (scene.camera, scene.gauges, scene.dataset):
        if section:
            section.build(scene.plate)


SCENE = Kind(".toml", make_scene, mutate_text, read_scene)
