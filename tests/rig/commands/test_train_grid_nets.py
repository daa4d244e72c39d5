"""`touchplate train dic-net` and `image-net`: on drawn data, stored, exported, gone on with."""

import json
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest

import models
import rig
from rig import cli
from rig.commands import score_displacement_net

pytest.importorskip("torch")

TINY = {
    "dic-net": {"steps": 2, "pairs": 1, "side": 32, "plates": 1, "seed": 5},
    "image-net": {"steps": 2, "pairs": 1, "side": 96, "plates": 1, "patterns": 1, "seed": 5},
}
SECTION = {"dic-net": "field_net", "image-net": "image_net"}
LOAD = {"dic-net": models.load_field_net, "image-net": models.load_image_net}
SAVE = {"dic-net": models.save_field_net, "image-net": models.save_image_net}
SHIPPED = {"dic-net": models.shipped_net, "image-net": models.shipped_image_net}


def is_drawn(plot):
    """Whether a PNG holds more than its paper."""
    return np.unique(cv2.imread(str(plot), cv2.IMREAD_GRAYSCALE)).size > 10


@pytest.mark.parametrize("scene", TINY)
def test_it_stores_the_net_its_seed_and_an_onnx_file(in_process, tmp_path, scene):
    given = [f"{SECTION[scene]}.{key}={value}" for key, value in TINY[scene].items()]
    settings = [part for one in given for part in ("--set", one)]
    path, onnx, cache = tmp_path / "net.npz", tmp_path / "net.onnx", tmp_path.parent / "cache"
    curves = tmp_path / "net.png"
    out = "--out", str(path), "--onnx", str(onnx), "--curves", str(curves), "--json"
    done = in_process(tmp_path, "train", scene, *out, *settings, cache=cache)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert (said["steps"], said["seed"]) == (2, 5)
    assert LOAD[scene](path).about["seed"] == 5
    assert onnx.stat().st_size > 1e5
    assert is_drawn(curves)
    stored = ["net.npz", "net.onnx", "net.png"]
    assert sorted(place.name for place in tmp_path.iterdir()) == stored


@pytest.mark.parametrize("scene", TINY)
def test_the_shipped_net_is_that_of_the_shipped_scene(scene):
    section = getattr(rig.load(scene), SECTION[scene])
    about = dict(SHIPPED[scene]().about)
    assert about.pop("cpu_seconds") > 0
    assert about == section.model_dump()


@pytest.mark.slow
@pytest.mark.parametrize("scene", TINY)
def test_a_net_is_scored_on_drawn_pairs_beside_the_adaptive_field(
    scene, monkeypatch, capsys, tmp_path
):
    """A net that has seen nothing leaves the adaptive field: their errors are one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(score_displacement_net, "PAIRS", 2)
    net = SHIPPED[scene]()
    nothing = np.zeros_like(net.low)
    SAVE[scene](tmp_path / "own.npz", replace(net, low=nothing, high=nothing))
    said = {}
    for model in ("own.npz", scene):
        monkeypatch.setattr(sys, "argv", ["touchplate", "score", model, "--json"])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert ended.value.code == 0
        said[model] = json.loads(capsys.readouterr().out)
    assert said["own.npz"]["by_net_fraction"] == 0
    assert said["own.npz"]["ratio"] == pytest.approx(1, abs=1e-6)
    assert said[scene]["pairs"] == 2
    assert 0 < said[scene]["error"] < 0.5
    assert said[scene]["adaptive_error"] == pytest.approx(said["own.npz"]["adaptive_error"])
    assert said[scene]["seconds"] > 0
