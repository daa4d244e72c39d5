"""Correlate a whole test: every frame with one reference, on all cores, gone on after a kill.

Each frame is searched for by itself, so that its fields do not depend on which frames came before,
and a test that was killed ends in the same bytes.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import dic
from rig.series.frames import Frames
from rig.series.measure import measure, nothing_measured
from rig.series.parts import is_whole, missing_part, write_part
from rig.series.tabulate import StrainOptions, strained
from rig.system.arrays import AnyArray
from rig.system.in_order import in_order

Report = Callable[[int, int], None]


@dataclass(frozen=True)
class Cluster:
    """Workers of a Dask scheduler.

    Attributes
    ----------
    address : str
        Of the scheduler, as tcp://host:8786.
    say : callable
        Takes a sentence where one of them is gone.
    """

    address: str
    say: Callable[[str], None] = lambda sentence: None


def correlate_frames(
    ref: dic.Reference,
    frames: Frames,
    parts: Path,
    strain: StrainOptions,
    workers: int | None = None,
    report: Report = lambda done, total: None,
) -> None:
    """Write the part of every frame that has none yet.

    A frame that cannot be read or does not fit the reference leaves a sentence in its part.
    """
    total = len(frames.names)
    missing = [n for n in range(total) if not is_whole(parts, n)]
    report(total - len(missing), total)

    def one(number: int) -> None:
        _, table, error = _fields(ref, strain, _read(frames, number))
        write_part(parts, number, table, error)

    count = workers or os.cpu_count() or 1
    for done, _ in enumerate(in_order(one, missing, count), total - len(missing)):
        report(done + 1, total)


def correlate_on_workers(
    cluster: Cluster,
    ref: dic.Reference,
    frames: Frames,
    parts: Path,
    strain: StrainOptions,
    report: Report = lambda done, total: None,
) -> None:
    """Write the part of every frame that has none yet, with the workers of a Dask scheduler.

    Frames are read here and fields are written here: the workers need no folder of ours. The frames
    of a worker that dies are correlated again by another.

    Raises
    ------
    OSError
        The scheduler cannot be reached, is lost or stays without a worker; what was done is kept.
    ValueError
        Dask is not installed.
    """
    from models import workers

    total = len(frames.names)
    missing = [n for n in range(total) if not is_whole(parts, n)]
    report(total - len(missing), total)
    read = (_read(frames, number) for number in missing)
    with workers(cluster.address, cluster.say) as each:
        fields = each(partial(_fields, ref, strain), read)
        for done, (number, table, error) in enumerate(fields, total - len(missing) + 1):
            write_part(parts, number, table, error)
            report(done, total)


Frame = tuple[int, AnyArray | None, str]
"""Number of a frame, its image, and what kept it from being read."""


def _read(frames: Frames, number: int) -> Frame:
    try:
        return number, frames.read(number), ""
    except (OSError, ValueError) as error:
        return number, None, str(error)


def _fields(
    ref: dic.Reference, strain: StrainOptions, frame: Frame
) -> tuple[int, dict[str, AnyArray], str]:
    """Fields of a frame, and a sentence where it does not fit the reference or shows no point."""
    number, image, error = frame
    if image is not None:
        try:
            found = measure(ref, image, strain.field, strain.guess)
            table = strained(found.disp, strain, found.by_net).table(strain.fields)
            return number, table, nothing_measured(found.disp, image)
        except (OSError, ValueError) as refusal:
            error = str(refusal)
    return number, missing_part(strain.fields, len(ref.xy)), error
