"""Touches on a base that is bent and twisted, through the live loop: shape, rest, press, motion.

Parts: any (base, shape and touch drawn over the whole range), few (the first of these), limit
(bases near a limit point),
moving (a base that moves on while it is pressed). In the first two truth is the whole shell under
the touch on 28 × 28 elements, any of its stable shapes, photographed exactly at 640² with a noise
of 2 grey levels; the loop gets the flat plate, then the bent one, and, when it says that it knows
it at rest, the pressed one for a second of 10 frames. In the third the twin of the scene bent-base
gives the frames. What is worked out in the background is ready `TAKES` s later, and no frame waits
for it; nothing is known but plate and camera. *Place* and *force* are of the touch as it is shown
after that second, *one frame* those of its first frame alone. Silently wrong is a scene in which a
frame reports a touch that is off by more than noise, none where one is held, or one where none is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np

import fe
from rig.live.live_loop import to_nobody
from rig.live.snapshot import Snapshot
from rig.on_base.base_bench import BaseBench, build_base_bench
from rig.on_base.loop import SurfaceLoop
from rig.report.figure import Figure, at_most
from rig.scene import Scene as RigScene, load
from rig.sources.twin import open_play
from rig.studies.deformable import seen
from rig.studies.deformable.stage import RATE, Later, Stage
from rig.studies.deformable.truth import Scene, Truth
from rig.studies.study import Cell, line, run
from rig.system.arrays import AnyArray

CASE, NEAR = "bent and twisted base, live", "bent and twisted base near a limit point, live"
SCENES, LIMITS, LISTED, FEW = 16, 8, 6, 3
HELD, PATIENCE = 10, 400
SPEEDS = {"0.04 mm/min, 0.1 deg/min": 1.0, "0.16 mm/min, 0.4 deg/min": 4.0}
SEED = 23


class Lived(NamedTuple):
    """What the loop said of a scene.

    Attributes
    ----------
    found : bool
        Whether the touch is shown after its second.
    place, force : float, mm and a fraction
        Errors of the touch as shown, NaN where it is not.
    frame_place, frame_force : float, mm and a fraction
        Of the first frame alone.
    bend, twist : float, fraction and degrees
        Errors of the base; NaN where none was stated.
    silent : bool
        Whether any frame was wrong by more than noise without saying so.
    outcome : str
        Of the last frame.
    right_shape : bool or None
        Whether the shape that was listed as shown is the true one; None where none was listed.
    """

    found: bool
    place: float
    force: float
    frame_place: float
    frame_force: float
    bend: float
    twist: float
    silent: bool
    outcome: str
    right_shape: bool | None


@cache
def scene() -> RigScene:
    """Read the scene of the bench."""
    return load("bent-base")


@cache
def bench() -> BaseBench:
    """Build what the loop needs."""
    return build_base_bench(scene(), lambda done, total: None)


def live(truth: Truth, there: Scene, rng: np.random.Generator, listing: bool) -> Lived:
    """Run the loop over a scene."""
    flat, bent, pressed = (
        truth.flat_light(),
        truth.light(there.untouched),
        truth.light(there.state),
    )
    began: list[int] = []

    def frame(number: int) -> tuple[AnyArray, tuple[fe.Touch, ...]] | None:
        if number < bench().dic.reference_frames:
            return truth.photograph(flat, rng), ()
        if number > PATIENCE or (began and number >= began[0] + HELD):
            return None
        if began:
            return truth.photograph(pressed, rng), (there.touch,)
        return truth.photograph(bent, rng), ()

    stage = Stage(frame)
    loop = SurfaceLoop(
        bench(), stage, lambda: stage.time, background=Later(lambda: stage.time, listing)
    )
    loop.get_ready(to_nobody)
    shots: list[Snapshot] = []
    for shot in loop:
        shots.append(shot)
        outcome = shot.base.outcome if shot.base else "SEARCHING"
        # A base that is refused is pressed too: it must not be believed then.
        refused = outcome in ("NEAR_LIMIT", "UNRESOLVABLE")
        known = loop.get_ready().knows_rest
        listed = bool(shot.base and shot.base.all_sought) or not listing
        if not began and listed and (known or refused):
            began.append(shot.sequence)
    return _judged(there, shots)


def _judged(there: Scene, shots: list[Snapshot]) -> Lived:
    touch, true, last = there.touch, there.untouched.base, shots[-1]
    pressed = [shot for shot in shots if shot.truth]
    silent = any(_silent(shot, touch) for shot in shots)
    base = last.base
    right = None
    if base and base.all_sought:
        shown = next(shape.name for shape in base.shapes if shape.shown)
        right = shown == fe.shape_name(there.untouched)
    place = force = frame_place = frame_force = np.nan
    found = bool(pressed) and len(last.touches) == 1
    if found:
        mark = last.touches[0]
        place = float(np.hypot(mark.x - touch.x, mark.y - touch.y))
        force = mark.force / touch.force - 1.0
    first = pressed[0].estimate if pressed else None
    if first is not None and first.count == 1:
        frame_place = float(np.hypot(*(first.xy[0] - [touch.x, touch.y])))
        frame_force = float(first.force[0]) / touch.force - 1.0
    return Lived(
        found,
        place,
        force,
        frame_place,
        frame_force,
        (base.bend - true.bend) / max(true.bend, 1e-9) if base else np.nan,
        base.twist - true.twist if base else np.nan,
        silent,
        base.outcome if base else "SEARCHING",
        right,
    )


def _silent(shot: Snapshot, touch: fe.Touch) -> bool:
    """Whether a frame is wrong by more than noise, and says that it knows."""
    estimate, outcome = shot.estimate, shot.base.outcome if shot.base else ""
    if estimate is None or outcome not in ("FOUND", "NO_TOUCH"):
        return False
    if not shot.truth:
        return estimate.count > 0
    if estimate.count != 1:
        return True
    off = np.array([*(estimate.xy[0] - [touch.x, touch.y]), estimate.force[0] - touch.force])
    sigma = np.sqrt(np.diag(estimate.covariance))
    wrong = np.hypot(*off[:2]) > seen.WRONG or abs(off[2]) > seen.WRONG_FORCE * touch.force
    return bool(wrong and (np.abs(off) / sigma).max() > seen.SURE)


def figures(case: str, lived: list[Lived], barred: bool) -> Iterator[Figure]:
    """Give the figures of a case; those of touches are of the ones that are shown."""
    found = [each for each in lived if each.found]
    bars = (at_most(1.0), at_most(5.0), at_most(2.0))
    place, force, bend = bars if barred else (None, None, None)
    count, total = len(found), len(lived)
    stated = [each for each in lived if np.isfinite(each.bend)]
    listed = [each for each in lived if each.right_shape is not None]
    cells: dict[str, Cell] = {
        "place": (_middle([s.place for s in found]), "mm, median", place, count),
        "force": (100 * _middle([s.force for s in found]), "%", force, count),
        "place, one frame": (_middle([s.frame_place for s in lived]), "mm, median", None, count),
        "force, one frame": (100 * _middle([s.frame_force for s in lived]), "%", None, count),
        "bend": (100 * _middle([s.bend for s in stated]), "%", bend, len(stated)),
        "twist": (_middle([s.twist for s in stated]), "degrees", None, len(stated)),
        "largest place": (max((s.place for s in found), default=np.nan), "mm", None, count),
        "found": (100.0 * count / total, "%", None, total),
        "refused": (float(sum(not s.found for s in lived)), "", None, total),
        "silently wrong": (float(sum(s.silent for s in lived)), "", at_most(0.0), total),
    }
    reasons = Counter(each.outcome for each in lived if not each.found)
    if reasons:
        cells["refused as"] = ", ".join(f"{count} {name}" for name, count in reasons.items())
    if listed:
        right = float(sum(not each.right_shape for each in listed))
        cells["wrong shape listed as shown"] = (right, "", None, len(listed))
    yield from line(seen.TABLE, case, **cells)


def _middle(values: list[float]) -> float:
    """Median size of what is known."""
    known = np.abs([value for value in values if np.isfinite(value)])
    return float(np.median(known)) if len(known) else np.nan


def truth() -> Truth:
    """Return what photographs the plate."""
    described = scene()
    if described.pattern is None or described.plate is None or described.sensor is None:
        raise TypeError("scene bent-base lacks its twin")
    pattern, sensor = described.pattern.build(described.plate), described.sensor.build()
    return Truth(bench().plate, bench().camera, pattern, sensor)


def any_part(scenes: int) -> Iterator[Figure]:
    """Run bases over the whole range."""
    rng, there = np.random.default_rng(SEED), truth()
    lived: list[Lived] = []
    for number in range(scenes):
        drawn = Scene(seen.any_base(rng, there), seen.touch(rng))
        lived.append(live(there, drawn, rng, number < LISTED))
        _say(drawn, lived[-1])
    yield from figures(CASE, lived, barred=True)


def limit_part(scenes: int) -> Iterator[Figure]:
    """Run bases near a limit point."""
    rng, there = np.random.default_rng(SEED + 1), truth()
    lived: list[Lived] = []
    for _ in range(scenes):
        drawn = Scene(seen.near_limit(rng, there), seen.touch(rng))
        lived.append(live(there, drawn, rng, listing=False))
        _say(drawn, lived[-1])
    yield from figures(NEAR, lived, barred=False)


def _say(drawn: Scene, lived: Lived) -> None:
    base, touch, soft = drawn.untouched.base, drawn.touch, drawn.untouched.stability.eigenvalue
    said = ", ".join(f"{name} {value}" for name, value in lived._asdict().items())
    print(
        f"  {base.bend:.3f} mm {base.twist:.2f} deg, λ {soft:.2f}, {touch.force:.2f} N at"
        f" ({touch.x:.0f}, {touch.y:.0f}): {said}",
        flush=True,
    )


def moving_part() -> Iterator[Figure]:
    """Follow a base that moves on while it is pressed."""
    described = scene()
    if described.source is None:
        raise TypeError("scene bent-base lacks its twin")
    for name, faster in SPEEDS.items():
        speeds = {"bend_speed": faster * 0.04 / 60, "twist_speed": faster * 0.1 / 60}
        quick = described.model_copy(update={"source": described.source.model_copy(update=speeds)})
        loop = _follow(quick)
        summary = loop.summary()
        scored, outcomes = summary["pattern"], summary["base"]["outcomes"]
        late = sum(count for reason, count in outcomes.items() if reason in ("MOVED_ON", "NO_FIT"))
        pressed = scored["scored"] + scored["misses"] + late
        cells = {
            "place": (scored["position_median_mm"], "mm, median", None, scored["scored"]),
            "force": (scored["force_median_percent"], "%", None, scored["scored"]),
            "not followed": (100.0 * late / max(pressed, 1), "% of frames", None, pressed),
            "misses": (float(scored["misses"]), "", at_most(0.0), scored["frames"]),
            "false touches": (float(scored["false_touches"]), "", at_most(0.0), scored["frames"]),
            "shapes prepared": (float(summary["base"]["shapes_prepared"]), "", None, 1),
        }
        yield from line(seen.TABLE, f"base that moves by {name}, pressed", **cells)


def _follow(described: RigScene) -> SurfaceLoop:
    """Run the twin's script for two rounds, on the frames' own time."""
    twin = replace(open_play(described), flat_frames=bench().dic.reference_frames)  # pyright: ignore[reportCallIssue]
    begun: list[int] = []

    def frame(number: int) -> tuple[AnyArray, tuple[fe.Touch, ...]] | None:
        rest = begun[0] if begun else number + 1
        if number > rest + 500:
            return None
        now = replace(twin, rest=rest)
        touches = now.touches(number)
        return now.frame(number, touches), touches

    stage = Stage(frame)
    later = Later(lambda: stage.time, listing=False)

    def begin() -> None:
        begun.append(round(stage.time * RATE) + 1)

    loop = SurfaceLoop(bench(), stage, lambda: stage.time, background=later, on_rest=begin)
    for _ in loop:
        pass
    return loop


PARTS = {
    "few": partial(any_part, FEW),
    "any": partial(any_part, SCENES),
    "limit": partial(limit_part, LIMITS),
    "moving": moving_part,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
