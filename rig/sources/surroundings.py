"""What lies between a plate and its image beside geometry: light, lens, hand and dirt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

import fe
import synthetic
from rig.system.arrays import F32, F64, Grey, Mask

CROSSING = 2.0  # s in which a shadow crosses the image
SOFT = 0.06  # of the image's width, over which it sets in
AWAY = 8.0  # mm between a finger's middle and where what is seen of the hand begins
SLANT = 0.33, 0.94  # sine and cosine of the arm's direction


@dataclass(frozen=True)
class Surroundings:
    """Sizes of what a lab has around a plate; at 0 each is absent.

    Attributes
    ----------
    brighter : float
        Fraction by which the light has grown since the reference was taken.
    shadow : float
        Fraction of the light that a shadow takes which crosses the plate again and again.
    flicker : float
        Standard deviation of the light from image to image, a fraction.
    defocus : float, px
        Standard deviation of the spot that a point has become since the reference was taken.
    hand : float, mm
        Width of the arm whose finger presses; it hides what lies behind it.
    clamps : float
        Light of what is seen beside the plate, 1 as bright as its ground.
    fixed_pattern : float, grey levels
        Standard deviation of what each pixel adds to every image.
    vignetting : float
        Fraction of the light that the corners of the image lack.
    """

    brighter: float = 0.0
    shadow: float = 0.0
    flicker: float = 0.0
    defocus: float = 0.0
    hand: float = 0.0
    clamps: float = 0.0
    fixed_pattern: float = 0.0
    vignetting: float = 0.0


@dataclass(frozen=True, eq=False)
class Surrounded:
    """A view of a plate with what surrounds both.

    Attributes
    ----------
    surroundings : Surroundings
    camera : synthetic.AnyCamera
    plate : (float, float), mm
        Sides of the plate.
    height : float, mm
        Of its seen face.
    seed : int
        Of the fixed pattern.
    """

    surroundings: Surroundings
    camera: synthetic.AnyCamera
    plate: tuple[float, float]
    height: float
    seed: int

    def expose(
        self,
        light: F32 | F64,
        since: float | None,
        touches: Sequence[fe.Touch],
        rng: np.random.Generator,
    ) -> F32:
        """Light that reaches each pixel, (H, W).

        Parameters
        ----------
        light : (H, W) float
            Of the evenly lit plate as a sharp lens shows it.
        since : float or None, s
            Time after the reference; None while that is taken.
        touches : sequence of fe.Touch
            Fingers whose hands are seen.
        rng : Generator
            Of the flicker.
        """
        around = self.surroundings
        lit = np.asarray(light, dtype=np.float32)
        if around.flicker:
            lit = lit * np.float32(max(1.0 + around.flicker * rng.standard_normal(), 0.0))
        if since is not None:
            lit = self._since(lit, since, touches)
        if around.clamps:
            lit = np.where(self._beside, np.float32(around.clamps), lit)
        return lit * self._falloff if around.vignetting else lit

    def soil(self, image: Grey) -> None:
        """Add to an image (H, W) what each pixel adds to every one."""
        if self.surroundings.fixed_pattern:
            image[:] = np.clip(np.rint(image + self._dirt), 0, 255)

    def _since(self, lit: F32, since: float, touches: Sequence[fe.Touch]) -> F32:
        around = self.surroundings
        if around.brighter or around.shadow:
            lit = lit * self._shaded(since)
        for touch in touches if around.hand else ():
            lit = self._arm(touch).cover(lit.astype(np.float64)).astype(np.float32)
        if around.defocus:
            lit = np.asarray(cv2.GaussianBlur(lit, (0, 0), around.defocus), dtype=np.float32)
        return lit

    def _shaded(self, since: float) -> F32:
        """Light of the lamp in each column, (W,): a shadow is a third of the image wide."""
        along = np.linspace(0.0, 1.0, self.camera.size[0])
        middle = (since / CROSSING) % 1.0
        rise, fall = (np.tanh((along - middle + half) / SOFT) for half in (1 / 6, -1 / 6))
        around = self.surroundings
        lamp = (1.0 + around.brighter) * (1.0 - around.shadow * (rise - fall) / 2.0)
        return lamp.astype(np.float32)

    def _arm(self, touch: fe.Touch) -> synthetic.Occluder:
        """Arm that ends beside a finger and leaves the image at the right."""
        sine, cosine = SLANT
        along, across = np.array([cosine, sine]), np.array([-sine, cosine])
        finger, wide = np.array([touch.x, touch.y]), 0.5 * self.surroundings.hand
        near, far = finger + AWAY * along, finger + 2.0 * max(self.plate) * along
        corners = (
            near - wide * across,
            near + wide * across,
            far + wide * across,
            far - wide * across,
        )
        on_face = np.column_stack([np.array(corners), np.full(4, self.height)])
        return synthetic.Occluder(self.camera.project(on_face))

    @cached_property
    def _beside(self) -> Mask:
        """Pixels that do not see the plate, (H, W) bool."""
        width, height = self.camera.size
        y, x = np.indices((height, width), dtype=np.float64)
        pixels = np.column_stack([x.ravel(), y.ravel()])
        points = self.camera.on_plate(pixels, self.height)
        outside = (points < 0.0) | (points > np.array(self.plate))
        return outside.any(axis=1).reshape(height, width)

    @cached_property
    def _falloff(self) -> F32:
        optics = synthetic.Optics(vignetting=self.surroundings.vignetting)
        return optics.falloff(self.camera.size).astype(np.float32)

    @cached_property
    def _dirt(self) -> F64:
        width, height = self.camera.size
        rng = np.random.default_rng((self.seed, 77))
        return self.surroundings.fixed_pattern * rng.standard_normal((height, width))
