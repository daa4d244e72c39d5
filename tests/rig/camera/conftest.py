"""An emulated camera at /dev/video0."""

from importlib.util import find_spec

import cv2
import numpy as np
import pytest

from tests.rig.emulation.clients import emulate

NEEDS = {"test_machine_vision.py": ("pypylon", "genicam"), "test_linuxpy.py": ("linuxpy",)}
"""Packages of extras that are not in the lock."""
collect_ignore = [name for name, needs in NEEDS.items() if not all(map(find_spec, needs))]

SIZE, RATE = (96, 64), 50


@pytest.fixture
def emulation():
    with emulate("camera", *SIZE, RATE) as camera:
        yield camera


@pytest.fixture
def compressing(tmp_path):
    """Give a camera that sends one JPEG over and over, and the path of that."""
    path = tmp_path / "sent.jpg"
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    cv2.imwrite(str(path), (120 + 80 * np.sin(x / 7) * np.cos(y / 5)).astype(np.uint8))
    with emulate("camera", *SIZE, RATE, path) as camera:
        yield camera, path
