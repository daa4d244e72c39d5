import multiprocessing
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig import CacheError
from rig.system import cache


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@dataclass(frozen=True)
class Plate:
    thickness: float


@dataclass(frozen=True)
class Shell:
    thickness: float


def never():
    raise RuntimeError("computed again")


def arrays():
    return {"a": np.arange(6.0).reshape(2, 3), "b": np.array(7), "c": np.zeros((0, 2), np.float32)}


def only_file(home):
    (path,) = home.rglob("*.npz")
    return path


def test_a_result_is_computed_once(home):
    first = cache.fetch("thing", {"n": 3}, arrays)
    second = cache.fetch("thing", {"n": 3}, never)
    assert second.keys() == first.keys()
    for name, array in first.items():
        np.testing.assert_array_equal(second[name], array)
        assert second[name].dtype == array.dtype
    assert [path.suffix for path in home.rglob("*.*")] == [".npz"]


DIFFERENT = [
    1,
    1.0,
    True,
    "1",
    None,
    (1,),
    ((1,),),
    (1, 1),
    "11",
    ("1", "1"),
    {"a": 1},
    {"b": 1},
    Plate(1.0),
    Shell(1.0),
    Plate(2.0),
    np.zeros(4),
    np.zeros((2, 2)),
    np.zeros(4, np.float32),
    np.array([0.0, 0.0, 0.0, 1e-300]),
    cache,
    multiprocessing,
]


def test_whatever_differs_has_another_key():
    keys = [cache.key("kind", part) for part in DIFFERENT]
    assert len(set(keys)) == len(DIFFERENT)
    assert cache.key("other", 1) != cache.key("kind", 1)


@given(st.dictionaries(st.text(), st.integers() | st.floats(allow_nan=False) | st.text()))
def test_the_order_of_a_mapping_does_not_matter(parts):
    turned = dict(reversed(parts.items()))
    assert cache.key("kind", parts) == cache.key("kind", turned)


def test_the_layout_of_an_array_in_memory_does_not_matter():
    array = np.arange(12.0).reshape(3, 4)
    assert cache.key("kind", array) == cache.key("kind", np.asfortranarray(array))


def test_a_part_without_content_is_refused():
    with pytest.raises(TypeError, match="a function cannot be part of a cache key"):
        cache.key("kind", [never])


def test_a_result_does_not_outlive_the_code_that_made_it(tmp_path, monkeypatch):
    source = tmp_path / "made.py"
    source.write_text("x = 1\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    import made  # pyright: ignore[reportMissingImports]

    before = cache.key("kind", made)
    source.write_text("x = 2\n", encoding="utf-8")
    assert cache.key("kind", made) != before


@pytest.mark.parametrize("place", [0.0, 0.3, 0.5, 0.9, 0.9999])
def test_a_file_with_a_changed_byte_is_computed_again(home, place):
    cache.fetch("thing", 1, lambda: {"a": np.ones(5000)})
    path = only_file(home)
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= 1
    path.write_bytes(content)
    healed(path)


@pytest.mark.parametrize("length", [0, 10, 32, 1000, -1])
def test_a_truncated_file_is_computed_again(home, length):
    cache.fetch("thing", 1, lambda: {"a": np.ones(5000)})
    path = only_file(home)
    path.write_bytes(path.read_bytes()[:length])
    healed(path)


def healed(path):
    with pytest.warns(cache.CacheWarning, match=f"{path.name} was damaged and is computed again"):
        assert cache.fetch("thing", 1, arrays).keys() == arrays().keys()
    assert cache.fetch("thing", 1, never).keys() == arrays().keys()


def test_a_deleted_file_is_computed_again(home):
    cache.fetch("thing", 1, arrays)
    only_file(home).unlink()
    assert cache.fetch("thing", 1, arrays).keys() == arrays().keys()


def test_a_folder_that_cannot_be_written_is_refused_before_the_work(tmp_path, monkeypatch):
    blocked = tmp_path / "blocked"
    blocked.write_text("a file, not a folder")
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(blocked))
    with pytest.raises(CacheError, match=r"cannot be written .*TOUCHPLATE_CACHE"):
        cache.fetch("thing", 1, never)


def test_a_full_disk_leaves_nothing_half_written(home, monkeypatch):
    def full(file, **_):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(CacheError, match="No space left on device"):
        cache.fetch("thing", 1, arrays)
    assert not [path for path in home.rglob("*") if path.is_file()]


def test_a_failed_computation_leaves_nothing(home):
    with pytest.raises(RuntimeError):
        cache.fetch("thing", 1, never)
    assert not [path for path in home.rglob("*") if path.is_file()]


def racing(_):
    return float(cache.fetch("race", 1, lambda: {"a": np.full(200_000, 3.0)})["a"].sum())


def test_processes_that_race_all_get_the_whole_result(home):
    with multiprocessing.get_context("fork").Pool(4) as pool:
        assert set(pool.map(racing, range(12))) == {600_000.0}
    assert only_file(home)
