"""A bench whose plate bends and twists with its base: the parts that the live loop needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import fe
import models
import synthetic
from rig.live.baseline import ReferenceFrame
from rig.live.bench import camera_view
from rig.plates import cached
from rig.scene import Scene
from rig.scene.bench import CameraSection
from rig.scene.counts import BASE_ELEMENTS
from rig.scene.plate import PlateSection
from rig.scene.sensing import DicSection, PatternEstimator

if TYPE_CHECKING:
    from rig.calibration.store import Calibration

ELEMENTS, FINER = BASE_ELEMENTS
"""Elements along a side: of the shell that is pressed, and of the one that makes its image."""


@dataclass(frozen=True, eq=False)
class BaseBench:
    """A plate between clamps that move, its camera, and what is computed from a frame.

    Attributes
    ----------
    plate : fe.Plate
        Flat.
    camera : synthetic.AnyCamera
    shell, finer : fe.Shell
        The plate on the elements on which it is pressed, and on those that make its image.
    known : tuple of fe.ShellState
        Shapes over the range of bases, where a search begins.
    dic : DicSection
        Tile and number of reference frames.
    max_touches : int
        Largest number of touches looked for.
    min_force : float, N
        Weakest touch that counts in the scores.
    rate : float or None, frames a second
        What the scene expects of the camera.
    friction : float
        Of touches, see `models.Estimator`.
    """

    plate: fe.Plate
    camera: synthetic.AnyCamera
    shell: fe.Shell
    finer: fe.Shell
    known: tuple[fe.ShellState, ...]
    dic: DicSection
    max_touches: int
    min_force: float
    rate: float | None = None
    friction: float = 0.0

    def watched(self, reference: ReferenceFrame) -> models.Watched:
        """Return plate and camera with an image of the flat plate.

        Raises
        ------
        ValueError
            If the reference has another size than the camera's images.
        """
        height, width = reference.image.shape
        if (width, height) != self.camera.size:
            raise ValueError(
                f"images are {width} × {height} px and the scene's camera has"
                f" {self.camera.size[0]} × {self.camera.size[1]} px; set camera.pixels to"
                f" [{width}, {height}]"
            )
        return models.Watched(self.camera, reference.image, self.finer, self.dic.tile)


def build_base_bench(
    scene: Scene, report: Callable[[int, int], None], calibration: Calibration | None = None
) -> BaseBench:
    """Build the live parts of a scene with a base; its known shapes are kept in the cache.

    Parameters
    ----------
    scene : Scene
    report : callable
        Called with how many of how many shapes are computed, a minute's work the first time.
    calibration : Calibration, optional
        The camera of it stands in the place of the scene's.

    Raises
    ------
    ValueError
        If the scene lacks what the loop needs, has what it cannot do on a base, or its plate cannot
        take one.
    """
    match scene:
        case Scene(
            plate=PlateSection() as section,
            camera=CameraSection() as camera,
            dic=DicSection() as dic,
            estimator=PatternEstimator() as estimator,
        ):
            pass
        case _:
            raise ValueError(
                f"scene '{scene.title}' has a base and cannot run live; it needs [plate], [camera],"
                " [dic] and an [estimator] of kind 'pattern', as bent-base has them"
            )
    _refuse(scene, camera, estimator)
    plate = section.build()
    shell = fe.Shell(plate, fe.even_grid(plate, ELEMENTS))
    return BaseBench(
        plate=plate,
        camera=camera_view(section, camera, calibration),
        shell=shell,
        finer=fe.Shell(plate, fe.even_grid(plate, FINER)),
        known=models.with_images(cached.shapes(shell, report)),
        dic=dic,
        max_touches=scene.touches.max_touches if scene.touches else 1,
        min_force=scene.touches.force[0] if scene.touches else 0.0,
        rate=camera.rate,
        friction=scene.touches.friction if scene.touches else 0.0,
    )


def _refuse(scene: Scene, camera: CameraSection, estimator: PatternEstimator) -> None:
    """Refuse what only the loop of a flat plate does."""
    unable = {
        "comparison": scene.comparison is not None,
        "projector": scene.projector is not None,
        "dynamics": scene.dynamics is not None,
        "camera.row_time": camera.row_time > 0,
        "estimator.bench": estimator.bench == "usual",
        "estimator.start": estimator.start != "search",
    }
    for key, named in unable.items():
        if named:
            raise ValueError(
                f"scene '{scene.title}' has a bent plate and names {key}, which only the loop of a"
                f" flat plate knows; leave one of {key} and [base] out"
            )
