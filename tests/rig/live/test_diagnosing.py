"""Causes named while the loop runs: from touches of which nobody says where they are."""

from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

import fe
import models
from models import Estimate, Result
from rig.live.diagnosing import MISFITS, TOUCHES, Diagnosing
from rig.live.known_bench import KnownBench

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
NOISE = 2e-3  # of an amplitude, mm²


@pytest.fixture(scope="module")
def forward(modal_bench):
    return modal_bench(PLATE, NOISE)


@pytest.fixture
def chain(forward, monkeypatch):
    """Give what the diagnosis asks of a chain, whose camera stands as it is said."""
    monkeypatch.setattr(KnownBench, "look", lambda known, pattern: None)
    return SimpleNamespace(
        pattern=SimpleNamespace(forward=lambda noise: forward, uncorrected=lambda motion: motion),
        noise=1.0,
    )


def frames(forward, p_value, extra=False, **wrong):
    """Give what a loop finds of touches far apart, on a bench of which something is wrong."""
    rng, values = np.random.default_rng(3), np.zeros(len(NAMES))
    for name, value in wrong.items():
        values[NAMES.index(name)] = value
    on = forward.on(values, None)
    for x, y in [(30, 30), (60, 35), (90, 30), (120, 40), (30, 80), (60, 75), (90, 85), (120, 70)]:
        touch = np.array([[x, y, rng.uniform(1, 4)]])
        seen = on.read(touch)[0] + rng.standard_normal(len(forward.whitening))
        found = np.vstack([touch, [[10.0, 10.0, 0.1]]]) if extra else touch
        estimate = Estimate(
            found[:, :2], found[:, 2], np.eye(found.size), 900.0, 99, p_value, Result.FOUND
        )
        yield SimpleNamespace(
            estimate=estimate,
            measured=seen,
            hidden=np.zeros(9, dtype=bool),
            whole_and_clear=True,
            state=SimpleNamespace(motion=np.zeros(6)),
        )


def follow(diagnosing, shown, chain):
    prior = models.bench_before(PLATE)
    for found in shown:
        diagnosing.follow(found, chain, prior)


@pytest.mark.slow
@pytest.mark.parametrize("phantoms", [False, True])
def test_the_cause_of_touches_that_do_not_fit_is_named_with_its_size(forward, chain, phantoms):
    diagnosing = Diagnosing(None, 16, waits=True)
    shown = [*frames(forward, 1e-20, phantoms, sag=0.2)]
    follow(diagnosing, shown, chain)
    assert diagnosing.sentence == ""
    follow(diagnosing, shown[:1], chain)
    assert diagnosing.sentence.startswith("Not as the scene says: a plate that is not flat (+0.")
    assert diagnosing.sentence.endswith("calibrate the bench.")
    assert diagnosing.notice.at(0.0) == diagnosing.sentence


def test_touches_that_fit_again_take_the_cause_back(forward, chain):
    diagnosing = Diagnosing(None, 16, waits=True)
    diagnosing.sentence = "Not as the scene says: the lens (k1 -0.08); calibrate the bench."
    follow(diagnosing, frames(forward, 0.3), chain)
    assert diagnosing.sentence == ""


def test_nothing_is_asked_where_few_do_not_fit_or_one_place_is_pressed(forward, chain, monkeypatch):
    monkeypatch.setattr(models, "diagnose", lambda *_: pytest.fail("a diagnosis was begun"))
    diagnosing = Diagnosing(None, 16, waits=True)
    fine, wrong = [*frames(forward, 0.3)], [*frames(forward, 1e-20, sag=0.2)]
    follow(diagnosing, [*wrong[: MISFITS - 1], *fine[MISFITS - 1 :], *fine[:1]], chain)
    follow(diagnosing, wrong[:1] * 3 * TOUCHES, chain)
    hidden = [SimpleNamespace(**{**vars(one), "hidden_fraction": 1.0}) for one in wrong]
    follow(diagnosing, [*hidden, *wrong[1:2]], chain)


def test_a_live_frame_does_not_wait(forward, chain, monkeypatch):
    go_on, done = Event(), Event()

    def slow(*_):
        go_on.wait()
        done.set()
        raise np.linalg.LinAlgError

    monkeypatch.setattr(models, "diagnose", slow)
    diagnosing = Diagnosing(None, 16)
    shown = [*frames(forward, 1e-20, sag=0.2)]
    follow(diagnosing, [*shown, *shown], chain)
    assert not done.is_set()
    go_on.set()
    assert done.wait(60.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("error", "why", "logged"),
    [
        (np.linalg.LinAlgError("singular"), "8 touches do not tell causes apart (singular)", False),
        (TypeError("no number"), "unexpected TypeError: no number", True),
    ],
)
def test_a_diagnosis_that_fails_is_said_and_tried_again(
    forward, chain, monkeypatch, caplog, error, why, logged
):
    def fail(*_):
        raise error

    shown = [*frames(forward, 1e-20, sag=0.2)]
    diagnosing = Diagnosing(None, 16, waits=True)
    with monkeypatch.context() as broken:
        broken.setattr(models, "diagnose", fail)
        follow(diagnosing, [*shown, shown[0]], chain)
    assert diagnosing.notice.text == f"what does not fit is not named: {why}; the next are tried"
    assert ("the diagnosis failed" in caplog.text) is logged
    assert diagnosing.sentence == ""
    follow(diagnosing, [*shown, shown[0]], chain)
    assert "a plate that is not flat" in diagnosing.sentence


def test_what_nothing_of_the_bench_explains_is_said(forward, chain):
    rng = np.random.default_rng(1)
    shown = [
        SimpleNamespace(
            **{**vars(one), "measured": one.measured + 9.0 * rng.standard_normal(len(one.measured))}
        )
        for one in frames(forward, 1e-20)
    ]
    diagnosing = Diagnosing(None, 16, waits=True)
    follow(diagnosing, [*shown, shown[0]], chain)
    assert diagnosing.sentence.startswith("Nothing of the bench alone explains it: touches are")
