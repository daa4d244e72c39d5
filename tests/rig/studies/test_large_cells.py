"""What a cell of the study of large touches keeps of a frame, and what its coverage leaves out."""

import numpy as np
import pytest

import models
from models import Result
from rig.studies.touches.large import FAR, Cell, beyond

TOUCHES = np.array([[40.0, 60.0, 2.0], [120.0, 90.0, 3.0]])


def estimate(touches, result=Result.FOUND):
    covariance = np.diag([0.04, 0.04, 0.01] * len(touches))
    return models.Estimate(touches[:, :2], touches[:, 2], covariance, 90.0, 100, 0.5, result)


@pytest.mark.parametrize(
    ("seen", "right", "left_out"),
    [
        (estimate(np.add(TOUCHES, (0.1, -0.2, 0.05))), True, False),
        (estimate(np.add(TOUCHES, (0.1, -0.2, 0.05)), Result.UNRESOLVABLE), True, True),
        (estimate(np.add(TOUCHES, (FAR + 1.0, 0.0, 0.0))), True, True),
        (estimate(TOUCHES[:1]), False, True),
    ],
)
def test_coverage_counts_the_frames_that_it_leaves_out(seen, right, left_out):
    cell = Cell()
    cell.add(seen, 7.5, TOUCHES)
    assert (cell.right, cell.left_out, cell.spent) == ([right], [left_out], [7.5])
    assert len(cell.deviations) == (0 if left_out else 6)
    assert len(cell.place) == (2 if right else 0)
    if not left_out:
        assert cell.deviations == pytest.approx([0.5, -1.0, 0.5] * 2)


def test_a_force_lies_below_within_or_above_its_bounds():
    assert [beyond(force, (1.0, np.inf)) for force in (0.9, 1.0, 50.0)] == [-1, 0, 0]
    assert beyond(2.5, (1.0, 2.0)) == 1
