"""`touchplate train` and `score` for regressions, other nets and a deformable surface."""

import io
import json
import sys
from contextlib import redirect_stderr, redirect_stdout
from typing import NamedTuple

import numpy as np
import onnxruntime
import pytest

from rig.cli import main


class Done(NamedTuple):
    """What a command left."""

    returncode: int
    stdout: str
    stderr: str


FLAT = """
title = "An oblong plate with 20 gauges"
[plate]
size = [60.0, 40.0]
thickness = 1.0
young = "3 GPa"
poisson = 0.3
edges.kind = "clamped"
[gauges]
kind = "ring"
spacing = 10.0
[estimator]
{estimator}
[training]
spacing = 5.0
validation_side = 5
test_samples = 200
"""

BENT = """
title = "An oblong plate, bent"
[plate]
size = [60.0, 40.0]
thickness = 1.0
young = "3 GPa"
poisson = 0.3
[plate.edges]
kind = "mixed"
west.kind = "clamped"
east.kind = "clamped"
south.kind = "free"
north.kind = "free"
[gauges]
kind = "ring"
spacing = 10.0
[estimator]
kind = "net"
layers = [16]
outputs = "scaled"
batch = 32
epochs = 200
learning_rate = 0.01
{estimator}
[training]
margin = 8.0
[training.bases]
count = 12
bend = [0.5, 1.0]
twist = [-1.0, 1.0]
touches = 20
elements = 8
"""

MODELS = {
    "linear": FLAT.format(estimator='kind = "regression"\nfit = "linear"'),
    "quadratic": FLAT.format(estimator='kind = "regression"'),
    "ring": FLAT.format(
        estimator='kind = "net"\nfamily = "convolutional"\nepochs = 200\nlearning_rate = 0.01'
    ),
    "critic": FLAT.format(
        estimator='kind = "net"\nfamily = "adversarial"\nepochs = 200\nlearning_rate = 0.01'
    ),
    "once": BENT.format(estimator=""),
    "twice": BENT.format(estimator='base_layers = [16]\nbase_strain = "direction"'),
}


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Return a folder with scenes, and a function that runs the command there."""
    folder = tmp_path_factory.mktemp("bench")
    for name, text in MODELS.items():
        (folder / f"{name}.toml").write_text(text)

    def touchplate(*arguments, killed_in=None):
        """Run the command in this process; it is quicker than to start one each time."""
        out, err = io.StringIO(), io.StringIO()
        with (
            pytest.MonkeyPatch.context() as patch,
            redirect_stdout(out),
            redirect_stderr(err),
        ):
            patch.chdir(folder)
            patch.setenv("TOUCHPLATE_CACHE", str(folder / "cache"))
            patch.setattr(sys, "argv", ["touchplate", *arguments])
            if killed_in:
                patch.setattr(*killed_in)
            try:
                main()
                code = 0
            except SystemExit as end:
                code = int(end.code or 0)
        return Done(code, out.getvalue(), err.getvalue())

    return folder, touchplate


@pytest.fixture(scope="module", params=list(MODELS))
def trained(bench, request):
    done = bench[1]("train", f"{request.param}.toml", "--json")
    assert done.returncode == 0, done.stderr
    return request.param, json.loads(done.stdout)


@pytest.mark.slow
def test_it_trains_and_its_score_repeats_from_the_file_alone(bench, trained):
    name, figures = trained
    done = bench[1]("score", name, "--json")
    assert done.returncode == 0, done.stderr
    again = json.loads(done.stdout)
    assert again["test"] == figures["test"]
    assert figures["test"]["mean"] < 16.0  # mm; the middle of the plate is off by about as much
    if name in ("once", "twice"):
        loads = {key: row["mean"] for key, row in figures.items() if str(key).startswith("load")}
        assert len(loads) == 5
        assert loads["load 1 Δ0"] == figures["test"]["mean"]
        assert figures["test"]["bend"] < 0.3
        if name == "twice":  # its places see no load
            assert np.ptp(list(loads.values())) < 1e-9
    assert not list((bench[0] / "results" / name).glob("*part*"))


@pytest.mark.slow
def test_a_net_is_refused_beyond_what_it_learnt(bench):
    folder, touchplate = bench
    for name in ("once", "linear"):
        if not (folder / "results" / name).exists():
            assert touchplate("train", f"{name}.toml").returncode == 0
    for model, setting, sentence in (
        ("once", "training.bases.bend=[0.5,3]", "learnt training.bases.bend from 0.5 to 1 mm"),
        ("once", "training.bases.twist=[-5,5]", "learnt training.bases.twist from -1 to 1 deg"),
        ("once", "training.force=[1,2]", "learnt training.force from 1 to 1 N"),
        ("linear", "plate.thickness=2", "was trained for the [plate] of its scene"),
        ("linear", "training.marin=2", "unknown key 'marin' in [training]; did you mean"),
    ):
        done = touchplate("score", model, "--set", setting)
        assert done.returncode == 2, (model, setting)
        assert done.stderr.count("\n") == 1
        assert sentence in done.stderr
    fewer = touchplate("score", "once", "--set", "training.bases.bend=[0.6,0.8]", "--json")
    assert fewer.returncode == 0, fewer.stderr


@pytest.mark.slow
def test_a_training_in_two_steps_that_was_killed_goes_on_with_its_first_net(bench):
    folder, touchplate = bench
    whole = json.loads(touchplate("train", "twice.toml", "--json", "--out", "whole.h5").stdout)
    words = ("train", "twice.toml", "--out", "cut.h5")

    def killed(*arguments, **more):
        raise KeyboardInterrupt

    touchplate(*words, killed_in=("models.train_place", killed))
    left = {path.name for path in folder.glob("cut*")}
    assert left == {"cut.part.first.h5"}
    done = touchplate(*words, "--json")
    assert json.loads(done.stdout)["test"] == whole["test"]
    assert {path.name for path in folder.glob("cut*")} == {"cut.h5"}


@pytest.mark.slow
def test_a_net_of_two_steps_runs_elsewhere(bench):
    folder, touchplate = bench
    done = touchplate(
        "train", "twice.toml", "--out", "x.h5", "--onnx", "x.onnx", "--curves", "x.png"
    )
    assert done.returncode == 0, done.stderr
    session = onnxruntime.InferenceSession(folder / "x.onnx")
    assert [each.name for each in session.get_inputs()] == ["before", "strain"]
    assert (folder / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            ["linear.toml", "--set", "estimator.fit=cubic"],
            "estimator.fit is 'cubic'; give 'linear'",
        ),
        (["linear.toml", "--onnx", "a.onnx"], "a regression is no net and cannot be exported"),
        (["linear.toml", "--curves", "a.png"], "has no losses on its way; leave --curves out"),
        (["once.toml", "--set", "estimator.family=adversarial"], "only full nets learn that"),
        (["once.toml", "--set", "training.bases.bend=[3,1]"], "runs from 3 to 1 mm; write the"),
        (["once.toml", "--set", "plate.edges={kind='clamped'}"], "touchplate: "),
    ],
)
def test_bad_input_ends_in_one_sentence(bench, arguments, sentence):
    done = bench[1]("train", *arguments)
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    assert sentence in done.stderr
    assert done.stdout == ""
