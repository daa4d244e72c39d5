"""What DIC reads of a scene's gauges through its camera: without images, and from some."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

import synthetic
from models import CameraGauges, prepare_camera_gauges
from rig.live.bench import MODES
from rig.plates.cached import plate_modes
from rig.scene.bench import LatticeSection, PatternSection, RingSection, SensorSection
from rig.scene.plate import PlateSection
from rig.scene.sensing import TrainingSection
from rig.system import cache
from rig.system.arrays import F64, AnyArray

ROUNDING = 1 / sqrt(12)  # grey levels, of an image of whole ones


@dataclass(frozen=True)
class GaugeSetup:
    """The sections of a scene that say how a camera sees its gauges, all of them there.

    Attributes
    ----------
    camera : synthetic.AnyCamera
    reference_frames : int
        Images averaged into the reference.
    """

    plate: PlateSection
    gauges: RingSection | LatticeSection
    subset: int
    camera: synthetic.AnyCamera
    pattern: PatternSection
    sensor: SensorSection
    training: TrainingSection
    reference_frames: int


@dataclass(frozen=True, eq=False)
class RenderedGauges:
    """A camera over a plate, its gauges and the noise of their strains.

    Attributes
    ----------
    seen : CameraGauges
    root : (3M, 3M) float64
        Of the covariance of the strains.
    warper : synthetic.Warper
    sensors : pair of synthetic.SensorSection
        Of the reference and of an image, each for the mean of some.
    """

    seen: CameraGauges
    root: F64
    warper: synthetic.Warper
    sensors: tuple[synthetic.Sensor, synthetic.Sensor]

    def correlate(self, touches: F64, rng: np.random.Generator) -> F64:
        """Render touches (N, 3), mm, mm, N, one an image; return what DIC reads, (N, 3M).

        The plate is that of its modes, as without images. Each has a reference of its own.
        """
        import dic

        modes, points = self.seen.modes, self.warper.points
        value, slope, height = modes.value(points), modes.slope(points), self.warper.z

        def image(q: F64, sensor: synthetic.Sensor) -> AnyArray:
            tilt = -height * np.einsum("nka,k->na", slope, q)
            return self.warper.render(np.column_stack([tilt, value @ q]), sensor, rng)

        found: list[F64] = []
        for q in touches[:, 2:] * modes.response(touches[:, :2]):
            still = image(0.0 * q, self.sensors[0])
            gauges = self.seen.gauges
            reference = dic.prepare(still, gauges.size, points=gauges.xy)
            field = dic.strain(dic.correlate(reference, image(q, self.sensors[1])))
            found.append(np.column_stack([field.exx, field.eyy, field.exy]).ravel())
        return np.array(found)


def render_gauges(view: GaugeSetup, report: Callable[[int, int], None]) -> RenderedGauges:
    """See the gauges of a scene; `report` is called while modes of the plate are computed.

    Raises
    ------
    ValueError
        If a gauge leaves the image.
    """
    plate, camera = view.plate.build(), view.camera
    modes, height = plate_modes(plate, MODES, report), camera.face_height(plate.thickness)
    seen = prepare_camera_gauges(modes, camera, view.gauges.build(view.plate), view.subset)
    arrays = cache.fetch(
        "sharp-pattern",
        (synthetic, view.pattern.model_dump(), camera, plate.thickness),
        lambda: synthetic.prepare_warp(view.pattern.build(view.plate), camera, height).arrays(),
    )
    warper = synthetic.Warper.from_arrays(camera, height, arrays)
    one = view.sensor.build()
    frames = (
        view.training.averaged_frames,
        max(view.reference_frames, view.training.averaged_frames),
    )
    image, reference = (one.noise / sqrt(number) for number in frames)
    noise = hypot(image, ROUNDING, reference, ROUNDING / sqrt(frames[1])) / sqrt(2)
    span = (one.white - one.black) * one.top / 255.0
    rest = span * warper.render(np.zeros((len(warper.points), 3)), None, None)
    sensors = tuple(
        synthetic.Sensor(noise=deviation, bits=one.bits) for deviation in (reference, image)
    )
    return RenderedGauges(seen, seen.root(rest, noise), warper, (sensors[0], sensors[1]))
