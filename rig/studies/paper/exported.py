"""Nets of the paper's scenes, of every kind, as ONNX files in another runtime: the same numbers."""

# onnxruntime states its types in part.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import onnxruntime

from models import TrainedTwoStep, predict_two_step, write_model_onnx
from rig.report.figure import Figure, at_most
from rig.studies.paper.drawn.trainings import KeptTraining, Settings, train_kept
from rig.studies.study import line, run_drawn
from rig.system.arrays import F64
from rig.training.model_score import predictor

TITLE = "Exported nets in onnxruntime"
FEW: Settings = {"estimator.epochs": 50}
NETS: dict[str, Settings] = {
    "paper-one": {},
    "paper-one-best": {},
    "paper-cnn": {},
    "paper-gan": {},
    "paper-two": {},
    "paper-two-best": {},
    "paper-three": FEW,
    "paper-three-best": {},
    "paper-two-magnitudes": FEW,
    "paper-two-magnitudes-best": {},
    "paper-deformable-one-step": {},
    "paper-deformable": {},
    "paper-deformable-best": {},
}
"""Scenes, and what is set of them: nets that train for long are compared after a few steps."""

SAME = 1e-6
"""mm and units of a magnitude, up to which numbers are the same; where two touches come within 1 mm
of each other their places are roots that amplify rounding, and they are compared apart."""

ASKED = 500


def exported(folder: Path) -> Iterator[Figure]:
    """Compare what each net says here and there."""
    differ = 0
    for scene, settings in NETS.items():
        kept = train_kept(scene, settings)
        ours, theirs = _both(kept)
        clear = _apart(ours, kept.plan.touches) > 1.0
        off = float(np.abs(theirs - ours)[clear].max())
        differ += off > SAME
        yield from line(TITLE, scene, **{"largest difference": (off, "", None, int(clear.sum()))})
    said = "exported nets whose numbers differ in onnxruntime"
    yield from line(TITLE, said, nets=(differ, "", at_most(0), len(NETS)))


def _both(kept: KeptTraining) -> tuple[F64, F64]:
    """Return what a model reports of the first touches of its test, here and there."""
    model = kept.model
    if kept.plan.training.bases:
        test = kept.bent.test.surface()
        fed = {"before": test.before[:ASKED], "strain": test.loaded[:ASKED]}
    else:
        fed = {"strain": kept.flat.test.strain[:ASKED].astype(np.float64)}
    if isinstance(model, TrainedTwoStep):
        ours = predict_two_step(model.nets, fed["before"], fed["strain"])
    else:
        ours = predictor(model)(fed["strain"])
        fed = {"strain": fed["strain"]}
    with TemporaryDirectory() as place:
        path = Path(place) / "net.onnx"
        write_model_onnx(path, model)
        session = onnxruntime.InferenceSession(path)
        (theirs,) = session.run(["targets"], fed)
    return ours, np.asarray(theirs, np.float64)


def _apart(found: F64, touches: int) -> F64:
    """Distance of the two nearest touches of each sample, mm; infinite for one."""
    places = found[:, : 2 * touches].reshape(-1, touches, 2)
    between = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
    return (between + np.where(np.eye(touches) > 0, np.inf, 0.0)).min(axis=(1, 2))


if __name__ == "__main__":
    run_drawn({"exported": exported}, __doc__)
