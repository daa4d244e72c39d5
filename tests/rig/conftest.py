"""A small bench for the tests of the live loop, and what a process leaves behind."""

import os
import time
from pathlib import Path

import numpy as np
import pytest

import rig
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.recording.recorder import SessionRecorder
from rig.sources.twin import build_twin
from rig.system.frame import Frame

SMALL = {
    "plate.size": [254, 203],
    "camera.pixels": [384, 320],
    "pattern.diameter": 3.5,  # mm; 5 px of this camera, as the shipped scene has
    "dic.tile": 8,
    "dic.subset": 25,
    "estimator.modes": 100,
}


class InHand:
    """The twin as a source without a process: every frame of `sequences`, one a grab."""

    def __init__(self, twin, sequences, with_truth=True):
        self._twin = twin
        self._sequences = iter(sequences)
        self._with_truth = with_truth
        # A plate that rings moves by the time of its script: long ago, so that no frame is ahead.
        self._begun = time.monotonic() - 60.0
        self.status = "the twin gives no images"

    def grab(self, timeout):
        sequence = next(self._sequences, None)
        if sequence is None:
            raise EOFError("the frames are over")
        touches = self._twin.touches(sequence)
        image = self._twin.frame(sequence, touches)
        rings = getattr(self._twin, "ringing", None)
        captured = self._begun + sequence / self._twin.rate if rings else time.monotonic()
        return Frame(sequence, captured, image, touches if self._with_truth else None)


@pytest.fixture(scope="session")
def live_cache(tmp_path_factory):
    """Folder of a cache that the tests of the live loop share."""
    return tmp_path_factory.mktemp("live-cache")


@pytest.fixture(scope="module")
def small(live_cache):
    """Load the twin with a small camera, changed as asked: `small({"source.script": "empty"})`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TOUCHPLATE_CACHE", str(live_cache))
        yield lambda overrides=(): rig.load("twin", SMALL | dict(overrides))


@pytest.fixture
def small_overrides():
    """Return what makes the twin small, as overrides of its scene."""
    return dict(SMALL)


@pytest.fixture
def in_hand():
    """Make a source without a process: `in_hand(twin, sequences, with_truth=True)`."""
    return InHand


@pytest.fixture
def session(small, in_hand):
    """Record frames of the twin: `session(path, sequences)` gives scene, bench and snapshots."""

    def make(path, sequences, waiting=100, changes=(), **options):
        scene = small({"touches.max_touches": 2} | dict(changes))
        bench = build_bench(scene, lambda done, total: None)
        source = in_hand(build_twin(scene), [*range(16), *sequences])
        with SessionRecorder(
            path, {"scene": scene.model_dump_json()}, waiting=waiting, **options
        ) as recorder:
            stream = iter(Loop(bench, source, recorder=recorder))
            shots = [next(stream) for _ in sequences]
        return bench, shots, recorder

    return make


@pytest.fixture(scope="session")
def small_settings():
    """Arguments of the command line that make the twin small."""
    return [f"--set={key}={value}" for key, value in SMALL.items()]


@pytest.fixture
def ended():
    """Wait for processes to end; gives those of `pids` that do not within `limit` s."""

    def wait(pids, limit=10.0):
        end = time.monotonic() + limit
        while (left := [pid for pid in pids if _runs(pid)]) and time.monotonic() < end:
            time.sleep(0.02)
        return left

    return wait


@pytest.fixture
def shared_memory():
    """Names of the shared memory that a process has mapped."""

    def names(pid):
        maps = Path(f"/proc/{pid}/maps").read_text()
        return {line.split()[5] for line in maps.splitlines() if "/dev/shm/psm_" in line}

    return names


@pytest.fixture
def session_of():
    """Numbers of the processes that belong to a session."""

    def pids(session):
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and _runs(int(entry.name)):
                try:
                    if os.getsid(int(entry.name)) == session:
                        found.append(int(entry.name))
                except ProcessLookupError:
                    pass
        return found

    return pids


def _runs(pid):
    """Whether a process exists and is no zombie, which waits for nothing but its parent."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


@pytest.fixture
def rng():
    return np.random.default_rng(7)
