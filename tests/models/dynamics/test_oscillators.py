"""Modes between knots of a force, against a general integrator of differential equations."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fe
import models
from models.dynamics.oscillators import span

DYNAMICS = models.PlateDynamics(2 * np.pi * np.array([41.0, 300.0]), np.array([0.02, 0.3]))


@pytest.mark.parametrize(("interval", "exposure"), [(1 / 30, 0.008), (1 / 120, 1 / 120), (0.2, 1)])
def test_state_and_mean_of_a_mode_are_those_of_its_equation(interval, exposure):
    step, rng = span(DYNAMICS, interval, exposure), np.random.default_rng(0)
    times = np.concatenate([[0.0], np.cumsum(step.steps)])
    load, state = rng.normal(size=len(times)), rng.normal(size=(2, 2))
    begins = interval - min(exposure, interval)
    for k, (omega, zeta) in enumerate(zip(DYNAMICS.omega, DYNAMICS.damping, strict=True)):

        def slope(time, x, omega=omega, zeta=zeta):
            push = omega * (np.interp(time, times, load) - x[0])
            return [omega * x[1], push - 2 * zeta * omega * x[1], x[0]]

        exact, mean = np.append(state[:, k], 0.0), 0.0
        for begin, end in pairwise(times):
            before = exact
            exact = solve_ivp(slope, (begin, end), before, rtol=1e-9, atol=1e-11).y[:, -1]
            if begin >= begins - 1e-9:
                mean += exact[2] - before[2]
        found = step.carry[:, :, k] @ state[:, k] + step.carried[:, :, k] @ load
        np.testing.assert_allclose(found, exact[:2], atol=1e-6)
        seen = step.seen[:, k] @ state[:, k] + step.pressed[:, k] @ load
        assert seen == pytest.approx(mean / min(exposure, interval), abs=1e-6)


def test_the_first_frequency_of_a_clamped_square_is_the_one_of_the_tables():
    plate = fe.Plate((254.0, 254.0), 1.0, 3000.0, 0.38, fe.Clamped())
    modes = fe.modes(plate, 10)
    found = models.plate_dynamics(modes, 1400.0, 0.02).omega[0]
    # Leissa (1969), table 4.15: ω a² √(ρ h / D) = 35.99
    rigidity = 3000.0 / (12 * (1 - 0.38**2))
    assert found == pytest.approx(35.99 / 254.0**2 * np.sqrt(rigidity / 1.4e-9), rel=1e-3)


@pytest.mark.parametrize(("density", "damping"), [(0.0, 0.02), (1400.0, 0.0), (1400.0, 1.0)])
def test_numbers_that_no_plate_has_are_refused(density, damping):
    modes = fe.modes(fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.38, fe.Clamped()), 4)
    with pytest.raises(ValueError, match=r"must (be positive|lie between)"):
        models.plate_dynamics(modes, density, damping)


@pytest.mark.parametrize(("interval", "exposure"), [(0.0, 0.01), (-0.1, 0.01), (0.1, 0.0)])
def test_a_frame_that_is_not_later_than_the_last_is_refused(interval, exposure):
    with pytest.raises(ValueError, match="must be positive"):
        span(DYNAMICS, interval, exposure)
