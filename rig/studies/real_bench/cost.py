"""What a frame costs where the bench is inferred too, beside an exact bench on the same images.

Parts: cost. Nothing is wrong with this bench: nine presses show it to one estimator, the other
takes the scene for granted, and both take touches as large. Each touch is seen twice, lying still
or after a millimetre and a twentieth of its force; the second frame is tracked and counts. Times
are of one thread's processor, through all that the live loop does from the image to the touches.
Truth is the whole plate of von Kármán on its own mesh.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

import fe
import rig
from models import match
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import Chain, at_rest
from rig.live.frame_estimate import FrameEstimate, estimate_frame
from rig.report.figure import Figure, at_most
from rig.studies.real_bench.as_it_is import identified, kept
from rig.studies.real_bench.departure import RealBench
from rig.studies.real_bench.session import REFERENCES, write_presses, write_scene
from rig.studies.real_bench.truth import Truth
from rig.studies.study import line, run, timed
from rig.system.arrays import Grey
from rig.system.timing import Stopwatch

SEED, TOUCHES, INSET = 3, 20, 30.0  # mm
TABLE = "What inference of the bench costs a frame"
STEPS = {"": 0.0, ", moving": 1.0}  # mm between two frames
STRONGER = 0.05  # of its force a millimetre
LIVE = at_most(20.0)
EXACT = {"estimator.bench": "exact", "plate.theory": "large"}


def cost() -> Iterator[Figure]:
    """Time tracked frames of one touch by both estimators, and compare their errors."""
    truth = Truth(RealBench(), SEED)
    zero = average_reference([truth.reference(number) for number in range(REFERENCES)])
    with tempfile.TemporaryDirectory() as place:
        path = write_scene(Path(place), Path(place) / "touches")
        listed = write_presses(truth, Path(place) / "presses", 9)
        known = kept(identified(path, listed, listed.with_suffix("")), Path(place))
        scenes = {"usual": (rig.load(path), known), "exact": (rig.load(path, EXACT), None)}
    chains = {
        name: build_bench(scene, lambda done, total: None, calibration).prepare(zero)[0]
        for name, (scene, calibration) in scenes.items()
    }
    for case, step in STEPS.items():
        yield from compared(case, chains, list(pressed(truth, step)))


def compared(
    case: str, chains: dict[str, Chain], seen: list[tuple[fe.Touch, tuple[Grey, Grey]]]
) -> Iterator[Figure]:
    """Time both estimators on the same images, and compare their errors."""
    spent: dict[str, list[float]] = {name: [] for name in chains}
    off: dict[str, list[float]] = {name: [] for name in chains}
    for touch, images in seen:
        for name, chain in chains.items():
            found, took = tracked(chain, images)
            if found.estimate.count == 1:
                spent[name].append(took)
                off[name].append(float(match(found.estimate, (touch,))[0][0]))
    for name, times in spent.items():
        yield from line(
            TABLE,
            f"{name} bench{case}",
            tracked=(float(np.median(times)), "CPU ms", None, len(times)),
            place=(float(np.median(off[name])), "mm", None, len(off[name])),
        )
    more = 100.0 * (float(np.median(spent["usual"]) / np.median(spent["exact"])) - 1.0)
    yield from line(
        TABLE,
        f"live cost of nuisances and covariance{case}",
        figure=(more, "% of a frame", LIVE, len(spent["usual"])),
    )


def pressed(truth: Truth, step: float) -> Iterator[tuple[fe.Touch, tuple[Grey, Grey]]]:
    """Photograph touches of 0.5 to 4 N twice each, the second time `step` mm on."""
    rng = np.random.default_rng((SEED, 11))
    for number in range(TOUCHES):
        x, y = rng.uniform(INSET, 254.0 - INSET, 2).tolist()
        touch = fe.Touch(x, y, float(rng.uniform(0.5, 4.0)))
        before = fe.Touch(x - step, y, (1.0 - STRONGER * step) * touch.force)
        first = truth.photograph((before,), None, 100 + 2 * number)
        yield touch, (first, truth.photograph((touch,), None, 101 + 2 * number))


def tracked(chain: Chain, images: tuple[Grey, Grey]) -> tuple[FrameEstimate, float]:
    """Estimate a frame after another one of the same touch; its time, ms."""
    watch = Stopwatch(time.thread_time)
    before = estimate_frame(chain, images[0], at_rest(chain), watch)
    return timed(partial(estimate_frame, chain, images[1], before.state, watch))


PARTS = {"cost": cost}

if __name__ == "__main__":
    run(PARTS, __doc__)
