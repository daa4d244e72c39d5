"""A whole test on a cluster: the bytes are those without one, though a worker is killed."""

import os
import signal
import socket
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest
from distributed import Client
from PIL import Image

import dic
from rig import cli
from rig.series.correlate import Cluster
from rig.series.frames import open_frames
from rig.series.regions import Extensometer, Regions
from rig.series.run import FIELDS, GRID, READINGS, run_series
from rig.series.tabulate import StrainOptions

FRAMES = 24
SHAPE = (260, 340)
SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"
WORKER = "from distributed.cli.dask_worker import main; main()"


def start(code, *arguments):
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def kill(process):
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.fixture
def cluster(tmp_path):
    """Return the address of a scheduler, and two worker processes of one thread."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    scheduler = start(SCHEDULER, "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    plain = "--no-nanny", "--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path)
    crew = [start(WORKER, address, *plain) for _ in range(2)]
    yield address, crew
    for process in (*crew, scheduler):
        kill(process)


@pytest.fixture
def folder(tmp_path):
    """Frames of noise that moves by whole px, one of them cut short."""
    wide = np.random.default_rng(4).integers(0, 255, (SHAPE[0] + 40, SHAPE[1] + 40), np.uint8)
    (tmp_path / "frames").mkdir()
    for n in range(FRAMES):
        frame = wide[n // 2 : n // 2 + SHAPE[0], n : n + SHAPE[1]]
        Image.fromarray(frame).save(tmp_path / "frames" / f"f{n}.png")
    (tmp_path / "frames" / "f7.png").write_bytes(b"no image")
    return tmp_path


@pytest.mark.slow
def test_the_bytes_are_those_without_a_cluster_though_a_worker_is_killed(cluster, folder):
    address, crew = cluster
    frames = open_frames(str(folder / "frames"))
    ref = dic.prepare(frames.read(0), 21, 6)
    regions = Regions(extensometer=[Extensometer(name="E", start=(60, 90), end=(220, 90))])
    heard, said = [], []
    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2)

    def kill_one(done, total):
        heard.append((done, total))
        if done == 3:
            kill(crew[0])

    about = (ref, frames, regions, StrainOptions(invariants=True))
    far = run_series(folder / "far", *about, cluster=Cluster(address, said.append), report=kill_one)
    here = run_series(folder / "here", *about)
    assert crew[0].poll() is not None
    assert crew[1].poll() is None
    assert [sentence.endswith("is gone; the others go on") for sentence in said] == [True]
    assert heard == [(n, FRAMES) for n in range(FRAMES + 1)]
    assert [name for name, _ in far.errors] == ["f7.png"]
    assert far.errors == here.errors
    for name in (FIELDS, GRID, READINGS):
        assert (folder / "far" / name).read_bytes() == (folder / "here" / name).read_bytes(), name


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("frames/f1.png",), "is for several frames"),
        (("frames", "--follow"), "leave out one"),
        (("frames", "--workers", "2"), "leave out one"),
    ],
)
def test_options_that_do_not_go_together_are_one_sentence(folder, monkeypatch, capsys, words, said):
    monkeypatch.chdir(folder)
    arguments = ["touchplate", "correlate", "frames/f0.png", *words, "--cluster", "tcp://x:1"]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    text = capsys.readouterr().err
    assert ended.value.code == 2
    assert said in text
    assert text.count("\n") == 1


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_one_sentence_and_nothing_is_lost(folder, monkeypatch):
    monkeypatch.setattr(import_module("models.workers"), "PATIENCE", 0.5)
    frames = open_frames(str(folder / "frames"))
    ref = dic.prepare(frames.read(0), 21, 40)
    about = (ref, frames, Regions(), StrainOptions())
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        with pytest.raises(OSError, match="cannot be reached"):
            run_series(folder / "out", *about, cluster=Cluster(address))
    assert not (folder / "out" / FIELDS).exists()
    assert run_series(folder / "out", *about).frames == FRAMES
