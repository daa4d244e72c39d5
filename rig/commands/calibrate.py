"""`touchplate calibrate WHAT SCENE`: live or from images to what a bench knows of itself."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit

if TYPE_CHECKING:
    from rig.calibration.board import CharucoBoard
    from rig.calibration.guide import Guide
    from rig.calibration.recorded import Recorded
    from rig.calibration.results import Part
    from rig.calibration.store import Calibration
    from rig.scene import Scene

PART = {"camera": "lens"}  # name of what is kept, where it is another
Name = Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")]
Images = Annotated[
    Path | None, typer.Option(help="Folder of images; else live, from the scene's source.")
]
Recording = Annotated[Path, typer.Argument(help="A recording *.h5, made with `run --record`.")]
Squares = Annotated[tuple[int, int], typer.Option(help="Squares of the board.")]
Square = Annotated[float, typer.Option(help="Side of a square, mm, as measured.")]
Marker = Annotated[float, typer.Option(help="Side of a marker, mm, as measured.")]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
SQUARES, SQUARE, MARKER = (11, 8), 20.0, 15.0

calibrate = typer.Typer(no_args_is_help=True)


@calibrate.command()
def camera(
    scene: Name,
    images: Images = None,
    squares: Squares = SQUARES,
    square: Square = SQUARE,
    marker: Marker = MARKER,
    leave_out: Annotated[list[int] | None, typer.Option(help="Bad view, from 0.")] = None,
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Find the lens: show a ChArUco board, tilted to all sides, over the whole image.

    With --images ten views of it.
    """
    from rig.calibration import steps

    bench, board = _bench("camera", scene, settings), _board(squares, square, marker)
    if images:
        part = steps.from_boards(images, board, tuple(leave_out or ()))
    else:
        from rig.calibration.board_guides import LensGuide

        part = bench.live(LensGuide(board))
    bench.keep(part, as_json)


@calibrate.command()
def pose(
    scene: Name,
    images: Images = None,
    squares: Squares = SQUARES,
    square: Square = SQUARE,
    marker: Marker = MARKER,
    at: Annotated[tuple[float, float], typer.Option(help="Board's top left, mm.")] = (0.0, 0.0),
    corner: Annotated[list[str] | None, typer.Option(help="x,y px of a plate corner.")] = None,
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Find the plate: lay the board on it, or mark its four corners in an image.

    With --images one of the board on the plate.
    """
    from rig.calibration import steps

    bench, board = _bench("pose", scene, settings), _board(squares, square, marker)
    if corner:
        part = steps.from_corners(bench.scene, bench.known, [_pair(text) for text in corner])
    elif images:
        part = steps.from_patch(bench.scene, bench.known, images, board, at)
    else:
        from rig.calibration.board_guides import PoseGuide

        height = steps.seen_height(bench.scene)
        part = bench.live(PoseGuide(bench.known.known_lens(), board, at, height))
    bench.keep(part, as_json)


@calibrate.command()
def projector(
    scene: Name, images: Images = None, settings: Settings = None, as_json: Json = False
) -> None:
    """Find the projector: leave the plate alone while stripes are projected.

    With --images what the camera saw of each image that `stripes` writes.
    """
    from rig.calibration import steps

    bench = _bench("projector", scene, settings)
    if images:
        part = steps.from_stripes(bench.scene, bench.known, images)
    else:
        from rig.calibration.light_guides import StripesGuide, settling_of

        window, view = steps.projector_of(bench.scene), steps.posed(bench.known)
        settling = settling_of(bench.known.latency)
        guide = StripesGuide(view, steps.plate_of(bench.scene), window.size, settling)
        part = bench.live(guide)
    bench.keep(part, as_json)


@calibrate.command()
def latency(scene: Name, settings: Settings = None, as_json: Json = False) -> None:
    """Find how late light comes: leave the plate alone while the projector flashes."""
    import numpy as np

    from rig.calibration import steps
    from rig.calibration.light_guides import LatencyGuide

    bench = _bench("latency", scene, settings)
    steps.projector_of(bench.scene)
    bench.keep(bench.live(LatencyGuide(np.random.default_rng())), as_json)


@calibrate.command()
def noise(
    scene: Name,
    images: Images = None,
    black: Annotated[float, typer.Option(help="Grey level without light.")] = 0.0,
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Find noise and gain of the camera: leave it alone, and change the light twice when asked.

    With --images a folder for each of three exposures.
    """
    from rig.calibration import steps

    bench = _bench("noise", scene, settings)
    if images:
        part = steps.from_stills(images, black)
    else:
        from rig.calibration.noise_guide import NoiseGuide

        part = bench.live(NoiseGuide(black))
    bench.keep(part, as_json)


@calibrate.command()
def bench(
    scene: Name,
    presses: Annotated[
        Path | None,
        typer.Option(metavar="LIST.csv", help="press,first_frame,last_frame,x_mm,y_mm,force_n"),
    ] = None,
    images: Annotated[
        Path | None, typer.Option(help="Folder of images or video, the first ones untouched.")
    ] = None,
    forget_learned: Annotated[
        bool, typer.Option(help="Forget what runs have learned since the presses.")
    ] = False,
    free: Annotated[
        list[str] | None, typer.Option(metavar="NAME,…", help="Find only these numbers.")
    ] = None,
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Find how plate, edges and camera really are, from presses of which some is known.

    Places and forces may be left empty; one known weight sets the newton.
    """
    from rig.calibration import bench_presses, steps, store
    from rig.calibration.bench_refusal import require_sound
    from rig.commands.bench_table import described, table
    from rig.commands.output import progress

    kept = _bench("bench", scene, settings)
    if forget_learned:
        said = _forget(scene)
        if presses is None:
            emit(said["sentence"], said, as_json)
            return
    if presses is None or images is None:
        raise ValueError(
            "a bench is found from presses: give their list with --presses and the folder or video"
            " of their images with --images"
        )
    listed, names = bench_presses.read_list(presses), _names(free or [])
    with progress("plate modes") as report:
        given = kept.scene, kept.known, listed, images, names, report
        found = bench_presses.identify_bench(*given)
    size = steps.plate_of(kept.scene).size
    require_sound(found, size)
    store.keep(kept.path, found, kept.scene)
    said = described(found, [one.press for one in listed], size) | {"path": str(kept.path)}
    emit(table(said), said, as_json)


@calibrate.command()
def damping(
    scene: Name, recording: Recording, settings: Settings = None, as_json: Json = False
) -> None:
    """Find how the plate rings: record one tap with a knuckle, and half a second after it.

    The scene names the density that is supposed, `dynamics.density`.
    """
    from rig.calibration.ringing import learn_ringing

    bench = _bench("damping", scene, settings)
    bench.keep(learn_ringing(bench.recorded(recording), bench.scene), as_json)


@calibrate.command()
def creep(
    scene: Name, recording: Recording, settings: Settings = None, as_json: Json = False
) -> None:
    """Find how the plate creeps: record one press held for a minute, and a minute after it."""
    from rig.calibration.creep import learn_held_press

    bench = _bench("creep", scene, settings)
    bench.keep(learn_held_press(bench.recorded(recording)), as_json)


@calibrate.command()
def stripes(
    scene: Name,
    images: Annotated[Path, typer.Option(help="Folder for them.")] = Path(),
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Write the images that find the projector, for another program to show."""
    from rig.calibration import steps

    images.mkdir(parents=True, exist_ok=True)
    count = steps.write_stripes(_bench("projector", scene, settings).scene, images)
    emit(f"{count} images in {images}", {"images": count}, as_json)


def _names(lists: list[str]) -> tuple[str, ...]:
    """Split lists of names, `a,b`, each given by an option of its own."""
    names = (name.strip() for text in lists for name in text.split(","))
    return tuple(name for name in names if name)


def _forget(scene: str) -> dict[str, Any]:
    """Forget what runs have learned of a scene's bench; say whether there was anything."""
    from rig.calibration.learned import forget_learned, learned_beside

    path, there = learned_beside(scene), forget_learned(scene)
    said = f"forgot '{path}'" if there else f"runs have learned nothing yet: no '{path}'"
    return {"sentence": said, "path": str(path), "forgotten": there}


@dataclass(frozen=True)
class _Bench:
    """A part of a bench, its scene, what is known of it, and the file in which that is kept."""

    what: str
    scene: Scene
    known: Calibration
    path: Path

    def live(self, guide: Guide) -> Part:
        from rig.commands.guided import live

        return live(self.what, self.scene, self.known, guide)

    def recorded(self, recording: Path) -> Recorded:
        """Read the frames of a recording on this bench."""
        from rig.calibration.recorded import read_recorded
        from rig.commands.output import progress
        from rig.recording.session import open_session

        with open_session(recording) as session, progress("plate modes") as report:
            return read_recorded(session, self.scene, self.known, report)

    def keep(self, part: Part, as_json: bool) -> None:
        """Keep a part with its date and error, and say what it is like."""
        from rig.calibration import store

        kept = store.keep(self.path, part)
        entry = getattr(kept, PART.get(self.what, self.what)).model_dump(mode="json")
        notes = kept.warnings(self.scene, datetime.now(UTC))
        left_out = list(getattr(part, "left_out", ()))
        error, residual = entry["error"], entry["residual"]
        lines = [f"{self.what}: error {error:.3g}, residual {residual:.3g}; in {self.path}"]
        if left_out:
            lines.append(f"views left out: {', '.join(map(str, left_out))}")
        said = entry | {"path": str(self.path), "notes": notes, "left_out": left_out}
        emit("\n".join([*lines, *notes]), said, as_json)


def _bench(what: str, name: str, settings: list[str] | None) -> _Bench:
    import rig
    from rig.calibration import store

    path = store.beside(name)
    scene = rig.load(name, rig.scene.parse_overrides(settings or []))
    return _Bench(what, scene, store.read_calibration(path), path)


def _board(squares: tuple[int, int], square: float, marker: float) -> CharucoBoard:
    from rig.calibration.board import CharucoBoard

    return CharucoBoard(squares, square, marker)


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"corner must be written as x,y in px, got '{text}'") from None
    return x, y
