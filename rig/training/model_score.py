"""What is scored: a stored net on the touches of its scene, or what a recording says was found."""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from pydantic import ValidationError

from rig.calibration.camera_of import camera_of
from rig.scene import Scene
from rig.scene.refusal import sentence
from rig.training.bases import BaseSets
from rig.training.data import TrainingNoise
from rig.training.descend import Sets, simulate
from rig.training.plan import training_plan
from rig.training.trained_range import replaced, require_within

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from models import (
        Dataset,
        DeformableSurface,
        ErrorMap,
        LinearForward,
        Model,
        Net,
        NetTouchEstimator,
        TouchPairs,
        TouchScore,
    )

SAMPLES = 500
"""Touches of a test set with noise of which a net says how sure it is, and as many empty ones."""

CLEAR = 512
"""Touches without noise on which its own error is measured."""


@dataclass(frozen=True, eq=False)
class Scored:
    """Figures, and where the errors are.

    Attributes
    ----------
    nets : dict
        Figures of a net by data set; empty for a recording.
    touches : TouchScore or None
        Of estimates with their stated uncertainty; None for a net without noise.
    bands : list of TouchScore
        The same by force.
    xy : (N, 2) float64, mm
    error : (N,) float64, mm
        Of touches there; NaN where one was not found.
    """

    title: str
    size: tuple[float, float]
    nets: dict[str, dict[str, float]]
    touches: TouchScore | None
    bands: list[TouchScore]
    xy: np.ndarray
    error: np.ndarray

    def map(self) -> ErrorMap:
        """Return the error over the plate."""
        from models import error_map

        return error_map(self.xy, self.error, self.size)


def is_recording(path: Path) -> bool:
    """Whether a file is a recorded session."""
    import h5py

    from rig.recording.layout import FORMAT

    try:
        with h5py.File(path, "r") as file:
            return cast(object, file.attrs.get("format")) in (FORMAT, FORMAT.encode())
    except OSError:
        return False


def score_recording(path: Path) -> Scored:
    """Score the touches found in a recording against what its source knew.

    Frames in which a finger lands or leaves, pressing less than the least force of the scene, are
    left out.

    Raises
    ------
    OSError
        If the recording cannot be read.
    ValueError
        If its source did not know what pressed.
    """
    from models import pair_touches, score_touches
    from rig.recording.session import open_session, reported_touches

    with open_session(path) as session:
        scene = session.scene
        min_force = scene.touches.force[0] if scene.touches else 0.0
        found, truth = reported_touches(session, min_force)
    if not truth or scene.plate is None:
        raise ValueError(
            f"recording '{path}' does not say what pressed; score one that was made in the twin"
        )
    pairs = pair_touches(found, truth)
    total, bands = score_touches(pairs)
    xy = pairs.truth[:, :2]
    return Scored(scene.title, scene.plate.size, {}, total, bands, xy, pairs.distance)


def score_model(
    path: Path, report: Callable[[int, int], None], overrides: Mapping[str, Any] | None = None
) -> Scored:
    """Repeat the test of a stored model; `report` is called while its touches are simulated.

    `overrides` replace values of its scene, by dotted key: other touches, bases or noise, as far as
    the model learnt them.

    Raises
    ------
    OSError
        If there is no such file, or it cannot be read.
    ValueError
        If it holds something else, the net of a bench that this release does not know, or is asked
        beyond what it learnt.
    """
    from models import Trained, load_model

    model, about = load_model(path)
    learnt = _bench(about, path)
    scene = replaced(learnt, overrides or {})
    require_within(learnt, scene)
    camera = camera_of(scene, str(about.get("calibration", "")))
    plan = training_plan(scene, camera)
    sets = simulate(plan, report)
    found, size = figures(model, sets, plan.touches), plan.plate.size
    if isinstance(sets, BaseSets):
        test = sets.test.surface()
        error = np.hypot(*(base_report(model, test)[:, :2] - test.xy).T)
        return Scored(scene.title, size, found, None, [], test.xy, error)
    if sets.noise and plan.touches == 1 and isinstance(model, Trained):
        pairs, total, bands = _judge_noisy(model.net, sets.test, sets.noise)
        xy, error = pairs.truth[:, :2], pairs.distance
        return Scored(scene.title, size, found, total, bands, xy, error)
    places = sets.test.targets[:, : 2 * plan.touches].reshape(-1, plan.touches, 2)
    predict = predictor(model)
    error = _matched(sets.test.targets, predict(sets.test.strain), plan.touches)[0]
    return Scored(scene.title, size, found, None, [], places.reshape(-1, 2), error.ravel())


def predictor(model: Model) -> Callable[[np.ndarray], np.ndarray]:
    """Return what a model of a flat plate makes of strains (N, I).

    Raises
    ------
    ValueError
        Where it is of two steps, which need the strain before the touch as well.
    """
    from models import Regression, Trained, predict

    match model:
        case Trained(net=net):
            return lambda strain: predict(net, strain)
        case Regression():
            return model.predict
        case _:
            raise ValueError(
                "a net of two steps needs the strain before the touch too; give its scene"
                " [training.bases]"
            )


def base_report(model: Model, surface: DeformableSurface) -> np.ndarray:
    """Return what a model reports of touches on bases, (N, 4): x, y, bend, twist."""
    from models import TrainedTwoStep, predict, predict_two_step

    if isinstance(model, TrainedTwoStep):
        place = predict_two_step(model.nets, surface.before, surface.loaded)
        return np.column_stack([place, predict(model.shape.net, surface.before)])
    return predictor(model)(surface.loaded)


def figures(model: Model, sets: Sets, touches: int) -> dict[str, dict[str, float]]:
    """Return the score of a model on each data set, as plain numbers by name.

    Touches of a sample are paired with the true ones before they are measured. Where the net
    estimates magnitudes their mean error follows, in units of the smallest force; on bases those
    of bend and twist.
    """
    if isinstance(sets, BaseSets):
        return {name: _judge_base(model, surface) for name, surface in sets.named().items()}
    predict = predictor(model)
    return {
        name: _judge(data.targets, predict(data.strain), touches)
        for name, data in sets.named().items()
    }


def _judge_base(model: Model, surface: DeformableSurface) -> dict[str, float]:
    from models import score_positions as judge

    off = base_report(model, surface) - surface.together.targets
    bend, twist = np.abs(off[:, 2:]).mean(axis=0)
    return asdict(judge(np.hypot(*off[:, :2].T))) | {"bend": float(bend), "twist": float(twist)}


def _judge(true: np.ndarray, found: np.ndarray, touches: int) -> dict[str, float]:
    from models import score_positions as judge

    error, order = _matched(true, found, touches)
    rows = asdict(judge(error.ravel()))
    if true.shape[1] > 2 * touches:
        forces = np.take_along_axis(found[:, 2 * touches :], order, axis=1)
        rows["magnitude"] = float(np.abs(forces - true[:, 2 * touches :]).mean())
    return rows


def _matched(true: np.ndarray, found: np.ndarray, touches: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors (N, k) mm of touches paired with those estimated, and in which order these came."""
    from models import matched_error

    places = [each[:, : 2 * touches].reshape(-1, touches, 2) for each in (true, found)]
    return matched_error(*places)


def _judge_noisy(
    net: Net, test: Dataset, noise: TrainingNoise
) -> tuple[TouchPairs, TouchScore, list[TouchScore]]:
    """Score what a net says of touches in noise, and of noise alone."""
    from models import pair_touches, score_touches

    estimator = _estimator(net, noise)
    strain, places = test.strain[:SAMPLES], test.targets[:SAMPLES]
    truth = np.column_stack([places, noise.forces[:SAMPLES]])
    rng = np.random.default_rng(0)
    empty = rng.standard_normal(strain.shape) @ estimator.root.T
    found = [estimator.fit(each.reshape(-1, 3)) for each in np.concatenate([strain, empty])]
    pairs = pair_touches(found, [*truth[:, None], *np.empty((len(empty), 0, 3))])
    return pairs, *score_touches(pairs, _bound(noise.forward, truth))


def _estimator(net: Net, noise: TrainingNoise) -> NetTouchEstimator:
    """Return a net that says how sure it is, from the error that it makes without noise."""
    from models import NetTouchEstimator, predict

    clear, places = noise.pool.strain[:CLEAR], noise.pool.targets[:CLEAR]
    off = np.asarray(predict(net, clear) - places, np.float64)
    alone = isinstance(noise.root, float)
    root = noise.root * np.eye(clear.shape[1]) if alone else np.asarray(noise.root, np.float64)
    return NetTouchEstimator(net, noise.towards, noise.forward, root, places, off)


def _bound(forward: LinearForward, touches: np.ndarray) -> np.ndarray:
    """Least variance of the place of each touch, force unknown, (N,) mm²."""
    from models import covariance

    spreads = (covariance(forward.read(touch[None])[1]) for touch in touches)
    return np.array([np.trace(spread[:2, :2]) for spread in spreads])


def _bench(about: dict[str, Any], path: Path) -> Scene:
    try:
        return Scene.model_validate(about.get("scene"))
    except ValidationError as error:
        raise ValueError(
            f"model file {path} names a bench that this release does not know"
            f" ({sentence(error, Scene)}); train the model again"
        ) from error
