"""A few solver steps from a start that is nearly right."""

import numpy as np
import pytest

import fe
import models
from models.nets.refine import refine

SIZE = (60.0, 40.0)
PLATE = fe.Plate(SIZE, 1.0, 3000.0, 0.3)
GAUGES = np.array(
    [[5.0, 20.0], [30.0, 5.0], [55.0, 20.0], [30.0, 35.0], [10.0, 10.0], [50.0, 30.0]]
)
INFLUENCE = fe.influence(PLATE, GAUGES, fe.Mesh(SIZE, (30, 20)))
FORWARD = models.gauge_forward(INFLUENCE, 1e-7)
TOUCHES = np.array([[20.0, 15.0, 2.0], [42.0, 27.0, 1.5]])


@pytest.mark.parametrize("count", [1, 2])
def test_steps_close_in_quadratically_on_exact_strains(count):
    truth = TOUCHES[:count]
    measured = FORWARD.read(truth)[0]
    start = truth + np.array([0.3, -0.2, 0.05])
    errors = [np.abs(refine(measured, FORWARD, start, steps) - truth).max() for steps in range(5)]
    assert errors[0] == pytest.approx(0.3)
    assert errors[2] < 0.02
    assert errors[4] < 1e-6


def test_a_step_that_leads_off_the_plate_ends_at_its_edge():
    measured = FORWARD.read(TOUCHES[:1])[0]
    places = refine(measured, FORWARD, [[58.0, 38.0, 40.0]], steps=3)[:, :2]
    assert np.all((places >= 0.0) & (places <= SIZE))


def test_a_measurement_of_other_gauges_is_refused():
    with pytest.raises(ValueError, match=r"must have shape \(18,\) as the forward model"):
        refine(np.zeros(12), FORWARD, TOUCHES)
    with pytest.raises(ValueError, match="steps must be 0 or more, got -1"):
        refine(np.zeros(18), FORWARD, TOUCHES, -1)
