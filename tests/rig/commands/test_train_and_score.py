"""`touchplate train` and `touchplate score` from scene to stored net and back."""

import json
import os
import subprocess
import sys
from functools import partial
from importlib import import_module

import pytest

SCENE = """
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
kind = "net"
layers = [8]
epochs = 300
learning_rate = 0.01
[training]
spacing = 5.0
validation_side = 5
test_samples = 200
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a scene."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "oblong.toml").write_text(SCENE)
    return folder


@pytest.fixture
def touchplate(folder, in_process):
    """Return a function that runs a command there."""
    return partial(in_process, folder)


def elsewhere(folder, code, *arguments):
    """Run code in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        env=os.environ | {"TOUCHPLATE_CACHE": str(folder / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def trained(folder):
    arguments = "train", "oblong.toml", "--json", "--onnx", "net.onnx", "--curves", "net.png"
    done = elsewhere(folder, "from rig.cli import main; main()", *arguments)
    assert done.returncode == 0, done.stderr
    return folder / "results" / "oblong" / "model.h5", json.loads(done.stdout), done.stderr


@pytest.mark.slow
def test_training_stores_the_net_and_prints_one_json_object(trained):
    path, figures, said = trained
    assert path.is_file()
    assert figures["model"] == "results/oblong/model.h5"
    counts = {name: figures[name]["count"] for name in ("training", "validation", "test")}
    assert counts == {"training": 9 * 5, "validation": 25, "test": 200}
    assert figures["training"]["mean"] < 3.0  # mm; the middle of the plate is off by 13 mm
    assert "stored in results/oblong/model.h5" in said
    assert (path.parents[2] / "net.onnx").is_file()
    assert (path.parents[2] / "net.png").read_bytes().startswith(b"\x89PNG")
    assert not list(path.parent.glob("*.npz"))  # no checkpoint is left


@pytest.mark.slow
@pytest.mark.parametrize("model", ["oblong", "oblong.toml", "results/oblong/model.h5"])
def test_score_repeats_the_figures_of_training_from_the_file_alone(trained, touchplate, model):
    done = touchplate("score", model, "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    for name in ("training", "validation", "test"):
        assert figures[name] == trained[1][name]


@pytest.mark.slow
def test_the_error_over_the_plate_is_written_and_drawn(folder, trained, touchplate):
    for name in ("map.csv", "map.png"):
        done = touchplate("score", "oblong", "--map", name, "--json")
        assert done.returncode == 0, done.stderr
    head, *rows = (folder / "map.csv").read_text().splitlines()
    assert head == "x_mm,y_mm,touches,mean_mm,largest_mm"
    assert len(rows) == 12 * 8
    assert sum(int(row.split(",")[2]) for row in rows) == 200
    assert (folder / "map.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_noise_of_the_gauges_brings_bound_bands_and_honesty(touchplate):
    noise = ["--set", "training.noise=0.02", "--set", "training.force=[1.0, 4.0]"]
    inputs = ["--set", "estimator.inputs=relative", "--set", "estimator.outputs=scaled"]
    done = touchplate("train", "oblong.toml", "--json", "--out", "noisy.h5", *noise, *inputs)
    assert done.returncode == 0, done.stderr
    scored = json.loads(touchplate("score", "noisy.h5", "--json").stdout)
    total, bands = scored["touches"], scored["bands"]
    assert (total["touches"], total["misses"], total["false"]) == (200, 0, 0)
    assert 0.0 < total["bound"] < total["rms"]
    assert [len(band["force"]) for band in bands] == [2, 2, 2]
    assert bands[0]["bound"] > 1.5 * bands[-1]["bound"]  # four times the force
    assert 0.5 < total["inside"][0] < total["inside"][1] < total["inside"][2]


@pytest.mark.slow
def test_score_prints_a_table_and_needs_no_torch(folder, trained):
    code = (
        "import sys; from rig.commands.score import score; score('oblong');"
        "sys.exit('torch' in sys.modules)"
    )
    done = elsewhere(folder, code)
    assert done.returncode == 0, done.stderr
    assert "below 0.5 mm" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["score", "never-trained"], "results/never-trained/model.h5 does not exist; train"),
        (["score", "oblong", "--map", "map.pdf"], "is no .csv and no .png; name one of these"),
        (["score", "oblong", "--map", "none/map.csv"], "cannot be written"),
        (["score", "foreign.h5"], "foreign.h5 is damaged or no HDF5 file; train"),
        (["train", "twin"], 'has no net to train; give its [estimator] kind = "net"'),
        (["train", "oblong.toml", "--out", "oblong.toml/m.h5"], "cannot be written"),
        (["train", "oblong.toml", "--out", "results"], "is a folder; give the name of a file"),
        (["train", "oblong.toml", "--set", "gauges.spacing=7"], "must divide the 50 mm"),
        (["tune", "oblong.toml", "--scheduler", "tcp://127.0.0.1:9"], "cannot be reached"),
        (["train", "oblong.toml", "--set", "training.spacing=7"], "must divide the 40 mm"),
    ],
)
def test_bad_input_ends_in_one_sentence_with_the_remedy(
    folder, trained, touchplate, monkeypatch, arguments, sentence
):
    (folder / "foreign.h5").write_text("not a model")
    monkeypatch.setattr(import_module("models.workers"), "PATIENCE", 0.5)
    done = touchplate(*arguments)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("touchplate: ")
    assert sentence in done.stderr
    assert done.stdout == ""


def test_training_that_fails_leaves_no_file(folder, touchplate):
    done = touchplate(
        *("train", "oblong.toml", "--out", "new/m.h5", "--set", "estimator.learning_rate=1e6"),
        *("--set", "estimator.layers=[8,8,8,8,8,8,8,8]"),
    )
    assert done.returncode == 2
    assert "use a smaller one" in done.stderr
    assert list((folder / "new").iterdir()) == []


@pytest.mark.slow
def test_the_first_model_of_the_paper_is_reproduced(touchplate):
    """Measured: training 0.08 mm, validation 0.37, test 0.32, 83 % of it below 0.5 mm.

    The paper prints below 0.3 for training and validation, 0.38 and "more than 80 %" for the test.
    """
    done = touchplate("train", "paper-one", "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert figures["training"]["mean"] < 0.3
    assert figures["validation"]["mean"] < 0.45
    assert figures["test"]["mean"] < 0.38
    assert figures["test"]["fraction"] > 0.75
    assert figures["test"]["max"] < 4.0


def test_a_search_prints_its_candidates_and_goes_on(folder, touchplate):
    short = ["oblong.toml", "--json", "--set", "estimator.epochs=20"]
    for trials in (2, 3):
        done = touchplate("tune", *short, "--trials", str(trials))
        assert done.returncode == 0, done.stderr
        candidates = json.loads(done.stdout)["candidates"]
        assert len(candidates) == trials
        assert candidates[0]["loss"] == min(each["loss"] for each in candidates)
    assert (folder / "results" / "oblong" / "search.db").is_file()


@pytest.mark.parametrize(
    "settings",
    [[], ["--set", "estimator.target_encoding=rational", "--set", "estimator.outputs=scaled"]],
)
def test_a_net_of_two_touches_estimates_places_and_magnitudes(folder, touchplate, settings):
    (folder / "pair.toml").write_text(PAIR)
    done = touchplate("train", "pair.toml", "--json", *settings)
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert {figures[name]["count"] for name in ("validation", "test")} == {2 * 50}
    assert figures["training"]["count"] == 2 * 300
    assert figures["test"]["mean"] < 12.0  # mm; the untrained net is at the middle of the plate
    assert figures["test"]["magnitude"] < 1.5  # of 1 to 4
    again = json.loads(touchplate("score", "pair", "--json").stdout)
    assert again["test"] == figures["test"]


PAIR = SCENE.replace("test_samples = 200", "test_samples = 50").replace(
    "epochs = 300", "epochs = 300\nbatch = 64"
)
PAIR = (
    PAIR.replace("seed = 0", "")
    + """
[dataset]
touches = 2
spacing = 5.0
force = "1 mN"
magnitudes = 4
samples = 300
"""
)
