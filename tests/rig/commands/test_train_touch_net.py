"""`touchplate train touch-net` and `touchplate score` of what it stored."""

import json
import sys

import pytest

import models
import rig
from rig import cli
from rig.commands import score_touch_net
from rig.scene import Scene

pytest.importorskip("torch")

TINY = ["steps=2", "head_steps=1", "batch=4", "head_batch=8", "benches=0", "seed=5"]


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["touchplate", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code, *capsys.readouterr()

    return run


def test_it_stores_the_net_its_scene_and_an_onnx_file(command, tmp_path):
    settings = [part for key in TINY for part in ("--set", f"touch_net.{key}")]
    path, onnx = tmp_path / "net.npz", tmp_path / "net.onnx"
    files = "--out", path, "--onnx", onnx, "--curves", tmp_path / "net.png"
    code, out, _ = command("train", "touch-net", *files, "--json", *settings)
    said = json.loads(out)
    assert code == 0
    assert (said["steps"], said["head_steps"], said["seed"]) == (2, 1, 5)
    about = models.load_touch_net(path).about
    assert about["recipe"]["seed"] == 5
    assert about["scene"]["plate"]["thickness"] == 2.0
    assert onnx.stat().st_size > 1e6
    assert sorted(place.name for place in tmp_path.iterdir()) == [
        "net.npz",
        "net.onnx",
        "net.png",
    ]
    assert (tmp_path / "net.png").stat().st_size > 1e4


def test_one_force_and_a_camera_that_is_no_pinhole_are_refused(command):
    code, _, err = command("train", "touch-net", "--set", 'camera.kind="telecentric"')
    assert code == 2
    assert "trained before a pinhole, got a camera of kind 'telecentric'" in err
    code, _, err = command("train", "touch-net", "--set", "touches.force=[1, 1]")
    assert code == 2
    assert "give two that differ" in err


def test_the_shipped_net_is_that_of_the_shipped_scene():
    scene = rig.load("touch-net")
    about = models.shipped_touch_net().about
    assert about["cpu_seconds"] > 0
    assert Scene.model_validate(about["scene"]) == scene
    section = scene.touch_net.model_dump()
    assert section.pop("margin") == models.shipped_touch_net().touches.margin
    assert about["recipe"] == section


def test_the_score_stands_beside_that_of_the_solver(command, monkeypatch):
    monkeypatch.setattr(score_touch_net, "SAMPLES", 20)
    code, out, _ = command("score", "touch-net", "--json")
    said = json.loads(out)
    assert code == 0
    assert [row["touches"] for row in said["numbers"]] == [0, 1, 2, 3, 4]
    one = said["numbers"][1]
    assert one["right"] == one["solver_right"] == 1.0
    assert one["over_bound"] < 1.6
    assert set(said["p_of_ranks"]) == {"x", "y", "F", "number"}


def test_a_map_of_a_touch_net_is_refused(command):
    code, _, err = command("score", "touch-net", "--map", "map.png")
    assert code == 2
    assert "leave --map and --set out" in err
