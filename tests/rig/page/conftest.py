"""Snapshots of an invented bench, drawn from closed forms, for the tests of the page."""

import numpy as np
import pytest

from rig.live.snapshot import Mark, Sign, Snapshot, StrainOverlay
from rig.projector.markers import project

PLATE = (254.0, 200.0)  # mm
SIZE = (640, 520)  # px, width and height
T_PX_PLATE = np.array([[2.2, 0.03, 38.0], [0.02, -2.25, 482.0], [0.0, 1.5e-5, 1.0]])


def draw_snapshot(sequence: int, *, size=SIZE, with_strain=True, status="two touches", **changes):
    """Two touches that press and move; everything follows from the sequence number."""
    rng = np.random.default_rng(sequence)
    time = sequence / 30
    scale = size[0] / SIZE[0]
    T = np.diag([scale, scale, 1.0]) @ T_PX_PLATE
    truth = (
        Mark(90 + 30 * np.cos(time), 80 + 30 * np.sin(time), 2 + 1.2 * np.sin(0.7 * time)),
        Mark(185.0, 140.0, 1.0 + 0.4 * np.sin(1.3 * time)),
    )
    corners = np.array([[0.0, 0.0], [PLATE[0], 0.0], PLATE, [0.0, PLATE[1]]])
    known = {
        "sequence": sequence,
        "captured": 100 + time,
        "image": _speckle(size),
        "plate_size": PLATE,
        "plate_outline": project(T, corners),
        "T_px_plate": T,
        "touches": tuple(_seen(m, (1.1, 0.7, 0.4), 0.03, rng) for m in truth),
        "from_strain": tuple(_seen(m, (6.0, 4.0, -0.3), 0.2, rng) for m in truth),
        "truth": truth,
        "strain": _strain(truth, T, size, rng) if with_strain else None,
        "status": status,
        "position_error": abs(rng.normal(0.8, 0.2)),
        "force_error": abs(rng.normal(0.03, 0.01)),
        "position_error_median": 0.79,
        "force_error_median": 0.031,
        "fps": 29.7,
        "dropped": 3,
        "stages": (
            ("wait", 2.0, 4.1), ("sums", 5.2, 6.9), ("touches", 0.9, 2.2), ("strain", 3.8, 5.0),
        ),
        "latency": (9.4, 13.1),
        "noise": 2.03,
        "signs": (Sign("light", "98% of that at rest", False), Sign("noise", "<b>9</b> gl", True)),
        "strain_reason": "" if with_strain else "the scene asks for no strain",
    }  # fmt: skip
    return Snapshot(**{**known, **changes})


def _seen(mark: Mark, sigma, sigma_force: float, rng) -> Mark:
    a, b, angle = sigma
    u, v = rng.normal(size=2) * (a, b)
    x = mark.x + u * np.cos(angle) - v * np.sin(angle)
    y = mark.y + u * np.sin(angle) + v * np.cos(angle)
    return Mark(x, y, mark.force + rng.normal(0, sigma_force), sigma, sigma_force)


def _speckle(size) -> np.ndarray:
    rng = np.random.default_rng(0)
    coarse = rng.normal(size=(size[1] // 2, size[0] // 2)).repeat(2, 0).repeat(2, 1)
    return np.clip(128 + 45 * coarse, 0, 255).astype(np.uint8)


def _strain(truth, T, size, rng) -> StrainOverlay:
    xs, ys = np.arange(30.0, size[0] - 30, 8), np.arange(25.0, size[1] - 25, 8)
    grid = np.stack(np.meshgrid(xs, ys), -1).reshape(-1, 2)
    xy = project(np.linalg.inv(T), grid)
    outside = ((xy < 0) | (xy > PLATE)).any(1)
    maps = 15e-6 * rng.normal(size=(3, len(xy)))
    for mark in truth:
        x, y = (xy - (mark.x, mark.y)).T / 35
        bump = mark.force * 120e-6 * np.exp(-(x**2 + y**2) / 2)
        maps += bump * np.stack([x**2 - 1, y**2 - 1, x * y])
    maps[:, outside] = np.nan
    exx, eyy, exy = maps.reshape(3, len(ys), len(xs)).astype(np.float32)
    return StrainOverlay(xs, ys, exx, eyy, exy, (15e-6, 15e-6, 15e-6))


@pytest.fixture
def snapshot():
    """Draw a snapshot from its sequence number and what should differ."""
    return draw_snapshot
