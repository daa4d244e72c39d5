"""The search over layers: random, stored, resumed, shared."""

import os
import signal
import subprocess
import sys

import pytest

from models.nets.tune import DEPTHS, WIDTHS, tune_net


def shallow(layers):
    """Return a loss that is least for one layer of 128."""
    return 10.0 * len(layers) - sum(layers) / 1000.0


def test_candidates_come_best_first_from_the_sizes_of_table_s1():
    found = tune_net(shallow, 12)
    assert [candidate.loss for candidate in found] == sorted(shallow(c.layers) for c in found)
    assert {len(candidate.layers) for candidate in found} <= set(DEPTHS)
    assert {width for candidate in found for width in candidate.layers} <= set(WIDTHS)


def test_the_same_seed_draws_the_same_architectures():
    first, again, other = tune_net(shallow, 6), tune_net(shallow, 6), tune_net(shallow, 6, seed=1)
    assert first == again != other


def test_a_search_goes_on_where_it_ended_with_other_architectures(tmp_path):
    storage = f"sqlite:///{tmp_path}/search.db"
    tried = []

    def judge(layers):
        tried.append(layers)
        return shallow(layers)

    tune_net(judge, 4, storage)
    found = tune_net(judge, 9, storage)
    assert len(tried) == len(found) == 9
    assert tried[4:8] != tried[:4]


KILLED = """
import os, signal
from models.nets.tune import tune_net
def judge(layers):
    judge.count += 1
    if judge.count == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return 1.0
judge.count = 0
tune_net(judge, 5, {storage!r})
"""


def test_a_killed_process_loses_only_the_trial_that_it_was_at(tmp_path):
    storage = f"sqlite:///{tmp_path}/search.db"
    code = KILLED.format(storage=storage)
    killed = subprocess.run([sys.executable, "-c", code], env=os.environ, check=False)
    assert killed.returncode == -signal.SIGKILL
    count = []
    found = tune_net(lambda layers: float(bool(count.append(layers))), 5, storage)
    assert len(found) == 5
    assert len(count) == 3


def test_errors_say_what_to_do(tmp_path):
    with pytest.raises(ValueError, match="trials must be at least 1, got 0"):
        tune_net(shallow, 0)
    with pytest.raises(OSError, match=r"cannot be opened .* such as sqlite:///search.db"):
        tune_net(shallow, 1, f"sqlite:///{tmp_path}/none/search.db")
