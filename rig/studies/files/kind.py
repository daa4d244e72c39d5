"""A kind of file: how a whole one is made, how it is changed, and how it is read.

Each reader goes the way of the program and then looks, by other means, at what it was given: text
by the limits of `limits`, binary files by comparing every number with those that were written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.studies.files.mutation import Rng

Wrong = Iterator[str]
"""What is out of range or other than it was written, in words."""

NO_NUMBERS = (np.inf, -np.inf, 1e300, -1e300)


@dataclass(frozen=True)
class Kind:
    """One kind of file.

    Attributes
    ----------
    suffix : str
        Of its name.
    make : callable
        Write a whole file.
    mutate : callable
        Change its bytes.
    read : callable
        Read a file as the program does; yields what was taken and cannot be.
    """

    suffix: str
    make: Callable[[Path], object]
    mutate: Callable[[bytes, Rng], bytes]
    read: Callable[[Path], Wrong]
