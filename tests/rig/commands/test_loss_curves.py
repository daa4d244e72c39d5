"""Losses over the steps of a training, as they are drawn."""

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig.commands.loss_curves import block_means, draw_steps


@given(st.integers(1, 2000), st.floats(-1.0, 1.0), st.floats(-5.0, 5.0))
def test_means_of_a_line_lie_on_it(count, slope, offset):
    steps, mean = block_means(offset + slope * (1.0 + np.arange(count)))
    assert len(steps) == min(count, 100)
    np.testing.assert_allclose(mean, offset + slope * steps, atol=1e-9)


def test_each_part_has_a_panel_and_losses_may_be_negative(tmp_path):
    rng = np.random.default_rng(0)
    falling = 3.0 / np.sqrt(1.0 + np.arange(700)) - 1.0 + rng.normal(0, 0.3, 700)
    heights = []
    for parts in ({"one": falling}, {"one": falling, "other": -falling[:40]}):
        draw_steps(tmp_path / "curves.png", parts)
        drawn = cv2.imread(str(tmp_path / "curves.png"), cv2.IMREAD_GRAYSCALE)
        assert drawn is not None
        heights.append(drawn.shape[0])
    assert heights[1] > 1.5 * heights[0]


def test_a_training_of_one_step_is_drawn_and_a_folder_that_is_missing_named(tmp_path):
    draw_steps(tmp_path / "one.png", {"one": np.array([0.5])})
    assert (tmp_path / "one.png").stat().st_size > 1e3
    with pytest.raises(OSError, match="cannot be drawn"):
        draw_steps(tmp_path / "none" / "one.png", {"one": np.array([0.5])})
