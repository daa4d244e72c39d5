"""What a net is trained from: the sections of a scene that its training needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.scene.bench import LatticeSection, RingSection
from rig.scene.dataset import DatasetSection
from rig.scene.plate import PlateSection
from rig.scene.scene import Scene
from rig.scene.sensing import NetEstimator, RegressionEstimator, TrainingSection
from rig.scene.theory import require_linear

if TYPE_CHECKING:
    import synthetic
    from rig.training.rendered_gauges import GaugeSetup


@dataclass(frozen=True)
class TrainingPlan:
    """The sections of a scene that a net is trained from, all of them there.

    Attributes
    ----------
    samples : DatasetSection or None
        Where a sample has several touches.
    view : GaugeSetup or None
        Where DIC reads the gauges through a camera.
    """

    plate: PlateSection
    gauges: RingSection | LatticeSection
    training: TrainingSection
    net: NetEstimator | RegressionEstimator
    samples: DatasetSection | None
    view: GaugeSetup | None

    @property
    def touches(self) -> int:
        """Touches of a sample."""
        return self.samples.touches if self.samples else 1

    @property
    def descent(self) -> NetEstimator:
        """The net.

        Raises
        ------
        ValueError
            Where there is a regression in its place.
        """
        if isinstance(self.net, RegressionEstimator):
            raise ValueError(
                "a regression has no layers and no epochs; set estimator.kind to 'net', or use"
                " `touchplate train` and `score` alone"
            )
        return self.net

    def dump(self) -> dict[str, Any]:
        """Return the sections as plain values: what a training belongs to."""
        sections = self.plate, self.gauges, self.training, self.net, self.samples
        names = "plate", "gauges", "training", "net", "samples"
        return {
            name: part and part.model_dump(mode="json")
            for name, part in zip(names, sections, strict=True)
        }

    @property
    def magnitudes(self) -> bool:
        """Whether the net estimates how hard each touch presses."""
        return self.samples is not None and self.samples.magnitudes > 1


def training_plan(scene: Scene, camera: synthetic.AnyCamera | None = None) -> TrainingPlan:
    """Return what a net is trained from; `camera` is the one that was calibrated, if any.

    Raises
    ------
    ValueError
        When the scene has no net to train, or a plate that linear theory does not serve.
    """
    match scene:
        case Scene(
            plate=PlateSection() as plate,
            gauges=RingSection() | LatticeSection() as gauges,
            training=TrainingSection() as training,
            estimator=NetEstimator() | RegressionEstimator() as net,
        ):
            if training.bases:
                _require_known_bases(scene, net)
                return TrainingPlan(plate, gauges, training, net, None, None)
            several = scene.dataset is not None and scene.dataset.touches > 1
            force = None if several else training.force[1]
            require_linear(scene, plate, force if gauges.subset else None, "training")
            view = _view(scene, plate, gauges, training, camera)
            return TrainingPlan(
                plate, gauges, training, net, scene.dataset if several else None, view
            )
        case _:
            raise ValueError(
                f"scene '{scene.title}' has no net to train; give its [estimator] kind = \"net\""
                " and add [gauges] and [training], as paper-one has them"
            )


def _require_known_bases(scene: Scene, net: NetEstimator | RegressionEstimator) -> None:
    """Refuse what no training on bent bases has."""
    if isinstance(net, RegressionEstimator) or net.family != "dense":
        raise ValueError(
            f"scene '{scene.title}' bends its plate, and only full nets learn that; set"
            " estimator.kind to 'net' and estimator.family to 'dense', or leave training.bases out"
        )
    if scene.gauges and scene.gauges.subset:
        raise ValueError(
            f"scene '{scene.title}' bends its plate, and no camera is simulated there; leave"
            " gauges.subset out"
        )


def _view(
    scene: Scene,
    plate: PlateSection,
    gauges: RingSection | LatticeSection,
    training: TrainingSection,
    camera: synthetic.AnyCamera | None,
) -> GaugeSetup | None:
    """Return what says how a camera sees the gauges; None where they are on the face."""
    if gauges.subset is None:
        return None
    if scene.pattern is None or scene.sensor is None or scene.camera is None:
        raise ValueError(
            f"scene '{scene.title}' has DIC read its gauges, and not what noise they have; add"
            " [pattern] and [sensor], as twin-net has them"
        )
    if scene.dataset is not None and scene.dataset.touches > 1:
        raise ValueError(
            f"scene '{scene.title}' has DIC read its gauges, and such nets learn one touch; set"
            " dataset.touches to 1 or leave gauges.subset out"
        )
    from rig.training.rendered_gauges import GaugeSetup

    view = camera or scene.camera.build(plate)
    frames = scene.dic.reference_frames if scene.dic else training.averaged_frames
    return GaugeSetup(
        plate, gauges, gauges.subset, view, scene.pattern, scene.sensor, training, frames
    )
