"""The live loop with what a bench does to it; `table` runs it.

The bench of the shipped twin with a small camera; images are rendered, then spoilt.
"""

import time
from collections.abc import Callable, Iterator

import numpy as np

import fe
import rig
from models import Estimate
from rig.live.baseline import average_reference
from rig.live.bench import Bench, build_bench
from rig.live.frame_estimate import FrameEstimate
from rig.live.tracker import FrameProcessor
from rig.report.figure import Figure
from rig.sources.twin import Twin, build_twin
from rig.studies.stiff.case import NOT_WRONG, case
from rig.system.arrays import AnyArray
from rig.system.frame import Frame
from rig.system.timing import Stopwatch
from synthetic import Occluder

SMALL = {
    "plate.size": [254, 203],
    "camera.pixels": [384, 320],
    "pattern.diameter": 3.5,
    "dic.tile": 8,
    "dic.subset": 25,
    "estimator.modes": 100,
    "comparison": None,
}
PRESS, NEAR = fe.Touch(80.0, 120.0, 2.5), fe.Touch(83.0, 120.0, 2.5)
ARM = Occluder(np.array([(190.0, -20.0), (410.0, -20.0), (410.0, 340.0), (190.0, 340.0)]), 0.45)
FRAMES = 12  # after the change; the last one counts
SIGMAS = 5.0
PLAIN = ("no touch", "one touch", "2 touches")  # sentences that question nothing

Change = Callable[[np.ndarray], np.ndarray]


def loop() -> Iterator[Figure]:
    """Spoil light, view and frames while one touch presses, then press what is hard to tell."""
    scene = rig.load("twin", SMALL)
    twin, bench = build_twin(scene), build_bench(scene, lambda done, total: None)
    rng = np.random.default_rng(3)
    strange = rng.uniform(50, 200, (320, 384))
    changes: tuple[tuple[str, Callable[[AnyArray], AnyArray]], ...] = (
        ("nothing wrong", lambda image: image),
        ("light down to 60 %", lambda image: 0.6 * image),
        ("light down to 20 %", lambda image: 0.2 * image),
        ("lamp that saturates a third", lambda image: 1.9 * image),
        ("camera bumped by 3 px", lambda image: np.roll(image, (2, 3), (0, 1))),
        ("hand over half the pattern", lambda image: 255.0 * ARM.cover(image / 255.0)),
        ("everything covered", lambda image: strange),
        ("black image", lambda image: 0.0 * image),
        ("noise of 20 grey levels", lambda image: image + rng.normal(0.0, 20.0, image.shape)),
    )
    for name, change in changes:
        yield from pressed(f"loop, {name}", bench, twin, (PRESS,), change)
        yield from pressed(f"loop, {name}, no touch", bench, twin, (), change)
    for name, touches in (
        ("two touches 3 mm apart", (PRESS, NEAR)),
        ("a touch of 20 mN", (fe.Touch(80.0, 120.0, 0.02),)),
        ("a touch 10 mm from an edge", (fe.Touch(10.0, 100.0, 2.5),)),
        ("a touch 2 mm from an edge", (fe.Touch(2.0, 100.0, 2.5),)),
        ("a touch of 60 N", (fe.Touch(80.0, 120.0, 60.0),)),
    ):
        yield from pressed(f"loop, {name}", bench, twin, touches, lambda image: image)


def pressed(
    name: str, bench: Bench, twin: Twin, touches: tuple[fe.Touch, ...], change: Change
) -> Iterator[Figure]:
    """Follow spoilt images of touches; what the last of them says counts."""
    processor = FrameProcessor(
        bench, average_reference([twin.frame(k, ()) for k in range(16)]), Stopwatch(time.monotonic),
        time.monotonic,
    )  # fmt: skip
    frames = [
        see(processor, change(twin.frame(number, touches).astype(float)), number)
        for number in range(20, 20 + FRAMES)
    ]
    last = frames[-1]
    said, found = processor.sentence(last), last.estimate
    truth = np.array([(touch.x, touch.y, touch.force) for touch in touches])
    right, sure = compared(found, truth, trace(processor, truth))
    doubted = bool(last.unusable_reason) or said not in PLAIN
    reason = f"{len(touches) or 'no'} touch{'es' * (len(touches) > 1)}"
    bar, unit = NOT_WRONG
    wrong = 0 if sure or doubted else 1
    return case(name, reason, wrong, unit, bar, seen=right, said=said)


def see(processor: FrameProcessor, image: np.ndarray, number: int) -> FrameEstimate:
    """Let the loop see an image as a camera of 8 bit takes it."""
    eight_bit = np.rint(image).clip(0, 255).astype(np.uint8)
    return processor.process(Frame(number, number / 30.0, eight_bit, None)).frame_estimate


def trace(processor: FrameProcessor, truth: np.ndarray) -> float:
    """How far touches stand out of the noise of an image, in its σ."""
    if not len(truth):
        return 0.0
    return float(np.linalg.norm(processor.chain.estimator.forward.read(truth)[0]))


def compared(found: Estimate, truth: np.ndarray, trace: float) -> tuple[str, bool]:
    """Say what is right of an estimate, and whether all of it is.

    What leaves no trace in the image need not be found, and two touches may be reported as the one
    that they are at this distance, with the force of both.
    """
    if found.count == 1 and len(truth) == 2:
        force = truth[:, 2]
        both = np.array([[*(force @ truth[:, :2] / force.sum()), force.sum()]])
        right, sure = compared(found, both, trace)
        return f"as one: {right}", sure
    if found.count != len(truth):
        said = f"{found.count} of {len(truth)} found, {trace:.1f} σ in the image"
        return said, not found.count and trace < SIGMAS
    if not found.count:
        return "none found", True
    off = np.column_stack([found.xy, found.force]) - truth
    sure = np.abs(off).ravel() <= SIGMAS * np.sqrt(np.diag(found.covariance))
    far, force = np.hypot(*off[:, :2].T).max(), np.abs(off[:, 2]).max()
    return f"{far:.2g} mm, {force:.2g} N", bool(sure.all())
