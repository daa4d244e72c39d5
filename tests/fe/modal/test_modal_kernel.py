"""The compiled sums over products against NumPy's, which are of double precision."""

import numpy as np

from fe.modal.kernel import pulls, summed


def test_products_are_summed_to_single_precision():
    rng = np.random.default_rng(2)
    halves = rng.normal(size=(11, 17, 17))
    products = halves + halves.swapaxes(1, 2)
    weights, stress = rng.normal(size=17), rng.normal(size=6)
    single = products.astype(np.float32)
    np.testing.assert_allclose(pulls(single, weights, 3, 9), products[3:9] @ weights, atol=1e-5)
    packed = np.ascontiguousarray(single[:6, *np.tril_indices(17)])
    np.testing.assert_allclose(
        summed(packed, stress), np.tensordot(stress, products[:6], 1), atol=1e-5
    )
