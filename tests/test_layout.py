"""The house itself: flat packages with generic names, found in this tree and nowhere else."""

import ast
import importlib
import importlib.metadata
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("dic", "fe", "models", "rig", "synthetic")


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
    for path in sorted((ROOT / name).rglob("*.py")):
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


def test_tests_are_no_packages():
    assert not list((ROOT / "tests").rglob("__init__.py"))


def test_the_wheel_holds_the_packages_and_is_not_for_upload():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert tuple(wheel["packages"]) == PACKAGES
    assert "Private :: Do Not Upload" in project["project"]["classifiers"]
    assert project["project"]["scripts"] == {"touchplate": "rig.cli:main"}
    assert importlib.metadata.version("touchplate") == project["project"]["version"]
