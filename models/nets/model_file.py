"""The file that holds a trained model: HDF5 with plain arrays, options as JSON and a checksum."""

import hashlib
import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.arrays import AnyArray

VERSION = 1


@dataclass(frozen=True)
class ModelFile:
    """What a model file holds.

    Attributes
    ----------
    format
        Which kind of model, "touchplate net".
    arrays
        By name.
    options
        What else makes the model, and "about", which names its bench: plain values.
    """

    format: str
    arrays: Mapping[str, np.ndarray]
    options: Mapping[str, Any]


def write_model(path: str | Path, model: ModelFile) -> None:
    """Write a model: aside first, then renamed, so that no half file is ever seen.

    Raises
    ------
    OSError
        When the file cannot be written.
    """
    path = Path(path)
    text = json.dumps(dict(model.options), sort_keys=True)
    prepare_net_file(path)
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        _write(aside, model, text)
        aside.replace(path)
    except OSError as error:
        raise _unwritable(path, error) from error
    finally:
        aside.unlink(missing_ok=True)


def prepare_net_file(path: str | Path) -> None:
    """Make the folder of `path` and try it, so that no training ends in a net without a place.

    Raises
    ------
    OSError
        When a file there cannot be written.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise _unwritable(path, error) from error
    if path.is_dir():
        raise IsADirectoryError(f"model file {path} is a folder; give the name of a file in it")


def read_model(path: str | Path, formats: tuple[str, ...]) -> ModelFile:
    """Read what `write_model` wrote.

    Parameters
    ----------
    path
        The file.
    formats
        Kinds of model that may be in it.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    PermissionError
        When it may not be read.
    ValueError
        When the file is damaged, of another version or something else.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"model file {path} does not exist; train the model first")
    head, arrays = _read(path)
    kind = str(head.get("format"))
    if kind not in formats:
        raise ValueError(f"model file {path} holds something else; give a file written by training")
    if str(head.get("version")) != str(VERSION):
        raise ValueError(
            f"model file {path} has version {head.get('version')}, this release reads {VERSION}; "
            "train the model again"
        )
    text = str(head.get("options"))
    if str(head.get("checksum")) != _checksum(arrays, text):
        raise ValueError(f"model file {path} is damaged; delete it and train the model again")
    try:
        options: dict[str, Any] = json.loads(text)
    except ValueError as error:
        raise not_runnable(path, error) from error
    return ModelFile(kind, arrays, options)


def not_runnable(path: str | Path, error: Exception) -> ValueError:
    """Return what is said of a file whose numbers make no model."""
    said = " ".join(str(error).split())
    return ValueError(
        f"model file {path} holds no net that can be run ({said}); train the model again"
    )


def _write(path: Path, model: ModelFile, text: str) -> None:
    import h5py

    # The latest format of HDF5 sums its own structure too, so that damage there is seen.
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs["version"] = VERSION
        checksum = _checksum(model.arrays, text)
        texts = {"format": model.format, "checksum": checksum, "options": text}
        for name, said in texts.items():  # of fixed length: others lie where HDF5 sums nothing up
            file.attrs[name] = np.bytes_(said.encode(errors="surrogateescape"))
        for name, array in model.arrays.items():
            file[name] = array


def _unwritable(path: Path, error: OSError) -> OSError:
    return OSError(
        f"model file {path} cannot be written ({error.strerror or error}); free space there or"
        " choose another place"
    )


def _read(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the attributes and the arrays of an HDF5 file, whatever they are."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            arrays: dict[str, AnyArray] = {name: np.asarray(item) for name, item in file.items()}
            return {name: _plain(value) for name, value in file.attrs.items()}, arrays
    except PermissionError as error:
        raise PermissionError(f"model file {path} cannot be read; check its permissions") from error
    except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"model file {path} is damaged or no HDF5 file; train the model again"
        ) from error


def _plain(attribute: object) -> object:
    """Text of an attribute, whether its length is fixed or not; anything else as it is."""
    if isinstance(attribute, bytes):
        return attribute.decode(errors="surrogateescape")
    return attribute


def _checksum(arrays: Mapping[str, np.ndarray], text: str) -> str:
    """SHA-256 over the options and each array's name, type, shape and bytes."""
    digest = hashlib.sha256(text.encode(errors="surrogateescape"))
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
