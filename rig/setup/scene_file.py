"""The scene file of a bench from what its owner says of it, refused where it cannot work."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

from rig.calibration.board import CharucoBoard
from rig.scene import Scene
from rig.scene.load import from_table
from rig.setup.answers import MATERIALS, Answers

SPOT = 5.0  # px across a speckle: three to five are read best, and prints come out no finer
EDGE = 0.02  # of the image that stays free on each side of the plate
TILE, COARSEST = 16, 48  # px of a tile, and tiles along the shorter side of an image that has few
SQUARES, MARKER = (11, 8), 0.75  # of the board, and the side of a marker over that of a square
COVERED = 0.9  # of the plate's sides that the board takes at the utmost
REFERENCE = 64  # frames: a weight that lies still is averaged over as many, and none is wasted
LIGHTEST = 0.1  # of the largest force, that the smallest one is
FRICTION = 0.2  # of a dry finger: what it pulls along the plate over what it presses into it

EDGES = {
    "clamped": 'edges.kind = "clamped"',
    "supported": 'edges.kind = "supported"',
    "two clamped": "\n".join(
        [
            'edges.kind = "mixed"',
            *(
                f'edges.{side}.kind = "{held}"'
                for side, held in zip(
                    ("west", "east", "south", "north"),
                    ("clamped",) * 2 + ("free",) * 2,
                    strict=True,
                )
            ),
        ]
    ),
}


def board_for(answers: Answers) -> CharucoBoard:
    """Return the board that fits on a plate, with squares of whole mm as they came out in print."""
    a, b = answers.size
    side = min(20.0, COVERED * a / SQUARES[0], COVERED * b / SQUARES[1])
    whole = max(float(int(side)), 1.0)
    scale = answers.ruler / 100.0
    return CharucoBoard(SQUARES, whole * scale, MARKER * whole * scale)


def printed_board(answers: Answers) -> CharucoBoard:
    """Return the board as it is sent to the printer, before anything is measured."""
    return board_for(answers.model_copy(update={"ruler": 100.0}))


def corner_of_board(answers: Answers) -> tuple[float, float]:
    """Where the board's corner towards the plate's origin lies, mm; in the middle if unsaid."""
    board, (a, b) = board_for(answers).size, answers.size
    left = (a - board[0]) / 2 if answers.left is None else answers.left
    below = (b - board[1]) / 2 if answers.below is None else answers.below
    return left, below


def printed_corner(answers: Answers) -> tuple[float, float]:
    """Where the printed top left corner of the board lies on the plate, mm, seen by the camera."""
    (left, below), (wide, high) = corner_of_board(answers), board_for(answers).size
    return left + (wide if answers.side == "below" else 0.0), below + high


def spot(answers: Answers) -> float:
    """Diameter of a speckle, mm."""
    free = 1 - 2 * EDGE
    scale = min(free * px / mm for px, mm in zip(answers.pixels, answers.size, strict=True))
    return round(SPOT / scale, 2)


def tile(answers: Answers) -> int:
    """Side of a tile, px: small images have smaller ones, or too few of them for the plate."""
    return max(4, min(TILE, min(answers.pixels) // COARSEST))


def scene_text(answers: Answers, rehearsal: bool = False) -> str:
    """Write the scene of a bench as TOML."""
    material, (width, height) = MATERIALS[answers.material], answers.pixels
    parts = [
        "# Written by `touchplate setup`; every key: docs/scene-keys.md",
        f'title = "A plate of {answers.material}, {answers.width:g} x {answers.height:g} mm"',
        "",
        "[plate]",
        f'size = ["{answers.width:g} mm", "{answers.height:g} mm"]',
        f'thickness = "{answers.thickness:g} mm"',
        f'young = "{material.young:g} MPa"   # usual of {answers.material}; presses correct it',
        f"poisson = {material.poisson:g}",
        f"strain_limit = {material.strain_limit:g}",
        EDGES[answers.edges],
        "",
        "[touches]",
        "max_touches = 2",
        f'force = ["{LIGHTEST * answers.force:g} N", "{answers.force:g} N"]',
        f"friction = {FRICTION:g}   # of a dry finger",
        "",
        "# What holds until lens and pose are calibrated.",
        "[camera]",
        'kind = "pinhole"',
        f"pixels = [{width}, {height}]",
        f'stand_off = "{answers.stand_off:g} mm"',
        *(['side = "below"'] if answers.side == "below" else []),
        f"margin = {EDGE}",
        f'rate = "{answers.rate:g} fps"',
        "",
        "[pattern]",
        f'diameter = "{spot(answers):g} mm"',
        "softness = 0.75",
        "",
        "[sensor]",
        'noise = "2 grey levels"',
        "",
        "[dic]",
        f"tile = {tile(answers)}",
        f"reference_frames = {REFERENCE}",
        "",
        "[estimator]",
        'kind = "pattern"',
        'bench = "usual"',
        "",
        *_source(answers, rehearsal),
        "[page]",
        "port = 8765",
        "",
        *_projector(answers),
    ]
    return "\n".join(parts).rstrip() + "\n"


def _source(answers: Answers, rehearsal: bool) -> list[str]:
    if rehearsal or answers.camera is None:
        return ["[source]", 'kind = "twin"', 'script = "tour"', ""]
    lines = ["[source]", *_camera(answers.camera)]
    if answers.exposure is not None:
        lines.append(f'exposure = "{1e3 * answers.exposure:g} ms"')
    return [*lines, ""]


def _camera(named: str) -> list[str]:
    """Write the source of a camera, which is named by its device node, or by its kind first."""
    match named.split():
        case ["basler", serial]:
            return ['kind = "basler"', f"serial = {_quoted(serial)}"]
        case ["genicam", serial, producer]:
            given = f"serial = {_quoted(serial)}", f"producer = {_quoted(producer)}"
            return ['kind = "genicam"', *given]
        case ["v4l2", node]:
            return ['kind = "v4l2"', f"device = {_quoted(node)}"]
        case _:
            return ['kind = "opencv"', f"device = {_quoted(named)}"]


def _projector(answers: Answers) -> list[str]:
    if answers.projector == "no":
        return []
    lines = ["[projector]", f"size = [{answers.screen[0]}, {answers.screen[1]}]"]
    if answers.output is not None:
        wanted = answers.output
        lines.append(f"output = {wanted if isinstance(wanted, int) else _quoted(wanted)}")
    return lines


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def scene_of(answers: Answers, rehearsal: bool = False) -> Scene:
    """Return the scene of a bench, without a file.

    Raises
    ------
    SceneError
        If an answer is none that a scene can have.
    """
    return from_table(tomllib.loads(scene_text(answers, rehearsal)))


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    aside = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)
