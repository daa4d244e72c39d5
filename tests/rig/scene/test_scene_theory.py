"""What a scene says of linear theory beyond the force that it is good for."""

from dataclasses import dataclass
from math import inf, sqrt

import pytest

import fe
import rig
from rig.scene import shipped
from rig.scene.theory import Theory, choose, largest_force


@dataclass(frozen=True)
class Range:
    """As much of `fe.LinearRange` as is asked for: the error grows with the square of the force."""

    force: float
    error: float
    theory: str = "linear"
    demand: float = 0.1


@pytest.mark.parametrize(("force", "error"), [(2.0, 0.01), (0.5, 0.2), (4.0, 0.05)])
def test_the_limit_is_where_the_error_reaches_what_was_accepted(force, error):
    theory = Theory("linear", Range(force, error), "")
    accepted = max(error, fe.LINEAR_TOLERANCE)
    assert theory.limit == pytest.approx(force * sqrt(accepted / error))
    assert theory.beyond(theory.limit) == ""


def test_beyond_the_limit_the_error_grows_with_the_square_of_the_force():
    theory = Theory("linear", Range(2.0, 0.04), "")
    assert theory.beyond(6.0) == (
        f"6 N is more than linear theory is good for; it is off by {fe.as_percent(0.36)}"
    )


@pytest.mark.parametrize("name", ["linear", "large"])
def test_forces_beyond_what_the_material_bears_are_said_by_either_theory(name):
    theory = Theory(name, Range(2.0, 0.04, name, demand=0.25), "")
    assert theory.overstrained(8.0) == ""
    said = "9.5 N may strain the material to 1.2 times its limit, where the plate yields or breaks"
    assert theory.overstrained(9.5) == f"{said}; press less"
    assert Theory(name, None, "").overstrained(1e9) == ""


@pytest.mark.parametrize("thickness", [0.5, 2.0])
def test_strain_grows_with_the_force_at_most(thickness):
    plate = fe.Plate((254.0, 180.0), thickness, 3000.0, 0.38, strain_limit=0.017)
    little, much = (fe.linear_range(plate, force).demand for force in (2.0, 40.0))
    assert 0.1 * 20.0 * little < much < 20.0 * little


def test_large_theory_has_no_limit_and_a_scene_without_forces_takes_that_of_a_finger():
    assert Theory("large", Range(2.0, 0.4, "large"), "").limit == inf
    assert Theory("linear", None, "").limit == inf
    assert Theory("linear", None, "").force == 5.0


@pytest.mark.parametrize("name", [name for name in shipped() if name.startswith("demo-")])
def test_no_demo_insists_on_a_theory_that_does_not_hold(name):
    scene = rig.load(name)
    assert not choose(scene, scene.plate, largest_force(scene)).against
