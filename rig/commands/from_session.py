"""What `touchplate train SCENE --from SESSION` does first: presses correct the forward model."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.output import progress
from rig.scene import Scene

if TYPE_CHECKING:
    from models import Net
    from rig.training.net_presses import PressScore
    from rig.training.plan import TrainingPlan


@dataclass(frozen=True)
class LearnedPresses:
    """What presses correct: a sentence for people and figures for machines."""

    sentence: str
    figures: dict[str, Any]


def learn_from(name: str, scene: Scene, path: Path) -> LearnedPresses:
    """Correct the forward model of a scene by the known presses of a recording.

    What helps on the presses held out is kept beside the scene, as a calibration.

    Raises
    ------
    ValueError
        If the scene is not that of the recording, or has gauges that no camera reads.
    OSError
        If the recording cannot be read.
    """
    from rig.calibration import store
    from rig.calibration.session import learn
    from rig.recording.session import open_session

    if not _seen(scene):
        raise ValueError(
            f"scene '{scene.title}' has no estimator of kind 'pattern' and no net whose gauges a"
            " camera reads, and known presses correct no other; leave --from out"
        )
    with open_session(path) as session, progress("plate") as report:
        if (session.scene.plate, session.scene.camera) != (scene.plate, scene.camera):
            raise ValueError(
                f"recording '{path}' is of another plate or camera than scene '{scene.title}';"
                " give the scene that it was recorded with"
            )
        learned = learn(session, report)
    score, kept = learned.score, learned.helps
    said = "kept" if kept else "not kept, for the model is not proven wrong"
    if kept:
        for part in (learned.lens, learned.pose, learned.alignment):
            store.keep(store.beside(name), part)
    figures = {"softness": 1 / learned.alignment.gain, "focal_px": learned.lens.focal, "kept": kept}
    return LearnedPresses(
        f"{score.held_out} presses held out: {score.place_before:.2f} → {score.place_after:.2f} mm,"
        f" force {100 * score.force_before:.1f} → {100 * score.force_after:.1f} %; {said}",
        asdict(score) | figures,
    )


def score_net(name: str, net: Net, plan: TrainingPlan, scene: Scene, path: Path) -> PressScore:
    """Score a net on the presses of a recording, through the camera as it is known now."""
    from rig.calibration import store
    from rig.recording.session import open_session
    from rig.training.net_presses import score_presses

    calibration = store.calibration_beside(name)
    with open_session(path) as session, progress("presses") as report:
        return score_presses(net, plan, scene, calibration, session, report)


def _seen(scene: Scene) -> bool:
    """Whether the touches of a scene are found in images."""
    kind = scene.estimator.kind if scene.estimator else ""
    return kind == "pattern" or (
        kind == "net" and scene.gauges is not None and scene.gauges.subset is not None
    )
