"""Storage of trained models: nets, nets in two steps and regressions."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from models.data.dataset import Dataset
from models.nets.model_file import ModelFile, not_runnable, read_model, write_model
from models.nets.net import Net, NetOptions, Scaling
from models.nets.regression import Regression
from models.nets.train import Trained
from models.nets.two_step import TrainedTwoStep

FORMAT = "touchplate net"
TWO_STEP = "touchplate net of two steps"
REGRESSION = "touchplate regression"
LARGEST = 1e9  # of a weight or a scale; NaN is not below it either

Model = Trained | TrainedTwoStep | Regression
"""Whatever training ends in."""


def save_net(path: str | Path, trained: Trained, about: Mapping[str, Any]) -> None:
    """Write a net and its history to `path`.

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
    save_model(path, trained, about)


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
    model, about = _load(path, (FORMAT,))
    if not isinstance(model, Trained):
        raise TypeError(f"a net was read as {type(model).__name__}")
    return model, about


def save_model(path: str | Path, model: Model, about: Mapping[str, Any]) -> None:
    """Write any trained model, as `save_net` does a net.

    Raises
    ------
    OSError
        When the file cannot be written.
    """
    arrays: dict[str, np.ndarray]
    match model:
        case Trained():
            kind, arrays = FORMAT, _to_arrays(model)
            options: dict[str, Any] = {"net": asdict(model.net.options)}
        case TrainedTwoStep():
            kind, arrays, options = TWO_STEP, {}, {"strain": model.nets.strain}
            for step, trained in model.steps().items():
                options[step] = asdict(trained.net.options)
                arrays |= {f"{step}-{name}": a for name, a in _to_arrays(trained).items()}
        case Regression():
            kind, options = REGRESSION, {"fit": model.fit}
            arrays = {"strain": model.training.strain, "targets": model.training.targets}
    write_model(path, ModelFile(kind, arrays, options | {"about": dict(about)}))


def load_model(path: str | Path) -> tuple[Model, dict[str, Any]]:
    """Read whatever `save_model` wrote; raises as `load_net`."""
    return _load(path, (FORMAT, TWO_STEP, REGRESSION))


def _load(path: str | Path, formats: tuple[str, ...]) -> tuple[Model, dict[str, Any]]:
    file = read_model(path, formats)
    try:
        return _model(file), file.options["about"]
    except (KeyError, TypeError, ValueError) as error:
        raise not_runnable(path, error) from error


def _model(file: ModelFile) -> Model:
    arrays, options = file.arrays, file.options
    match file.format:
        case "touchplate net":
            return _trained(arrays, options["net"])
        case "touchplate net of two steps":
            steps = (_trained(_of_step(arrays, step), options[step]) for step in ("shape", "place"))
            return TrainedTwoStep(*steps, strain=options["strain"]).sound()
        case _:
            return Regression(options["fit"], Dataset(arrays["strain"], arrays["targets"]))


def _of_step(arrays: Mapping[str, np.ndarray], step: str) -> dict[str, np.ndarray]:
    own = f"{step}-"
    return {name.removeprefix(own): a for name, a in arrays.items() if name.startswith(own)}


def _trained(arrays: Mapping[str, np.ndarray], options: Mapping[str, Any]) -> Trained:
    named: dict[str, Any] = {**options, "layers": tuple(options["layers"])}
    return _sound(_from_arrays(arrays, NetOptions(**named)))


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
