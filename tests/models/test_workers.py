"""Work on a local cluster whose worker is killed, and on one whose scheduler goes."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from importlib import import_module

import cloudpickle
import numpy as np
import pytest
from distributed import Client

from models.data.reader import read_dataset
from models.data.sampling_plan import BLOCK, SamplingPlan, TouchBox
from models.data.writer import begin_dataset
from models.forward.simulator import superpose
from models.nets.tune import tune_net
from models.workers import workers

# Workers do not find this file.
cloudpickle.register_pickle_by_value(sys.modules[__name__])

SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"
WORKER = "from distributed.cli.dask_worker import main; main()"
GAUGES = np.array([[10.0, 0.0], [60.0, 15.0]])
PLAN = SamplingPlan(TouchBox((5.0, 5.0, 0.5), (55.0, 35.0, 1.0)), touches=2, samples=5 * BLOCK - 7)


def start(code, *arguments):
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def stop(process):
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.fixture
def scheduler():
    """Return the address of a scheduler and its process."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    process = start(SCHEDULER, "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    yield address, process
    stop(process)


@pytest.fixture
def cluster(scheduler, tmp_path):
    """Return the address of a scheduler, its process, and those of two workers of one thread."""
    address, process = scheduler
    plain = "--no-nanny", "--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path)
    crew = [start(WORKER, address, *plain) for _ in range(2)]
    yield address, process, crew
    for worker in crew:
        stop(worker)


def unit(xy):
    time.sleep(0.2)  # so that a kill comes on the way
    apart = np.linalg.norm(xy[:, None] - GAUGES, axis=2)
    return np.stack([apart, 2.0 * apart, -apart], axis=2)


def quick(xy):
    apart = np.linalg.norm(xy[:, None] - GAUGES, axis=2)
    return np.stack([apart, 2.0 * apart, -apart], axis=2)


def test_without_a_scheduler_the_map_is_python_s_own():
    with workers(None) as each:
        assert each is map


def test_a_data_set_is_whole_though_a_worker_is_killed_and_the_same_as_one_written_here(
    cluster, tmp_path
):
    address, _, crew = cluster
    heard = []

    def kill_one(done, total):
        heard.append(done)
        if len(heard) == 1:
            stop(crew[0])

    far, here, said = tmp_path / "far.h5", tmp_path / "here.h5", []
    wait_for_both(address)
    with workers(address, said.append) as each:
        begin_dataset(far, PLAN, GAUGES, {}).fill(superpose(unit), kill_one, each)
    begin_dataset(here, PLAN, GAUGES, {}).fill(superpose(quick))
    assert heard == [min(BLOCK * number, PLAN.rows) for number in range(1, 6)]
    assert len(read_dataset(far)) == PLAN.rows
    assert far.read_bytes() == here.read_bytes()
    (sentence,) = said
    assert re.fullmatch(r"worker tcp://127.0.0.1:\d+ is gone; the others go on", sentence)


def wait_for_both(address):
    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2)


@pytest.fixture
def impatient(monkeypatch):
    """Wait a moment for a worker where there is none."""
    module = import_module("models.workers")
    monkeypatch.setattr(module, "ALONE", 0.5)
    monkeypatch.setattr(module, "LOOK", 0.1)


def test_when_no_worker_is_left_it_ends_in_a_sentence_and_what_was_done_is_kept(
    cluster, tmp_path, impatient
):
    address, _, crew = cluster
    path, said = tmp_path / "cut.h5", []

    def kill_all(done, total):
        if done == 2 * BLOCK:
            for worker in crew:
                stop(worker)

    wait_for_both(address)
    with (
        pytest.raises(OSError, match=r"had no worker for 0\.5 s; start some with 'dask worker tcp"),
        workers(address, said.append) as each,
    ):
        begin_dataset(path, PLAN, GAUGES, {}).fill(superpose(unit), kill_all, each)
    assert sum("is gone" in sentence for sentence in said) == 2
    assert said[-1] == f"scheduler {address} has no worker; waiting 0.5 s for one"
    assert 2 * BLOCK <= begin_dataset(path, PLAN, GAUGES, {}).found < PLAN.rows


def test_results_that_died_with_the_last_worker_are_not_waited_for(cluster, impatient):
    address, _, crew = cluster
    wait_for_both(address)
    with workers(address) as each:
        results = each(judge, [(n, n) for n in range(8)])
        next(results)
        time.sleep(0.5)  # those of the window are done
        for worker in crew:
            stop(worker)
        with pytest.raises(OSError, match=r"had no worker for 0\.5 s"):
            list(results)


def test_a_scheduler_that_never_had_a_worker_is_not_waited_for(scheduler, impatient):
    address, _ = scheduler
    said = []
    with (
        pytest.raises(OSError, match="run again, what was done is kept"),
        workers(address, said.append) as each,
    ):
        list(each(judge, [(1, 2)]))
    assert said == [f"scheduler {address} has no worker; waiting 0.5 s for one"]


def judge(layers):
    time.sleep(0.1)
    return float(sum(layers))


def test_a_search_has_each_trial_once_though_a_worker_is_killed(cluster, tmp_path):
    address, _, crew = cluster
    storage = f"sqlite:///{tmp_path}/search.db"
    heard = []

    def kill_one(done, last):
        heard.append(done)
        if done == 2:
            stop(crew[0])

    with workers(address) as each:
        found = tune_net(judge, 8, storage, on_trial=kill_one, each=each)
    assert heard == list(range(1, 9))
    assert len(found) == 8
    assert all(candidate.loss == sum(candidate.layers) for candidate in found)
    assert tune_net(judge, 8, storage) == found  # nothing is left to do


@pytest.mark.slow
def test_a_scheduler_that_goes_is_one_sentence_and_what_was_done_is_kept(cluster, tmp_path):
    address, scheduler, _ = cluster
    path = tmp_path / "cut.h5"

    def kill(done, total):
        if done == 2 * BLOCK:
            stop(scheduler)

    file = begin_dataset(path, PLAN, GAUGES, {})
    with (
        pytest.raises(OSError, match=r"scheduler tcp://.* was lost on the way; start it and run"),
        workers(address) as each,
    ):
        file.fill(superpose(unit), kill, each)
    again = begin_dataset(path, PLAN, GAUGES, {})
    assert 2 * BLOCK <= again.found < PLAN.rows
    again.fill(superpose(quick))
    assert len(read_dataset(path)) == PLAN.rows


def test_a_scheduler_that_is_not_there_is_one_sentence(monkeypatch):
    monkeypatch.setattr(import_module("models.workers"), "PATIENCE", 0.5)
    with (
        pytest.raises(OSError, match=r"scheduler tcp://127.0.0.1:9 cannot be reached .* without"),
        workers("tcp://127.0.0.1:9"),
    ):
        pass


NONSENSE = """
from models import workers

try:
    with workers("nonsense"):
        pass
except OSError as error:
    print(error)
    raise SystemExit(2)  # with the error at hand, as a command ends
"""


def test_an_address_that_is_none_is_one_sentence_and_nothing_after_it():
    done = subprocess.run([sys.executable, "-c", NONSENSE], capture_output=True, text=True)
    assert "scheduler nonsense cannot be reached (missing port number" in done.stdout
    assert (done.stderr, done.returncode) == ("", 2)
