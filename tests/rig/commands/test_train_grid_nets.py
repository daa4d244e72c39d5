"""`touchplate train dic-net` and `image-net`: on drawn data, stored, exported, gone on with."""

import json

import pytest

import models
import rig

pytest.importorskip("torch")

TINY = {
    "dic-net": {"steps": 2, "pairs": 1, "side": 32, "plates": 1, "seed": 5},
    "image-net": {"steps": 2, "pairs": 1, "side": 96, "plates": 1, "patterns": 1, "seed": 5},
}
SECTION = {"dic-net": "field_net", "image-net": "image_net"}
LOAD = {"dic-net": models.load_field_net, "image-net": models.load_image_net}
SHIPPED = {"dic-net": models.shipped_net, "image-net": models.shipped_image_net}


@pytest.mark.parametrize("scene", TINY)
def test_it_stores_the_net_its_seed_and_an_onnx_file(in_process, tmp_path, scene):
    given = [f"{SECTION[scene]}.{key}={value}" for key, value in TINY[scene].items()]
    settings = [part for one in given for part in ("--set", one)]
    path, onnx, cache = tmp_path / "net.npz", tmp_path / "net.onnx", tmp_path.parent / "cache"
    out = "--out", str(path), "--onnx", str(onnx), "--json"
    done = in_process(tmp_path, "train", scene, *out, *settings, cache=cache)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert (said["steps"], said["seed"]) == (2, 5)
    assert LOAD[scene](path).about["seed"] == 5
    assert onnx.stat().st_size > 1e5
    assert sorted(place.name for place in tmp_path.iterdir()) == ["net.npz", "net.onnx"]


@pytest.mark.parametrize("scene", TINY)
def test_the_shipped_net_is_that_of_the_shipped_scene(scene):
    section = getattr(rig.load(scene), SECTION[scene])
    about = dict(SHIPPED[scene]().about)
    assert about.pop("cpu_seconds") > 0
    assert about == section.model_dump()
