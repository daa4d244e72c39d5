"""The lock: whole, installed as it stands, open to the oldest Python that the project allows."""

import re
import tomllib
from importlib.metadata import distribution
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OLDEST = PROJECT["requires-python"].removeprefix(">=")


def pins(name):
    return [Requirement(line) for line in (ROOT / name).read_text(encoding="utf-8").splitlines()]


LOCKED, TORCH = pins("requirements.lock"), pins("requirements-torch.lock")
NAMES = {canonicalize_name(pin.name) for pin in LOCKED + TORCH}


@pytest.mark.parametrize("pin", LOCKED + TORCH, ids=str)
def test_a_pin_is_installed_and_allows_the_oldest_python(pin):
    installed = distribution(pin.name)
    assert pin.specifier.contains(installed.version, prereleases=True)
    allowed = SpecifierSet(installed.metadata.get("Requires-Python") or "")
    assert allowed.contains(OLDEST), f"{pin} wants Python {allowed}"


def required(requirements):
    """Names of requirements that hold here, extras left out."""
    parsed = (Requirement(text) for text in requirements)
    here = (need for need in parsed if not need.marker or need.marker.evaluate({"extra": ""}))
    return {canonicalize_name(need.name) for need in here}


@pytest.mark.parametrize("pin", LOCKED, ids=str)
def test_the_lock_holds_what_a_pin_requires(pin):
    """Pip takes it with ``--no-deps``, so nothing is added that was not looked at."""
    assert required(distribution(pin.name).requires or []) <= NAMES


def licence(name):
    """Return what a package says of its licence: an expression, else words and classifiers."""
    said = distribution(name).metadata
    classes = [kind for kind in said.get_all("Classifier", []) if kind.startswith("License")]
    return said.get("License-Expression") or "; ".join([said.get("License", "")[:200], *classes])


@pytest.mark.parametrize("pin", LOCKED + TORCH, ids=str)
def test_a_pin_leaves_the_project_under_its_own_licence(pin):
    """The GPL would not; the Lesser GPL, by which pygame comes, does."""
    lesser = licence(pin.name).replace("LGPL", "").replace("Lesser General Public License", "")
    assert not re.search("GPL|General Public License", lesser)


def test_the_lock_holds_what_the_project_requires():
    extras = PROJECT["optional-dependencies"]
    assert required(chain(PROJECT["dependencies"], extras["dev"])) <= NAMES
