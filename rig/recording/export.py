"""A recording for other programs: images, a table, surfaces, a video."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import cv2
import numpy as np

import fe
from rig.plates.plate_solver import plate_solver, solve_plate
from rig.recording.film import to_film
from rig.recording.fit import COLUMNS as FIT, RESULT, fit_cells, recorded_sentence
from rig.recording.layout import LAST, there
from rig.recording.session import Session, reported
from rig.system.arrays import AnyArray

Report = Callable[[int, int], None]
COLUMNS = ("frame", "sequence", "captured_s", "identity", "x_mm", "y_mm", "force_n")
SIGMAS = ("sigma_x_mm", "sigma_y_mm", "sigma_force_n")
TRUTH = ("true_x_mm", "true_y_mm", "true_force_n", "true_radius_mm")
CODEC = "FFV1"  # without loss
AS_IT_IS = cv2.IMWRITE_TIFF_COMPRESSION, 1
"""Without compression: OpenCV's LZW makes noise larger, and not every reader has it."""
ELEMENTS = 48  # along the longer side of an exported surface


def to_tiff(session: Session, folder: Path, report: Report) -> list[Path]:
    """Write each image as a TIFF, as the camera gave it."""
    return [
        _save(folder / f"frame-{index:06d}.tiff", session.row(index)["frames/image"])
        for index in _reported(session, report)
    ]


def to_csv(session: Session, folder: Path, report: Report) -> list[Path]:
    """Write what was found, one row a touch, and what was there where that is known.

    A frame without a touch has one row, as of `run --touches`.
    """
    found, truth = folder / "touches.csv", folder / "truth.csv"
    with found.open("w", newline="") as one, truth.open("w", newline="") as other:
        touches, true = csv.writer(one), csv.writer(other)
        touches.writerow(COLUMNS + SIGMAS + FIT)
        true.writerow(COLUMNS[:3] + TRUTH)
        for index in _reported(session, report):
            row = session.row(index)
            head = (index, int(row[LAST]), float(row["frames/captured"]))
            touches.writerows((*head, *cells) for cells in _found(row))
            true.writerows((*head, *finger.tolist()) for finger in there(row["frames/truth"]))
    return [found, truth]


def _found(row: Mapping[str, AnyArray]) -> Iterator[tuple[object, ...]]:
    """Yield the cells of each touch of a frame; empty ones where there is none."""
    fit = fit_cells(reported(row), recorded_sentence(row)) if RESULT in row else [""] * len(FIT)
    places = there(row["touches/place"])
    sigma = np.sqrt(np.diagonal(row["touches/covariance"], axis1=1, axis2=2))
    for k, place in enumerate(places):
        yield (int(row["touches/identity"][k]), *place.tolist(), *sigma[k].tolist(), *fit)
    if not len(places):
        yield (*[""] * (len(COLUMNS) - 3 + len(SIGMAS)), *fit)


def to_vtu(session: Session, folder: Path, report: Report) -> list[Path]:
    """Write the plate bent by the touches of each frame, with its strain, for ParaView."""
    if session.scene.plate is None:
        raise ValueError(f"recording '{session.path}' names no plate; export it as tiff or csv")
    solver = plate_solver(session.scene, session.scene.plate, ELEMENTS, report)
    paths: list[Path] = []
    for index in _reported(session, report):
        places = there(session.row(index)["touches/place"])
        touches = tuple(fe.Touch(*place.tolist()) for place in places)
        paths.append(folder / f"frame-{index:06d}.vtu")
        fe.write_vtu(paths[-1], solve_plate(solver, touches), touches)
    return paths


def to_video(session: Session, folder: Path, report: Report) -> list[Path]:
    """Write the images as a video without loss, at the mean rate of the session."""
    path = folder / "session.avi"
    captured = session.columns()["frames/captured"]
    seconds = float(captured[-1] - captured[0]) if len(captured) > 1 else 0.0
    rate = (len(captured) - 1) / seconds if seconds > 0 else 30.0
    height, width = session.reference.image.shape
    video = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*CODEC), rate, (width, height), isColor=False
    )
    if not video.isOpened():
        raise OSError(f"video '{path}' cannot be written with codec {CODEC}; export as tiff")
    for index in _reported(session, report):
        video.write(session.row(index)["frames/image"])
    video.release()
    return [path]


WAYS = {"tiff": to_tiff, "csv": to_csv, "vtu": to_vtu, "video": to_video, "film": to_film}


def _reported(session: Session, report: Report):
    for index in range(session.frames):
        yield index
        report(index + 1, session.frames)


def _save(path: Path, image: AnyArray) -> Path:
    if not cv2.imwrite(str(path), image, AS_IT_IS):
        raise OSError(f"image '{path}' cannot be written; check whether the disk is full")
    return path
