"""What of a bench is not as its scene says, from images of ordinary touches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import models
from rig.calibration.bench_presses import (
    ShownPress,
    bench_as_known,
    measured,
    with_fixed_pattern,
)
from rig.calibration.press_images import ordered_images
from rig.calibration.store import Calibration
from rig.camera.files import read_grey
from rig.live.baseline import still_reference
from rig.live.bench import Bench
from rig.live.chain import Chain
from rig.live.hidden_parts import HiddenParts
from rig.live.known_bench import KnownBench
from rig.live.visibility import SLIGHT
from rig.scene import Scene
from rig.system.arrays import F32, AnyArray

TOUCHES = 8  # are enough to tell one cause from another
_LOOKED_AT = 40  # images, spread over all
_APART = 15.0  # mm, within which two images show one touch
_WORN = 5  # touches in which a place is hidden before it is called worn
_MIN_FORCE = 0.4  # N: weaker ones tell little


class SeenCauses(NamedTuple):
    """What images of touches show.

    Attributes
    ----------
    diagnosis : models.Diagnosis
        Of the bench.
    occlusion : str
        What hides the pattern, as a sentence without its end; empty where nothing does.
    """

    diagnosis: models.Diagnosis
    occlusion: str

    @property
    def sentence(self) -> str:
        """State both for the user."""
        found, hidden = self.diagnosis.sentence, self.occlusion
        return f"{found} {hidden[0].upper()}{hidden[1:]}." if hidden else found


def diagnose_images(
    scene: Scene, known: Calibration, folder: Path, report: Callable[[int, int], None]
) -> SeenCauses:
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
    shown = shown_touches(chain, ((path.name, read_grey(path)) for path in looked_at))
    return SeenCauses(diagnosed(bench, chain, shown, report), occlusion(bench.hidden_parts, shown))


def diagnosed(
    bench: Bench, chain: Chain, shown: Sequence[ShownPress], report: Callable[[int, int], None]
) -> models.Diagnosis:
    """Name what explains touches.

    Parameters
    ----------
    bench : Bench
        That of `bench_as_known`.
    chain : Chain
        Prepared for the reference.
    shown : sequence of ShownPress
        See `shown_touches`.

    Raises
    ------
    ValueError
        If the bench is exact, or there are fewer than three touches.
    """
    forward = chain.pattern.forward(chain.noise)
    if not isinstance(forward, models.BenchForward) or bench.known is None:
        raise ValueError("the bench has no estimator of kind 'pattern'; give the scene one")
    if len(shown) < 3:
        raise ValueError(
            f"{len(shown)} touches of {_MIN_FORCE:g} N or more are found in the images; press at"
            f" {TOUCHES} places, far apart"
        )
    presses = [_unknown_press(one, bench.reference_frames) for one in shown]
    look = KnownBench(bench.known, bench.camera).look(chain.pattern)
    return models.diagnose(forward, presses, bench.known, look, report)


def shown_touches(chain: Chain, images: Iterable[tuple[str, AnyArray]]) -> list[ShownPress]:
    """Measure up to `TOUCHES` single touches at places far apart, in the order of named images.

    What they show of a pattern of the sensor is taken out of all of them.
    """
    found: list[ShownPress] = []
    taken: list[tuple[str, F32]] = []
    for name, grey in images:
        image = np.asarray(grey, dtype=np.float32)
        try:
            shown = measured(chain, image, None, name)
        except ValueError:  # nobody touches the plate here
            continue
        near = any(np.hypot(*(shown.touch[:2] - one.touch[:2])) < _APART for one in found)
        if shown.touch[2] >= _MIN_FORCE and not near:
            found.append(shown)
            taken.append((name, image))
        if len(found) == TOUCHES:
            break
    chain = with_fixed_pattern(chain, ((image, None) for _, image in taken))
    if not chain.fixed_pattern.variance:
        return found
    return [measured(chain, image, None, name) for name, image in taken]


def occlusion(parts: HiddenParts, shown: Sequence[ShownPress]) -> str:
    """Say what hides the pattern while touches are shown; empty where nothing does.

    Parameters
    ----------
    parts : HiddenParts
        Before any image.
    shown : sequence of ShownPress
    """
    parts = replace(parts, enough=min(_WORN, len(shown)))
    for one in shown:
        parts = parts.followed(one.hidden)
    passing = [one.hidden & ~parts.worn for one in shown]
    largest = max(passing, key=np.count_nonzero)
    said = [parts.sentence(parts.worn)] if parts.worn.any() else []
    if largest.mean() > SLIGHT:
        count = sum(bool(one.mean() > SLIGHT) for one in passing)
        said.append(f"in {count} of {len(shown)} images {parts.sentence(largest)}")
    return "; ".join(said)


def _unknown_press(shown: ShownPress, references: int) -> models.Press:
    """Return a touch of unknown place and force as it was measured in one frame."""
    unknown, frames = np.full(3, np.inf), (1, references)
    given = shown.whitening, shown.moved, shown.errors
    return models.Press.of_frames(shown.seen, shown.touch, unknown, frames, *given)
