"""A bench that is ready to run: the parts of a scene that the live loop needs, and no others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import fe
import synthetic
from dic import lay_tiles
from models import ImageMotions, bench_before, prepare_motions
from rig.live.alignment import Alignment
from rig.live.baseline import ReferenceFrame
from rig.live.chain import Chain, prepare_chain
from rig.live.hidden_parts import HiddenParts
from rig.live.known_bench import KnownBench, motions_on_bench, require_bench
from rig.live.plate_in_time import PlateInTime, in_time, require_own_modes
from rig.live.strain_chain import StrainChain, prepare_strain, with_touches
from rig.live.touch_start import touch_net_of
from rig.plates.cached import plate_modes, reduced
from rig.scene import Scene
from rig.scene.bench import CameraSection
from rig.scene.described import described
from rig.scene.plate import PlateSection
from rig.scene.sensing import DicSection, NetEstimator, PatternEstimator, StrainEstimator
from rig.scene.theory import Theory, choose, largest_force

if TYPE_CHECKING:
    import models
    from models import BenchEstimate, LargePlate
    from rig.calibration.store import Calibration
    from rig.live.net_chain import NetChain, NetPlan

MODES = int(PatternEstimator.model_fields["modes"].default)
"""Modes of the plate where the scene does not say how many."""


@dataclass(frozen=True, eq=False)
class PreparedBench:
    """Everything that is prepared once for a reference.

    Attributes
    ----------
    reference : ReferenceFrame
    chain : Chain
    strain : StrainChain or None
        Where the scene compares with strain.
    net : NetChain or None
        Where the scene has one.
    """

    reference: ReferenceFrame
    chain: Chain
    strain: StrainChain | None
    net: NetChain | None


@dataclass(frozen=True, eq=False)
class Bench:
    """Plate, camera and what is computed from a frame.

    Attributes
    ----------
    plate : fe.Plate
    camera : synthetic.AnyCamera
    motions : models.ImageMotions
        Of plate modes and camera, on the tiles of the image.
    dic : rig.scene.sensing.DicSection
        Tile, block, strain window and number of reference frames.
    max_touches : int
        Largest number of touches looked for.
    min_force : float, N
        Weakest touch that counts in the scores.
    strain : bool
        Whether the map of strain is made as well.
    theory : rig.scene.theory.Theory
        That of small or of large touches, and why.
    alignment : Alignment or None
        What known presses correct in every estimate.
    net : NetPlan or None
        The net that estimates the touches, where the scene has one.
    known : models.BenchEstimate or None
        What is known of plate, edges and camera, where they are not just as the scene says.
    in_time : PlateInTime or None
        How the plate rings and creeps, where the scene says it.
    row_time : float, s
        From the reading of one row of an image to that of the next; 0 for a global shutter.
    start : models.TouchNet or None
        What proposes touches where a search is cold, where the scene names it.
    strain_touches : bool
        Whether touches are estimated from strain, where that is drawn.
    rate : float or None, frames a second
        What the scene expects of the camera.
    friction : float
        Of touches, see `models.Estimator`.
    """

    plate: fe.Plate
    camera: synthetic.AnyCamera
    motions: ImageMotions
    dic: DicSection
    max_touches: int
    min_force: float
    strain: bool
    theory: Theory
    alignment: Alignment | None = None
    net: NetPlan | None = None
    known: models.BenchEstimate | None = None
    in_time: PlateInTime | None = None
    row_time: float = 0.0
    start: models.TouchNet | None = None
    strain_touches: bool = True
    rate: float | None = None
    friction: float = 0.0

    @property
    def height(self) -> float:
        """Height of the seen face over the plate's middle plane, mm."""
        return self.camera.face_height(self.plate.thickness)

    @property
    def reference_frames(self) -> int:
        """Frames averaged into the reference."""
        return self.dic.reference_frames

    @property
    def hidden_parts(self) -> HiddenParts:
        """What hides the pattern, before any frame."""
        return HiddenParts.of(self.motions.tiles, self.camera, self.height)

    def prepare_all(self, reference: ReferenceFrame) -> PreparedBench:
        """Prepare all that a frame goes through.

        Raises
        ------
        ValueError
            See `prepare` and `prepare_net`.
        """
        chain, strain = self.prepare(reference)
        return PreparedBench(reference, chain, strain, self.prepare_net(reference, chain))

    def prepare(self, reference: ReferenceFrame) -> tuple[Chain, StrainChain | None]:
        """Prepare the chain, and that of strain where the scene wants it.

        Raises
        ------
        ValueError
            If the reference has another size than the camera's images, or shows too little to
            tell the modes of the plate apart.
        """
        height, width = reference.image.shape
        if (width, height) != self.camera.size:
            raise ValueError(
                f"images are {width} × {height} px and the scene's camera has"
                f" {self.camera.size[0]} × {self.camera.size[1]} px; set camera.pixels to"
                f" [{width}, {height}]"
            )
        try:
            known = None
            if self.known is not None:
                known = KnownBench(self.known, self.camera, self.row_time)
            chain = prepare_chain(
                reference,
                self.motions,
                self.max_touches,
                known,
                self.in_time,
                self.start,
                self.dic.prefilter,
                self.friction,
            )
        except np.linalg.LinAlgError:
            raise ValueError(
                f"images of {self.camera.size[0]} × {self.camera.size[1]} px cannot tell"
                f" {self.motions.modes.count} modes of the plate apart; set"
                " estimator.modes or dic.tile lower, and look whether the pattern is in view"
            ) from None
        if not self.strain:
            return chain, None
        strain = prepare_strain(chain, self.camera, self.dic.block, self.dic.window)
        return chain, with_touches(strain, chain) if self.strain_touches else strain

    def prepare_net(self, reference: ReferenceFrame, chain: Chain) -> NetChain | None:
        """Prepare the net for a reference, where the scene has one.

        Raises
        ------
        ValueError
            If the net or its gauges do not suit the reference.
        """
        if self.net is None:
            return None
        from rig.live.net_chain import prepare_net

        return prepare_net(self.net, chain, reference, self.camera)


def build_bench(
    scene: Scene, report: Callable[[int, int], None], calibration: Calibration | None = None
) -> Bench:
    """Build the live parts of a scene; `report` is called while the modes are computed.

    What was calibrated stands in the place of what the scene says: the camera, and what known
    presses correct. A bench of another plate or camera is left aside.

    Raises
    ------
    ValueError
        If the scene lacks what the live loop needs, compares with what it cannot run, bends the
        plate before it is touched, or has its camera on the other side than it was calibrated.
    """
    comparison = _comparison(scene)
    calibration = calibration.for_scene(scene) if calibration else None
    plate, camera, dic, estimator = _live_parts(scene)
    flat, theory = plate.build(), choose(scene, plate, largest_force(scene))
    view = camera_view(plate, camera, calibration)
    known = _known(flat, view, scene, calibration)
    require_own_modes(scene, theory.name, exact=known is None)
    require_bench(camera, exact=known is None)
    net = _net(scene, theory)  # read first: a wrong file is not to be found out after a minute
    tiles = lay_tiles((view.size[1], view.size[0]), dic.tile)
    if known is not None:
        motions = motions_on_bench(known, flat, view, tiles, report)
    else:
        count = estimator.modes if isinstance(estimator, PatternEstimator) else MODES
        modes, large = _fields(flat, count, theory, report)
        motions = prepare_motions(modes, view, view.face_height(flat.thickness), tiles, large)
    return Bench(
        plate=flat,
        camera=view,
        motions=motions,
        dic=dic,
        max_touches=scene.touches.max_touches if scene.touches else 1,
        min_force=scene.touches.force[0] if scene.touches else 0.0,
        strain=comparison is not None,
        strain_touches=comparison is None or comparison.touches,
        theory=theory,
        alignment=calibration.alignment() if calibration and known is None else None,
        net=net,
        known=known,
        in_time=in_time(scene, motions, calibration),
        row_time=camera.row_time,
        rate=camera.rate,
        friction=scene.touches.friction if scene.touches else 0.0,
        start=touch_net_of(scene, theory.name, exact=known is None),
    )


def _comparison(scene: Scene) -> StrainEstimator | None:
    """Return what the loop compares with, or refuse what it cannot run beside."""
    if not isinstance(scene.comparison, StrainEstimator | None):
        raise ValueError(
            f"scene '{scene.title}' compares with an estimator of kind '{scene.comparison.kind}',"
            " and live only strain is compared; set comparison.kind to 'strain' or leave it out"
        )
    return scene.comparison


def _live_parts(
    scene: Scene,
) -> tuple[PlateSection, CameraSection, DicSection, PatternEstimator | NetEstimator]:
    """Return the sections that the live loop needs, or refuse a scene that cannot run."""
    match scene:
        case Scene(
            plate=PlateSection() as plate,
            camera=CameraSection() as camera,
            dic=DicSection() as dic,
            estimator=PatternEstimator() | NetEstimator() as estimator,
        ):
            pass
        case _:
            raise ValueError(
                f"scene '{scene.title}' cannot run live; it needs [plate], [camera], [dic] and an"
                " [estimator] of kind 'pattern' or 'net', as twin and twin-net have them"
            )
    if scene.base:
        raise ValueError(
            f"scene '{scene.title}' has a bent plate, and the live loop takes it as flat; leave"
            " [base] out"
        )
    return plate, camera, dic, estimator


def camera_view(
    plate: PlateSection, camera: CameraSection, calibration: Calibration | None
) -> synthetic.AnyCamera:
    """Return the calibrated camera where it has the pixels of the scene, else the scene's."""
    view = calibration.camera() if calibration else None
    if view is None or view.size != camera.pixels:
        view = camera.build(plate)
    if view.face != camera.face:
        raise ValueError(
            f"the calibrated pose has the camera on the other side of the plate than camera.side ="
            f' "{camera.side}"; calibrate the pose again, or correct camera.side'
        )
    return view


def _known(
    flat: fe.Plate,
    view: synthetic.AnyCamera,
    scene: Scene,
    calibration: Calibration | None,
) -> BenchEstimate | None:
    """Return what is known of a bench by presses, or before any; None where it counts as exact.

    Before presses a camera that was calibrated is known as well as boards have left it.
    """
    known = calibration.known_bench() if calibration else None
    if known is not None or described(scene) == "exact":
        return known
    return calibration.bench_before(flat, view.size) if calibration else bench_before(flat)


def _net(scene: Scene, theory: Theory) -> NetPlan | None:
    if not isinstance(scene.estimator, NetEstimator):
        return None
    from rig.live.net_chain import plan_net

    return plan_net(scene, theory)


def _fields(
    plate: fe.Plate, count: int, theory: Theory, report: Callable[[int, int], None]
) -> tuple[fe.Modes, LargePlate | None]:
    """Give what carries the motion of a plate: its modes, and under large touches more."""
    if theory.name == "linear":
        return plate_modes(plate, count, report), None
    from models import large_plate

    large = large_plate(reduced(plate, theory.force, report), count)
    return large.modes, large
