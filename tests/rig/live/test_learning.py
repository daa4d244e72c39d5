"""The bench learned on while the loop runs: which touches count, and when they are taken over."""

from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

import fe
import models
from models import Estimate, Result
from rig.live.first_touches import ENOUGH, FirstTouches
from rig.live.learning import HELD, LATER, Learning
from rig.live.memory import Memory
from rig.live.next_bench import NextBench

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
TENSION = [NAMES.index("tension_xx"), NAMES.index("tension_yy")]
NOISE = 2e-3  # of an amplitude, mm²
INTERVAL = 1.0 / 30.0
TOUCH = np.array([60.0, 50.0, 2.0])


@pytest.fixture(scope="module")
def forward():
    modal = fe.modal_plate(PLATE, 30, fe.grid(PLATE, 16))
    fields = models.BenchFields(fe.BenchPlate(modal, fe.bench_values()))
    return models.BenchForward(fields, np.eye(fields.count + fields.drifts) / NOISE)


@pytest.fixture
def learning():
    prior = models.bench_before(PLATE)
    known = models.BenchEstimate(
        prior.values, 0.02**2 * prior.covariance, 1e-3, prior.prior, memory=0.0
    )
    return Learning(known, 16)


@pytest.fixture
def frames(forward):
    """Give what a loop finds frame after frame on a plate that has warmed."""
    rng, values = np.random.default_rng(1), np.zeros(len(NAMES))
    values[TENSION] = -0.05
    true = forward.on(values, None)

    def found(touch, **changed):
        touches = np.asarray(touch, dtype=float).reshape(-1, 3)
        seen = true.read(touches)[0]
        estimate = Estimate(
            touches[:, :2],
            touches[:, 2],
            1e-4 * np.eye(touches.size),
            float(len(seen)),
            len(seen) - touches.size,
            0.5,
            Result.FOUND if len(touches) else Result.NO_TOUCH,
        )
        one = SimpleNamespace(
            estimate=estimate,
            measured=seen + rng.standard_normal(len(seen)),
            hidden=np.zeros(4, dtype=bool),
            whole_and_clear=True,
            state=SimpleNamespace(memory=Memory(), motion=np.zeros(len(seen) + 6)),
        )
        return SimpleNamespace(**{**vars(one), **changed})

    return found


def chain_of(forward):
    """Give what the learning asks of a chain; a hidden tile takes a tenth of every amplitude."""
    factor = np.linalg.cholesky(forward.whitening.T @ forward.whitening)
    visible = SimpleNamespace(factor=0.9 * factor)
    return SimpleNamespace(
        estimator=SimpleNamespace(forward=forward),
        pattern=SimpleNamespace(factor=factor, uncorrected=lambda motion: motion[len(factor) :]),
        noise=1.0,
        masked_models=SimpleNamespace(pattern_for=lambda hidden: visible),
    )


def follow(learning, forward, shown, start=100.0):
    """Show frames; give the numbers of those after which the bench is another one."""
    chain = chain_of(forward)
    begun = [learning.follow(start + k * INTERVAL, one, chain) for k, one in enumerate(shown)]
    return [k for k, bench in enumerate(begun) if bench is not None]


def test_a_touch_that_is_held_is_learned_from_a_fixed_number_of_frames_later(
    learning, forward, frames
):
    before = learning.bench
    learning.bench = models.wandered(before, 60.0)
    shown = [frames(TOUCH) for _ in range(HELD)] + [frames([]) for _ in range(2 * LATER)]
    assert follow(learning, forward, shown) == [HELD - 1 + LATER]
    assert (learning.learned.touches, learning.learned.strange) == (1, 0)
    assert np.abs(learning.bench.values[TENSION] + 0.05).max() < 0.03


def test_few_hidden_tiles_change_nothing(learning, forward, frames):
    learning.bench = models.wandered(learning.bench, 60.0)
    other = Learning(learning.bench, 16)
    shown = [frames(TOUCH) for _ in range(HELD + LATER)]
    few = np.arange(100) == 7
    hidden = [
        SimpleNamespace(**{**vars(one), "measured": 0.9 * one.measured, "hidden": few})
        for one in shown
    ]
    assert follow(learning, forward, shown) == follow(other, forward, hidden)
    np.testing.assert_allclose(other.bench.values, learning.bench.values, atol=1e-9)


@pytest.mark.parametrize("what", ["two", "moving", "light", "hidden", "unusable", "left too soon"])
def test_what_is_no_still_touch_says_nothing(learning, forward, frames, what):
    shown = {
        "two": [frames([TOUCH, [110.0, 40.0, 2.0]])] * 40,
        "moving": [frames(TOUCH + np.array([k, 0.0, 0.0])) for k in range(40)],
        "light": [frames(TOUCH * np.array([1.0, 1.0, 0.1]))] * 40,
        "hidden": [frames(TOUCH, whole_and_clear=False)] * 40,
        "unusable": [frames(TOUCH, measured=None)] * 40,
        "left too soon": [*[frames(TOUCH)] * (HELD - 1), *[frames([])] * 40],
    }[what]
    before = learning.bench
    assert follow(learning, forward, shown) == []
    assert learning.bench is before


def test_a_touch_that_stays_is_looked_at_once(learning, forward, frames):
    follow(learning, forward, [frames(TOUCH) for _ in range(4 * (HELD + LATER))])
    assert learning.learned.touches + learning.learned.strange == 1


def test_a_touch_that_fits_no_likely_bench_is_left_aside(learning, forward, frames):
    strange = [frames(TOUCH) for _ in range(HELD + LATER)]
    strange = [
        SimpleNamespace(**{**vars(one), "measured": one.measured[::-1].copy()}) for one in strange
    ]
    before = learning.bench.values
    assert follow(learning, forward, strange) == []
    assert learning.learned.strange == 1
    np.testing.assert_array_equal(learning.bench.values, before)


def test_an_unexpected_error_is_said_and_leaves_the_bench_as_it_was(
    learning, forward, frames, monkeypatch, caplog
):
    def broken(*_):
        raise TypeError("no number")

    monkeypatch.setattr(models, "learn", broken)
    assert follow(learning, forward, [frames(TOUCH) for _ in range(HELD + LATER)]) == []
    says = "the bench stays as it was known: unexpected TypeError: no number"
    assert learning.notice.text == says
    assert "the learning of the bench failed" in caplog.text


def test_a_bench_that_nothing_is_seen_of_is_less_and_less_sure(learning, forward, frames):
    before = learning.bench.sigma[TENSION]
    chain = chain_of(forward)
    begun = [learning.follow(100.0 + 10.0 * k, frames([]), chain) for k in range(10)]
    assert [k for k, one in enumerate(begun) if one is not None] == [3, 6, 9]
    assert (learning.bench.sigma[TENSION] > 2.0 * before).all()


def test_a_known_weight_sets_the_newton_and_another_force_does_not(learning, forward, frames):
    with pytest.raises(ValueError, match=r"must be 0\.5 N or more, got 0\.1 N"):
        learning.weigh(0.1)
    learning.bench = models.wandered(learning.bench, 3600.0)
    learning.weigh(2.6)
    assert follow(learning, forward, [frames(TOUCH) for _ in range(2 * HELD)]) == []
    assert "presses with 2.00" in learning.notice.at(200.0)
    learning.weigh(2.0)
    shown = [frames(TOUCH) for _ in range(HELD)] + [frames([]) for _ in range(LATER)]
    assert follow(learning, forward, shown, 102.0) == [HELD - 1 + LATER]
    learned = learning.learned
    assert (learned.touches, learned.weights, learned.weight) == (1, 1, None)
    assert learned.force_sigma < 0.01
    assert "known weight of 2 N" in learning.notice.at(400.0)


def test_a_run_that_is_recorded_forgets_what_was_on_its_way(learning, forward, frames):
    shown = [frames(TOUCH) for _ in range(HELD)]
    learning.bench = models.wandered(learning.bench, 60.0)
    assert follow(learning, forward, shown) == []
    learning.pause()
    assert follow(learning, forward, [frames([]) for _ in range(2 * LATER)]) == []
    assert learning.learned.touches == 0


class Together(FirstTouches):
    """First touches that show the bench that a test knows, when it lets them."""

    def find(self, pattern, noise):
        assert LET.wait(10.0)
        softer = np.zeros(len(NAMES))
        softer[0] = -0.1
        return NextBench(models.BenchEstimate(softer, 1e-4 * np.diag(self.prior.prior**2), 1e-3,
                                              self.prior.prior))  # fmt: skip


LET = Event()


@pytest.fixture
def first():
    """Learn of a bench of which nothing is known but its scene, and let its frames wait."""
    LET.set()

    def made(waits):
        prior = models.bench_before(PLATE)
        return Learning(prior, 16, Together(prior, None), waits)

    return made


def stills(frames, count):
    """Give single frames of touches at places all over the plate."""
    rng = np.random.default_rng(5)
    places = rng.uniform([20.0, 20.0], [130.0, 90.0], (40 * count, 2))
    apart = [places[0]]
    for place in places:
        if len(apart) < count and np.hypot(*(place - apart[-1])) > 30.0:
            apart.append(place)
    return [frames([*place, 2.0]) for place in apart]


def test_the_first_touches_show_a_bench_together(forward, frames, first):
    learning, shown = first(waits=True), stills(frames, ENOUGH[-1] + 6)
    few = ENOUGH[0] - 1
    assert follow(learning, forward, shown[:few]) == []
    assert (learning.learned.gathered, learning.learned.touches) == (few - 1, 0)
    assert learning.bench.is_prior
    assert len(follow(learning, forward, shown[few:], 110.0)) == 2
    assert learning.bench.values[0] == -0.1
    assert f"the bench is found from {ENOUGH[-1]} touches" in learning.notice.text
    assert (learning.learned.gathered, learning.learned.touches) == (0, ENOUGH[-1])


def test_live_frames_do_not_wait_for_what_first_touches_show(forward, frames, first):
    learning = first(waits=False)
    LET.clear()
    assert follow(learning, forward, stills(frames, ENOUGH[0] + 10)) == []
    LET.set()
    for _ in range(1000):
        if learning.follow(130.0, frames([]), chain_of(forward)) is not None:
            break
        Event().wait(0.01)
    assert learning.learned.touches == ENOUGH[0]


def test_a_finger_that_slides_is_no_first_touch(forward, frames, first):
    learning = first(waits=True)
    slide = [frames([20.0 + 4.0 * k, 50.0, 2.0]) for k in range(25)]
    unsure = frames([60.0, 50.0, 2.0], measured=None)
    assert (
        follow(learning, forward, [frames([]), *slide, frames([]), unsure, slide[9], unsure]) == []
    )
    assert learning.learned.gathered == 0


def test_first_touches_against_another_reference_are_gathered_anew(forward, frames, first):
    learning = first(waits=True)
    follow(learning, forward, stills(frames, 10))
    assert learning.learned.gathered == 9
    learning.pause()
    assert learning.learned.gathered == 0
    assert len(follow(learning, forward, stills(frames, ENOUGH[0] + 2), 120.0)) == 1
    learning.pause()
    follow(learning, forward, stills(frames, 10), 140.0)
    assert (learning.learned.touches, learning.learned.gathered) == (ENOUGH[0], 9)


class Nothing(FirstTouches):
    """First touches of which no descent ends."""

    def find(self, pattern, noise):
        return None


def test_first_touches_that_show_no_bench_change_nothing_and_are_gathered_anew(forward, frames):
    learning = Learning(models.bench_before(PLATE), 16, Nothing(models.bench_before(PLATE), None))
    assert follow(learning, forward, stills(frames, ENOUGH[-1] + 20)) == []
    assert 0 < learning.learned.gathered < ENOUGH[0]
    assert (
        learning.notice.text
        == f"the first {ENOUGH[-1]} touches show no likely bench; more are gathered"
    )
    assert learning.bench.is_prior


def test_a_weight_sets_the_newton_of_a_bench_that_is_not_found_yet(forward, frames, first):
    learning = first(waits=True)
    learning.follow(99.0, frames([]), chain_of(forward))
    before = learning.learned.force_sigma
    learning.weigh(2.0)
    follow(learning, forward, [frames(TOUCH) for _ in range(HELD + LATER)])
    learned = learning.learned
    assert (learned.touches, learned.weights, learned.gathered) == (0, 1, 1)
    assert learned.force_sigma < 0.5 * before


def test_a_forward_model_apart_remembers_nothing_of_the_loop(forward):
    here, elsewhere = np.array([[60.0, 80.0, 2.0]]), np.array([[150.0, 90.0, 2.0]])
    forward.read(here)
    beside = forward.apart()
    beside.read(elsewhere)
    assert beside.fields.beside(here) is None
    assert forward.fields.beside(here) is not None
    assert forward.fields.beside(elsewhere) is None
