"""Weights of a net, changed."""

import tempfile
from pathlib import Path

import numpy as np

import models
from rig.studies.files.kind import NO_NUMBERS, Kind, Wrong
from rig.studies.files.mutation import Rng, mutate_bytes


def net() -> models.Trained:
    """Return a small net."""
    rng = np.random.default_rng(0)
    layers = tuple(
        (rng.normal(size=(n, m)), rng.normal(size=m)) for n, m in ((6, 5), (5, 4), (4, 2))
    )
    scaling = models.Scaling(rng.normal(size=6), rng.uniform(1.0, 2.0, 6))
    small = models.Net(models.NetOptions((5, 4), "silu"), scaling, layers)
    return models.Trained(small, rng.uniform(size=(10, 2)))


def mutate_model(content: bytes, rng: Rng) -> bytes:
    """Change bytes, or a number behind the checksum's back."""
    if rng.random() < 0.7:
        return mutate_bytes(content, rng)
    whole = net()
    arrays = [whole.net.scaling.centre, whole.net.scaling.scale]
    arrays += [array for layer in whole.net.layers for array in layer]
    array = arrays[rng.integers(len(arrays))]
    array.flat[rng.integers(array.size)] = rng.choice(NO_NUMBERS)
    with tempfile.TemporaryDirectory() as folder:
        models.save_net(Path(folder) / "net.h5", whole, {})
        return (Path(folder) / "net.h5").read_bytes()


def make_model(path: Path) -> None:
    """Write a small net."""
    models.save_net(path, net(), {"scene": {"title": "a test"}})


def read_model(path: Path) -> Wrong:
    """Read a net and compare every number."""
    found, about = models.load_net(path)
    strain = np.linspace(-1, 1, 6)[None]
    if not np.array_equal(models.predict(found.net, strain), models.predict(net().net, strain)):
        yield "the net gives other places"
    if about != {"scene": {"title": "a test"}} or not np.array_equal(found.history, net().history):
        yield "what goes with the net is other"


MODEL = Kind(".h5", make_model, mutate_model, read_model)
