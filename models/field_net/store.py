"""Storage of field nets: plain arrays, options as JSON and a checksum, in one npz."""

from __future__ import annotations

import json
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.arrays import F32
from models.field_net.unet import Weights, shapes
from models.nets.checkpoint import fingerprint

FORMAT, VERSION = "touchplate field net", 1
_LARGEST = 1e3  # of a weight; NaN is not below it either


@dataclass(frozen=True, eq=False)
class FieldNet:
    """A trained field net.

    Attributes
    ----------
    weights : dict of float32 arrays
        By the names of `models.field_net.unet.shapes`.
    low, high : (9, 1, 1) float32
        Least and largest of each input that training has seen.
    about : dict
        Seed, steps and CPU seconds of the training, as plain values.
    """

    weights: Weights
    low: F32
    high: F32
    about: dict[str, Any]


def save_field_net(path: str | Path, net: FieldNet) -> None:
    """Write a net aside and rename it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    path = Path(path)
    arrays = net.weights | {"low": net.low, "high": net.high}
    text = json.dumps({"format": FORMAT, "version": VERSION, "about": net.about}, sort_keys=True)
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


def load_field_net(path: str | Path) -> FieldNet:
    """Read what `save_field_net` wrote.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged, of another version or something else.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"net file {path} does not exist; run 'touchplate train dic-net'")
    again = "delete it and run 'touchplate train dic-net'"
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: np.asarray(stored[name]) for name in stored.files}
        text, checksum = str(arrays.pop("options")), str(arrays.pop("checksum"))
        said = json.loads(text)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"net file {path} is damaged or no field net; {again}") from error
    if said.get("format") != FORMAT or said.get("version") != VERSION:
        raise ValueError(
            f"net file {path} is of version {said.get('version')}, this release reads {VERSION}; "
            "run 'touchplate train dic-net'"
        )
    if checksum != _sum(arrays, text) or not _sound(arrays):
        raise ValueError(f"net file {path} is damaged; {again}")
    low, high = (arrays.pop(name).astype(np.float32) for name in ("low", "high"))
    return FieldNet({name: arrays[name] for name in shapes()}, low, high, said["about"])


def _sound(arrays: dict[str, np.ndarray]) -> bool:
    expected = shapes()
    return arrays.keys() == expected.keys() | {"low", "high"} and all(
        arrays[name].shape == shape
        and arrays[name].dtype == np.float32
        and bool((np.abs(arrays[name]) < _LARGEST).all())
        for name, shape in expected.items()
    )


def _sum(arrays: dict[str, F32], text: str) -> str:
    return fingerprint(text, *(part for name in sorted(arrays) for part in (name, arrays[name])))
