"""Photographs of a sheet that is pulled along x, drawn exactly, and their result."""

import asyncio

import httpx
import numpy as np
import pytest
from PIL import Image

import dic
from rig.series.frames import open_frames
from rig.series.regions import Regions
from rig.series.run import FIELDS, run_series
from rig.series.tabulate import StrainOptions
from rig.view.server import application
from rig.view.viewed import SomeFrames, ViewedTest
from rig.web.access import Access

SHAPE = (110, 150)
STRETCH = 0.004  # a frame
SUBSET, STEP = 21, 7
ADDRESS = "http://127.0.0.1:8765"


def draw(stretch, seed=5):
    """Gaussian spots that move before they are drawn, (H, W) uint8."""
    rng = np.random.default_rng(seed)
    height, width = SHAPE
    middle = np.array([width - 1, height - 1]) / 2
    centres = rng.uniform(-10, [width + 10, height + 10], (1000, 2))
    centres = middle + (centres - middle) * (1 + stretch, 1.0)
    x = np.exp(-(((np.arange(width)[:, None] - centres[:, 0]) / 2.2) ** 2))
    y = np.exp(-(((np.arange(height)[:, None] - centres[:, 1]) / 2.2) ** 2))
    clean = 230 - 190 * (1 - np.exp(-0.9 * (y @ x.T)))
    noise = np.random.default_rng(round(1e6 * stretch)).normal(0, 2.0, SHAPE)
    return np.clip(np.rint(clean + noise), 0, 255).astype(np.uint8)


@pytest.fixture(scope="session")
def photographs(tmp_path_factory):
    """Folder of a reference and three frames."""
    folder = tmp_path_factory.mktemp("photographs")
    for n in range(4):
        Image.fromarray(draw(STRETCH * n)).save(folder / f"f{n}.png")
    return folder


@pytest.fixture(scope="session")
def result(photographs, tmp_path_factory):
    """Path of the result of the three frames."""
    frames = open_frames(str(photographs))
    ref = dic.prepare(frames.read(0), SUBSET, STEP)
    folder = tmp_path_factory.mktemp("result")
    run_series(folder, ref, SomeFrames(frames, (1, 2, 3)), Regions(), StrainOptions())
    return folder / FIELDS


class Client:
    """Asks the page's server in this process, as a browser at an address does."""

    def __init__(self, test, access=None, peer="127.0.0.1"):
        self.application, self.peer = application(test, access or Access()), (peer, 50000)

    def _ask(self, method, path, **more):
        async def asked():
            way = httpx.ASGITransport(self.application, client=self.peer)
            async with httpx.AsyncClient(transport=way, base_url=ADDRESS) as client:
                return await client.request(method, path, **more)

        return asyncio.run(asked())

    def get(self, path, **more):
        return self._ask("GET", path, **more)

    def post(self, path, **more):
        return self._ask("POST", path, **more)


@pytest.fixture
def client():
    return Client


@pytest.fixture
def viewed(photographs, result, tmp_path):
    """Open the result with its images under it."""
    with ViewedTest(open_frames(str(photographs)), result, tmp_path / "test") as test:
        yield test
