"""What trainings of the paper's systems came to."""

from collections.abc import Iterable
from typing import NamedTuple

from rig.report.figure import Bar


class Sample(NamedTuple):
    """One quantity of one training.

    Attributes
    ----------
    system, what, unit
        Which of the paper's systems, and which quantity.
    paper
        The paper's own figure, as it prints it; empty where it has none.
    epochs
        Steps of Adam; 0 where nothing was trained.
    seed, value
        Of this training.
    bar
        What the median of the seeds should reach, if anything.
    """

    system: str
    what: str
    unit: str
    paper: str
    epochs: int
    seed: int
    value: float
    bar: Bar | None = None


def grouped(samples: Iterable[Sample]) -> dict[tuple[str, str], list[Sample]]:
    """Put the samples of all seeds of a system and quantity together."""
    groups: dict[tuple[str, str], list[Sample]] = {}
    for sample in samples:
        groups.setdefault((sample.system, sample.what), []).append(sample)
    return groups
