"""What a rolling shutter leaves in the measurement, against the motion of each tile by itself."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models
from models.bench.marginal import rate_sigma, scatter
from models.forward.rolling import Rolled

ROW = 3e-5  # s
PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
TOUCHES = np.array([[60.0, 50.0, 2.0], [100.0, 70.0, 1.0]])


@pytest.fixture(scope="module")
def forward():
    """Of a bench, its rows read one after the other in a way that is drawn."""
    modal = fe.modal_plate(PLATE, 30, fe.grid(PLATE, 16))
    fields = models.BenchFields(fe.BenchPlate(modal, fe.bench_values()))
    factor = 500.0 * np.eye(fields.count + fields.drifts)
    reading = np.random.default_rng(3).normal(size=factor.shape)
    return fields.rolling_forward(factor, Rolled(reading, np.array([1e-2, 2e-5, -1e-4])))


@pytest.fixture(scope="module")
def rolling(bench):
    tiles = bench.pattern.motions.tiles
    shutter = models.rolling_shutter(bench.camera, bench.height, tiles, ROW)
    return replace(bench.pattern, shutter=shutter)


def test_places_are_read_when_their_rows_are(bench, rolling):
    xy = np.random.default_rng(0).uniform((5, 5), (145, 105), (20, 2))
    seen = bench.camera.project(np.column_stack([xy, np.full(20, bench.height)]))
    after = ROW * (seen[:, 1] - (bench.camera.size[1] - 1) / 2)
    np.testing.assert_allclose(rolling.shutter.read_at(xy), after, atol=1e-9)
    middles = rolling.motions.tiles.xy[:, 1]
    assert np.ptp(rolling.shutter.tiles) == pytest.approx(ROW * np.ptp(middles))


@pytest.mark.parametrize("hides", [False, True])
def test_a_change_is_seen_as_far_as_each_tile_is_late(rolling, hides):
    """As the image takes a motion of each tile, which is another way through the same tiles."""
    hidden = np.zeros(len(rolling.reference.hessian), bool)
    hidden[200:230] = hides
    pattern = rolling.hiding(hidden)
    change = np.random.default_rng(1).normal(size=pattern.count)
    basis = pattern.motions.tile_basis()[:, :, : pattern.count]
    late = np.where(hidden, 0.0, pattern.shutter.tiles)
    motion = late[:, None] * (basis @ change)
    hessian = pattern.reference.hessian[:, [[0, 1], [1, 2]]]
    towards = (hessian @ motion[:, :, None])[:, :, 0]
    every = pattern.motions.tile_basis()
    right = np.concatenate([
        np.einsum("tci,tc->i", every, towards),
        -np.einsum("tcl,tc->l", pattern.reference.light[:, [[0, 2], [1, 3]]], motion),
    ])  # fmt: skip
    expected = pattern.whiten(right, 1.0)
    np.testing.assert_allclose(
        pattern.rolled @ change, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max()
    )


def test_a_plate_that_is_just_as_described_is_refused(rolling):
    large = replace(rolling, motions=replace(rolling.motions, large=None))
    with pytest.raises(ValueError, match="need the forward model of a bench"):
        large.forward(1.0)


def test_the_rate_of_a_touch_is_seen_as_far_as_each_part_is_later_than_its_own_row(forward):
    """Against touches that have moved and grown by a little, solved again."""

    def seen(touches):
        return forward.fields.seeing @ forward.fields.bench.press(touches).values

    rates = forward.by_rate(TOUCHES)
    for number, step in enumerate(np.eye(6).reshape(6, 2, 3)):
        change = (seen(TOUCHES + 1e-4 * step) - seen(TOUCHES - 1e-4 * step)) / 2e-4
        x, y, _ = TOUCHES[number // 3]
        own = 1e-2 + 2e-5 * x - 1e-4 * y
        expected = forward.rolled.reading @ change - own * (forward.whitening @ change)
        np.testing.assert_allclose(rates[number], expected, atol=1e-4 * np.abs(expected).max())


def test_what_may_change_while_rows_are_read_is_in_the_scatter(forward):
    bench = models.bench_before(PLATE)
    moving = rate_sigma(TOUCHES).ravel()[:, None] * forward.by_rate(TOUCHES)
    still = scatter(replace(forward, rolled=None), bench, TOUCHES)
    added = scatter(forward, bench, TOUCHES) - still
    np.testing.assert_allclose(added, moving.T @ moving, atol=1e-9 * np.abs(added).max())
    assert not forward.by_rate(TOUCHES[:0]).size
