"""Derivatives of a state by differences, against which the exact ones are tested."""

import numpy as np

import fe

STEPS = {"rotation": 1e-6, "membrane": 1e-6}


def by_touches(bench, touches):
    """Change of all values by x1, y1, F1, x2, …, one after the other."""
    for change in 1e-3 * np.eye(touches.size):
        ahead, behind = (
            bench.press(touches + sign * change.reshape(touches.shape)).values for sign in (1, -1)
        )
        yield (ahead - behind) / 2e-3


def by_parameter(modal, values, touches, name):
    """Change of all values by one number of a bench."""
    step = STEPS.get(name.split("_")[0], 1e-4)
    change = fe.bench_values(**{name: step})
    ahead, behind = (
        fe.BenchPlate(modal, values + sign * change).press(touches).values for sign in (1, -1)
    )
    return (ahead - behind) / (2 * step)


def loosened(values):
    """Bench (54,) whose edges all give at both ends, by more than what is differenced."""
    more = {
        name: 3.0 * STEPS[name.split("_")[0]]
        for name, _ in fe.BENCH_PARAMETERS
        if name.startswith(("rotation", "membrane")) and not name.endswith("slope")
    }
    return values + fe.bench_values(**more)
