"""Compiled code on disk: damaged files are compiled again, in every package that compiles."""

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("dic", "fe", "models", "synthetic")


def double(x):
    return 2 * x


@pytest.fixture
def compiled(tmp_path, monkeypatch):
    """Compile `double` into a folder as a new process would."""
    from numba import config

    def make(package):
        njit = importlib.import_module(f"{package}.compiled").njit
        return njit(cache=True, nogil=True)(double)

    with monkeypatch.context() as inside:
        inside.setenv("NUMBA_CACHE_DIR", str(tmp_path))
        config.reload_config()
        yield make
    config.reload_config()


def hits(function):
    return sum(function.stats.cache_hits.values())


@pytest.mark.parametrize("package", PACKAGES)
def test_what_was_compiled_is_found_again(compiled, package):
    assert compiled(package)(3) == 6
    again = compiled(package)
    assert (again(3), hits(again)) == (6, 1)


def empty(content):
    return b""


def halved(content):
    return content[: len(content) // 2]


def flipped(content):
    changed = bytearray(content)
    changed[len(changed) // 2] ^= 4
    return bytes(changed)


@pytest.mark.parametrize("damage", [empty, halved, flipped])
@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_damaged_code_is_compiled_again_and_kept_whole(compiled, tmp_path, suffix, damage):
    compiled("dic")(3)
    (path,) = tmp_path.rglob(f"*.{suffix}")
    path.write_bytes(damage(path.read_bytes()))
    healed = compiled("dic")
    assert (healed(3), hits(healed)) == (6, 0)
    again = compiled("dic")
    assert (again(3), hits(again)) == (6, 1)


def test_the_packages_keep_code_in_the_same_way():
    texts = {(ROOT / package / "kernel_file.py").read_text() for package in PACKAGES}
    assert len(texts) == 1
