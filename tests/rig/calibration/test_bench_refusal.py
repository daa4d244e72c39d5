"""Lists of another plate and benches that cannot be are refused, and those that can are not."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models
from rig.calibration.bench_refusal import require_places, require_sound

SIZE = (254.0, 203.0)
NAMES = [name for name, _ in models.BENCH]
PLATE = fe.Plate(SIZE, 1.0, 3000.0, 0.38)


@pytest.fixture
def places(rng):
    return rng.uniform(0.1, 0.9, (12, 2)) * SIZE


@pytest.mark.parametrize("away", [0.3, 3.0, 9.0])
def test_places_are_taken_where_a_bench_shows_them_nearly_there(rng, places, away):
    """A bench a little wrong everywhere shows touches some millimetres beside themselves."""
    angle = rng.uniform(0, 2 * np.pi, 12)
    seen = places + away * np.column_stack([np.cos(angle), np.sin(angle)])
    seen[3] += 30.0  # one that is mislabelled is down-weighted later
    require_places(places, seen, SIZE)
    require_places(np.empty((0, 2)), np.empty((0, 2)), SIZE)


@pytest.mark.parametrize(
    ("listed", "says"),
    [
        (lambda p: p[:, ::-1], "with x_mm and y_mm swapped they agree; correct the list"),
        (lambda p: (254.0, 0.0) + p * (-1, 1), "with x_mm counted from the other edge they agree"),
        (lambda p: (0.0, 203.0) + p * (1, -1), "with y_mm counted from the other edge they agree"),
        (lambda p: (254.0, 203.0) - p, "with both counted from the other edge they agree"),
        (lambda p: np.roll(p, 1, axis=0), "touches; correct the list, or plate.size in the scene"),
    ],
)
def test_a_list_of_other_places_is_refused_with_what_it_looks_like(rng, places, listed, says):
    seen = places + rng.normal(0.0, 2.0, places.shape)
    with pytest.raises(
        ValueError, match=r"half of the listed places are [0-9]+ mm or more"
    ) as refusal:
        require_places(listed(places), seen, SIZE)
    assert says in str(refusal.value)


def found(**numbers):
    """Give a bench that nine presses have shown, some of whose numbers are other than 0."""
    prior = models.bench_before(PLATE)
    values = prior.values.copy()
    for name, value in numbers.items():
        values[NAMES.index(name)] = value
    held = models.HeldOut(0.4, 0.006, 9)
    touches = np.column_stack([np.linspace(30, 200, 9), np.linspace(30, 170, 9), np.ones(9)])
    known = replace(prior, values=values, covariance=0.04 * prior.covariance, held_out=held)
    return replace(known, touches=touches)


def wide(name, part):
    """Give a bench of which a number is `part` times as uncertain as before."""
    bench = found()
    covariance, index = bench.covariance.copy(), NAMES.index(name)
    covariance[index, index] = (part * bench.prior[index]) ** 2
    return replace(bench, covariance=covariance)


HONEST = [
    found(),
    found(young=-0.1),
    found(thickness=-0.06, sag=0.5, turn_x=0.03),
    wide("k2", 1.1),
    replace(wide("shift_x", 2.0), label_offset=(2.9, 0.0)),
    replace(found(), outliers=(2, 5)),
    replace(found(), held_out=models.HeldOut(4.0, float("nan"), 9)),
    replace(found(), held_out=None),
]


@pytest.mark.parametrize("bench", HONEST)
def test_a_bench_as_it_may_be_is_kept(bench):
    require_sound(bench, SIZE)


REFUSED = [
    (
        found(young=1.7),
        r"young = 1\.7, 17 times as far from the scene .* plate\.thickness, plate\.",
    ),
    (found(thickness=-0.72), r"thickness = -0\.72, 24 times as far .* forces of the list, in N"),
    (found(sag=1.1), r"sag = 1\.1 mm, 7 times as far .* plate\.size and the places of the list"),
    (replace(found(), converged=False), "did not converge; .* press at nine places or more"),
    (wide("shift_x", 1488), "leave shift_x 1488.0 times as uncertain as before them; check"),
    (replace(found(), outliers=(0, 1, 2, 4, 8)), "5 of 9 presses contradict the others; check"),
    (replace(found(), held_out=models.HeldOut(28.8, 0.1, 9)), "found 29 mm from their places; ch"),
    (
        replace(found(), held_out=models.HeldOut(2.0, 8.19, 9)),
        "contradict each other: .* wrong by 819%; check them",
    ),
]


@pytest.mark.parametrize(("bench", "says"), REFUSED)
def test_a_bench_that_cannot_be_is_refused_with_what_to_check(bench, says):
    with pytest.raises(ValueError, match=says + ".*: the calibration stays as it was$"):
        require_sound(bench, SIZE)
