import json
import subprocess
import sys

import pytest
from typer.testing import CliRunner

import rig
from rig import cli
from rig.scene import shipped
from rig.scene.account import account, linear_error, relative_deflection


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
    for text in ("plate", "39204 unknowns", "pinhole", "torch", "no net in this scene"):
        assert text in done.output


def test_json_is_one_object():
    done = show("twin", "--json")
    said = json.loads(done.stdout)
    assert {"title", "parts", "left_out", "relative_deflection"} == said.keys()


def test_show_imports_no_part_that_it_speaks_of():
    code = (
        "import sys; sys.argv = ['touchplate', 'show', 'twin', '--json']\n"
        "from rig.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print({'torch', 'numba', 'dic', 'fe', 'synthetic', 'models'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("set()\n")


def test_the_deflection_is_that_of_linear_theory():
    import fe

    scene = rig.load("twin", {"plate.size": [254, 203.2]})
    assert scene.plate is not None
    assert scene.touches is not None
    plate = scene.plate.build()
    force = scene.touches.force[1]
    state = fe.deflect(plate, [fe.Touch(127.0, 101.6, force)])
    depth = abs(float(state.deflection([[127.0, 101.6]])[0]))
    estimate = relative_deflection(scene.plate, scene.touches)
    assert estimate == pytest.approx(depth / plate.thickness, rel=0.01)


def test_the_costs_are_those_of_the_parts():
    import fe
    from dic.tiles import MARGIN
    from rig.scene.account import ELEMENTS, TILE_MARGIN

    scene = rig.load("twin", {"plate.size": [254, 127]})
    assert scene.plate is not None
    assert max(fe.default_mesh(scene.plate.build()).counts) == ELEMENTS
    assert TILE_MARGIN == MARGIN


def test_a_thin_plate_is_said_to_bend_too_far_for_linear_theory():
    thick = account(rig.load("twin", {"plate.thickness": 6}))
    thin = account(rig.load("twin", {"plate.thickness": 1}))
    why = {part.name: part.why for part in thin.left_out}["nonlinear shell"]
    assert "more than 10 %" in why
    assert thick.relative_deflection is not None
    assert "1 %" in linear_error(thick.relative_deflection)
