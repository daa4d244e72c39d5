"""What the study of plates by aspect says of all its rows together."""

import pytest

from rig.studies.plates.aspect import SHELL, Off, pressed, summed


def test_the_worst_of_all_is_that_of_strain_and_deflection_and_stated_too_large_or_too_small():
    rows = [Off(2e-4, 1e-5, 2.0), Off(1e-4, 3e-4, 0.4), Off(7e-3, 1e-6, 1.0)]
    error, stated = summed("shell", rows, SHELL)
    assert (error.value, error.samples, error.verdict) == (7e-3, 3, "missed")
    assert (stated.value, stated.samples, stated.verdict) == (0.4, 3, "met")


@pytest.mark.slow
def test_an_error_is_a_magnitude():
    """A square sags less than the strip that it is compared with."""
    off, _ = pressed(1.0, "clamped")
    assert off.deflection > SHELL.at_most
