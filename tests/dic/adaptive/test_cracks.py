"""Tiles that a crack cuts, beside a steep wave once the motion about them is known."""

import numpy as np

from dic.adaptive.cracks import still_torn

SHAPE = (20, 30)  # tiles


def field(value, right=0.0, down=0.0):
    """Lay u on tiles with its slopes along x and y, and v = 0: (2, 3, R, C)."""
    u = np.stack(np.broadcast_arrays(value, right, down, np.empty(SHAPE))[:3])
    return np.stack([u, np.zeros_like(u)])


def column_torn(values):
    torn = np.zeros(SHAPE, bool)
    torn[:, 15] = True
    values[..., torn] = np.nan
    return torn, values


def test_a_jump_keeps_its_tiles_torn():
    x = np.arange(SHAPE[1])
    torn, values = column_torn(field(0.002 * x + 1.0 * (x > 15), 0.002))
    assert np.array_equal(still_torn(torn, values), torn)


def test_a_wave_of_seven_tiles_is_whole_again():
    x, k = np.arange(SHAPE[1]), 2 * np.pi / 7
    torn, values = column_torn(field(0.5 * np.cos(k * x), -0.5 * k * np.sin(k * x)))
    assert not still_torn(torn, values).any()


def test_three_tiles_alone_part_nothing_and_what_is_not_known_stays_torn():
    torn, values = np.zeros(SHAPE, bool), field(0.0)
    torn[5, 4:7] = True  # beside one another
    torn[10:18, 20:24] = True  # no neighbours in the middle
    values[0, 0, 6] = 1.0  # a step across the first three
    values[..., torn] = np.nan
    left = still_torn(torn, values)
    assert not left[5].any()
    assert left[11:17, 21:23].all()
