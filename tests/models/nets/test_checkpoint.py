"""Training that was killed goes on, and ends in the same net to the last bit."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from models.data.dataset import Dataset
from models.nets.checkpoint import Checkpoint
from models.nets.net import NetOptions
from models.nets.train import Recipe, train_net

pytest.importorskip("torch")

RUN = """
import os, signal, sys
import numpy as np
from pathlib import Path
from models.nets.batches import shuffled_batches
from models.nets.checkpoint import Checkpoint
from models.data.dataset import Dataset
from models.nets.net import NetOptions
from models.nets.train import Recipe, train_net

def run(path, stop=0):
    rng = np.random.default_rng(0)
    data = Dataset(rng.normal(size=(40, 6)), rng.uniform(0.0, 50.0, (40, 2)))
    began = []
    def progress(epoch, loss):
        began.append(epoch)
        if epoch == stop:
            os.kill(os.getpid(), signal.SIGKILL)
    trained = train_net(data, data, NetOptions((8,)), Recipe(60, 1e-2, check=7), rng, progress,
                    batches=shuffled_batches(data, 16, np.random.default_rng(1)),
                    checkpoint=Checkpoint(Path(path), every=10))
    return trained, began[0]
"""
space: dict = {}
exec(RUN, space)


@pytest.mark.slow
def test_a_killed_training_ends_in_the_same_net(tmp_path):
    path = tmp_path / "part.npz"
    code = f"{RUN}\nrun({str(path)!r}, stop=35)"
    killed = subprocess.run([sys.executable, "-c", code], env=os.environ, check=False)
    assert killed.returncode == -signal.SIGKILL
    resumed, first = space["run"](path)
    whole, _ = space["run"](tmp_path / "other.npz")
    assert first == 31
    for ours, theirs in zip(resumed.net.layers, whole.net.layers, strict=True):
        np.testing.assert_array_equal(ours[0], theirs[0])
        np.testing.assert_array_equal(ours[1], theirs[1])
    np.testing.assert_array_equal(resumed.history, whole.history)
    assert not list(tmp_path.iterdir())


def test_the_checkpoint_of_another_training_is_not_gone_on_from(tmp_path):
    checkpoint = Checkpoint(tmp_path / "part.npz")
    checkpoint.save({"task": np.array("another"), "epoch": np.array(5)})
    assert checkpoint.load("this") is None
    data = Dataset(np.eye(4), np.ones((4, 2)))
    epochs = []
    rng = np.random.default_rng(0)
    progress = lambda epoch, loss: epochs.append(epoch)  # noqa: E731
    train_net(data, data, NetOptions((3,)), Recipe(3), rng, progress, checkpoint=checkpoint)
    assert epochs == [1, 2, 3]


def test_a_damaged_checkpoint_is_refused(tmp_path):
    (tmp_path / "part.npz").write_bytes(b"not a checkpoint")
    with pytest.raises(ValueError, match="is damaged; delete it, and training begins anew"):
        Checkpoint(tmp_path / "part.npz").load("any")


def test_a_checkpoint_that_cannot_be_written_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="cannot be written"):
        Checkpoint(tmp_path / "file" / "part.npz").save({})
    with pytest.raises(ValueError, match="at least 1, got 0"):
        Checkpoint(tmp_path / "part.npz", every=0)
