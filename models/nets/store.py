"""Storage of trained nets: HDF5 with plain arrays, options as JSON and a checksum."""

import hashlib
import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from models.arrays import AnyArray
from models.nets.net import Net, NetOptions, Scaling
from models.nets.train import Trained

FORMAT = "touchplate net"
VERSION = 1
LARGEST = 1e9  # of a weight or a scale; NaN is not below it either


def save_net(path: str | Path, trained: Trained, about: Mapping[str, Any]) -> None:
    """Write `trained` to `path`: aside first, then renamed, so that no half file is ever seen.

    Parameters
    ----------
    path
        Its folder is made where it is missing; a file that exists is replaced.
    trained
        Net and history.
    about
        Whatever names the bench that the net belongs to, as plain values that JSON can hold.

    Raises
    ------
    OSError
        When the file cannot be written.
    """
    path = Path(path)
    text = json.dumps({"net": asdict(trained.net.options), "about": dict(about)}, sort_keys=True)
    prepare_net_file(path)
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        _write(aside, _to_arrays(trained), text)
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


def load_net(path: str | Path) -> tuple[Trained, dict[str, Any]]:
    """Read what `save_net` wrote.

    Returns
    -------
    The trained net and `about`.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    PermissionError
        When it may not be read.
    ValueError
        When the file is damaged, of another version or something else, or holds numbers that
        make no net.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"model file {path} does not exist; train the model first")
    head, arrays = _read(path)
    if str(head.get("format")) != FORMAT:
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
        options = json.loads(text)
        named = options["net"] | {"layers": tuple(options["net"]["layers"])}
        trained = _from_arrays(arrays, NetOptions(**named))
        return _sound(trained), options["about"]
    except (KeyError, TypeError, ValueError) as error:
        said = " ".join(str(error).split())
        raise ValueError(
            f"model file {path} holds no net that can be run ({said}); train the model again"
        ) from error


def _write(path: Path, arrays: Mapping[str, np.ndarray], text: str) -> None:
    import h5py

    # The latest format of HDF5 sums its own structure too, so that damage there is seen.
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs["version"] = VERSION
        texts = {"format": FORMAT, "checksum": _checksum(arrays, text), "options": text}
        for name, said in texts.items():  # of fixed length: others lie where HDF5 sums nothing up
            file.attrs[name] = np.bytes_(said.encode(errors="surrogateescape"))
        for name, array in arrays.items():
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


def _sound(trained: Trained) -> Trained:
    """Return what was read, if its layers fit each other and every number is of use."""
    scaling, count = trained.net.scaling, trained.net.scaling.centre.size
    expected = [(scaling.centre, (count,)), (scaling.scale, (count,))]
    for weights, biases in trained.net.layers:
        expected += [(weights, (count, biases.size)), (biases, (biases.size,))]
        count = biases.size
    for array, shape in expected:
        if array.shape != shape or array.dtype.kind != "f":
            raise ValueError(f"an array of {array.dtype} {array.shape} where {shape} must be")
        if not (np.abs(array) < LARGEST).all():
            raise ValueError(f"weights beyond {LARGEST:g}: its training has diverged")
    knee = scaling.knee
    if scaling.scale.min(initial=1.0) <= 0 or (knee is not None and not 0 < knee < np.inf):
        raise ValueError("a scale of its inputs that is not positive")
    return trained


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


def _to_arrays(trained: Trained) -> dict[str, np.ndarray]:
    net = trained.net
    arrays = {
        "centre": net.scaling.centre,
        "scale": net.scaling.scale,
        "history": trained.history,
    }
    if net.scaling.knee is not None:
        arrays["knee"] = np.array(net.scaling.knee)
    for number, (weights, biases) in enumerate(net.layers):
        arrays |= {f"weights{number}": weights, f"biases{number}": biases}
    return arrays


def _from_arrays(arrays: Mapping[str, np.ndarray], options: NetOptions) -> Trained:
    layers = tuple(
        (arrays[f"weights{number}"], arrays[f"biases{number}"])
        for number in range(len(options.layers) + 1)
    )
    knee = float(arrays["knee"]) if "knee" in arrays else None
    relative = options.inputs == "relative"
    net = Net(options, Scaling(arrays["centre"], arrays["scale"], knee, relative), layers)
    return Trained(net, arrays["history"])
