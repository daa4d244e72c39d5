"""The scale: newton with their σ, tared, and what it cannot say."""

import numpy as np
import pytest

from models import Estimate, Result
from rig.live.snapshot import Mark
from rig.projector.content import draw
from rig.projector.demos.moment import Load, Moment, load_of
from rig.projector.demos.weighing import CANNOT_SAY, STEADY, Weighing, decimals
from tests.rig.page.conftest import draw_snapshot

RATE = 30.0


def weighed(scale, loads, begun=0.0):
    for number, load in enumerate(loads):
        scale = scale.after(Moment(begun + number / RATE, (), load))
    return scale


def estimate(force, covariance, result=Result.FOUND):
    count = len(force)
    xy = np.linspace(50, 150, 2 * count).reshape(count, 2)
    return Estimate(xy, np.array(force), covariance, 1.0, 1, 0.5, result)


def test_a_load_is_the_sum_of_the_forces_and_sigma_follows_from_all_of_their_covariance():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(6, 6)) * 0.1
    covariance = root @ root.T
    load = load_of(draw_snapshot(1, estimate=estimate([1.25, 2.5], covariance)))
    drawn = rng.multivariate_normal(np.zeros(6), covariance, 200_000)
    assert load.force == pytest.approx(3.75)
    assert load.sigma == pytest.approx(np.std(drawn[:, 2] + drawn[:, 5]), rel=0.02)


def test_what_is_unresolvable_is_not_said(plate, screen):
    unknown = estimate([1.0, 1.0], np.eye(6), Result.UNRESOLVABLE)
    load = load_of(draw_snapshot(1, estimate=unknown))
    assert np.isnan([load.force, load.sigma]).all()
    scale = weighed(Weighing(plate, 8.0), [Load(2.0, 0.1)] * 5 + [load])
    assert scale.lines == (CANNOT_SAY, Result.UNRESOLVABLE.value)
    assert draw(scale, screen).any()
    assert scale.tared().zero == scale.zero


@pytest.mark.parametrize(
    "covariance", [np.full((3, 3), np.nan), np.full((3, 3), np.inf), -np.eye(3)]
)
def test_a_load_of_unknown_sigma_is_not_said(covariance):
    assert load_of(draw_snapshot(1, estimate=estimate([1.0], covariance))).reason
    assert load_of(draw_snapshot(1, estimate=None)).reason
    found = estimate([1.0], np.eye(3))
    assert load_of(draw_snapshot(1, estimate=found, fresh=False)).reason


def test_frames_of_a_resting_load_are_averaged_and_sigma_is_that_of_a_frame(plate):
    rng = np.random.default_rng(3)
    forces = 2.0 + 0.04 * rng.normal(size=60)
    scale = weighed(Weighing(plate, 8.0), [Load(force, 0.04) for force in forces])
    last = forces[-len(scale.loads) :]
    assert len(last) == pytest.approx(STEADY * RATE, abs=1)
    assert scale.net.force == pytest.approx(last.mean())
    assert scale.net.sigma == pytest.approx(0.04)


def test_another_load_is_said_at_once(plate):
    scale = weighed(Weighing(plate, 8.0), [Load(2.0, 0.02)] * 30 + [Load(3.0, 0.02)])
    assert scale.lines == ("3.00 N", "± 0.02 N")


def test_tare_takes_what_lies_there_for_nothing_and_adds_its_sigma(plate):
    bowl, filled = Load(1.5, 0.03), Load(3.5, 0.04)
    scale = weighed(Weighing(plate, 8.0), [bowl] * 10).tared()
    assert scale.lines == ("0.00 N", "± 0.04 N net")
    scale = weighed(scale, [filled] * 10, 1.0)
    assert scale.net.force == pytest.approx(2.0)
    assert scale.net.sigma == pytest.approx(0.05)
    assert scale.lines == ("2.00 N", "± 0.05 N net")
    lifted = weighed(scale, [Load(0.0, 0.0)] * 10, 2.0)
    assert lifted.lines[0] == "-1.50 N"
    assert lifted.tared().lines == ("0 N", "nothing is felt")


def test_digits_follow_sigma():
    assert [decimals(sigma) for sigma in (0.04, 0.019, 0.2, 0.15, 1.2, 30.0, 0.0, np.nan)] == [
        2, 3, 1, 2, 1, 0, 2, 2,
    ]  # fmt: skip


def test_the_dial_shows_the_load_and_two_sigma(plate, screen):
    """The filled part of the dial ends at the load, for loads of all sizes."""
    ends = []
    for force in (1.0, 4.0, 7.0):
        touches = (Mark(120, 75, force, identity=1),)
        scale = Weighing(plate, 8.0).after(Moment(0.0, touches, Load(force, 0.01)))
        row = draw(scale, screen)[150 - 19].astype(float)  # below the band of 2σ
        blue = np.nonzero(row[:, 2] > 22)[0]
        ends.append(blue.max())
    start, wide = 0.12 * plate[0], 0.76 * plate[0]
    assert ends == pytest.approx([start + wide * part for part in (1 / 8, 0.5, 7 / 8)], abs=2.5)


def test_the_words_stand_where_nothing_lies(plate, screen):
    def words(y):
        touches = (Mark(120, y, 2.0, identity=1),)
        shown = Weighing(plate, 8.0).after(Moment(0.0, touches, Load(2.0, 0.01)))
        light = draw(shown, screen).max(axis=2)
        return light[: 150 - 95].any(), light[150 - 80 : 150 - 30].any()  # upper half, lower half

    assert words(30) == (True, False)
    assert words(120) == (False, True)
