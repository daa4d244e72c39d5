"""What of a bench is not as its scene says, from images of ordinary touches."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

import models
from rig.calibration.bench_presses import bench_as_known, measured
from rig.calibration.press_images import ordered_images
from rig.calibration.store import Calibration
from rig.camera.files import read_grey
from rig.live.baseline import still_reference
from rig.live.bench import Bench
from rig.live.chain import Chain
from rig.live.known_bench import KnownBench
from rig.scene import Scene
from rig.system.arrays import AnyArray

TOUCHES = 8  # are enough to tell one cause from another
_LOOKED_AT = 40  # images, spread over all
_APART = 15.0  # mm, within which two images show one touch
_MIN_FORCE = 0.4  # N: weaker ones tell little


def diagnose_images(
    scene: Scene, known: Calibration, folder: Path, report: Callable[[int, int], None]
) -> models.Diagnosis:
    """Name what explains the touches in a folder of images, the first of them untouched.

    Of a bench that is calibrated, that is what has changed since.

    Raises
    ------
    OSError
        If there are no more images than the reference needs.
    ValueError
        If the scene cannot run live, something moves in the first images, or fewer than three
        touches are found.
    """
    ordered_images(folder, 0)  # a wrong folder is refused before the bench is built, a minute
    bench = bench_as_known(scene, known, report)
    paths = ordered_images(folder, bench.reference_frames)
    still, later = paths[: bench.reference_frames], paths[bench.reference_frames :]
    chain = bench.prepare(still_reference([read_grey(path) for path in still]))[0]
    looked_at = later[:: max(1, len(later) // _LOOKED_AT)]
    return diagnosed(bench, chain, ((path.name, read_grey(path)) for path in looked_at), report)


def diagnosed(
    bench: Bench,
    chain: Chain,
    images: Iterable[tuple[str, AnyArray]],
    report: Callable[[int, int], None],
) -> models.Diagnosis:
    """Name what explains the touches in named images, of which as many as needed are taken.

    Parameters
    ----------
    bench : Bench
        That of `bench_as_known`.
    chain : Chain
        Prepared for the reference.

    Raises
    ------
    ValueError
        If the bench is exact, or fewer than three touches are found.
    """
    forward = chain.pattern.forward(chain.noise)
    if not isinstance(forward, models.BenchForward) or bench.known is None:
        raise ValueError("the bench has no estimator of kind 'pattern'; give the scene one")
    presses = _touches(chain, images, bench.reference_frames)
    if len(presses) < 3:
        raise ValueError(
            f"{len(presses)} touches of {_MIN_FORCE:g} N or more are found in the images; press at"
            f" {TOUCHES} places, far apart"
        )
    look = KnownBench(bench.known, bench.camera).look(chain.pattern)
    return models.diagnose(forward, presses, bench.known, look, report)


def _touches(
    chain: Chain, images: Iterable[tuple[str, AnyArray]], references: int
) -> list[models.Press]:
    """Measure up to `TOUCHES` single touches at places far apart, in the order of the images."""
    found: list[models.Press] = []
    for name, grey in images:
        image = np.asarray(grey, dtype=np.float32)
        try:
            shown = measured(chain, image, None, name)
        except ValueError:  # nobody touches the plate here
            continue
        touch = shown.touch
        near = any(np.hypot(*(touch[:2] - one.touch[:2])) < _APART for one in found)
        if touch[2] >= _MIN_FORCE and not near:
            unknown, frames = np.full(3, np.inf), (1, references)
            given = shown.whitening, shown.moved, shown.errors
            found.append(models.Press.of_frames(shown.seen, touch, unknown, frames, *given))
        if len(found) == TOUCHES:
            break
    return found
