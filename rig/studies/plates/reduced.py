"""Print what the reduced plate costs and how far it is from the shell on a finer mesh.

Usage: ``python benchmarks/reduced_bars.py [SHELL_ELEMENTS [STATES [TIMES]]]``: elements of the
shell along a side, single touches (pairs are a quarter as many), and readings that are timed.

The plate is PVC, 254 x 254 x 1 mm, with four and with two clamped edges. Touches of up to 5 N press
at least 25 mm inside: in the corners and at the middles of that square, and evenly over it. Strain
is that of 72 points on a ring 5 mm inside the edges; its error is the root of the sum of squares
over the ring, in parts of the same of the strain. The error of the deflection is the largest on a
grid and under the touches, in parts of the largest deflection, and that in the plane is in µm.
Times are of the processor, on one core.
"""

import itertools
import resource
import sys
import time

import numpy as np

import fe

SHELL_ELEMENTS, STATES, TIMES = 60, 36, 200
INSIDE, RING = 25.0, 5.0
SIDE = 254.0
FORCES = (0.1, 0.3, 0.7, 1.5, 3.0, 5.0)
RATIOS = (0.0, 1.3, 3.5, 10.0)  # w/h between which errors are gathered
C, F = fe.Clamped(), fe.Free()
EDGES = {"four clamped edges": C, "two clamped edges": fe.Edges(C, C, F, F)}


def ring():
    """72 points 5 mm inside the edges, (72, 2) mm."""
    s = np.linspace(RING, SIDE - RING, 19)
    low, high = np.full(18, RING), np.full(18, SIDE - RING)
    sides = [(s[:-1], low), (high, s[:-1]), (s[1:], high), (low, s[1:])]
    return np.concatenate([np.column_stack(side) for side in sides])


def field():
    """Grid of points over the plate, (121, 2) mm."""
    s = np.linspace(0.0, SIDE, 13)[1:-1]
    return np.stack(np.meshgrid(s, s), axis=-1).reshape(-1, 2)


def scenes(states):
    """Touches: the worst places under the largest force, then a spread, then pairs."""
    rng = np.random.default_rng(1)
    near, middle, far = INSIDE, SIDE / 2, SIDE - INSIDE
    worst = [(near, near), (near, middle), (middle, near), (middle, middle), (near, far)]
    single = [[fe.Touch(x, y, FORCES[-1])] for x, y in worst]
    for k in range(states - len(worst)):
        x, y = rng.uniform(near, far, 2)
        single.append([fe.Touch(x, y, FORCES[k % len(FORCES)])])
    pairs = []
    for k in range(states // 4):
        (x0, y0), (x1, y1) = rng.uniform(near, far, (2, 2))
        force = FORCES[2 + k % 4]
        pairs.append([fe.Touch(x0, y0, force), fe.Touch(x1, y1, 0.7 * force)])
    return single + pairs


def errors(shell, touches, gauges, points):
    """w/h of the shell, and errors of strain, deflection and motion in the plane; None if lost."""
    state = shell.rest.touch(touches)
    if state.stability.verdict is not fe.Verdict.STABLE:
        return None
    xy = np.array([(t.x, t.y) for t in touches])
    force = np.array([t.force for t in touches])
    strain, moved = state.strain(ring()), state.displacement(field())
    deep = np.abs(np.concatenate([state.deflection(xy), moved[:, 2]])).max()
    under = points.reduced.solve(touches).deflection(xy) - state.deflection(xy)
    off = points.read(xy, force).values - moved
    return (
        deep / shell.plate.thickness,
        np.linalg.norm(gauges.read(xy, force).values - strain) / np.linalg.norm(strain),
        np.abs(np.concatenate([under, off[:, 2]])).max() / deep,
        1e3 * np.abs(off[:, :2]).max(),
    )


def print_accuracy(reduced, elements, states):
    """One row for each class of w/h, of single touches and of pairs."""
    shell = fe.Shell(reduced.plate, fe.Mesh(reduced.plate.size, (elements, elements)))
    gauges, points = reduced.gauges(ring()), reduced.points(field())
    rows = {1: [], 2: []}
    for touches in scenes(states):
        if found := errors(shell, touches, gauges, points):
            rows[len(touches)].append(found)
        else:
            print(f"the shell found no stable state under {touches}")
    print("at once  w/h         states  ring strain median, worst  w median, worst  plane worst")
    for touches, found in rows.items():
        table = np.array(found).reshape(-1, 4)
        for low, high in itertools.pairwise(RATIOS):
            part = table[(table[:, 0] > low) & (table[:, 0] <= high)]
            if len(part):
                middle, worst = np.median(part, axis=0), part.max(axis=0)
                print(
                    f"{touches:4d}   {low:4.1f} to {high:4.1f} {len(part):8d}"
                    f"{100 * middle[1]:14.2f} %{100 * worst[1]:8.2f} %"
                    f"{100 * middle[2]:10.2f} %{100 * worst[2]:5.2f} %{worst[3]:8.1f} µm",
                    flush=True,
                )


def print_times(reduced, times):
    """Time of values and Jacobian of the ring, for touches anywhere."""
    gauges, rng = reduced.gauges(ring()), np.random.default_rng(2)
    for count in (1, 2):
        for force in (0.5, 5.0):
            taken = []
            for _ in range(times + 2):
                xy = rng.uniform(INSIDE, SIDE - INSIDE, (count, 2))
                began = time.process_time_ns()
                gauges.read(xy, np.full(count, force))
                taken.append((time.process_time_ns() - began) * 1e-6)
            low, middle, high = np.percentile(taken[2:], [5, 50, 95])
            print(
                f"solve and Jacobian, {count} at once of {force:g} N: {middle:.2f} ms "
                f"({low:.2f} to {high:.2f} in nine of ten)"
            )


def jacobian_error(reduced):
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

                def value(far, touch=touch, axis=axis, start=start, view=view):
                    moved = start.copy()
                    moved[touch, axis] += far * step
                    return view.read(moved[:, :2], moved[:, 2]).values

                near, far = value(1) - value(-1), value(2) - value(-2)
                difference = (8 * near - far) / (12 * step)
                error = np.abs(exact[..., touch, axis] - difference).max()
                worst = max(worst, error / np.abs(difference).max())
    return worst


def main(elements, states, times):
    """Print one block for each way of holding the plate."""
    for name, edges in EDGES.items():
        plate = fe.Plate((SIDE, SIDE), thickness=1.0, young=3000.0, poisson=0.38, edges=edges)
        began = time.process_time()
        reduced = fe.reduce(plate)
        taken = time.process_time() - began
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        stored = sum(array.nbytes for array in reduced.arrays().values()) / 2**20
        print(f"{name}: built in {taken:.0f} s of the processor, {peak:.0f} MB at most", end="")
        print(f", {stored:.0f} MB stored")
        print_times(reduced, times)
        print(f"Jacobian against differences: {jacobian_error(reduced):.1e}")
        print(f"against the shell on {elements} x {elements} elements", flush=True)
        print_accuracy(reduced, elements, states)


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    defaults = (SHELL_ELEMENTS, STATES, TIMES)
    main(*given, *defaults[len(given) :])
