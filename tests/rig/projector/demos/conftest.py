"""A plate that is not square under a projector of one px a mm, so that a px is a place."""

import numpy as np
import pytest

from rig.projector.markers import Screen

PLATE = (240.0, 150.0)


@pytest.fixture
def plate():
    return PLATE


@pytest.fixture
def screen():
    """Screen whose px (column, row) lies at the place (column, 150 - row), mm."""
    T = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, PLATE[1]], [0.0, 0.0, 1.0]])
    return Screen((241, 151), T)


@pytest.fixture
def light_at():
    """Give the light of an image at a place, mm: the mean of the channels."""

    def light(image, x, y):
        return float(image[round(PLATE[1] - y), round(x)].mean())

    return light
