import json
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import rig
from rig import cli
from rig.scene import shipped
from rig.scene.account import account, made_of_plate

MIXED = {
    "kind": "mixed",
    "west": {"kind": "clamped"},
    "east": {"kind": "free"},
    "south": {"kind": "supported"},
    "north": {"kind": "elastic", "deflection": float("inf"), "rotation": 3.0},
}
PLAIN = """
title = "a plate"
[plate]
size = [120, 250]
thickness = 2
young = 3000
poisson = 0.38
edges.kind = "clamped"
"""


def show(*arguments):
    arguments = ["show", *arguments]
    return CliRunner().invoke(cli.application(arguments), arguments)


@pytest.mark.parametrize("name", shipped())
def test_every_section_is_either_in_or_left_out(name):
    scene = rig.load(name)
    said = account(scene)
    sections = set(type(scene).model_fields) - {"title"}
    parts, absent = {p.name for p in said.parts}, {p.name for p in said.left_out}
    assert sections <= parts | absent
    assert not parts & absent
    assert all(part.what for part in said.parts)
    assert all(part.why for part in said.left_out)


def test_the_tables_name_parts_and_reasons():
    done = show("twin")
    assert done.exit_code == 0
    for text in ("plate", "56644 unknowns", "pinhole", "torch", "no net in this scene"):
        assert text in done.output


@pytest.mark.parametrize(
    ("overrides", "count"),
    [({}, 72), ({"gauges.placement": "inside"}, 72), ({"gauges.margin": 10}, 64)],
)
def test_the_gauges_of_a_ring_are_counted_as_they_are_laid(overrides, count):
    scene = rig.load("paper-one", overrides)
    assert len(scene.gauges.build(scene.plate)) == count
    (ring,) = [part for part in account(scene).parts if part.name == "gauges"]
    assert ring.what.startswith(f"ring of {count} gauges, ")


def test_names_of_sections_are_printed_as_they_are(tmp_path):
    path = tmp_path / "plain.toml"
    path.write_text(PLAIN.replace("a plate", "a plate on [bold] feet"), encoding="utf-8")
    assert "a plate on [bold] feet" in show(str(path)).output


def test_json_is_one_object():
    said = json.loads(show("twin", "--json").stdout)
    assert {"title", "parts", "left_out", "theory", "regime"} == said.keys()
    assert said["regime"]["force"] == 4.0


@pytest.mark.parametrize(("scene", "parts"), [("twin", {"fe"}), ("paper-plain", set())])
def test_show_imports_no_part_but_the_plate_where_forces_are_expected(scene, parts, tmp_path):
    plain = tmp_path / "paper-plain.toml"
    plain.write_text(PLAIN, encoding="utf-8")
    scene = str(plain) if scene == "paper-plain" else scene
    code = (
        f"import sys; sys.argv = ['touchplate', 'show', {scene!r}, '--json']\n"
        "from rig.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print({'torch', 'dic', 'fe', 'synthetic', 'models'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith(f"{parts}\n")


def test_the_costs_are_those_of_the_parts():
    import fe
    from dic.tiles.tiles import MARGIN
    from fe.linear.energy import free
    from rig.scene.counts import TILE_MARGIN, TWIN_ELEMENTS
    from rig.sources.twin import ELEMENTS

    scene = rig.load("twin", {"plate.size": [254, 127], "plate.edges": MIXED})
    assert scene.plate is not None
    mesh = fe.default_mesh(scene.plate.build())
    unknowns = [int(np.sum(free)) for free in free(scene.plate.build(), mesh)]
    said = {part.name: part for part in account(scene).parts}["plate"]
    assert "west clamped, east free, south supported, north elastic" in said.what
    assert f"{mesh.counts[0]} × {mesh.counts[1]} elements" in said.cost
    assert f" {unknowns[0] * unknowns[1]} unknowns" in said.cost
    assert (TILE_MARGIN, TWIN_ELEMENTS) == (MARGIN, ELEMENTS)


def test_patches_are_listed_with_the_elements_that_they_need():
    import fe

    patch = {"x": [10, 12], "y": ["5 cm", "80 mm"], "thickness": "5 mm"}
    scene = rig.load("twin", {"plate.patches": [patch]})
    assert scene.plate is not None
    columns, rows = fe.default_mesh(scene.plate.build()).counts
    said = {part.name: part for part in account(scene).parts}["plate"]
    assert "1 patch" in said.what
    assert f"{columns} × {rows} elements" in said.cost


def left_out(name, overrides):
    return {part.name: part.why for part in account(rig.load(name, overrides)).left_out}


def test_the_theory_is_the_one_that_the_forces_need():
    free = {"plate": rig.load("twin").model_dump()["plate"] | {"theory": None, "thickness": 6}}
    thick = account(rig.load("twin", free))
    assert thick.theory == "linear"
    assert thick.regime is not None
    assert thick.regime.error < 0.01
    why = left_out("twin", free)["large deflection"]
    assert why.startswith("linear theory: w/h is up to 0.0038 under 4 N at (127, 127) mm, where")
    thin = account(rig.load("twin", free | {"plate.thickness": 1}))
    assert thin.theory == "large"
    why = left_out("twin", free | {"plate.thickness": 1})["linear theory"]
    assert why.startswith("theory of large deflection: w/h is up to")


def test_large_touches_are_followed_on_a_reduced_plate():
    def parts(name, overrides=None):
        return {part.name for part in account(rig.load(name, overrides)).parts}

    exact = {"estimator.bench": "exact"}
    assert "reduced plate" in parts("bench", exact)
    linear = parts("bench", exact | {"plate.theory": "linear"})
    assert "reduced plate" not in linear | parts("bench") | parts("twin")


def test_a_scene_that_insists_hears_the_cost():
    why = left_out("twin", {"plate.thickness": 1})["large deflection"]
    assert why.startswith(
        "needed, and left out all the same: linear theory, as the scene insists: w/h is up to"
    )
    assert "linear theory is off by more than 100 %" in why
    assert "as the scene insists" in left_out("twin", {"plate.theory": "large"})["linear theory"]


def test_without_forces_small_ones_are_taken(tmp_path):
    plain = tmp_path / "plain.toml"
    plain.write_text(PLAIN, encoding="utf-8")
    why = left_out(plain, {})["large deflection"]
    assert why == "linear theory: the scene names no forces, so small ones are taken"


@pytest.mark.parametrize(
    ("name", "overrides", "sentence"),
    [
        ("bent-base", {"base.bend": "70 mm"}, r"bend of the base must stay below 54\.31 mm"),
        (
            "bent-base",
            {"plate.edges.north.kind": "clamped"},
            "north edge must be free or on springs",
        ),
        (
            "twin",
            {"plate.thickness": "300 mm"},
            r"plate thickness must stay below 0\.05 of the span",
        ),
    ],
)
def test_a_plate_that_cannot_be_is_refused_where_it_is_shown(name, overrides, sentence):
    with pytest.raises(ValueError, match=sentence):
        account(rig.load(name, overrides))


def test_what_is_made_of_a_plate_has_its_name():
    plate = {"plate": rig.load("twin").model_dump()["plate"] | {"theory": "linear"}}
    assert made_of_plate(rig.load("twin", plate)) == "plate modes"
    assert made_of_plate(rig.load("twin", plate | {"plate.theory": "large"})) == "reduced plate"
    assert made_of_plate(rig.load("bench-real")) == "plate in modes"
