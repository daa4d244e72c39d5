"""The same call by torch, on a CPU and on a GPU."""

import sys

import numpy as np
import pytest

import dic
from dic.correlation import iteration

pytest.importorskip("torch")

# What torch runs on here; on a CPU it takes the way that a GPU takes.
DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.gpu)]
MOTION = (3.4, -2.3), ((1.2e-2, 2e-3), (-4e-3, -8e-3))


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_torch_finds_what_the_loops_find(pattern, reference, order, device):
    noise = np.random.default_rng(1).normal(0, 2, reference.shape)
    frame = 0.8 * pattern.draw(*MOTION) + 12 + noise
    fields = [
        dic.correlate(dic.prepare(reference, 21, 7, order, device=place), frame)
        for place in (None, device)
    ]
    both = fields[0].valid & fields[1].valid
    assert both.mean() > 0.8
    assert np.count_nonzero(fields[0].valid != fields[1].valid) <= 1
    for part, atol in (("u", 1e-4), ("v", 1e-4), ("zncc", 1e-5), ("sigma_u", 1e-5)):
        here, there = (getattr(field, part)[both] for field in fields)
        np.testing.assert_allclose(there, here, atol=atol)


@pytest.mark.parametrize("device", DEVICES)
def test_torch_takes_holes_and_a_grid_to_the_border(pattern, reference, device, monkeypatch):
    # A few points of the host stop at their own, up to STILL apart; here all go on together.
    monkeypatch.setattr(iteration, "FEW", 0.0)
    roi = np.ones(reference.shape, dtype=bool)
    roi[60:90, 80:120] = False
    height, width = reference.shape
    grid = dic.Grid(np.arange(2, width, 6), np.arange(1, height, 6), 21, 6)
    here, there = (
        dic.correlate(
            dic.prepare(reference, 21, 6, roi=roi, points=grid, device=place),
            pattern.draw((0.2, -0.1)),
        )
        for place in (None, device)
    )
    np.testing.assert_array_equal(here.status, there.status)
    np.testing.assert_allclose(here.u, there.u, atol=1e-4)


@pytest.mark.parametrize("device", DEVICES)
def test_torch_goes_on_from_a_field_with_lost_points(pattern, reference, device):
    frame = pattern.draw(*MOTION) + np.random.default_rng(2).normal(0, 2, reference.shape)
    before = dic.correlate(dic.prepare(reference, 21, 7), frame)
    before.u[::3] = np.nan
    here, there = (
        dic.correlate(dic.prepare(reference, 21, 7, device=place), frame, before)
        for place in (None, device)
    )
    np.testing.assert_array_equal(here.status, there.status)
    for part in ("u", "v", "sigma_u", "sigma_v", "gradient", "sigma_gradient"):
        np.testing.assert_allclose(getattr(there, part), getattr(here, part), atol=2e-4)


@pytest.mark.parametrize("device", DEVICES)
def test_torch_names_what_the_loops_name(pattern, reference, device):
    """A hand, glare, a crack and a part that leaves the image."""
    rng = np.random.default_rng(3)
    frame = pattern.draw((-6.0, 0.0)) + rng.normal(0, 2, reference.shape)
    frame[20:60, 110:] = pattern.draw((-6.0, 1.5))[20:60, 110:]
    frame[95:125, 60:100] = rng.uniform(0, 255, (30, 40))
    frame[100:140, 120:160] += 180
    still = np.clip(np.rint(reference), 0, 255).astype(np.uint8)
    frame = np.clip(np.rint(frame), 0, 255).astype(np.uint8)
    here, there = (
        dic.correlate(dic.prepare(still, 21, 5, device=place), frame) for place in (None, device)
    )
    assert len(set(here.status.tolist())) >= 4
    assert np.mean(here.status != there.status) < 0.02
    both = here.valid & there.valid
    off = [np.sqrt(np.mean(np.square(field.u[both] + 6.0))) for field in (here, there)]
    assert off[1] < 1.05 * off[0]


def test_device_that_is_not_there_is_refused(reference, monkeypatch):
    with pytest.raises(ValueError, match="device 'nowhere' cannot be used by torch here"):
        dic.prepare(reference, device="nowhere")
    with pytest.raises(ValueError, match="device 'cpu' serves a grid; leave it out"):
        dic.prepare(reference, points=[[90.0, 70.0]], device="cpu")
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ValueError, match="device 'cuda' needs torch, which is not installed"):
        dic.prepare(reference, device="cuda")
