"""The compiled sums over products against NumPy's, which are of double precision."""

import numpy as np
import pytest

from fe.modal.kernel import pulls, summed


@pytest.mark.parametrize("size", [1, 2, 17, 18])
def test_products_are_summed_to_single_precision(size: int):
    rng = np.random.default_rng(size)
    halves = rng.normal(size=(11, size, size))
    products = halves + halves.swapaxes(1, 2)
    weights, stress = rng.normal(size=size), rng.normal(size=6)
    rows, columns = np.tril_indices(size)
    packed = products[:, rows, columns].astype(np.float32)
    np.testing.assert_allclose(pulls(packed, weights, 3, 9), products[3:9] @ weights, atol=1e-5)
    np.testing.assert_allclose(
        summed(packed, stress), np.tensordot(stress, products[:6], 1), atol=1e-5
    )
