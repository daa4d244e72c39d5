"""The house itself: flat packages with generic names, found in this tree and nowhere else."""

import ast
import importlib
import importlib.metadata
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("dic", "fe", "models", "rig", "synthetic")
NEEDS = {
    "rig": ("dic", "fe", "models", "synthetic"),
    "models": ("dic", "fe", "synthetic"),
    "synthetic": ("dic", "fe"),
}
"""What each package imports of the others."""


@pytest.mark.parametrize("name", PACKAGES)
def test_each_package_is_the_one_of_this_tree(name):
    module = importlib.import_module(name)
    assert module.__file__ is not None
    assert Path(module.__file__).resolve() == ROOT / name / "__init__.py"


@pytest.mark.parametrize("name", PACKAGES)
def test_everything_a_package_offers_is_there(name):
    module = importlib.import_module(name)
    for public in module.__all__:
        assert getattr(module, public) is not None
    with pytest.raises(AttributeError):
        module.no_such_name  # noqa: B018


@pytest.mark.parametrize("name", PACKAGES)
def test_a_door_is_not_hidden_by_the_file_of_its_name(name):
    package = importlib.import_module(name)
    for path in (ROOT / name).glob("[a-z]*.py"):
        module = importlib.import_module(f"{name}.{path.stem}")
        if path.stem in package.__all__ and hasattr(module, path.stem):
            assert getattr(package, path.stem) is getattr(module, path.stem)


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_takes_from_others_what_they_offer(name):
    studies = ROOT / "rig" / "studies"  # they measure what stands inside as well
    for path in sorted(set((ROOT / name).rglob("*.py")) - set(studies.rglob("*.py"))):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                taken = [(alias.name, None) for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                taken = [(node.module or "", alias.name) for alias in node.names]
            else:
                continue
            for module, public in taken:
                if module.split(".")[0] not in set(PACKAGES) - {name}:
                    continue
                assert module in PACKAGES, f"{path}: {module} is inside a package"
                assert public is None or public in importlib.import_module(module).__all__, path


@pytest.mark.parametrize(
    ("package", "hidden"), [(name, other) for name, others in NEEDS.items() for other in others]
)
def test_a_file_that_hides_a_package_is_named(tmp_path, package, hidden):
    own = tmp_path / f"{hidden}.py"
    own.write_text("")
    script = tmp_path / "script.py"
    script.write_text(f"import {package}\n")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    *_, last = done.stderr.splitlines()
    assert last == f"ImportError: '{hidden}' is '{own}' and not touchplate's; rename that file"


def test_a_script_that_hides_no_package_imports_all(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"import {', '.join(PACKAGES)}\n")
    subprocess.run([sys.executable, script], check=True)


def test_a_class_of_one_package_has_a_name_of_its_own():
    homes: dict[str, set[str]] = {}
    for name in PACKAGES:
        for path in (ROOT / name).rglob("*.py"):
            if path.is_relative_to(
                ROOT / "rig" / "studies"
            ):  # programs, each with words of its own
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    homes.setdefault(node.name, set()).add(name)
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_tests_are_no_packages():
    assert not list((ROOT / "tests").rglob("__init__.py"))


def test_the_wheel_holds_the_packages_and_is_not_for_upload():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert tuple(wheel["packages"]) == PACKAGES
    assert "Private :: Do Not Upload" in project["project"]["classifiers"]
    assert project["project"]["scripts"] == {"touchplate": "rig.cli:main"}
    assert importlib.metadata.version("touchplate") == project["project"]["version"]
