"""What `touchplate train SCENE --from SESSION` does: known presses correct the forward model."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from rig.commands.output import emit, progress
from rig.scene import Scene


def learn_from(name: str, scene: Scene, path: Path, as_json: bool) -> None:
    """Correct the forward model of a scene by the known presses of a recording.

    What helps on the presses held out is kept beside the scene, as a calibration.

    Raises
    ------
    ValueError
        If the scene is not that of the recording, or finds touches by a net.
    OSError
        If the recording cannot be read.
    """
    from rig.calibration import store
    from rig.calibration.session import learn
    from rig.recording.session import open_session

    if scene.estimator is None or scene.estimator.kind != "pattern":
        raise ValueError(
            f"scene '{scene.title}' has no estimator of kind 'pattern', and known presses correct"
            " no other; leave --from out"
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
    emit(
        f"{score.held_out} presses held out: {score.place_before:.2f} → {score.place_after:.2f} mm,"
        f" force {100 * score.force_before:.1f} → {100 * score.force_after:.1f} %; {said}",
        asdict(score) | figures,
        as_json,
    )
