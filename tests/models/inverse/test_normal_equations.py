"""Small normal equations are solved as by LAPACK, and stay finite where nothing is known."""

import numpy as np
import pytest

from models.inverse import normal_equations


def drawn(rng, size):
    """Draw a matrix (size, size) of a Fisher matrix's kind, with scales of many decades."""
    jacobian = rng.normal(size=(size, 40)) * 10.0 ** rng.uniform(-3, 3, (size, 1))
    return jacobian @ jacobian.T


@pytest.mark.parametrize("size", [3, 6, 12])
def test_a_damped_step_solves_its_equations(size):
    rng = np.random.default_rng(size)
    matrix, slope = drawn(rng, size), rng.normal(size=size)
    step = normal_equations.damped_step(matrix, slope, np.zeros(size, dtype=bool), 0.1)
    damped = matrix + 0.1 * np.diag(np.diag(matrix))
    np.testing.assert_allclose(step, np.linalg.solve(damped, slope), rtol=1e-9)


def test_what_is_held_does_not_bend_the_step_of_others():
    rng = np.random.default_rng(1)
    matrix, slope, held = drawn(rng, 6), rng.normal(size=6), np.arange(6) == 2
    step = normal_equations.damped_step(matrix, slope, held, 0.0)
    assert step[2] == 0
    free = np.linalg.solve(matrix[~held][:, ~held], slope[~held])
    np.testing.assert_allclose(step[~held], free, rtol=1e-9)


def test_what_is_not_measured_takes_no_step():
    matrix = np.diag([2.0, 0.0, 4.0])
    step = normal_equations.damped_step(
        matrix, np.array([2.0, 0.0, 2.0]), np.zeros(3, dtype=bool), 0.0
    )
    np.testing.assert_allclose(step, [1.0, 0.0, 0.5], rtol=1e-15)


def test_an_inverse_is_that_of_lapack():
    correlations = np.asarray(np.corrcoef(np.random.default_rng(2).normal(size=(9, 30))))
    inverse = normal_equations.inverse(correlations, 1e-14)
    np.testing.assert_allclose(inverse, np.linalg.inv(correlations), rtol=1e-9, atol=1e-12)


def test_the_inverse_of_what_cannot_be_separated_is_huge_and_finite():
    inverse = normal_equations.inverse(
        np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), 1e-14
    )
    assert inverse[0, 0] == pytest.approx(0.5e14, rel=1e-3)
    assert inverse[2, 2] == pytest.approx(1.0)


def test_a_step_ends_at_the_bounds_and_is_held_there():
    bounds = np.array([[1.0, 1.0, 0.0], [9.0, 9.0, np.inf]])
    touches = np.array([[2.0, 8.0, 1.0]])
    after = normal_equations.clipped_step(touches, np.array([-5.0, 5.0, -3.0]), bounds)
    np.testing.assert_array_equal(after, [[1.0, 9.0, 0.0]])
    np.testing.assert_array_equal(
        normal_equations.active_bounds(after, np.array([-1.0, -1.0, -1.0]), bounds),
        [True, False, True],
    )
