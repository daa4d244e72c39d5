"""Displacements with known strain: gradients, strains, and the laws that they come from."""

import numpy as np
import pytest

import synthetic
from synthetic import closed_forms

FORMULAS = [
    closed_forms.Uniform(((0.5, 0.1), (-0.2, -0.3)), about=(3.0, 4.0), shift=(0.1, -0.2)),
    closed_forms.rotation(np.radians(170), about=(30.0, 20.0)),
    closed_forms.Polynomial([[0.0, 0.1, 2e-3], [0.2, 1e-3, 0.0]], [[0.3, -0.1]], about=(5.0, 2.0)),
    closed_forms.Wave((0.3, -0.1), (1 / 20, 1 / 33), phase=0.4),
    closed_forms.Star(amplitude=0.5, first=10.0, period_slope=0.3, middle=20.0),
    closed_forms.Hole(radius=6.0, centre=(31.0, 18.0), strain=1e-3, poisson=0.35),
]
POINTS = np.random.default_rng(0).uniform((1, 1), (60, 40), (200, 2))
POINTS = POINTS[np.hypot(*(POINTS - (31.0, 18.0)).T) > 6.1]


@pytest.mark.parametrize("formula", FORMULAS, ids=lambda formula: type(formula).__name__)
def test_the_gradient_is_the_derivative_of_the_displacement(formula):
    h = 1e-4
    steps = [(h, 0.0), (0.0, h)]
    slopes = [
        (formula(POINTS + step) - formula(POINTS - np.array(step))) / (2 * h) for step in steps
    ]
    assert np.allclose(formula.gradient(POINTS), np.stack(slopes, axis=-1)[:, :2], atol=1e-6)
    assert np.all(formula(POINTS)[:, 2] == 0)


def test_a_stretch_of_half_has_the_strains_of_each_definition():
    stretch = closed_forms.Uniform(((0.5, 0.0), (0.0, -0.2)))
    for kind, expected in {
        "small": (0.5, -0.2, 0.0),
        "green-lagrange": ((1.5**2 - 1) / 2, (0.8**2 - 1) / 2, 0.0),
        "logarithmic": (np.log(1.5), np.log(0.8), 0.0),
    }.items():
        assert np.allclose(closed_forms.strain_of(stretch, [[3.0, 4.0]], kind), [expected])


def test_rotation_strains_nothing_and_shear_is_half_of_its_angle():
    turned = closed_forms.rotation(2.5, about=(10.0, 5.0))
    assert np.allclose(closed_forms.strain_of(turned, POINTS, "green-lagrange"), 0, atol=1e-15)
    assert np.allclose(turned(np.array([[10.0, 5.0]])), 0)
    quarter = closed_forms.rotation(np.pi / 2, about=(10.0, 5.0))(np.array([[13.0, 5.0]]))
    assert np.allclose(quarter, [[-3.0, 3.0, 0.0]])  # from x towards y
    sheared = closed_forms.Uniform(((0.0, 0.02), (0.0, 0.0)))
    assert np.allclose(closed_forms.strain_of(sheared, [[1.0, 2.0]]), [[0.0, 0.0, 0.01]])


def stress(hole, points):
    """Stress over Young's modulus from strain, by Hooke's law in plane stress."""
    exx, eyy, exy = closed_forms.strain_of(hole, points).T
    nu = hole.poisson
    return np.array([exx + nu * eyy, eyy + nu * exx, (1 - nu) * exy]) / (1 - nu**2)


def test_the_rim_of_a_hole_is_free_and_carries_three_times_the_stress_at_its_sides():
    hole = FORMULAS[-1]
    angle = np.linspace(0, 2 * np.pi, 37)
    c, s = np.cos(angle), np.sin(angle)
    sx, sy, t = (
        stress(hole, hole.centre + 6.0 * (1 + 1e-12) * np.column_stack([c, s])) / hole.strain
    )
    assert np.allclose(sx * c * c + 2 * t * s * c + sy * s * s, 0, atol=1e-9)
    assert np.allclose((sy - sx) * s * c + t * (c * c - s * s), 0, atol=1e-9)
    around = sx * s * s - 2 * t * s * c + sy * c * c
    assert np.allclose(around, 1 - 2 * np.cos(2 * angle), atol=1e-9)


def test_far_from_a_hole_the_plate_is_pulled_evenly():
    far = stress(FORMULAS[-1], [[5e5, 2e5], [-3e5, 6e5]]) / 1e-3
    assert np.allclose(far.T, [1.0, 0.0, 0.0], atol=1e-6)


def test_there_is_no_strain_inside_a_hole_and_its_displacement_is_that_of_the_rim():
    hole, inside = FORMULAS[-1], np.array([[31.0, 18.0], [33.0, 18.0]])
    assert np.isnan(closed_forms.strain_of(hole, inside)).all()
    assert np.allclose(hole(inside), hole(np.array([[37.0, 18.0]])))


def test_a_formula_is_a_displacement_to_render():
    pattern = synthetic.Speckle((60.0, 40.0)).draw()
    camera = synthetic.telecentric_above((60.0, 40.0), (120, 80))
    turned = closed_forms.rotation(np.radians(180), about=(30.0, 20.0))
    rest, moved = (synthetic.render(pattern, camera, u, None, None) for u in (None, turned))
    assert np.allclose(moved, rest[::-1, ::-1], atol=1e-6)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: closed_forms.Polynomial([1.0], [[1.0]]), "coefficients u must be finite"),
        (lambda: closed_forms.Hole(0.0, (0.0, 0.0), 1e-3), "radius of the hole must be positive"),
        (lambda: closed_forms.strain_of(FORMULAS[0], [1.0, 2.0]), "points must have shape"),
    ],
)
def test_bad_input_is_named_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()
