"""Print how far linear theory is off against the shell, and what `fe.regime` says without it.

Usage: ``python benchmarks/regime.py [ELEMENTS]``, elements of the shell along the longer side.
The plate is PVC, 254 x 254 x 1 mm; the touch presses where it gives most. Both errors are relative:
of the deflection under the touch, and of the strain of the touched face over the whole of it (root
of the sum of squares on a grid of 10 x 10 points); the larger of the two counts.
"""

import dataclasses
import sys
import time

import numpy as np

import fe
from fe.linear.linear_range import regime
from fe.shell import solve

ELEMENTS = 24
RATIOS = (0.02, 0.05, 0.1, 0.2, 0.35, 1.0, 2.0, 3.5)  # w/h that are aimed at
REPEATS = 7
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


def measured(plate, said, elements):
    """Ratio w/h of the shell and error of linear theory against it; None where it is not found."""
    mesh, touch = fe.grid(plate, elements), fe.Touch(*said.place, said.force)
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
    return depth / plate.thickness, max(of_depth, of_strain)


def force_for(plate, ratio):
    """Force that deflects the plate to w/h = `ratio`, N, by halving."""
    low = ratio * 1e-6 / regime(plate, 1e-6).ratio
    high = 200.0 * low
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if regime(plate, middle).ratio < ratio else (low, middle)
    return low


def seconds(plate):
    """Median and spread of the time of one call, s."""
    taken = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        regime(plate, 1.0)
        taken.append(time.perf_counter() - began)
    return np.median(taken), np.ptp(taken)


def main(elements):
    """Print one block for each way of holding the plate."""
    regime(PVC, 1.0)
    print(f"shell on {elements} x {elements} elements")
    print("   force N   w/h said   w/h shell   error said   error of linear theory")
    for name, edges in EDGES.items():
        plate = dataclasses.replace(PVC, edges=edges)
        median, spread = seconds(plate)
        print(f"{name}: regime in {median:.3f} s, spread {spread:.3f} s")
        for ratio in RATIOS:
            said = regime(plate, force_for(plate, ratio))
            row = f"{said.force:10.4f} {said.ratio:10.3f}"
            if found := measured(plate, said, elements):
                row += f" {found[0]:11.3f} {100 * said.error:10.2f} % {100 * found[1]:10.2f} %"
            else:
                row += "   the shell found no stable state"
            print(row, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ELEMENTS)
