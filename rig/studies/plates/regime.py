"""How far linear theory is off against the shell, and what `fe.linear_range` says without it.

Parts: regime. The plate is PVC, 254 x 254 x 1 mm; the touch presses where it gives most. Both
errors are relative: of the deflection under the touch, and of the strain of the touched face over
the whole of it (root of the sum of squares on a grid of 10 x 10 points); the larger of the two
counts.
"""

import dataclasses
from collections.abc import Iterator

import numpy as np

import fe
from fe import linear_range, solve
from rig.report.figure import Figure
from rig.studies.study import line, run

ELEMENTS = 24  # of the shell, along the longer side
RATIOS = (0.02, 0.05, 0.1, 0.2, 0.35, 1.0, 2.0, 3.5)  # w/h that are aimed at
C, S, F = fe.Clamped(), fe.Supported(), fe.Free()
PVC = fe.Plate((254.0, 254.0), thickness=1.0, young=3000.0, poisson=0.38)
EDGES = {
    "clamped": C,
    "supported": S,
    "supported, free to slide": fe.Elastic(np.inf, 0.0, membrane=1e-3),
    "two clamped, two free": fe.Edges(C, C, F, F),
    "two clamped, two supported": fe.Edges(C, C, S, S),
    "one clamped": fe.Edges(C, F, F, F),
    "springs": fe.Elastic(deflection=10.0, rotation=100.0, membrane=10.0),
}


def measured(plate: fe.Plate, said: fe.LinearRange) -> tuple[float, float] | None:
    """Ratio w/h of the shell and error of linear theory against it; None where it is not found."""
    mesh, touch = fe.grid(plate, ELEMENTS), fe.Touch(*said.place, said.force)
    large, linear = solve(plate, [touch], mesh=mesh), fe.deflect(plate, [touch], mesh)
    if large.stability.verdict.name != "STABLE":
        return None
    along = np.linspace(0.05, 0.95, 10)
    x, y = np.meshgrid(along * plate.size[0], along * plate.size[1])
    face, under = np.column_stack([x.ravel(), y.ravel()]), [said.place]
    true, small = large.strain(face), linear.strain(face)
    depth = -large.deflection(under)[0]
    of_depth = -linear.deflection(under)[0] / depth - 1.0
    of_strain = np.linalg.norm(small - true) / np.linalg.norm(true)
    return float(depth / plate.thickness), float(max(of_depth, of_strain))


def force_for(plate: fe.Plate, ratio: float) -> float:
    """Force that deflects the plate to w/h = `ratio`, N, by halving."""
    low = ratio * 1e-6 / linear_range(plate, 1e-6).ratio
    high = 200.0 * low
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if linear_range(plate, middle).ratio < ratio else (low, middle)
    return low


def ranges() -> Iterator[Figure]:
    """Compare what is said with the shell, for each way of holding the plate."""
    for name, edges in EDGES.items():
        plate = dataclasses.replace(PVC, edges=edges)
        for ratio in RATIOS:
            said = linear_range(plate, force_for(plate, ratio))
            found = measured(plate, said)
            yield from line(
                f"Linear theory against the shell, {name}",
                f"{said.force:.3g} N",
                stated=(said.ratio, "w/h"),
                shell=(found and found[0], "w/h"),
                stated_error=(100 * said.error, "%"),
                error=(found and 100 * found[1], "%"),
            )


PARTS = {"regime": ranges}

if __name__ == "__main__":
    run(PARTS, __doc__)
