"""The reduced plate against the shell: another theory, another solver, a finer mesh.

`python -m rig.studies.plates.reduced` does the same on the default mesh over many touches.
"""

import numpy as np
import pytest

import fe

C, F = fe.Clamped(), fe.Free()
SIDE, RIM = 254.0, 25.4
EDGES = {"four": C, "two": fe.Edges(C, C, F, F)}


def mesh(elements):
    """Elements along a side, six of them in each rim."""
    breaks = (RIM, SIDE - RIM)
    return fe.Mesh((SIDE, SIDE), (elements, elements), (breaks, breaks))


def ring():
    """Forty points 5 mm inside the edges."""
    s = np.linspace(5.0, SIDE - 5.0, 11)
    low, high = np.full(10, 5.0), np.full(10, SIDE - 5.0)
    sides = [(s[:-1], low), (high, s[:-1]), (s[1:], high), (low, s[1:])]
    return np.concatenate([np.column_stack(side) for side in sides])


@pytest.mark.slow
@pytest.mark.parametrize("edges", EDGES.values(), ids=EDGES.keys())
def test_strain_and_displacement_are_those_of_the_shell(edges):
    """Measured: 0.9 % and 3.0 % with four and two edges clamped; 2.4e-3 of the displacement."""
    plate = fe.Plate((SIDE, SIDE), thickness=1.0, young=3000.0, poisson=0.38, edges=edges)
    reduced = fe.reduced_plate(plate, mesh(24))
    shell, at = fe.Shell(plate, mesh(36)), np.array([[60.0, 90.0], [127.0, 140.0], [200.0, 61.0]])
    for touches in (
        [fe.Touch(127.0, 127.0, 5.0)],
        [fe.Touch(41.0, 203.0, 5.0)],
        [fe.Touch(88.0, 70.0, 3.0), fe.Touch(170.0, 151.0, 2.0)],
    ):
        true, found = shell.undeformed.touch(touches), reduced.solve(touches)
        assert true.stability.verdict is fe.Verdict.STABLE
        assert found.result is fe.Trust.TRAINED
        strain, moved = true.strain(ring()), true.displacement(at)
        of_strain = np.linalg.norm(found.strain(ring()) - strain) / np.linalg.norm(strain)
        of_motion = np.abs(found.displacement(at) - moved).max() / np.abs(moved).max()
        assert of_strain < 0.04
        assert of_motion < 0.005


@pytest.mark.slow
def test_a_bowed_plate_colder_than_its_frame_bends_as_the_shell_does():
    """Measured: 1.0 % of the strain and 5e-4 of the displacement."""
    even = 3000.0 * 1e-4 / (1 - 0.38)
    plate = fe.Plate(
        (SIDE, 200.0), 1.0, 3000.0, 0.38, tension=(even, even, 0.0), shape=fe.Shape(0.5)
    )
    reduced = fe.reduced_plate(plate, fe.grid(plate, 28))
    shell, at = fe.Shell(plate, fe.grid(plate, 36)), np.array([[60.0, 90.0], [127.0, 120.0]])
    gauges = np.array([[5.0, 60.0], [120.0, 5.0], [249.0, 130.0], [60.0, 195.0], [80.0, 50.0]])
    for touches in ([fe.Touch(127.0, 107.0, 5.0)], [fe.Touch(51.0, 143.0, 1.0)]):
        true, found = shell.undeformed.touch(touches), reduced.solve(touches)
        assert true.stability.verdict is fe.Verdict.STABLE
        assert found.result is fe.Trust.TRAINED
        strain, moved = true.strain(gauges), true.displacement(at)
        of_strain = np.linalg.norm(found.strain(gauges) - strain) / np.linalg.norm(strain)
        of_motion = np.abs(found.displacement(at) - moved).max() / np.abs(moved).max()
        assert of_strain < 0.04
        assert of_motion < 0.005
