"""Search over layers and their sizes: the paper's third step, its Table S1 (optuna lives here)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

from models.workers import Map

if TYPE_CHECKING:
    import optuna

DEPTHS = (1, 2, 4)
"""Hidden layers of the models in Table S1."""

WIDTHS = (4, 8, 16, 24, 32, 48, 64, 128)
"""Neurons of the layers in Table S1."""


@dataclass(frozen=True)
class NetCandidate:
    """An architecture that was tried.

    Attributes
    ----------
    layers
        Neurons of each hidden layer.
    loss
        What the search makes small.
    """

    layers: tuple[int, ...]
    loss: float


def tune_net(
    objective: Callable[[tuple[int, ...]], float],
    trials: int,
    storage: str | None = None,
    name: str = "touchplate",
    seed: int = 0,
    on_trial: Callable[[int, NetCandidate], None] | None = None,
    each: Map = map,
) -> list[NetCandidate]:
    """Try random architectures until `trials` of them are done, those of earlier runs counted.

    Several processes with one storage share the work. A trial whose process was killed is not
    counted, and another takes its place.

    Parameters
    ----------
    objective
        Trains a net with these hidden layers and returns its validation loss.
    trials
        Architectures in all.
    storage
        Address of optuna's data base, "sqlite:///search.db"; None keeps nothing.
    name
        Of the study in the data base.
    seed
        Of the draw; another run with it goes on with other architectures.
    on_trial
        Called with the number of trials done and the latest one.
    each
        What evaluates the architectures, from `models.workers`; the data base is written here.

    Returns
    -------
    All candidates, the best first.

    Raises
    ------
    ValueError
        When `trials` is below 1 or optuna is not installed.
    OSError
        When the storage cannot be opened.
    """
    if trials < 1:
        raise ValueError(f"number of trials must be at least 1, got {trials}; use 50")
    study = _study(storage, name, seed)

    running: deque[optuna.Trial] = deque()

    def fresh() -> Iterator[tuple[int, ...]]:
        while len(_candidates(study)) + len(running) < trials:
            running.append(study.ask())
            yield _draw(running[-1])

    for loss in each(objective, fresh()):
        study.tell(running.popleft(), loss)
        done = _candidates(study)
        if on_trial:
            on_trial(len(done), done[-1])
    return sorted(_candidates(study), key=lambda candidate: candidate.loss)


def _draw(trial: optuna.Trial) -> tuple[int, ...]:
    depth = trial.suggest_categorical("depth", DEPTHS)
    return tuple(trial.suggest_categorical(_layer(number), WIDTHS) for number in range(depth))


def _study(storage: str | None, name: str, seed: int) -> optuna.Study:
    if find_spec("optuna") is None:
        raise ValueError(
            "optuna is not installed and the search needs it; run 'pip install optuna'"
        )
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    # Each data base has errors of its own.
    try:
        study = optuna.create_study(storage=storage, study_name=name, load_if_exists=True)
    except Exception as error:
        raise OSError(
            f"storage {storage} of the search cannot be opened ({_first_line(error)}); give an "
            "address such as sqlite:///search.db in a folder that exists"
        ) from error
    # A run that goes on must not draw again what the last one drew.
    study.sampler = optuna.samplers.RandomSampler(seed + 1_000_003 * len(study.trials))
    return study


def _candidates(study: optuna.Study) -> Sequence[NetCandidate]:
    """Trials that were finished, in their order."""
    import optuna

    finished = study.get_trials(deepcopy=False, states=[optuna.trial.TrialState.COMPLETE])
    return [
        NetCandidate(
            tuple(trial.params[_layer(number)] for number in range(trial.params["depth"])),
            float(trial.value or 0.0),
        )
        for trial in finished
    ]


def _layer(number: int) -> str:
    return f"layer-{number + 1}"


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
