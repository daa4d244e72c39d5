"""Data sets on disk: the same bytes whether cut off or not, and nothing half-written is read."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from models import begin_dataset, read_dataset, superpose
from models.data import writer
from models.data.dataset import grid_places
from models.data.flat_file import locate
from models.data.sampling_plan import BLOCK, SamplingPlan, TouchBox, TouchLattice

GAUGES = np.array([(0.0, 5.0), (60.0, 15.0), (25.0, 40.0), (35.0, 0.0)])
PLACES = grid_places((60.0, 40.0), spacing=5.0, margin=10.0)
PLAN = SamplingPlan(TouchLattice(PLACES, np.arange(1.0, 6.0)), 2, 3 * BLOCK + 1000, seed=7)
ABOUT = {"scene": {"plate": {"thickness": 1.0}, "dataset": {"seed": 7}}}


def unit(xy):
    """Strain that is any smooth function of the place of a touch, per newton."""
    away = xy[:, None] - GAUGES
    r2 = (away**2).sum(axis=2)
    return np.stack([np.exp(-r2 / 900), away[..., 0] / (50 + r2), away[..., 1] / 60], axis=2)


SIMULATOR = superpose(unit)


def write(path, plan=PLAN, simulator=SIMULATOR, about=ABOUT, progress=None):
    file = begin_dataset(path, plan, GAUGES, about)
    file.fill(simulator, progress)
    return file.found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "set.h5"
    assert write(path) == 0
    return path


def cut_off(path, after, **options):
    def stop(done, rows):
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(path, progress=stop, **options)


def test_what_is_read_is_what_the_plan_and_the_plate_say(whole):
    got = read_dataset(whole)
    touches = np.concatenate([PLAN.block(k) for k in range(PLAN.blocks)])
    assert len(got) == len(touches) == PLAN.rows
    np.testing.assert_array_equal(got.touches, touches)
    np.testing.assert_array_equal(got.gauges, GAUGES)
    assert got.about == ABOUT
    assert got.strain.dtype == np.float32
    expected = sum(touches[:, k, 2, None, None] * unit(touches[:, k, :2]) for k in (0, 1))
    np.testing.assert_allclose(got.strain, expected, rtol=1e-7, atol=1e-7)


def test_the_same_seed_gives_the_same_bytes(whole, tmp_path):
    write(tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("after", [1, BLOCK + 1, 3 * BLOCK])
def test_a_run_that_was_cut_off_goes_on_to_the_same_bytes(whole, tmp_path, after):
    path = tmp_path / "set.h5"
    cut_off(path, after)
    with pytest.raises(ValueError, match=r"holds \d+ of 13288 samples; run the command"):
        read_dataset(path)
    assert write(path) == -(-after // BLOCK) * BLOCK
    assert path.read_bytes() == whole.read_bytes()


def test_only_what_is_missing_is_computed(tmp_path):
    path, asked = tmp_path / "set.h5", []

    def counted(touches):
        asked.append(len(touches))
        return SIMULATOR(touches)

    cut_off(path, 2 * BLOCK)
    write(path, simulator=counted)
    assert asked == [BLOCK, BLOCK, 1000]  # the last block that was there, to see that it is so
    assert write(path) == PLAN.rows


@pytest.mark.parametrize(
    "delay", np.random.default_rng().uniform(0.02, 0.4, 3), ids=["a", "b", "c"]
)
def test_a_run_that_was_killed_goes_on_to_the_same_bytes(whole, tmp_path, delay):
    """Killed at a moment drawn anew in each run; four blocks take about 0.4 s here."""
    path = tmp_path / "set.h5"
    code = (
        "import importlib.util, sys, time\n"
        f"spec = importlib.util.spec_from_file_location('t', {__file__!r})\n"
        "t = importlib.util.module_from_spec(spec); spec.loader.exec_module(t)\n"
        "def slow(touches):\n    time.sleep(0.1); return t.SIMULATOR(touches)\n"
        "print('ready', flush=True)\n"
        f"t.write({str(path)!r}, simulator=slow)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        time.sleep(delay)
        os.kill(process.pid, signal.SIGKILL)
    if path.exists():
        try:
            assert len(read_dataset(path)) == PLAN.rows
        except ValueError as refusal:
            assert "samples; run the command that began it" in str(refusal)  # noqa: PT017
    write(path)
    assert path.read_bytes() == whole.read_bytes()
    assert len(read_dataset(path)) == PLAN.rows


def test_the_strain_before_any_touch_is_added_to_each_sample():
    before = np.arange(12.0).reshape(4, 3)
    touches = PLAN.block(0)[:5]
    added = superpose(unit, before)(touches) - SIMULATOR(touches)
    np.testing.assert_allclose(added, np.tile(before, (5, 1, 1)), atol=1e-12)


def test_batches_hold_every_row_once_in_random_order(whole):
    data = read_dataset(whole)
    batches = list(data.batches(3000, np.random.default_rng(0)))
    assert [len(touches) for _, touches in batches] == [3000] * 4 + [1288]
    rows = np.concatenate([touches.reshape(-1, 6) for _, touches in batches])
    assert not np.array_equal(rows, data.touches.reshape(-1, 6))
    order, expected = np.lexsort(rows.T), np.lexsort(data.touches.reshape(-1, 6).T)
    np.testing.assert_array_equal(rows[order], data.touches.reshape(-1, 6)[expected])
    strain, touches = batches[2]
    np.testing.assert_allclose(strain, SIMULATOR(touches), rtol=1e-6, atol=1e-7)


def test_reading_takes_no_memory_until_rows_are_asked_for(whole):
    data = read_dataset(whole)
    assert isinstance(data.strain, np.memmap)
    with pytest.raises(ValueError, match="read-only"):
        data.strain[0] = 0.0


def test_a_box_may_hold_one_touch_of_one_force(tmp_path):
    plan = SamplingPlan(TouchBox((10.0, 10.0, 1.0), (50.0, 30.0, 1.0)), 1, 100)
    write(tmp_path / "set.h5", plan)
    data = read_dataset(tmp_path / "set.h5")
    assert data.touches.shape == (100, 1, 3)
    np.testing.assert_array_equal(data.touches[..., 2], 1.0)


def test_another_plan_is_not_mixed_into_a_file(whole, tmp_path):
    path = tmp_path / "set.h5"
    path.write_bytes(whole.read_bytes())
    other = {"scene": {"plate": {"thickness": 1.0}, "dataset": {"seed": 8}}}
    with pytest.raises(ValueError, match=r"begun with scene.dataset.seed = 7, got 8; delete it"):
        write(path, about=other)
    with pytest.raises(ValueError, match="begun by another version of this program"):
        write(path, simulator=lambda touches: 1.01 * SIMULATOR(touches))
    assert path.read_bytes() == whole.read_bytes()


def test_damage_is_seen(whole, tmp_path):
    content = bytearray(whole.read_bytes())
    _, places = locate(whole)
    for name in ("strain", "touches"):
        broken = content.copy()
        broken[places[name].offset + 4321] ^= 1
        (tmp_path / "broken.h5").write_bytes(broken)
        with pytest.raises(ValueError, match=r"broken\.h5 is damaged; delete it"):
            read_dataset(tmp_path / "broken.h5")
    (tmp_path / "short.h5").write_bytes(content[: len(content) // 2])
    with pytest.raises(ValueError, match="damaged or no HDF5 file"):
        read_dataset(tmp_path / "short.h5")


def test_what_is_no_data_set_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="does not exist; write it first"):
        read_dataset(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text(json.dumps(ABOUT))
    for call in (read_dataset, write):
        with pytest.raises(ValueError, match=r"text\.h5 is damaged or no HDF5 file"):
            call(tmp_path / "text.h5")
    with pytest.raises(IsADirectoryError, match="is a folder; give the name of a file"):
        write(tmp_path)


def test_a_full_disk_is_one_sentence_and_keeps_what_was_done(whole, tmp_path, monkeypatch):
    path, put = tmp_path / "set.h5", writer.ArrayPlace.put

    def full(place, file, row, rows):
        if len(place.shape) == 3 and row >= 2 * BLOCK:
            raise OSError(28, "No space left on device")
        put(place, file, row, rows)

    with monkeypatch.context() as patch:
        patch.setattr(writer.ArrayPlace, "put", full)
        with pytest.raises(OSError, match=r"cannot be written \(No space left.*run again to go on"):
            write(path)
    assert write(path) == 2 * BLOCK
    assert path.read_bytes() == whole.read_bytes()
