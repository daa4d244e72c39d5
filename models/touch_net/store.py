"""Storage of touch nets: plain arrays, options as JSON and a checksum, in one npz."""

from __future__ import annotations

import json
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.arrays import F32, AnyArray
from models.nets.checkpoint import fingerprint
from models.touch_net.maps import PLACES
from models.touch_net.network import Weights, shapes
from models.touch_net.prior import TouchRange

FORMAT, VERSION = "touchplate touch net", 1
_LARGEST = 1e3  # of a weight; NaN is not below it either
_AGAIN = "run 'touchplate train touch-net'"


@dataclass(frozen=True, eq=False)
class TouchNet:
    """A trained touch net.

    Attributes
    ----------
    weights : dict of float32 arrays
        By the names of `models.touch_net.network.shapes`.
    touches : TouchRange
        Touches that it was trained on.
    low, high : (257,) float32
        Least and largest of `signature` over the benches of the training.
    about : dict
        Bench, seed, steps and CPU seconds of the training, as plain values.
    """

    weights: Weights
    touches: TouchRange
    low: F32
    high: F32
    about: dict[str, Any]


def save_touch_net(path: str | Path, net: TouchNet) -> None:
    """Write a net aside and rename it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    path = Path(path)
    arrays = net.weights | {"low": net.low, "high": net.high}
    said = {
        "format": FORMAT,
        "version": VERSION,
        "about": net.about,
        "touches": [net.touches.size, net.touches.margin, net.touches.force],
    }
    text = json.dumps(said, sort_keys=True)
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with aside.open("wb") as file:
            np.savez_compressed(
                file,
                allow_pickle=False,
                options=np.array(text),
                checksum=np.array(_sum(arrays, text)),
                **arrays,
            )
        aside.replace(path)
    except OSError as error:
        raise OSError(
            f"net file {path} cannot be written ({error.strerror or error}); free space there or "
            "choose another place"
        ) from error
    finally:
        aside.unlink(missing_ok=True)


def load_touch_net(path: str | Path) -> TouchNet:
    """Read what `save_touch_net` wrote.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged, of another version or something else.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"net file {path} does not exist; {_AGAIN}")
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: np.asarray(stored[name]) for name in stored.files}
        text, checksum = str(arrays.pop("options")), str(arrays.pop("checksum"))
        said = json.loads(text)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zipfile.error) as error:
        raise ValueError(
            f"net file {path} is damaged or no touch net; delete it and {_AGAIN}"
        ) from error
    if said.get("format") != FORMAT or said.get("version") != VERSION:
        raise ValueError(
            f"net file {path} is a '{said.get('format')}' of version {said.get('version')}, this"
            f" release reads a '{FORMAT}' of version {VERSION}; {_AGAIN}"
        )
    if checksum != _sum(arrays, text) or not _sound(arrays):
        raise ValueError(f"net file {path} is damaged; delete it and {_AGAIN}")
    (a, b), margin, (low, high) = said["touches"]
    touches = TouchRange((float(a), float(b)), float(margin), (float(low), float(high)))
    weights: Weights = {name: arrays[name] for name in shapes()}
    return TouchNet(weights, touches, arrays["low"], arrays["high"], said["about"])


def _sound(arrays: dict[str, AnyArray]) -> bool:
    expected = shapes() | {"low": (PLACES + 1,), "high": (PLACES + 1,)}
    return arrays.keys() == expected.keys() and all(
        arrays[name].shape == shape
        and arrays[name].dtype == np.float32
        and bool((np.abs(arrays[name]) < _LARGEST).all())
        for name, shape in expected.items()
    )


def _sum(arrays: dict[str, F32], text: str) -> str:
    return fingerprint(text, *(part for name in sorted(arrays) for part in (name, arrays[name])))
