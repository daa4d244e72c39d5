"""Nets that are plain arrays, changed: those of fields, images and touches."""

import tempfile
from pathlib import Path

import numpy as np

from models.nets.array_file import NetKind, load_arrays, save_arrays
from rig.studies.files.kind import NO_NUMBERS, Kind, Wrong
from rig.studies.files.mutation import Rng, mutate_bytes
from rig.system.arrays import F32

NET = NetKind("touchplate study net", 1, "train one by 'touchplate train'")
SHAPES = {"first.weight": (8, 5, 3, 3), "first.bias": (8,), "out.weight": (2, 8), "low": (5, 1, 1)}
OPTIONS = {"about": {"seed": 3, "steps": 400}}


def weights() -> dict[str, F32]:
    """Return the weights of a small net."""
    rng = np.random.default_rng(2)
    return {name: rng.normal(size=shape).astype(np.float32) for name, shape in SHAPES.items()}


def make_net(path: Path) -> None:
    """Write a small net."""
    save_arrays(path, NET, weights(), OPTIONS)


def mutate_net(content: bytes, rng: Rng) -> bytes:
    """Change bytes, or a number behind the checksum's back."""
    if rng.random() < 0.7:
        return mutate_bytes(content, rng)
    forged = weights()
    array = forged[rng.choice(sorted(SHAPES))]
    with np.errstate(over="ignore"):
        array.flat[rng.integers(array.size)] = rng.choice(NO_NUMBERS)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "net.npz"
        save_arrays(path, NET, forged, OPTIONS)
        return path.read_bytes()


def read_net(path: Path) -> Wrong:
    """Read a net and compare every number."""
    arrays, options = load_arrays(path, NET, SHAPES)
    for name, array in weights().items():
        if not np.array_equal(arrays[name], array):
            yield f"{name} is other than it was written"
    if options["about"] != OPTIONS["about"]:
        yield "what goes with the net is other"


ARRAY_NET = Kind(".npz", make_net, mutate_net, read_net)
