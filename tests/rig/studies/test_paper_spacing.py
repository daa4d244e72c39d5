"""What the paper leaves open of its finest spacing is trained choice by choice, and drawn."""

import numpy as np
import pytest

pytest.importorskip("torch")

from rig.studies.paper.drawn import size, trainings

COARSE = {
    "gauges.spacing": "10 mm",
    "training.spacing": "10 mm",
    "training.test_samples": 50,
    "estimator.epochs": 400,
}


@pytest.mark.slow
def test_each_choice_has_a_loss_and_a_constant_rate_is_extrapolated(tmp_path, monkeypatch):
    falling = COARSE | {"estimator.decay": "cosine"}
    monkeypatch.setattr(trainings, "FOLDER", tmp_path)
    monkeypatch.setattr(size, "LEFT_OPEN", {"all": COARSE, "falling": falling})
    drawing, *rows = size.finest(tmp_path)
    assert (tmp_path / str(drawing.value)).is_file()
    here = {row.case: row.value for row in rows if row.quantity == "here"}
    said = "Ls 1, Lt 1 mm, {}: loss"
    ahead = "Ls 1, Lt 1 mm, all, extrapolated to 30000 epochs: loss"
    assert list(here) == [said.format("all"), ahead, said.format("falling")]
    between = {row.quantity: row.value for row in rows if row.case == ahead}
    assert 0.0 < between["least"] <= between["here"] <= between["largest"]


@pytest.mark.parametrize(("batch", "steps"), [(None, 30000), (32, 90000)])
def test_epochs_are_counted_in_steps(tmp_path, monkeypatch, batch, steps):
    monkeypatch.setattr(trainings, "FOLDER", tmp_path)
    settings = COARSE | {"estimator.epochs": 5} | ({"estimator.batch": batch} if batch else {})
    kept = trainings.train_kept("paper-one", settings)
    assert len(kept.flat.training) == 81
    assert size.steps_of_the_paper(kept) == steps
    assert np.isfinite(kept.curves()[""]).all()
