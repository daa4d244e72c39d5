"""Errors, forces and times that a setup promises.

Nothing but a patch of the pattern is rendered.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from math import log

import numpy as np

import fe
import models
import synthetic
from dic import (
    TileReference,
    lay_tiles,
    prepare_blocks,
    prepare_tiles,
    tile_prefilter,
    tile_sums,
    unbiased_gradient,
)
from models import (
    ExpectedErrors,
    aliased_part,
    equal_tiles,
    errors_of_interpolation,
    expected_errors,
    gradient_energy,
    places_over_plate,
)
from rig.design.focus import blur_of
from rig.design.setup import Setup
from rig.scene.bench import CameraSection
from rig.scene.plate import PlateSection
from rig.system.arrays import F64

MODES = 200  # of the plate, on
ELEMENTS = 48  # elements along its longer side: bounds within 0.2 % of those on 120
PATCH = 256  # px of the patch whose gradient is taken
UNIT = 1.0  # N, of the touches on the map
ACROSS = 24  # touches along the longer side
SMALL = 0.1  # px: a shift as touches make them
REPEATS = 7  # of the frame whose time is taken


@dataclass(frozen=True, eq=False)
class Prediction:
    """What the whole pattern promises.

    Attributes
    ----------
    setup : Setup
    force : float, N
        Of the touches.
    pattern : TilePattern
        Alike in all tiles, with a gradient energy of 1.
    unit : ExpectedErrors
        Over the plate, for that pattern and a noise of 1 grey level.
    interpolated : ExpectedErrors
        Over the plate, by what interpolation leaves if it doubled small motions.
    aliased : (n,) float64
        Of the variance that aliasing leaves of any motion, the part that is there under each touch.
    patch : TileReference
        Of the pattern as the camera sees it in its middle, behind the prefilter of the live loop.
    energy : float, grey levels² a px²
        Mean squared gradient of that.
    gain : float
        Part by which small motions are measured too large, where aliasing keeps tiles from knowing
        what interpolation adds.
    """

    setup: Setup
    force: float
    pattern: models.TilePattern
    unit: ExpectedErrors
    interpolated: ExpectedErrors
    aliased: F64
    patch: TileReference
    energy: float
    gain: float

    def noise(self, aliased: F64) -> F64:
        """Noise by which tiles err where such parts of aliasing are there, (n,) grey levels."""
        own = self.setup.noise
        added = self.patch.motion_noise(own) ** 2 - own**2
        return np.sqrt(own**2 + aliased * added)

    def at_noise(self, noise: float | F64) -> ExpectedErrors:
        """Return the bound for a noise, grey levels, of a frame less the reference."""
        return self.unit.scaled(noise / float(np.sqrt(self.energy)))

    @property
    def errors(self) -> ExpectedErrors:
        """Errors for the noise of the setup, and what interpolation and aliasing leave."""
        interpolated = self.interpolated.scaled(abs(self.gain))
        return self.at_noise(self.noise(self.aliased)).combined_with(interpolated)


def predict(
    setup: Setup,
    like: Prediction | None = None,
    force: float = UNIT,
    modal: fe.ModalPlate | None = None,
) -> Prediction:
    """Predict what a setup promises; what it shares with that of `like` is not computed again.

    Parameters
    ----------
    setup : Setup
    like : Prediction, optional
        Of another setup, with the same plate in modes.
    force : float, N
        Of the touches.
    modal : fe.ModalPlate, optional
        The plate in modes, for large touches; its thickness may be another one. Without it theory
        is linear.

    Raises
    ------
    ValueError
        If the images are too small to tell the modes of the plate apart.
    """
    shared = like if like is not None and like.setup.geometry == setup.geometry else None
    pattern = _unit_pattern(setup, modal) if shared is None else shared.pattern
    if shared is not None and force == shared.force:
        unit, interpolated, aliased = shared.unit, shared.interpolated, shared.aliased
    else:
        touches = touches_over(setup.plate.size, force)
        unit = expected_errors(pattern.forward(1.0), touches)
        interpolated = errors_of_interpolation(pattern, touches)
        aliased = np.array([aliased_part(pattern, touch) for touch in touches])
    if like is not None and _drawn(like.setup) == _drawn(setup):
        patch, energy, gain = like.patch, like.energy, like.gain
    else:
        patch = patch_of(setup)
        energy, gain = gradient_energy(patch), remaining_gain(setup, patch)
    return Prediction(setup, force, pattern, unit, interpolated, aliased, patch, energy, gain)


def _unit_pattern(given: Setup, modal: fe.ModalPlate | None) -> models.TilePattern:
    motions = image_motions(given.plate, given.camera, given.tile, modal)
    return equal_pattern(given, motions, 1.0)


def _drawn(setup: Setup) -> tuple[object, ...]:
    """Return what decides how the pattern looks."""
    return setup.pattern, setup.sensor, setup.camera, setup.plate


def from_strain(prediction: Prediction, motions: models.ImageMotions) -> ExpectedErrors:
    """Predict errors under 1 N over the plate from strain maps alone."""
    given = prediction.setup
    reference = equal_tiles(motions.tiles, prediction.energy)
    pattern = models.prepare_pattern(motions, reference)
    blocks = prepare_blocks(reference, given.dic.block)
    strain = models.prepare_strain_map(
        pattern, blocks, given.camera.build(given.plate), given.dic.window
    )
    return expected_errors(strain.forward(given.noise), touches_over(given.plate.size, UNIT))


def linear_to(plate: fe.Plate) -> float:
    """Find the force up to which linear theory is right to `fe.LINEAR_TOLERANCE`, N."""
    from fe import LINEAR_TOLERANCE

    force = UNIT
    for _ in range(8):  # the error grows with the square of the force, nearly
        force *= float(np.sqrt(LINEAR_TOLERANCE / fe.linear_range(plate, force).error))
    return force


def time_of_frame(given: Setup, motions: models.ImageMotions) -> float:
    """Measure how long a frame with one touch takes here, image to touch, s: the median."""
    width, height = given.camera.pixels
    image = np.random.default_rng(0).normal(128.0, 40.0, (height, width)).clip(0, 255)
    reference = prepare_tiles(image.astype(np.float32), motions.tiles.size)
    pattern = models.prepare_pattern(motions, reference)
    estimator = models.Estimator(pattern.forward(given.noise), max_touches=1)
    a, b = motions.modes.plate.size
    touch = np.array([[0.5 * a, 0.5 * b, UNIT]])
    motion, frame = pattern.still(), image.astype(np.uint8)
    motion[: pattern.count] = motions.modal_amplitudes(touch[:, :2], touch[:, 2])
    measured = estimator.forward.read(touch)[0]
    spent: list[float] = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        sums = tile_sums(reference, frame, *motions.flow_and_gradient(motion))
        pattern.whiten(pattern.gradient(sums, motion), given.noise)
        estimator.fit_whitened(measured, touch)
        spent.append(time.perf_counter() - begun)
    return float(np.median(spent))


def image_motions(
    plate: PlateSection, camera: CameraSection, tile: int, modal: fe.ModalPlate | None = None
) -> models.ImageMotions:
    """See the motions of the plate and of the camera on tiles of `tile` px.

    Without `modal` they are linear in the force, and those of the plate without its shape.
    """
    flat, view = plate.build(), camera.build(plate)
    tiles = lay_tiles((view.size[1], view.size[0]), tile)
    if modal is None:
        modes = fe.modes(flat.flat, MODES, mesh=fe.grid(flat, ELEMENTS))
        return models.prepare_motions(modes, view, view.face_height(flat.thickness), tiles)
    bent = fields(modal, flat)
    return models.prepare_motions(
        bent, view, view.face_height(flat.thickness), tiles, bent, models.with_tilts
    )


def fields(modal: fe.ModalPlate, plate: fe.Plate) -> models.BenchFields:
    """Amplitudes of a plate in modes that is otherwise as thick and stiff as `plate`."""
    thicker = log(plate.thickness / modal.plate.thickness)
    stiffer = log(plate.young / modal.plate.young)
    values = fe.bench_values(thickness=thicker, young=stiffer)
    return models.BenchFields(fe.BenchPlate(modal, values))


def equal_pattern(given: Setup, motions: models.ImageMotions, energy: float) -> models.TilePattern:
    """Prepare a pattern that is alike in all tiles.

    Raises
    ------
    ValueError
        If the images are too small to tell the modes of the plate apart.
    """
    try:
        return models.prepare_pattern(motions, equal_tiles(motions.tiles, energy))
    except np.linalg.LinAlgError:
        width, height = given.camera.pixels
        raise ValueError(
            f"images of {width} × {height} px in tiles of {given.tile} px cannot tell"
            f" {motions.modes.count} modes of the plate apart; set camera.pixels higher or dic.tile"
            " lower"
        ) from None


def patch_of(given: Setup) -> TileReference:
    """Prepare the middle of the image, without noise, as the live loop prepares its reference."""
    image, asked = _patch(given), given.dic.prefilter
    chosen = tile_prefilter(image, given.tile, given.noise) if asked is None else asked
    return prepare_tiles(image, given.tile, chosen)


def remaining_gain(given: Setup, reference: TileReference) -> float:
    """Measure the part by which the tiles of its patch find a small motion too large.

    Its image is rendered moved, so that aliasing is in it as in a camera's.
    """
    flow = np.full((len(reference.hessian), 2), SMALL)
    sums = tile_sums(reference, _patch(given, (SMALL, SMALL)), flow)
    left: F64 = -unbiased_gradient(reference, sums).sum(axis=0)
    xx, _, yy = reference.hessian.sum(axis=0)
    sine = float(np.sin(2.0 * np.pi * SMALL) / (2.0 * np.pi))
    return float(left[0] / xx + left[1] / yy) / (2.0 * sine)


def _patch(given: Setup, shift: tuple[float, float] = (0.0, 0.0)) -> F64:
    """Render the middle of the image without noise, moved by a shift in px, grey levels.

    It is blurred as that end of the plate is which is further out of focus.
    """
    view = given.camera.build(given.plate)
    width, height = (min(PATCH, side) for side in view.size)
    left, top = (view.size[0] - width) // 2, (view.size[1] - height) // 2
    centre = (view.centre[0] - left + shift[0], view.centre[1] - top + shift[1])
    patch = replace(view, size=(width, height), centre=centre)
    pattern, sensor, blur = given.pattern.build(given.plate), given.sensor.build(), blur_of(given)
    optics = None if blur is None else synthetic.Optics(disc=max(blur.circles))
    exposure, height = synthetic.Exposure(optics), view.face_height(given.plate.thickness)
    light = synthetic.render(pattern, patch, None, None, None, height, exposure=exposure) / 255.0
    return (sensor.white - sensor.black) * sensor.top * light


def touches_over(size: tuple[float, float], force: float, across: int = ACROSS) -> F64:
    """List touches over a plate, (n, 3) mm, mm, N."""
    places = places_over_plate(size, across)
    return np.column_stack([places, np.full(len(places), force)])
