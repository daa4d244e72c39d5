"""The steps of a calibration from images on disk: what to take, and what comes of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

import synthetic
from rig.calibration.board import BoardView, CharucoBoard, lying_at, on_plate
from rig.calibration.lens import Lens, calibrate_lens
from rig.calibration.photon import Photon, photon_transfer
from rig.calibration.pose import Pose, find_pose
from rig.calibration.projector import ProjectorLight, brightness, find_light
from rig.calibration.store import Calibration
from rig.projector import gray_code
from rig.scene import Scene
from rig.scene.loop import ProjectorSection
from rig.scene.plate import PlateSection
from rig.system.arrays import AnyArray, Grey

SUFFIXES = {".png", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg"}
BY_HAND = 0.7  # px, standard deviation of a corner that was marked by hand


def read_images(folder: Path) -> list[Grey]:
    """Read the images of a folder in the order of their names, as grey levels.

    Raises
    ------
    OSError
        If there is no such folder, it holds no images, or one cannot be read.
    """
    if not folder.is_dir():
        raise OSError(f"folder '{folder}' of images does not exist; check the path")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise OSError(f"folder '{folder}' holds no images; put PNG or TIFF files there")
    return [_read(path) for path in paths]


def from_boards(folder: Path, board: CharucoBoard, left_out: tuple[int, ...]) -> Lens:
    """Calibrate the lens; views are numbered from 0 in the order of their names.

    Raises
    ------
    OSError, ValueError
        If there are too few images that show the board.
    """
    images = read_images(folder)
    found = [board.find(image) for image in images]
    unseen = tuple(index for index, view in enumerate(found) if view is None)
    nothing = BoardView(np.empty((0, 2)), np.empty((0, 2)))
    views = [view or nothing for view in found]
    size = (images[0].shape[1], images[0].shape[0])
    return calibrate_lens(views, size, tuple(sorted({*left_out, *unseen})))


def from_corners(scene: Scene, known: Calibration, corners: list[tuple[float, float]]) -> Pose:
    """Find the plate from its corners in an image, px: origin, end of x, far corner, end of y."""
    (a, b), height = plate_of(scene).size, seen_height(scene)
    mm = np.array([(0, 0, height), (a, 0, height), (a, b, height), (0, b, height)])
    if len(corners) != 4:
        raise ValueError(f"plate has 4 corners, got {len(corners)}; give --corner four times")
    return find_pose(known.known_lens(), BoardView(mm, np.array(corners)), BY_HAND)


def from_patch(
    scene: Scene, known: Calibration, folder: Path, board: CharucoBoard, at: tuple[float, float]
) -> Pose:
    """Find the plate from a board on its seen face, the printed top left corner at (x, y) mm."""
    view = board.find(read_images(folder)[0])
    if view is None:
        raise ValueError(f"the first image in '{folder}' shows no board; look at its light")
    height = seen_height(scene)
    return find_pose(known.known_lens(), on_plate([(view, lying_at(at, height))], height))


def from_stripes(scene: Scene, known: Calibration, folder: Path) -> ProjectorLight:
    """Find the projector from images of its Gray code, in the order of `gray.patterns`."""
    window, camera = projector_of(scene), posed(known)
    return light_of(read_images(folder), camera, plate_of(scene), window.size)


def light_of(
    images: Sequence[AnyArray], camera: synthetic.Camera, plate: PlateSection, size: tuple[int, int]
) -> ProjectorLight:
    """Find the projector of `size` px from images of its Gray code, and how bright it is."""
    seen, valid = gray_code.decode(images, size)
    height = camera.face_height(plate.thickness)
    light = find_light(seen, valid, camera, plate.size, size, height)
    strength, black = brightness(images[0], images[1], valid)
    return replace(light, strength=strength, black=black)


def from_stills(folder: Path, black: float) -> Photon:
    """Measure noise and gain from still images, a folder in `folder` for each exposure."""
    if not folder.is_dir():
        raise OSError(f"folder '{folder}' of exposures does not exist; check the path")
    return photon_transfer(
        [read_images(part) for part in sorted(folder.iterdir()) if part.is_dir()], black
    )


def write_stripes(scene: Scene, folder: Path) -> int:
    """Write the images that the projector must show; gives their number."""
    stripes = gray_code.patterns(projector_of(scene).size)
    for index, image in enumerate(stripes):
        cv2.imwrite(str(folder / f"{index:02d}.png"), image)
    return len(stripes)


def plate_of(scene: Scene) -> PlateSection:
    """Return the plate of a scene that must have one."""
    if scene.plate is None:
        raise ValueError(f"scene '{scene.title}' has no plate; add [plate]")
    return scene.plate


def seen_height(scene: Scene) -> float:
    """Height of the face that the camera of a scene looks at over the middle plane, mm."""
    face = scene.camera.face if scene.camera else "top"
    return synthetic.face_height(face, plate_of(scene).thickness)


def projector_of(scene: Scene) -> ProjectorSection:
    """Return the projector of a scene that must have one."""
    if scene.projector is None:
        raise ValueError(f"scene '{scene.title}' has no projector; add [projector]")
    return scene.projector


def posed(known: Calibration) -> synthetic.Camera:
    """Return the camera that lens and pose give."""
    camera = known.camera()
    if camera is None:
        raise ValueError(
            "the projector is found through a calibrated camera; run `touchplate calibrate camera`"
            " and `pose` first"
        )
    return camera


def _read(path: Path) -> Grey:
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise OSError(f"image '{path}' cannot be read; save it as PNG or TIFF")
    return np.asarray(image, dtype=np.uint8)
