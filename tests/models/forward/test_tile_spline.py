"""Smooth fields over tiles: exact for what is linear, close for modes, with an exact adjoint."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from models.forward.tile_spline import spread_over

SHAPES = [(30, 38), (12, 7), (4, 9), (2, 5), (1, 3), (1, 1)]


def places(shape):
    """Row and column of every tile, (T, 2)."""
    return np.stack(np.indices(shape, dtype=float), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("shape", SHAPES)
def test_linear_fields_are_exact(shape):
    spread, (row, column) = spread_over(shape), places(shape).T
    field = np.column_stack([np.ones_like(row), row, column, 3 + 2 * row - 0.7 * column])
    np.testing.assert_allclose(spread.over_tiles(spread.fit(field)), field, atol=1e-9)


@pytest.mark.parametrize("shape", SHAPES[:3])
def test_bicubic_fields_are_exact(shape):
    spread, (row, column) = spread_over(shape), places(shape).T / 10
    field = (row**3 * column**3 - row**2 * column + 1)[:, None]
    np.testing.assert_allclose(spread.over_tiles(spread.fit(field)), field, atol=1e-8)


def test_waves_of_fifteen_tiles_are_within_a_thousandth():
    shape = (31, 40)
    row, column = places(shape).T
    field = (np.sin(2 * np.pi * row / 15) * np.cos(2 * np.pi * column / 15 + 0.3))[:, None]
    spread = spread_over(shape)
    missed = spread.over_tiles(spread.fit(field)) - field
    assert missed.std() < 1e-3 * field.std()


def test_a_quarter_as_many_numbers_carry_a_field():
    spread = spread_over((40, 60))
    assert spread.down.shape[1] * spread.across.shape[1] < 40 * 60 / 3


@pytest.mark.parametrize("shape", SHAPES[:3])
def test_slopes_of_bicubic_fields_are_exact(shape):
    spread, (row, column) = spread_over(shape), places(shape).T
    coefficients = spread.fit((row**2 * column - 3 * column**3)[:, None])
    along_x, along_y = spread.slopes(coefficients)
    np.testing.assert_allclose(along_x[:, 0], row**2 - 9 * column**2, atol=1e-6)
    np.testing.assert_allclose(along_y[:, 0], 2 * row * column, atol=1e-6)


@settings(max_examples=30)
@given(st.integers(1, 14), st.integers(1, 14), st.integers(1, 3), st.integers(0, 10**6))
def test_to_gather_is_the_adjoint_of_to_spread(rows, columns, fields, seed):
    spread, rng = spread_over((rows, columns)), np.random.default_rng(seed)
    coefficients = rng.normal(size=(spread.down.shape[1] * spread.across.shape[1], fields))
    values, others = rng.normal(size=(2, rows * columns, fields))
    there = (spread.over_tiles(coefficients) * values).sum()
    assert there == pytest.approx((coefficients * spread.project(values)).sum(), abs=1e-9)
    along_x, along_y = spread.slopes(coefficients)
    there = (along_x * values + along_y * others).sum()
    back = (coefficients * spread.project_slopes(values, others)).sum()
    assert there == pytest.approx(back, abs=1e-9)


def test_splines_add_up_to_one_and_are_not_negative():
    # So that the largest coefficient bounds the field.
    for matrix in (spread_over((13, 24)).down, spread_over((13, 24)).across):
        np.testing.assert_allclose(matrix.sum(axis=1), 1.0)
        assert (matrix >= 0).all()
