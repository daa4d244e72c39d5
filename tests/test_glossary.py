"""The glossary: every term once and in order, every public class once and no other."""

import importlib
import inspect
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs/glossary.md"
PACKAGES = ("dic", "fe", "models", "rig", "synthetic")


def entries():
    """First and second cell of each row, of the terms and of the classes."""
    terms, classes = PAGE.read_text(encoding="utf-8").split("## Classes\n")
    return [
        [
            tuple(cell.strip(" `") for cell in row.split("|")[1:3])
            for row in part.splitlines()
            if row.startswith("| ")
        ][1:]
        for part in (terms, classes)
    ]


def public_classes():
    for package in map(importlib.import_module, PACKAGES):
        for name in package.__all__:
            if inspect.isclass(getattr(package, name)):
                yield f"{package.__name__}.{name}"


def test_each_term_is_defined_once_in_order():
    terms = [term for term, _ in entries()[0]]
    assert len(terms) > 60
    assert terms == sorted(set(terms), key=str.casefold)


def test_each_public_class_is_defined_once_in_order():
    assert [name for name, _ in entries()[1]] == sorted(public_classes())


def test_each_definition_is_a_sentence_of_its_own():
    said = [what for part in entries() for _, what in part]
    assert all(what.endswith((".", ")")) and what[0].isupper() for what in said)
    assert len(set(said)) == len(said)
