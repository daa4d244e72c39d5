"""Error of correlation against its run time, setting by setting, ours and those of its peers.

Peers stand beside ours where they are installed (extra ``peers``: pyvale, al-dic; OpenCV's PyrLK is
always there). CPU times are of one thread and the median of some runs.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import dic
import synthetic
from rig.studies.correlation.peers import Peer, al_dic_field, pyramid, pyvale_field
from rig.studies.study import cpu_seconds, rms
from rig.system.arrays import F64, AnyArray, Grey
from synthetic import closed_forms

SIDE, SCALE, NOISE = 512, 0.25, 2.0  # px, mm per px, grey levels
BORDER = 45  # px, kept by every window of subsets
SIZE = (SIDE * SCALE, SIDE * SCALE)
CAMERA = synthetic.telecentric_above(SIZE, (SIDE, SIDE), 0.0)
SHIFT, AMPLITUDE, PERIODS = (0.4, -0.3), (0.5, 0.4), (110.0, 140.0)  # px
MOTIONS = {
    "shift": closed_forms.Polynomial(
        np.array([[SHIFT[0] * SCALE]]), np.array([[SHIFT[1] * SCALE]])
    ),
    "waves": closed_forms.Wave(
        (AMPLITUDE[0] * SCALE, AMPLITUDE[1] * SCALE),
        (1 / PERIODS[0] / SCALE, 1 / PERIODS[1] / SCALE),
    ),
}
LENGTH = 1 / np.hypot(1 / PERIODS[0], 1 / PERIODS[1])  # px, of the waves
SUBSETS, STEPS = (11, 15, 21, 31, 41), (2, 3, 10, 20)
SMOOTHED = ((11, 9), (15, 7), (15, 9), (15, 11), (21, 9))  # subset, window


Images = Mapping[str, Grey]


class Setting(NamedTuple):
    """One setting of one code; `window` and `interpolation` as they are to be read."""

    code: str
    subset: int
    step: int
    order: int
    window: str = ""
    interpolation: str = "quintic"

    @property
    def name(self) -> str:
        """What it is called in a table."""
        name = f"{self.code} {self.subset}/{self.step}, order {self.order}"
        if self.window:
            name += f", smoothed {self.window}"
        return name + " (default)" * (name == "ours 21/5, order 1")


@dataclass(frozen=True)
class Measured:
    """What a setting costs and how well it does.

    Attributes
    ----------
    setting : Setting
    points : int
    from_nothing, next_frame : float, s
        CPU time of a pair of images, and of a further one from the last field.
    errors : dict of float, px
        Root mean square of both components, by motion.
    """

    setting: Setting
    points: int
    from_nothing: float
    next_frame: float
    errors: dict[str, float]


def images() -> Images:
    """Take the reference and both motions, exactly rendered."""
    rng, sensor = np.random.default_rng(0), synthetic.Sensor(noise=NOISE)
    pattern = synthetic.speckle(SIZE)
    moved = {"rest": None} | MOTIONS
    return {k: synthetic.render(pattern, CAMERA, m, sensor, rng) for k, m in moved.items()}


def error(name: str, xy: F64, moved: F64) -> float:
    """Root mean square of what was measured less the truth, px, away from the border."""
    inside = np.all((xy >= BORDER) & (xy <= SIDE - 1 - BORDER), axis=1)
    inside &= np.isfinite(moved).all(axis=1)
    places = CAMERA.on_plate(xy[inside], 0.0)
    truth = synthetic.image_motion(CAMERA, places, MOTIONS[name](places), 0.0)
    return rms(moved[inside] - truth)


def every(seen: Images) -> Iterator[Measured]:
    """Measure every setting of ours and of the peers."""
    for order in (0, 1, 2):
        for subset in SUBSETS:
            yield ours(seen, subset, order=order)
    for step in STEPS:
        yield ours(seen, 21, step)
    for subset, window in SMOOTHED:
        yield ours(seen, subset, window=window)
    for window in (15, 21, 31):
        yield by_pyramid(seen, window)
    yield from full_field_peers(seen)


def some(seen: Images) -> Iterator[Measured]:
    """Measure a few."""
    for subset in (15, 21, 31):
        yield ours(seen, subset)
    yield ours(seen, 21, 10)
    yield ours(seen, 15, window=9)
    yield by_pyramid(seen, 21)


def ours(
    seen: Images, subset: int, step: int = 5, order: int = 1, window: int | None = None
) -> Measured:
    """Correlate, and smooth if a window is given."""

    def field(reference: dic.Reference, name: str, guess: dic.DisplacementField | None = None):
        found = dic.correlate(reference, seen[name], guess)
        return found, found if window is None else dic.smooth(found, window)

    reference = dic.prepare(seen["rest"], subset, step, order)
    last, _ = field(reference, "waves")
    found = {name: field(reference, name)[1] for name in MOTIONS}
    return Measured(
        Setting("ours", subset, step, order, "" if window is None else f"{window}, degree 4"),
        len(reference.xy),
        seconds(lambda: field(dic.prepare(seen["rest"], subset, step, order), "waves")),
        seconds(lambda: field(reference, "waves", last)),
        {name: error(name, f.xy, np.column_stack([f.u, f.v])) for name, f in found.items()},
    )


def by_pyramid(seen: Images, window: int) -> Measured:
    """OpenCV's tracker at the points of a grid of step 5."""
    xy = dic.prepare(seen["rest"], 21).xy
    taken = seconds(lambda: pyramid(seen["rest"], seen["waves"], xy, window))
    errors = {n: error(n, xy, pyramid(seen["rest"], seen[n], xy, window)) for n in MOTIONS}
    setting = Setting("PyrLK", window, 5, 0, interpolation="linear")
    return Measured(setting, len(xy), taken, taken, errors)


def full_field_peers(seen: Images) -> Iterator[Measured]:
    """Run pyvale and al-dic where they are installed; each call does all of the work."""
    codes: tuple[tuple[Setting, Callable[[AnyArray, AnyArray], Peer | None]], ...] = (
        (Setting("pyvale", 21, 5, 1, "", "its own"), lambda a, b: pyvale_field(a, b, 1)),
        (Setting("pyvale", 21, 5, 2, "", "its own"), lambda a, b: pyvale_field(a, b, 2)),
        (Setting("al-dic, local", 20, 4, 1, "", "its own"), al_dic_field),
    )
    for setting, correlate in codes:
        found = {name: correlate(seen["rest"], seen[name]) for name in MOTIONS}
        peers = {name: peer for name, peer in found.items() if peer is not None}
        if peers.keys() != MOTIONS.keys():
            continue
        errors = {name: error(name, peer.xy, peer.moved) for name, peer in peers.items()}
        last = peers["waves"]
        yield Measured(setting, len(last.xy), last.seconds, last.seconds, errors)


def seconds(work: Callable[[], object]) -> float:
    """Median CPU time of three runs after a first, s."""
    work()
    return cpu_seconds(work, 3)
