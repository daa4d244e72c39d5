"""Print what the solver makes of extreme touches: right, refused, or silently wrong.

Usage: ``python benchmarks/solver_extremes.py [--quick] [PART ...]``; parts are forces,
edges, together and float32, all of them if none is named. Strain of 72 gauges on a plate of
100 x 100 mm, with noise of a hundredth of the strain of 1 N where nothing else is said.

An answer is *right* if its count is and all lies within 5 stated σ (or rounding, 1e-3 mm) of the
truth, *one* if it is a single touch in the middle of two, with the force of both, *told* if the
result or a p-value below 1e-4 says that it is not to be believed, and *wrong* otherwise.
"""

import sys
from collections import Counter
from collections.abc import Iterator

import numpy as np

import models
from rig.studies.touches.rows import Part, Row, show
from rig.studies.touches.strain import INFLUENCE, UNIT, measured, prepared

SIGMAS, DOUBTFUL, ROUNDING = 5.0, 1e-4, 1e-3
VERDICTS = "right", "one", "told", "wrong"


def verdict(estimate, touches):
    """Whether an estimate is right, one for both, told to be doubtful, or wrong."""
    if estimate.count < len(touches) and _is_middle(estimate, touches):
        return "one"
    if estimate.count == len(touches):
        found = np.column_stack([estimate.xy, estimate.force])
        nearest = np.linalg.norm(found[:, None, :2] - touches[:, :2], axis=2).argmin(axis=1)
        off = np.abs(found - touches[nearest]).ravel()
        if np.all(off <= SIGMAS * np.sqrt(np.diag(estimate.covariance)) + ROUNDING):
            return "right"
    believed = estimate.result is models.Result.FOUND and estimate.p_value >= DOUBTFUL
    return "wrong" if believed else "told"


def _is_middle(estimate, touches):
    """Whether an estimate is one touch with the force of all, where their weight lies."""
    total = touches[:, 2].sum()
    middle = np.array([*(touches[:, 2] @ touches[:, :2] / total), total])
    if estimate.count != 1:
        return False
    off = np.abs(np.array([*estimate.xy[0], estimate.force[0]]) - middle)
    return np.all(off <= SIGMAS * np.sqrt(np.diag(estimate.covariance)) + 0.02 * middle)


def judged(search, touches, share) -> str:
    """Verdicts on noisy measurements of touches, and the size of the usual error."""
    touches = np.array(touches, dtype=float)
    rng, count, errors = np.random.default_rng(0), Counter(), []
    for _ in range(max(int(200 * share), 10)):
        estimate = models.find(measured(search.forward, touches, rng), search)
        count[verdict(estimate, touches)] += 1
        if estimate.count:
            apart = np.linalg.norm(estimate.xy[:, None] - touches[:, :2], axis=2)
            errors.append(apart.min(axis=1).max())
    said = ", ".join(
        f"{name} {count[name]}" for name in ("right", "one", "told", "wrong") if count[name]
    )
    return f"{said}; {np.median(errors):.2g} mm" if errors else said


def force_rows(share) -> Iterator[Row]:
    """Press with 1 mN to 1 kN; two forces further and further apart."""
    search, fine = prepared(0.01), prepared(1e-6)
    for force in 10.0 ** np.arange(-3, 4):
        yield f"one touch of {force:g} N", judged(search, [(35, 62, force)], share), "none wrong"
    for force in 10.0 ** np.arange(0, 7, 2):
        figure = judged(fine, [(35, 62, force), (70, 30, 1)], share)
        yield f"{force:g} N beside 1 N, noise of 1e-6", figure, "none wrong"


def edge_rows(share) -> Iterator[Row]:
    """Press with 5 N nearer and nearer to a clamped edge and to a corner."""
    search = prepared(0.01)
    for distance in (10.0, 5.0, 2.0, 1.0, 0.5, 0.0):
        at_edge = judged(search, [(40, distance, 5)], share)
        yield f"{distance:g} mm from an edge", at_edge, "none wrong"
        at_corner = judged(search, [(distance, distance, 5)], share)
        yield f"{distance:g} mm from both edges of a corner", at_corner, "none wrong"


def together_rows(share) -> Iterator[Row]:
    """Press with 3 N and 2 N, together and apart."""
    search = prepared(0.01)
    for apart in (0.0, 0.1, 1.0, 2.0, 5.0, 10.0):
        touches = [(40 - 0.4 * apart, 60, 3), (40 + 0.6 * apart, 60, 2)]
        yield f"3 N and 2 N, {apart:g} mm apart", judged(search, touches, share), "none wrong"


def float32_rows(share) -> Iterator[Row]:
    """Round the strain to single precision, as a file or a device may."""
    rng = np.random.default_rng(0)
    for noise in (0.01, 1e-4):
        worst = 0.0
        for _ in range(max(int(50 * share), 5)):
            touches = np.column_stack([rng.uniform(15, 85, (2, 2)), rng.uniform(1, 10, 2)])
            strain = np.einsum("n,nmc->mc", touches[:, 2], INFLUENCE.strain(touches[:, :2]))
            strain += rng.normal(0, noise * UNIT, strain.shape)
            double, single = (
                models.solve(strain.astype(kind), INFLUENCE, noise * UNIT, count=2)
                for kind in (np.float64, np.float32)
            )
            off = np.column_stack([double.xy - single.xy, double.force - single.force]).ravel()
            worst = max(worst, (np.abs(off) / np.sqrt(np.diag(double.covariance))).max())
        yield f"float32, noise {noise:g} of the strain of 1 N", f"moves {worst:.1g} σ", "≤ 0.1 σ"


PARTS = {
    "forces": Part("Extremes: forces over six decades", force_rows),
    "edges": Part("Extremes: touches at edges and corners", edge_rows),
    "together": Part("Extremes: touches that coincide", together_rows),
    "float32": Part("Extremes: strain in single precision", float32_rows),
}


if __name__ == "__main__":
    show(PARTS, sys.argv[1:])
