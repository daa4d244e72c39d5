"""The strain matrix says what `dic.strain` says, holes and borders included."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import dic


def field(shape, step, lost, seed):
    """Make a displacement field of random numbers, `lost` (R, C) of its points not measured."""
    grid = dic.Grid(10 + step * np.arange(shape[1]), 7 + step * np.arange(shape[0]), 21, step)
    n = lost.size
    u, v = np.where(lost.ravel(), np.nan, np.random.default_rng(seed).normal(0, 1, (2, n)))
    return dic.DisplacementField(
        xy=grid.xy, u=u, v=v, sigma_u=np.ones(n), sigma_v=np.ones(n),
        gradient=np.zeros((n, 2, 2)), sigma_gradient=np.zeros((n, 2, 2)), zncc=np.ones(n),
        iterations=np.ones(n, np.int16), valid_fraction=np.ones(n),
        status=np.where(lost.ravel(), dic.Status.FLAT, dic.Status.OK).astype(np.int8),
        subset=21, order=0, grid=grid,
    )  # fmt: skip


@settings(max_examples=40)
@given(
    st.integers(7, 11), st.integers(7, 11), st.sampled_from([3, 5, 7]),
    st.integers(1, 9), st.floats(0, 0.6), st.integers(0, 10**6),
)  # fmt: skip
def test_it_equals_the_strain_of_the_field(rows, columns, window, step, holes, seed):
    lost = np.random.default_rng(seed).random((rows, columns)) < holes
    disp = field((rows, columns), step, lost, seed)
    eps = dic.strain(disp, window=window)
    operator = dic.strain_operator(~lost, step, window)
    motion = np.nan_to_num(np.column_stack([disp.u, disp.v])).ravel()
    found = (operator @ motion).reshape(-1, 3)
    truth = np.column_stack([eps.exx, eps.eyy, eps.exy])
    np.testing.assert_allclose(found[eps.valid], truth[eps.valid], atol=1e-12)
    empty = np.diff(operator.indptr).reshape(-1, 3) == 0
    np.testing.assert_array_equal(empty, np.tile(~eps.valid[:, None], 3))


def test_a_hole_is_never_read():
    lost = np.zeros((8, 9), dtype=bool)
    lost[3, 4] = True
    operator = dic.strain_operator(~lost, 5.0, 5)
    hole = 3 * 9 + 4
    assert not operator[:, [2 * hole, 2 * hole + 1]].nnz


def test_it_maps_two_displacements_to_three_strains_a_point():
    operator = dic.strain_operator(np.ones((6, 8), dtype=bool), 4.0, 3)
    assert operator.shape == (3 * 48, 2 * 48)
    x, y = (part.ravel() for part in np.meshgrid(4.0 * np.arange(8), 4.0 * np.arange(6)))
    motion = np.column_stack([2e-3 * x + 5e-3 * y, 1e-3 * x - 3e-3 * y]).ravel()
    inner = (operator @ motion).reshape(6, 8, 3)[1:-1, 1:-1]  # corners have too few neighbours
    np.testing.assert_allclose(inner - [2e-3, -3e-3, 3e-3], 0.0, atol=1e-15)


@pytest.mark.parametrize("window", [4, 1, -3])
def test_an_even_or_short_window_is_refused(window):
    with pytest.raises(ValueError, match=f"^strain window must be odd .* got {window}; use 5$"):
        dic.strain_operator(np.ones((6, 8), dtype=bool), 4.0, window)
