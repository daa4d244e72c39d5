"""What a report is made of: sections of studies, each a program that writes figures."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

Effort = Literal["quick", "normal", "full"]
Words = tuple[str, ...] | Literal[False]
CONTENTS = "report.toml"
SHIPPED = "rig.studies"


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

    def words(self, effort: Effort) -> Words:
        """Return the words of an effort, False where the study is left out of it."""
        return getattr(self, effort)


class Section(BaseModel):
    """A heading, what it is about, and its studies."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str
    text: str = ""
    studies: tuple[Study, ...]


class _Contents(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    section: tuple[Section, ...]


@dataclass(frozen=True)
class Contents:
    """The sections of a report, and the folder where their programs stand.

    Attributes
    ----------
    home : Path
    sections : tuple of Section
    package : str
        Name of the package that the folder is; empty where it is a folder of one's own.
    """

    home: Path
    sections: tuple[Section, ...]
    package: str = ""

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
    try:
        with path.open("rb") as file:
            sections = _Contents.model_validate(tomllib.load(file)).section
    except (tomllib.TOMLDecodeError, ValidationError) as error:
        raise ValueError(
            f"{path} is not a table of contents: {' '.join(str(error).split())}"
        ) from error
    for section in sections:
        for study in section.studies:
            if not (home / study.program).is_file():
                raise ValueError(
                    f"{path}: study '{study.name}' names {study.program}, which is not there"
                )
    return Contents(home, sections)
