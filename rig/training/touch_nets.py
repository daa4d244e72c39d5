"""What a scene says of the training of its touch net."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.design.prediction import patch_of
from rig.design.setup import setup_of
from rig.scene import Scene
from rig.scene.plate import TouchesSection
from rig.scene.touch_net import TouchNetSection

if TYPE_CHECKING:
    import models

MAX_TOUCHES = 4  # touches that a touch net knows


def described_bench(scene: Scene) -> models.DescribedBench:
    """Return the bench of a scene, its noise by a rendered patch of its pattern.

    Raises
    ------
    ValueError
        The scene lacks a part, or its camera is no pinhole.
    """
    from models import DescribedBench, gradient_energy

    setup = setup_of(scene)
    if setup.camera.kind != "pinhole":
        raise ValueError(
            f"a touch net is trained before a pinhole, got a camera of kind '{setup.camera.kind}';"
            " set camera.kind to 'pinhole'"
        )
    patch = patch_of(setup)
    noise = float(patch.motion_noise(setup.noise) / np.sqrt(gradient_energy(patch)))
    camera = setup.camera
    return DescribedBench(
        setup.plate.build(), camera.stand_off, camera.pixels, setup.dic.tile, noise
    )


def touch_range(scene: Scene, section: TouchNetSection) -> models.TouchRange:
    """Return the touches that a net of a scene learns.

    Raises
    ------
    ValueError
        The scene expects no touches, or all of one force.
    """
    from models import TouchRange

    if scene.plate is None or not isinstance(scene.touches, TouchesSection):
        raise ValueError("a touch net needs [plate] and [touches]; add them, as touch-net has them")
    low, high = scene.touches.force
    if low == high:
        raise ValueError(
            f"a touch net learns a range of forces, got touches.force from {low:g} to {high:g} N;"
            " give two that differ"
        )
    a, b = scene.plate.size
    return TouchRange((a, b), section.margin, (low, high))


def touch_net_recipe(section: TouchNetSection) -> models.TouchNetRecipe:
    """Return the recipe that a section describes."""
    from models import TouchNetRecipe

    return TouchNetRecipe(
        steps=section.steps,
        head_steps=section.head_steps,
        seed=section.seed,
        batch=section.batch,
        head_batch=section.head_batch,
        learning_rate=section.learning_rate,
        benches=section.benches,
    )
