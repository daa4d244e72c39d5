"""Benches of any kind, drawn: size, material, edges, camera, and what is wrong with them.

Parts: few (2 benches), many (8). Each is described by a scene and is otherwise: Young's modulus and
thickness by what the prior of a usual bench states, and so are clamps, tension, sag, uneven
thickness, pose, focal length and lens, each of which is as it should be on every second bench. Ten
touches a bench, before and after nine presses. Plates are up to 400 mm long, of PVC, acrylic,
polycarbonate or aluminium, clamped, supported or free at their edges, seen from above or below by a
camera whose image they may fill or not. Where presses show a bench that the command refuses, it
counts as refused, and its touches as they are before. Truth is the whole plate of von Kármán on its
own mesh. Benches that would buckle at rest are drawn again.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import fe
import models
import rig
from rig.calibration.bench_refusal import UnsoundBenchError
from rig.calibration.store import Calibration
from rig.report.figure import Figure
from rig.sources.real_twin import RealTwin
from rig.sources.twin import open_play
from rig.studies.real_bench import session
from rig.studies.real_bench.as_it_is import NONE, cells, identified, kept
from rig.studies.real_bench.score import Score, pooled, score
from rig.studies.real_bench.twin_truth import TwinTruth
from rig.studies.study import Part, line, run
from rig.system.arrays import F64, Grey

TABLE = "Benches of any kind, drawn"
FEW, MANY = 2, 8
TOUCHES = 10  # of a bench
_SEED = 23
_EDGES = (
    ("clamped", "clamped", "clamped", "clamped"),
    ("clamped", "clamped", "free", "free"),
    ("clamped", "clamped", "clamped", "free"),
    ("clamped", "supported", "clamped", "supported"),
    ("supported", "supported", "supported", "supported"),
)
_SIDES: tuple[str, ...] = ("west", "east", "south", "north")
_MATERIALS = (3000.0, 0.38), (3200.0, 0.37), (2300.0, 0.37), (69000.0, 0.33)  # MPa
_DEEPEST, _THICKEST = 1.2, 0.03  # w over the thickness; thickness over the shorter side
_IMAGES = (800, 600), (1024, 1024), (1280, 800), (1600, 1200)
_CAUSES = (
    ("rotation_west", "rotation_east", "rotation_south", "rotation_north"),
    ("membrane_west", "membrane_east", "membrane_south", "membrane_north"),
    ("tension_xx", "tension_yy"),
    ("sag",),
    ("thickness_x",),
    ("turn_x", "turn_y", "turn_z", "shift_x", "shift_y", "shift_z"),
    ("focal",),
    ("k1", "k2"),
)
_BENCH = """
title = "Drawn bench"
[plate]
size = {size}
thickness = {thickness}
young = {young}
poisson = {poisson}
[plate.edges]
kind = "mixed"
{edges}
[touches]
max_touches = 2
force = {force}
[camera]
kind = "pinhole"
pixels = {pixels}
stand_off = {stand_off}
side = "{side}"
[dic]
tile = 16
[estimator]
kind = "pattern"
bench = "usual"
"""
_TWIN = """
[pattern]
diameter = {diameter}
seed = {seed}
[sensor]
noise = {noise}
[source]
kind = "twin"
script = "empty"
[source.departure]
{departure}
"""
_FOLDER = """
[source]
kind = "folder"
path = "{folder}"
"""


@dataclass(frozen=True)
class DrawnBench:
    """A bench as its scene has it, and as it is.

    Attributes
    ----------
    scene, twin : str
        Sections of both, and of the twin alone.
    plate : fe.Plate
        As described.
    force : float, N
        Of the largest touches.
    """

    scene: str
    twin: str
    plate: fe.Plate
    force: float


def drawn(benches: int) -> Iterator[Figure]:
    """Score touches on benches that are drawn, before and after nine presses."""
    nominal, after, refused = list[Score](), list[Score](), 0
    for number in range(benches):
        rng = np.random.default_rng((_SEED, number))
        with tempfile.TemporaryDirectory() as place:
            before, then = _scored(rng, number, Path(place))
        refused += then is None
        then = before if then is None else then
        nominal.append(before)
        after.append(then)
        yield from line(
            TABLE,
            f"bench {number + 1}",
            **{
                "place before": (
                    float(np.median(before.place)) if len(before.place) else None,
                    "mm",
                ),
                "place after": (
                    float(np.median(then.place)) if len(then.place) else None,
                    "mm",
                ),
                "missed before": (before.missed, "", None, TOUCHES),
                "missed after": (then.missed, "", None, TOUCHES),
            },
        )
    for case, found in (("nominal scene", nominal), ("after 9 presses", after)):
        yield from line(TABLE, f"{benches} benches, {case}", **cells(pooled(found), NONE))
    yield from line(
        TABLE, f"{benches} benches, after 9 presses", refused=(refused, "", None, benches)
    )


def _scored(rng: np.random.Generator, number: int, folder: Path) -> tuple[Score, Score | None]:
    bench, truth = _built(rng, number, folder)
    scene = folder / "scene.toml"
    scene.write_text(bench.scene + _FOLDER.format(folder=folder / "touches"), encoding="utf-8")
    made = _touched(rng, bench, truth, folder / "touches")
    nominal = score(rig.load(scene), Calibration(), made)
    listed = session.write_listed(truth, folder / "presses", _presses(bench), rng)
    try:
        found = identified(scene, listed, listed.with_suffix(""))
    except UnsoundBenchError:
        return nominal, None
    return nominal, score(rig.load(scene), kept(found, folder), made)


def _built(rng: np.random.Generator, number: int, folder: Path) -> tuple[DrawnBench, TwinTruth]:
    """Draw a bench that does not buckle at rest, and photograph it."""
    path = folder / "twin.toml"
    while True:
        bench = _drawn(rng)
        path.write_text(bench.scene + bench.twin, encoding="utf-8")
        twin = open_play(rig.load(path))
        if not isinstance(twin, RealTwin):
            raise TypeError(f"a drawn bench must be one that departs, got {type(twin).__name__}")
        truth, (a, b) = TwinTruth(twin, number), bench.plate.size
        try:
            truth.held((fe.Touch(0.5 * a, 0.5 * b, bench.force),), None, 0)
        except ValueError as error:
            if "buckling" not in str(error):
                raise
            continue
        return bench, truth


def _touched(
    rng: np.random.Generator, bench: DrawnBench, truth: TwinTruth, folder: Path
) -> list[session.Touched]:
    """Write images at rest, of touches anywhere, and of the plate alone after each third."""
    sides = bench.plate.size
    margin = 0.1 * min(sides)
    images = session.references(truth)
    made = list[session.Touched]()

    def take(touch: F64 | None, image: Grey) -> None:
        made.append(session.Touched(len(images), touch))
        images.append(image)

    for one in range(TOUCHES):
        x, y = (float(rng.uniform(margin, side - margin)) for side in sides)
        force = float(rng.uniform(bench.force / 8.0, bench.force))
        take(np.array([x, y, force]), truth.held((fe.Touch(x, y, force),), None, 100 + 2 * one))
        if one % 3 == 2:
            take(None, truth.held((), None, 101 + 2 * one))
    session.write_images(folder, images)
    return made


def _presses(bench: DrawnBench) -> F64:
    """Nine presses, three by three over the plate, of a quarter, a half and all of the force."""
    fractions = session.nine_places() / session.SAID.size
    forces = np.resize(bench.force * np.array([0.25, 0.5, 1.0]), len(fractions))
    return np.column_stack([fractions * bench.plate.size, forces])


def _drawn(rng: np.random.Generator) -> DrawnBench:
    plate, edges, force = _plate(rng)
    long, (width, height) = max(plate.size), _IMAGES[rng.integers(len(_IMAGES))]
    pixel = 1.05 * max(plate.size[0] / width, plate.size[1] / height)  # mm
    scene = _BENCH.format(
        size=list(plate.size),
        thickness=plate.thickness,
        young=plate.young,
        poisson=plate.poisson,
        edges="\n".join(f'{side}.kind = "{edge}"' for side, edge in edges.items()),
        force=[force / 8.0, force],
        pixels=[width, height],
        stand_off=long * rng.uniform(1.5, 2.5),
        side="below" if rng.random() < 0.25 else "above",
    )
    twin = _TWIN.format(
        diameter=pixel * rng.uniform(2.8, 5.0),
        seed=int(rng.integers(1000)),
        noise=rng.uniform(1.0, 4.0),
        departure=_departure(rng, plate, edges),
    )
    return DrawnBench(scene, twin, plate, force)


def _plate(rng: np.random.Generator) -> tuple[fe.Plate, dict[str, str], float]:
    """Draw a plate, its edges, and a force that bends it by a tenth of its thickness or more."""
    long, short = rng.uniform(150.0, 400.0) * np.array([1.0, rng.uniform(0.5, 1.0)])
    size = (float(long), float(short)) if rng.random() < 0.7 else (float(short), float(long))
    young, poisson = _MATERIALS[rng.integers(len(_MATERIALS))]
    edges = dict(zip(_SIDES, _EDGES[rng.integers(len(_EDGES))], strict=True))
    force, ratio = float(rng.choice([2.0, 4.0, 8.0])), _DEEPEST * 12.0 ** -rng.random()
    # The middle of a clamped plate sinks by 0.0056 F b²/D, and w/h = ratio gives h⁴.
    stiff = young / (12.0 * (1.0 - poisson**2))
    thickness = (0.0056 * force * short**2 / (stiff * ratio)) ** 0.25
    thickness = min(float(thickness), _THICKEST * float(short))
    return fe.Plate(size, thickness, young, poisson), edges, force


def _departure(rng: np.random.Generator, plate: fe.Plate, edges: dict[str, str]) -> str:
    """Draw what a bench has that its scene does not say, as lines of a scene."""
    names = [name for name, _ in models.BENCH]
    prior = dict(zip(names, models.bench_before(plate).prior.tolist(), strict=True))
    off = {name: prior[name] * float(rng.normal()) for name in ("young", "thickness")}
    for cause in _CAUSES:
        size = float(rng.integers(2))
        off |= {name: size * prior[name] * float(rng.normal()) for name in cause}
    held = [side for side, edge in edges.items() if edge == "clamped"]
    if len(held) < len(edges):  # such a plate lies flat, and hangs in its two clamps at most
        off |= {"sag": 0.0, "tension_yy": 0.0}
    turned = [float(np.degrees(off[name])) for name in ("turn_x", "turn_y", "turn_z")]
    lines = [
        *(f"{name} = {off[name]}" for name in ("young", "thickness", "sag", "focal", "k1", "k2")),
        f"uneven = {off['thickness_x']}",
        f"tension = {[off['tension_xx'], off['tension_yy']]}",
        f"moved = {[off[name] for name in ('shift_x', 'shift_y', 'shift_z')]}",
        f"turned = {turned}",
    ]
    for side in held:
        springs = (
            ("rotation", abs(off[f"rotation_{side}"])),
            ("membrane", abs(off[f"membrane_{side}"])),
        )
        given = [f"{name} = {1.0 / gives}" for name, gives in springs if gives]
        if given:
            lines.append(f"{side} = {{ {', '.join(given)} }}")
    return "\n".join(lines)


PARTS: dict[str, Part] = {"few": partial(drawn, FEW), "many": partial(drawn, MANY)}

if __name__ == "__main__":
    run(PARTS, __doc__)
