"""Scenes of older releases: their keys are accepted, with one sentence for each."""

import json
import subprocess
import sys
import warnings

import pytest

import rig
from rig.scene import shipped
from rig.scene.renamed import RENAMED, RenamedKeyWarning
from rig.scene.scene import Scene

# What a recording of release 0.1.0 holds, shortened by the sections that are as they were.
STORED = """{
 "title": "a bench of old", "page": null, "source": null,
 "plate": {"size": [100.0, 80.0], "thickness": 1.0, "young": 3000.0, "poisson": 0.3,
  "edges": {"kind": "clamped"}, "patches": [], "theory": null},
 "touches": {"most": 3, "force": [0.5, 4.0], "radius": 0.0},
 "gauges": {"spacing": 5.0, "subset": null, "kind": "ring", "reading": "A", "margin": 7.5},
 "estimator": {"kind": "net", "layers": [32, 16], "activation": "relu", "epochs": 30,
  "learning_rate": 0.001, "inputs": "standard", "outputs": "raw", "told": "poles",
  "decay": "constant", "finish": 12, "batch": null, "magnitude_weight": 1.0, "seed": 0,
  "model": null, "steps": 2},
 "training": {"spacing": 5.0, "margin": 10.0, "validation": 6, "test": 70, "test_seed": 1,
  "samples": null, "force": [1.0, 2.0], "noise": 0.0, "frames": 4, "pictures": 9, "share": 0.25},
 "dataset": {"touches": 2, "places": "grid", "spacing": 5.0, "margin": 10.0, "side": 11,
  "force": 1.0, "magnitudes": 1, "samples": null, "order": "canonical", "seed": 0}
}"""
NEW = {
    "touches": {"max_touches": 3},
    "gauges": {"placement": "inside", "margin": 7.5},
    "estimator": {"target_encoding": "rational", "lbfgs_steps": 12, "solver_steps": 2},
    "training": {
        "validation_side": 6,
        "test_samples": 70,
        "averaged_frames": 4,
        "rendered_images": 9,
        "rendered_fraction": 0.25,
    },
    "dataset": {"midpoint_side": 11},
}
MAIN = "from rig.cli import main; main()"
NET = {"estimator": {"kind": "net"}, "comparison": {"kind": "net"}, "gauges": {"kind": "ring"}}


def test_a_stored_scene_of_an_older_release_opens_with_a_sentence_for_each_old_key():
    with pytest.warns(RenamedKeyWarning) as said:
        scene = Scene.model_validate_json(STORED)
    for section, values in NEW.items():
        found = getattr(scene, section).model_dump()
        assert {key: found[key] for key in values} == values
    assert len(said) == len([each for each in RENAMED if each.section != "comparison"])
    assert str(said[0].message) == (
        "touches.most is now called touches.max_touches; the old name is accepted until release 0.3"
    )


def test_what_is_stored_now_has_only_the_new_keys():
    with pytest.warns(RenamedKeyWarning):
        scene = Scene.model_validate_json(STORED)
    stored = scene.model_dump_json()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Scene.model_validate_json(stored) == scene
    sections = json.loads(stored)
    assert not any(each.old in (sections[each.section] or ()) for each in RENAMED)


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenes_have_the_new_keys(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rig.load(name)


@pytest.mark.parametrize("renamed", RENAMED, ids=lambda each: f"{each.section}.{each.old}")
def test_an_override_by_the_old_name_replaces_what_the_file_has_by_the_new(renamed):
    scene = "paper-one" if renamed.section in ("dataset", "training") else "twin"
    values = renamed.values or {"max_touches": 4, "rendered_fraction": 0.5}.get(renamed.new, 3)
    given, wanted = next(iter(values.items())) if renamed.values else (values, values)
    overrides = {renamed.section: NET[renamed.section]} if renamed.section in NET else {}
    if renamed.section in ("estimator", "comparison"):
        overrides = {"gauges": NET["gauges"], "training": {}} | overrides
    key = f"{renamed.section}.{renamed.old}"
    with pytest.warns(RenamedKeyWarning, match=f"{key} is now called .*{renamed.new}"):
        found = rig.load(scene, overrides | {key: given})
    assert getattr(getattr(found, renamed.section), renamed.new) == wanted


def test_an_override_by_the_new_name_replaces_what_the_file_has_by_the_old(tmp_path):
    path = tmp_path / "old.toml"
    path.write_text(
        'title = "old"\n[plate]\nsize = [90, 70]\nthickness = 1\nyoung = 3000\npoisson = 0.3\n'
        'edges.kind = "clamped"\n[touches]\nmost = 2\nforce = [1, 2]\n',
        encoding="utf-8",
    )
    with pytest.warns(RenamedKeyWarning, match=r"touches\.most"):
        assert rig.load(path, {"touches.max_touches": 3}).touches.max_touches == 3


@pytest.mark.filterwarnings("ignore::rig.scene.renamed.RenamedKeyWarning")
def test_both_names_of_a_key_are_refused(tmp_path):
    path = tmp_path / "both.toml"
    path.write_text('title = "both"\n[touches]\nmost = 2\nmax_touches = 2\n', encoding="utf-8")
    with pytest.raises(rig.SceneError) as refusal:
        rig.load(path)
    assert str(refusal.value) == (
        "both.toml: touches.most and touches.max_touches are two names of one key; leave"
        " touches.most, the old one, out"
    )
    for both in (
        {"touches.most": 3, "touches.max_touches": 3},
        {"touches": {"most": 3, **NEW["touches"]}},
    ):
        with pytest.raises(rig.SceneError, match=r"touches\.max_touches"):
            rig.load("twin", both)


def test_a_wrong_value_of_an_old_key_is_refused_by_its_new_name():
    with pytest.warns(RenamedKeyWarning), pytest.raises(rig.SceneError) as refusal:
        rig.load("twin", {"touches.most": 9})
    assert str(refusal.value) == "twin.toml: touches.max_touches is 9; give at most 4"


def test_the_command_says_it_in_one_line_on_stderr():
    done = subprocess.run(
        [sys.executable, "-c", MAIN, "show", "twin", "--json", "--set", "touches.most=3"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr.splitlines() == [
        "touchplate: touches.most is now called touches.max_touches; the old name is accepted"
        " until release 0.3"
    ]
    assert "up to 3 touches" in done.stdout
