"""What a report is made of: sections of studies, each a program that writes figures."""

from __future__ import annotations

import tomllib
from collections.abc import Collection
from dataclasses import dataclass, replace
from importlib.resources import files
from math import inf
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rig.report.figure import Bar, Figure
from rig.report.needs import PATTERN

Effort = Literal["quick", "normal", "full"]
Words = tuple[str, ...] | Literal[False]
CONTENTS, OPEN_BARS = "report.toml", "open_bars.toml"
SHIPPED = "rig.studies"
Model = TypeVar("Model", bound=BaseModel)


class Study(BaseModel):
    """One study. Its program is called with ``--figures FILE`` and the words of the effort.

    Attributes
    ----------
    name, title, text : str
        What its files are called; its heading; what it compares, in Markdown.
    program : str
        A Python file of the folder of studies, or of a folder in it.
    quick, normal, full : tuple of str, or False
        Further words on its command line by effort; False where it is left out.
    limit : float
        Seconds after which it is stopped at the normal effort; a full one has no limit.
    needs : tuple of str
        What it needs beside this package, as `rig.report.needs` reads it; it is left out where that
        is not there. One that needs data gets the words ``--data FOLDER``.
    front : str
        How the table begins that the page opens with, as a plot; empty for none.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(pattern="^[a-z0-9-]+$")]
    title: str
    text: str = ""
    program: str
    quick: Words = ()
    normal: Words = ()
    full: Words = ()
    limit: Annotated[float, Field(gt=0)] = 600.0
    needs: tuple[Annotated[str, Field(pattern=PATTERN)], ...] = ()
    front: str = ""

    def words(self, effort: Effort) -> Words:
        """Return the words of an effort, False where the study is left out of it."""
        return getattr(self, effort)


class Section(BaseModel):
    """A heading, what it is about, and its studies."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str
    text: str = ""
    studies: tuple[Study, ...]


class OpenBar(BaseModel):
    """A bar that stands as not measured until the report has a figure of its case and quantity."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    case: str
    quantity: str = "figure"
    unit: str = ""
    at_least: float = -inf
    at_most: float = inf


class Topic(BaseModel):
    """What such bars are about; a table of the report."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str
    bars: tuple[OpenBar, ...]

    def without(self, measured: Collection[tuple[str, str]]) -> Topic:
        """Return the topic without the bars whose case and quantity are measured."""
        left = tuple(bar for bar in self.bars if (bar.case, bar.quantity) not in measured)
        return self.model_copy(update={"bars": left})

    @property
    def figures(self) -> tuple[Figure, ...]:
        """The figures that are to be measured."""
        return tuple(
            Figure(self.title, b.case, b.quantity, None, b.unit, Bar(b.at_least, b.at_most))
            for b in self.bars
        )


class _Contents(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    section: tuple[Section, ...]


class _OpenBars(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    topic: tuple[Topic, ...] = ()


@dataclass(frozen=True)
class Contents:
    """The sections of a report, and the folder where their programs stand.

    Attributes
    ----------
    home : Path
    sections : tuple of Section
    package : str
        Name of the package that the folder is; empty where it is a folder of one's own.
    open_bars : tuple of Topic
        What may not be measured yet.
    """

    home: Path
    sections: tuple[Section, ...]
    package: str = ""
    open_bars: tuple[Topic, ...] = ()

    @property
    def studies(self) -> tuple[Study, ...]:
        """All studies, in their order."""
        return tuple(study for section in self.sections for study in section.studies)

    def program(self, study: Study) -> tuple[str, ...]:
        """Return what Python is called with: a file of a folder, or a module of a package.

        A module is run without the current folder on the path, whose files could hide packages.
        """
        if not self.package:
            return (str(self.home / study.program),)
        within = study.program.removesuffix(".py").replace("/", ".")
        return "-P", "-m", f"{self.package}.{within}"


def shipped() -> Contents:
    """Read the studies that come with this package."""
    return replace(read_contents(Path(str(files(SHIPPED)))), package=SHIPPED)


def read_contents(home: Path) -> Contents:
    """Read the table of contents of a folder of studies.

    Raises
    ------
    OSError
        If the folder has none.
    ValueError
        If it is not readable, or names a program that is not there.
    """
    path = home / CONTENTS
    if not path.exists():
        raise OSError(
            f"there is no {CONTENTS} in '{home}'; name the folder that holds one with --studies"
        )
    contents = Contents(home, _parsed(path, _Contents).section)
    for study in contents.studies:
        if not (home / study.program).is_file():
            raise ValueError(
                f"{path}: study '{study.name}' names {study.program}, which is not there"
            )
    bars = home / OPEN_BARS
    return (
        replace(contents, open_bars=_parsed(bars, _OpenBars).topic) if bars.exists() else contents
    )


def _parsed(path: Path, kind: type[Model]) -> Model:
    """Read a TOML file as a model."""
    try:
        with path.open("rb") as file:
            return kind.model_validate(tomllib.load(file))
    except (tomllib.TOMLDecodeError, ValidationError) as error:
        said = " ".join(str(error).split())
        raise ValueError(f"{path} is not a table of contents: {said}") from error
