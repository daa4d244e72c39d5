"""The study of a GPU: its row of a net on torch's CPU, which any machine has."""

import numpy as np
import pytest

from rig.studies.correlation.gpu import NETS, Size, net_rate

pytest.importorskip("torch")


@pytest.mark.parametrize("name", NETS)
def test_a_net_is_timed_and_compared_with_the_truth(name):
    rate = net_rate(name, Size(160, 8), "cpu")
    assert rate.seconds > 0
    assert rate.error < 0.01  # px
    per_second = [figure.value for figure in rate.figures(Size(160, 8))][:2]
    assert np.allclose(per_second, np.array([1e-6 * rate.points, 1.0]) / rate.seconds)
