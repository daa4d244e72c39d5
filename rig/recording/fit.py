"""How well touches explained a frame, as recordings and tables keep it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from models import Estimate, Result
from rig.system.arrays import AnyArray

COLUMNS = ("result", "p_value", "chi2_per_dof", "sentence")
RESULT, P_VALUE, CHI2, DOF, SENTENCE = (
    f"touches/{name}" for name in ("result", "p_value", "chi2", "dof", "sentence")
)
RESULTS = tuple(Result)
"""Outcomes in the order of their numbers in a recording."""

_LARGEST = 1e15  # χ² of ten million pixels, each off by ten thousand of its σ
_LENGTH = 400  # bytes of a sentence; what is longer is cut off

SHAPES: Mapping[str, tuple[tuple[int, ...], str]] = {
    RESULT: ((), "i8"),
    P_VALUE: ((), "f8"),
    CHI2: ((), "f8"),
    DOF: ((), "i8"),
    SENTENCE: ((_LENGTH,), "u1"),
}
"""Shape of a frame's part and type of number of every array."""


def fit_row(estimate: Estimate, sentence: str) -> dict[str, object]:
    """Arrays of one frame, in the shapes of `SHAPES`."""
    text = sentence.encode()[:_LENGTH].ljust(_LENGTH, b"\0")
    return {
        RESULT: RESULTS.index(estimate.result),
        P_VALUE: estimate.p_value,
        CHI2: estimate.chi2,
        DOF: estimate.dof,
        SENTENCE: np.frombuffer(text, np.uint8),
    }


def wrong_fit(row: Mapping[str, AnyArray]) -> str:
    """Say what is wrong with the fit of a frame; empty where nothing is, or none was recorded."""
    if RESULT not in row:
        return ""
    if not 0 <= int(row[RESULT]) < len(RESULTS):
        return f"{RESULT} is {int(row[RESULT])}"
    if row[P_VALUE] < 0.0 or row[P_VALUE] > 1.0:
        return f"{P_VALUE} is {float(row[P_VALUE]):g}"
    if not (1 <= row[DOF] <= _LARGEST) or row[CHI2] < 0.0 or row[CHI2] > _LARGEST:
        return f"{CHI2} is {float(row[CHI2]):g} of {int(row[DOF])}"
    return ""


def with_fit(estimate: Estimate, row: Mapping[str, AnyArray]) -> Estimate:
    """Return an estimate with the fit of a frame; as it is where none was recorded."""
    if RESULT not in row:
        return estimate
    return replace(
        estimate,
        chi2=float(row[CHI2]),
        dof=int(row[DOF]),
        p_value=float(row[P_VALUE]),
        result=RESULTS[int(row[RESULT])],
    )


def recorded_sentence(row: Mapping[str, AnyArray]) -> str:
    """Return what was stated of a frame; empty where it was not recorded."""
    if SENTENCE not in row:
        return ""
    return bytes(row[SENTENCE]).rstrip(b"\0").decode(errors="ignore")


def fit_cells(estimate: Estimate, sentence: str) -> list[str]:
    """Cells of a table under `COLUMNS`."""
    fit = f"{estimate.p_value:.6g}", f"{estimate.chi2 / estimate.dof:.6g}"
    return [estimate.result.name, *fit, sentence]
