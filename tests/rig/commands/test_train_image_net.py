"""`touchplate train image-net`: a net on rendered pairs, stored, exported, gone on with."""

import json
import sys

import pytest

import models
import rig
from rig import cli

pytest.importorskip("torch")

TINY = ["steps=2", "pairs=1", "side=96", "plates=1", "patterns=1", "seed=5"]


@pytest.fixture
def train(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["touchplate", "train", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code, *capsys.readouterr()

    return run


def test_it_stores_the_net_its_seed_and_an_onnx_file(train, tmp_path):
    settings = [part for key in TINY for part in ("--set", f"image_net.{key}")]
    path, onnx = tmp_path / "net.npz", tmp_path / "net.onnx"
    code, out, _ = train("image-net", "--out", path, "--onnx", onnx, "--json", *settings)
    said = json.loads(out)
    assert code == 0
    assert (said["steps"], said["seed"]) == (2, 5)
    assert models.load_image_net(path).about["seed"] == 5
    assert onnx.stat().st_size > 1e5
    assert sorted(place.name for place in tmp_path.iterdir()) == ["net.npz", "net.onnx"]


def test_the_shipped_net_is_that_of_the_shipped_scene():
    section = rig.load("image-net").image_net
    about = dict(models.shipped_image_net().about)
    assert about.pop("cpu_seconds") > 0
    assert about == section.model_dump()
