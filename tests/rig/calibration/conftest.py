"""A room of its own truth: a camera, flat images on a plane, and light that falls on them."""

from functools import cache
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import synthetic

SIZE = (640, 512)
LENS = synthetic.Distortion(k1=-0.11, k2=0.05, p1=0.0006, p2=-0.0004)
FOCAL, CENTRE = 820.0, (322.5, 251.2)


def camera_at(position, target=(127.0, 100.0, 0.0), up=(0.0, 1.0, 0.0)):
    pose = synthetic.look_at(position, target, up)
    return synthetic.Camera(SIZE, FOCAL, CENTRE, pose, LENS)


FINE = 2  # parts of a pixel along each side


@cache
def rays():
    """Rays of the parts of each pixel, (H W FINE², 2): the same wherever the camera stands."""
    part = (np.arange(FINE) + 0.5) / FINE - 0.5
    axes = np.arange(SIZE[1]), np.arange(SIZE[0]), part, part
    y, x, dy, dx = np.meshgrid(*axes, indexing="ij")
    px = np.stack([x + dx, y + dy], axis=-1).reshape(-1, 2)
    return LENS.straighten((px - CENTRE) / FOCAL)


def places_seen(camera, height):
    """Places (H, W, FINE², 2) mm of the plane at a height that the parts of each pixel see."""
    R = camera.T_cam_plate[:3, :3]
    towards = np.column_stack([rays(), np.ones(len(rays()))]) @ R
    centre = camera.position
    along = (height - centre[2]) / towards[:, 2:]
    return (centre[:2] + along * towards[:, :2]).reshape(SIZE[1], SIZE[0], FINE**2, 2)


def look_up(image, px):
    """Read an image (H, W) at px (..., 2), bilinear, grey beside it."""
    flat = px.reshape(-1, 1, 2).astype(np.float32)
    rows = len(flat)
    wide = 4096
    padded = np.zeros((-(-rows // wide) * wide, 1, 2), np.float32)
    padded[:rows] = flat
    maps = padded.reshape(-1, wide, 2)
    read = cv2.remap(
        image.astype(np.float32), maps[..., 0], maps[..., 1], cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT, borderValue=110,
    )  # fmt: skip
    return read.ravel()[:rows].reshape(px.shape[:-1])


def photograph(sharp, rng, noise=2.0):
    """Blur by a lens, add noise and round, (H, W) grey levels → uint8."""
    blurred = cv2.GaussianBlur(sharp.astype(np.float32), (0, 0), 0.6)
    return np.clip(np.rint(blurred + rng.normal(0, noise, sharp.shape)), 0, 255).astype(np.uint8)


def make_room():
    """Give camera_at, places_seen, look_up and photograph."""
    return SimpleNamespace(
        camera_at=camera_at, places_seen=places_seen, look_up=look_up, photograph=photograph,
        size=SIZE, focal=FOCAL, centre=CENTRE, lens=LENS,
    )  # fmt: skip


@pytest.fixture(scope="session")
def room():
    """Give the room to each test."""
    return make_room()
