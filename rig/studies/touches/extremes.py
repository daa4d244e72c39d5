"""What the solver makes of extreme touches: right, refused, or silently wrong.

Parts: forces, edges, together, float32. Strain of 72 gauges on a plate of 100 x 100 mm, with noise
of a hundredth of the strain of 1 N where nothing else is said.

An answer is *right* if its count is and all lies within 5 stated σ (or rounding, 1e-3 mm) of the
truth, *one* if it is a single touch in the middle of two, with the force of both, *doubted* if the
result or a p-value below 1e-4 says that it is not to be believed, and *wrong* otherwise.
"""

from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

import models
from models import CandidateGrid, Estimate
from rig.report.figure import Figure, at_most
from rig.studies.study import Cell, line, run
from rig.studies.touches.strain import INFLUENCE, UNIT, Touches, measured, prepared
from rig.system.arrays import F64

SIGMAS, DOUBTFUL, ROUNDING = 5.0, 1e-4, 1e-3
NONE_WRONG = at_most(0)
PRESSES, PAIRS = 200, 50
Verdict = Literal["right", "one", "doubted", "wrong"]
VERDICTS: tuple[Verdict, ...] = ("right", "one", "doubted", "wrong")


def verdict(estimate: Estimate, touches: Touches) -> Verdict:
    """Judge an estimate: right, one for both, doubted by itself, or wrong."""
    if estimate.count < len(touches) and _is_middle(estimate, touches):
        return "one"
    if estimate.count == len(touches):
        found = np.column_stack([estimate.xy, estimate.force])
        nearest = np.linalg.norm(found[:, None, :2] - touches[:, :2], axis=2).argmin(axis=1)
        off = np.abs(found - touches[nearest]).ravel()
        if np.all(off <= SIGMAS * np.sqrt(np.diag(estimate.covariance)) + ROUNDING):
            return "right"
    believed = estimate.result is models.Result.FOUND and estimate.p_value >= DOUBTFUL
    return "wrong" if believed else "doubted"


def _is_middle(estimate: Estimate, touches: Touches) -> bool:
    """Whether an estimate is one touch with the force of all, where their weight lies."""
    total = touches[:, 2].sum()
    middle = np.array([*(touches[:, 2] @ touches[:, :2] / total), total])
    if estimate.count != 1:
        return False
    off = np.abs(np.array([*estimate.xy[0], estimate.force[0]]) - middle)
    return bool(np.all(off <= SIGMAS * np.sqrt(np.diag(estimate.covariance)) + 0.02 * middle))


def judged(search: CandidateGrid, touches: ArrayLike, presses: int) -> dict[str, Cell]:
    """Judge noisy measurements of touches; count each verdict, and give the usual error."""
    true = np.asarray(touches, dtype=float)
    rng, count = np.random.default_rng(0), Counter[Verdict]()
    errors: list[float] = []
    for _ in range(presses):
        estimate = models.find(measured(search.forward, true, rng), search)
        count[verdict(estimate, true)] += 1
        if estimate.count:
            apart = np.linalg.norm(estimate.xy[:, None] - true[:, :2], axis=2)
            errors.append(float(apart.min(axis=1).max()))
    fractions = {name: (100 * count[name] / presses, "%") for name in VERDICTS[:-1]}
    return {
        "wrong": (100 * count["wrong"] / presses, "%", NONE_WRONG, presses),
        **fractions,
        "error": (float(np.median(errors)) if errors else None, "mm, median"),
    }


def forces(presses: int = PRESSES) -> Iterator[Figure]:
    """Press with 1 mN to 1 kN; two forces further and further apart."""
    table, search, fine = "Extremes: forces over six decades", prepared(0.01), prepared(1e-6)
    for force in 10.0 ** np.arange(-3, 4):
        cells = judged(search, [(35, 62, force)], presses)
        yield from line(table, f"one touch of {force:g} N", **cells)
    for force in 10.0 ** np.arange(0, 7, 2):
        cells = judged(fine, [(35, 62, force), (70, 30, 1)], presses)
        yield from line(table, f"{force:g} N beside 1 N, noise of 1e-6", **cells)


def edges(presses: int = PRESSES) -> Iterator[Figure]:
    """Press with 5 N nearer and nearer to a clamped edge and to a corner."""
    table, search = "Extremes: touches at edges and corners", prepared(0.01)
    for distance in (10.0, 5.0, 2.0, 1.0, 0.5, 0.0):
        for name, place in (
            ("an edge", (40, distance, 5)),
            ("both edges of a corner", (distance, distance, 5)),
        ):
            cells = judged(search, [place], presses)
            yield from line(table, f"{distance:g} mm from {name}", **cells)


def together(presses: int = PRESSES) -> Iterator[Figure]:
    """Press with 3 N and 2 N, together and apart."""
    search = prepared(0.01)
    for apart in (0.0, 0.1, 1.0, 2.0, 5.0, 10.0):
        touches = [(40 - 0.4 * apart, 60, 3), (40 + 0.6 * apart, 60, 2)]
        yield from line(
            "Extremes: touches that coincide",
            f"3 N and 2 N, {apart:g} mm apart",
            **judged(search, touches, presses),
        )


def float32(pairs: int = PAIRS) -> Iterator[Figure]:
    """Round the strain to single precision, as a file or a device may."""
    rng = np.random.default_rng(0)
    for noise in (0.01, 1e-4):
        worst = 0.0
        for _ in range(pairs):
            touches = np.column_stack([rng.uniform(15, 85, (2, 2)), rng.uniform(1, 10, 2)])
            strain: F64 = np.einsum("n,nmc->mc", touches[:, 2], INFLUENCE.strain(touches[:, :2]))
            strain += rng.normal(0, noise * UNIT, strain.shape)
            double, single = (
                models.solve(strain.astype(kind), INFLUENCE, noise * UNIT, count=2)
                for kind in (np.float64, np.float32)
            )
            off = np.column_stack([double.xy - single.xy, double.force - single.force]).ravel()
            sigma = np.sqrt(np.diag(double.covariance))
            worst = max(worst, float((np.abs(off) / sigma).max()))
        yield from line(
            "Extremes: strain in single precision",
            f"noise {noise:g} of the strain of 1 N",
            moves=(worst, "σ", at_most(0.1), pairs),
        )


PARTS = {"forces": forces, "edges": edges, "together": together, "float32": float32}
SOME = {
    "forces": partial(forces, 50),
    "edges": partial(edges, 50),
    "together": partial(together, 50),
    "float32": partial(float32, 12),
}
"""The same on a quarter of the draws, for the table of stiff and extreme cases."""

if __name__ == "__main__":
    run(PARTS, __doc__)
