"""A result whose fields are closed forms: a stretch along x that grows from frame to frame."""

import numpy as np
import pytest

import dic
from rig.series.parts import FIELDS, missing_part, open_parts, write_part
from rig.series.result import write_result

SHAPE = (90, 130)
RATE = 0.002  # strain a frame
SIGMA = 0.01  # px


def table_of(ref, number):
    """Fields of a frame: u = RATE·n·x, v = 0."""
    points = len(ref.xy)
    zeros = {name: np.zeros(points) for name in FIELDS}
    spread = {name: np.full(points, 1e-5) for name in FIELDS if name.startswith("sigma_e")}
    loose = {"sigma_u": np.full(points, SIGMA), "sigma_v": np.full(points, 2 * SIGMA)}
    moved = {"u": RATE * number * ref.xy[:, 0], "exx": np.full(points, RATE * number)}
    return zeros | spread | loose | moved | {"status": np.zeros(points, np.int8)}


@pytest.fixture(scope="session")
def ref():
    rng = np.random.default_rng(3)
    image = rng.integers(0, 255, SHAPE, dtype=np.uint8)
    return dic.prepare(image, subset=21, step=8, prefilter=0.0)


@pytest.fixture
def result(tmp_path, ref):
    """Four frames, of which the third could not be read."""
    parts = open_parts(tmp_path / "parts", {})
    for number in range(4):
        if number == 2:
            write_part(parts, number, missing_part(FIELDS, len(ref.xy)), 'no "image", cut short')
        else:
            write_part(parts, number, table_of(ref, number), "")
    path = tmp_path / "fields.h5"
    settings = {"subset": 21, "step": 8, "strain_window": 5, "field": "subset"}
    write_result(path, parts, ["a.tif", "b.tif", "c.tif", "d.tif"], ref, FIELDS, settings)
    return path
