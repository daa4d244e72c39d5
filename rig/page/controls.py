"""What the page shows beside the frame: notes, recording, settings, a guided calibration."""

from __future__ import annotations

from dataclasses import dataclass

from rig.calibration.guide import Progress


@dataclass(frozen=True)
class PageSetting:
    """Something that may be changed while the loop runs.

    Attributes
    ----------
    key : str
        As the scene has it, such as "projector.mode".
    label : str
    value : str
    choices : tuple of str
    """

    key: str
    label: str
    value: str
    choices: tuple[str, ...]


@dataclass(frozen=True)
class Recording:
    """The recording: whether one runs, and how it is."""

    running: bool
    status: str
    frames: int
    dropped: int


@dataclass(frozen=True)
class Measured:
    """A part of the calibration: its age and what it leaves, with its unit."""

    name: str
    days: int
    error: float
    unit: str


UNITS = {"latency": "s", "noise": "fraction", "damping": "ratio", "creep": "N"}
"""Units of the errors of a calibration's parts, where they are not mm."""


@dataclass(frozen=True)
class Wizard:
    """A guided calibration on its way, and the unit of its error."""

    what: str
    progress: Progress
    unit: str


@dataclass(frozen=True)
class Played:
    """A recording that is played: where it is, of how long, s, and whether it runs."""

    seconds: float
    length: float
    running: bool


@dataclass(frozen=True)
class Recordings:
    """Recordings that can be played beside the run.

    Attributes
    ----------
    names : tuple of str
        Of the files, the newest first.
    played : str
        The one that was chosen last; empty for none.
    address : str
        Of the page that plays it; empty while there is none.
    trouble : str
        Why there is none, as a sentence.
    """

    names: tuple[str, ...]
    played: str = ""
    address: str = ""
    trouble: str = ""


@dataclass(frozen=True)
class PageControls:
    """Everything beside the frame.

    Attributes
    ----------
    notes : tuple of str
        What the user should know, a sentence each.
    recording : Recording or None
        None where nothing can be recorded.
    settings : tuple of PageSetting
    calibration : tuple of Measured
    wizard : Wizard or None
    played : Played or None
        None where frames are live.
    table : str or None
        File that touches are written to, empty while there is none; None where none can be.
    recordings : Recordings or None
        None where none can be played.
    """

    notes: tuple[str, ...] = ()
    recording: Recording | None = None
    settings: tuple[PageSetting, ...] = ()
    calibration: tuple[Measured, ...] = ()
    wizard: Wizard | None = None
    played: Played | None = None
    table: str | None = None
    recordings: Recordings | None = None
