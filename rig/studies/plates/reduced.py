"""What the reduced plate costs, and how far it is from the shell on a finer mesh.

Parts: built (what it costs to make three plates, each in a process of its own, on two cores), four,
two: PVC, 254 x 254 x 1 mm, with so many clamped edges. Touches of up to 5 N press at
least 25 mm inside: in the corners and at the middles of that square, and evenly over it. Strain is
that of 72 points on a ring 5 mm inside the edges; its error is the root of the sum of squares over
the ring, in parts of the same of the strain. The error of the deflection is the largest on a grid
and under the touches, in parts of the largest deflection, and that in the plane is in µm. Times are
of the processor, on one core.
"""

import itertools
import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

import fe
from rig.report.figure import Bar, Figure, at_most
from rig.studies.study import line, run, timed, times

SHELL_ELEMENTS = 60  # of the shell, along a side
STATES = 36  # single touches; pairs are a quarter as many
TIMES = 200  # readings that are timed
INSIDE, RING = 25.0, 5.0  # mm
SIDE = 254.0  # mm
FORCES = (0.1, 0.3, 0.7, 1.5, 3.0, 5.0)  # N
RATIOS = (0.0, 1.3, 3.5, 10.0)
"""w/h between which errors are gathered; what is asked ends at the third."""
WORST = {1.3: (at_most(2.0), at_most(0.5)), 3.5: (at_most(5.0), at_most(1.0))}
"""By the end of a class, bars of the worst strain of a ring and of the worst deflection, %."""
SEEN = 2.0  # w/h to which the camera's view of motion in the plane is asked for
MEDIAN = at_most(1.0)  # % of the ring's strain
SOLVE = {1: at_most(2.0), 2: at_most(10.0)}  # ms, by touches at once
C, F = fe.Clamped(), fe.Free()
EDGES = {"four": C, "two": fe.Edges(C, C, F, F)}


def ring() -> NDArray[np.float64]:
    """72 points 5 mm inside the edges, (72, 2) mm."""
    s = np.linspace(RING, SIDE - RING, 19)
    low, high = np.full(18, RING), np.full(18, SIDE - RING)
    sides = [(s[:-1], low), (high, s[:-1]), (s[1:], high), (low, s[1:])]
    return np.concatenate([np.column_stack(side) for side in sides])


def field() -> NDArray[np.float64]:
    """Grid of points over the plate, (121, 2) mm."""
    s = np.linspace(0.0, SIDE, 13)[1:-1]
    return np.stack(np.meshgrid(s, s), axis=-1).reshape(-1, 2)


def scenes(states: int) -> list[list[fe.Touch]]:
    """Touches: the worst places under the largest force, then a spread, then pairs."""
    rng = np.random.default_rng(1)
    near, middle, far = INSIDE, SIDE / 2, SIDE - INSIDE
    worst = [(near, near), (near, middle), (middle, near), (middle, middle), (near, far)]
    single = [[fe.Touch(x, y, FORCES[-1])] for x, y in worst]
    for k in range(states - len(worst)):
        x, y = rng.uniform(near, far, 2)
        single.append([fe.Touch(x, y, FORCES[k % len(FORCES)])])
    pairs: list[list[fe.Touch]] = []
    for k in range(states // 4):
        (x0, y0), (x1, y1) = rng.uniform(near, far, (2, 2))
        force = FORCES[2 + k % 4]
        pairs.append([fe.Touch(x0, y0, force), fe.Touch(x1, y1, 0.7 * force)])
    return single + pairs


def errors(
    shell: fe.Shell, touches: list[fe.Touch], gauges: fe.ReducedReadings, points: fe.ReducedReadings
) -> tuple[float, float, float, float, float] | None:
    """w/h of the shell, errors of strain, deflection and motion in the plane; None if lost.

    That in the plane of the face twice: in µm, and in parts of the largest there.
    """
    state = shell.undeformed.touch(touches)
    if state.stability.verdict is not fe.Verdict.STABLE:
        return None
    xy = np.array([(t.x, t.y) for t in touches])
    force = np.array([t.force for t in touches])
    strain, moved = state.strain(ring()), state.displacement(field())
    deep = float(np.abs(np.concatenate([state.deflection(xy), moved[:, 2]])).max())
    under = points.reduced.solve(touches).deflection(xy) - state.deflection(xy)
    off = points.read(xy, force).values - moved
    along = np.abs(moved[:, :2]).max()
    return (
        deep / shell.plate.thickness,
        float(np.linalg.norm(gauges.read(xy, force).values - strain) / np.linalg.norm(strain)),
        float(np.abs(np.concatenate([under, off[:, 2]])).max() / deep),
        1e3 * float(np.abs(off[:, :2]).max()),
        float(np.abs(off[:, :2]).max() / along),
    )


def accuracy(name: str, reduced: fe.Reduced) -> Iterator[Figure]:
    """Make a line for each class of w/h, of single touches and of pairs."""
    shell = fe.Shell(reduced.plate, fe.Mesh(reduced.plate.size, (SHELL_ELEMENTS, SHELL_ELEMENTS)))
    gauges, points = reduced.gauges(ring()), reduced.points(field())
    found: dict[int, list[tuple[float, ...]]] = {1: [], 2: []}
    for touches in scenes(STATES):
        if error := errors(shell, touches, gauges, points):
            found[len(touches)].append(error)
    for count, rows in found.items():
        table = np.array(rows).reshape(-1, 5)
        for low, high in itertools.pairwise(RATIOS):
            part = table[(table[:, 0] > low) & (table[:, 0] <= high)]
            if len(part):
                yield from _class(name, f"{count} at once, w/h {low:g} to {high:g}", part, high)
    every = np.array([row for rows in found.values() for row in rows])
    small = 100.0 * every[every[:, 0] <= SEEN, 4]
    yield from line(
        "Reduced plate: motion in the plane",
        f"reduced plate, motion in the plane to w/h {SEEN:g}, {name} edges clamped",
        error=(float(small.max()), "%", at_most(2.0), len(small)),
        median=(float(np.median(small)), "%", None, len(small)),
    )


def _class(name: str, case: str, part: NDArray[np.float64], high: float) -> Iterator[Figure]:
    (_, middle, *_), (_, strain, w, plane, _) = np.median(part, axis=0), part.max(axis=0)
    median: Bar | None = MEDIAN if high in WORST else None
    worst, deflection = WORST.get(high, (None, None))
    return line(
        f"Reduced plate, {name} edges clamped, against the shell on {SHELL_ELEMENTS}²",
        case,
        ring_strain_median=(100 * middle, "%", median, len(part)),
        ring_strain_worst=(100 * strain, "%", worst, len(part)),
        w_worst=(100 * w, "%", deflection, len(part)),
        in_the_plane_worst=(plane, "µm"),
    )


def cost(name: str, reduced: fe.Reduced) -> Iterator[Figure]:
    """Time of values and Jacobian of the ring, for touches anywhere."""
    gauges, rng = reduced.gauges(ring()), np.random.default_rng(2)
    for count in (1, 2):
        for force in (0.5, 5.0):
            taken: list[float] = []
            for _ in range(TIMES + 2):
                xy = rng.uniform(INSIDE, SIDE - INSIDE, (count, 2))
                read = partial(gauges.read, xy, np.full(count, force))
                taken.append(timed(read)[1])
            yield from line(
                f"Reduced plate, {name} edges clamped: values and Jacobian of 72 gauges",
                f"{count} at once of {force:g} N",
                **times(taken[2:], SOLVE[count]),
            )


def jacobian_error(reduced: fe.Reduced) -> float:
    """Largest difference of the Jacobian from differences of fourth order, in parts of itself."""
    worst, step, rng = 0.0, 0.01, np.random.default_rng(3)
    for view in (reduced.gauges(ring()), reduced.points(field())):
        for count in (1, 2):
            # Places that no step takes over a line of the mesh, where third derivatives jump.
            nodes = [0.5 * (n[1:] + n[:-1]) for n in reduced.mesh.nodes]
            places = [rng.choice(n[6:-6], count, replace=False) for n in nodes]
            start = np.column_stack([*places, rng.uniform(1.0, 5.0, count)])
            exact = view.read(start[:, :2], start[:, 2]).jacobian
            for touch, axis in np.ndindex(count, 3):

                def value(
                    far: int,
                    touch: int = touch,
                    axis: int = axis,
                    start: NDArray[np.float64] = start,
                    view: fe.ReducedReadings = view,
                ) -> NDArray[np.float64]:
                    moved = start.copy()
                    moved[touch, axis] += far * step
                    return view.read(moved[:, :2], moved[:, 2]).values

                near, far = value(1) - value(-1), value(2) - value(-2)
                difference = (8 * near - far) / (12 * step)
                error = np.abs(exact[..., touch, axis] - difference).max()
                worst = max(worst, float(error / np.abs(difference).max()))
    return worst


def plate(name: str) -> Iterator[Figure]:
    """Build, time and compare a plate that is held in one way."""
    made = fe.Plate((SIDE, SIDE), thickness=1.0, young=3000.0, poisson=0.38, edges=EDGES[name])
    began = time.process_time()
    reduced = fe.reduced_plate(made)
    taken = time.process_time() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    stored = sum(array.nbytes for array in reduced.arrays().values()) / 2**20
    yield from line(
        "Reduced plate: what it costs to build",
        f"{name} edges clamped",
        time=(taken, "CPU s"),
        memory=(peak, "MB"),
        stored=(stored, "MB"),
    )
    yield from cost(name, reduced)
    yield from line(
        "Reduced plate: Jacobian against differences of fourth order",
        f"{name} edges clamped",
        worst=(jacobian_error(reduced), "relative", at_most(1e-6)),
    )
    yield from accuracy(name, reduced)


BUILT = {
    "four": (
        "building it, square, four edges clamped, two cores",
        "(254.0, 254.0), 1.0, 3000.0, 0.38",
        10.0,
    ),
    "two": (
        "building it, two edges clamped, two cores",
        "(254.0, 254.0), 1.0, 3000.0, 0.38, fe.Edges(c, c, f, f)",
        20.0,
    ),
    "mixed": (
        "building it, 254 × 180 mm, mixed edges, two cores",
        "(254.0, 180.0), 1.0, 3000.0, 0.38, mixed",
        40.0,
    ),
}
MADE = """
import json, re, time
began = time.time()
import fe
c, f, s = fe.Clamped(), fe.Free(), fe.Supported()
two = fe.Edges(c, c, f, f)
mixed = fe.Edges(c, s, fe.Elastic(5.0, 200.0, 50.0), f)
said = [began]
fe.reduced_plate(fe.Plate({plate}), progress=lambda done, total: said.append(time.time()))
said.append(time.time())
peak = re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1]
silence = max(after - before for before, after in zip(said, said[1:]))
spent = time.time() - began, time.process_time()
print(json.dumps([*spent, int(peak) / 1e3, silence, len(said) - 2]))
"""


def built() -> Iterator[Figure]:
    """Make reduced plates from nothing but compiled kernels."""
    for case, numbers, limit in BUILT.values():
        made = [sys.executable, "-c", MADE.format(plate=numbers)]
        done = subprocess.run(made, capture_output=True, text=True, check=True)
        wall, spent, memory, silence, steps = json.loads(done.stdout)
        yield from line(
            "Reduced plate: made from nothing on two cores",
            case,
            time=(wall, "s", at_most(limit)),
            of_the_processor=(spent, "CPU s"),
            memory=(memory, "MB", at_most(600.0)),
            longest_silence=(silence, "s"),
            steps=(steps, ""),
        )


PARTS = {"built": built} | {name: partial(plate, name) for name in EDGES}

if __name__ == "__main__":
    run(PARTS, __doc__)
