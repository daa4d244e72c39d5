"""Images and files of a bent plate show the plate that was bent."""

import subprocess
import sys
from base64 import b64decode
from xml.etree import ElementTree as ET

import meshio
import numpy as np
import pytest
from matplotlib.image import imread

import fe
from fe.output.plot import draw
from fe.output.vtu import write_vtu
from fe.shell import solve

PATCH = fe.Patch((30.0, 60.0), (0.0, 40.0), 1.5, 3000.0)
PLATE = fe.Plate((90.0, 60.0), 1.0, 3000.0, 0.38, patches=(PATCH,))
TOUCHES = (fe.Touch(20.0, 25.0, 0.8), fe.Touch(64.0, 41.0, 0.3, 5.0))
TYPES = {"Float64": np.float64, "Int64": np.int64, "UInt8": np.uint8}


@pytest.fixture(scope="module")
def state():
    return fe.deflect(PLATE, TOUCHES, fe.grid(PLATE, 30))


@pytest.fixture
def vtu(state, tmp_path):
    write_vtu(tmp_path / "plate.vtu", state, TOUCHES)
    return read(tmp_path / "plate.vtu")


def read(path):
    """Read the arrays of a file of one piece, by name, as VTK's description of it says."""
    file = ET.parse(path).getroot()
    assert file.attrib["type"] == "UnstructuredGrid"
    assert file.attrib["header_type"] == "UInt64"
    assert file.attrib["byte_order"] == f"{sys.byteorder.capitalize()}Endian"
    (piece,) = file.iter("Piece")
    arrays = {}
    for array in piece.iter("DataArray"):
        content = b64decode(array.text)
        values = np.frombuffer(content[8:], TYPES[array.attrib["type"]])
        assert np.frombuffer(content[:8], np.uint64)[0] == values.nbytes
        width = int(array.attrib.get("NumberOfComponents", 1))
        arrays[array.attrib["Name"]] = values.reshape(-1, width) if width > 1 else values
    points, cells = (int(piece.attrib[f"NumberOf{kind}"]) for kind in ("Points", "Cells"))
    assert len(arrays["points"]) == points
    assert len(arrays["types"]) == len(arrays["offsets"]) == cells
    return arrays


def flat(vtu):
    """Places of the points on the flat plate."""
    return vtu["points"] - vtu["displacement"]


def test_every_point_of_the_file_has_displacement_and_strain_of_its_place(vtu, state):
    xy = np.clip(flat(vtu)[:, :2], 0, PLATE.size)
    np.testing.assert_allclose(vtu["displacement"], state.displacement(xy), atol=1e-13)
    strain = np.column_stack([vtu["exx"], vtu["eyy"], vtu["exy"]])
    np.testing.assert_allclose(strain, state.strain(xy), atol=1e-13)


def test_a_bowed_plate_is_written_from_its_shape_at_rest(tmp_path):
    bowed = fe.Plate((90.0, 60.0), 1.0, 3000.0, 0.38, shape=fe.Shape(0.4))
    touch = fe.Touch(45.0, 30.0, 0.5)
    write_vtu(tmp_path / "bowed.vtu", solve(bowed, [touch], mesh=fe.grid(bowed, 12)), [touch])
    at_rest = flat(read(tmp_path / "bowed.vtu"))
    assert at_rest[:, 2] == pytest.approx(0.5 + bowed.rise(at_rest[:, :2]), abs=1e-12)
    assert at_rest[-1, 2] == pytest.approx(0.9)


def test_meshio_reads_it_too(vtu, state, tmp_path):
    write_vtu(tmp_path / "again.vtu", state, TOUCHES)
    found = meshio.read(tmp_path / "again.vtu")
    np.testing.assert_array_equal(found.points, vtu["points"])
    assert {block.type: len(block.data) for block in found.cells} == {
        "quad": np.prod(state.mesh.counts),
        "vertex": len(TOUCHES),
    }
    for name in ("displacement", "exx", "eyy", "exy", "thickness", "force", "radius"):
        np.testing.assert_array_equal(found.point_data[name], vtu[name])


def test_the_surface_is_the_touched_face_in_its_bent_shape(vtu):
    thick = vtu["thickness"] > 1.2
    assert 0 < thick.sum() < thick.size
    np.testing.assert_allclose(flat(vtu)[:, 2], np.where(thick, 0.75, 0.5), atol=1e-14)
    assert vtu["points"][:, 2].min() < 0.47  # pressed in


def test_quadrilaterals_cover_the_plate_once_and_face_the_finger(vtu, state):
    quads = vtu["connectivity"][: vtu["offsets"][vtu["types"] == 9][-1]].reshape(-1, 4)
    x, y = flat(vtu)[quads, :2].transpose(2, 0, 1)
    area = 0.5 * (x * np.roll(y, -1, 1) - np.roll(x, -1, 1) * y).sum(1)
    assert (area > 0).all()  # counter-clockwise seen from +z
    assert len(quads) == np.prod(state.mesh.counts)
    np.testing.assert_allclose(area.sum(), PLATE.area)


def test_touches_are_vertices_on_the_bent_surface(vtu, state):
    vertices = vtu["connectivity"][vtu["offsets"][vtu["types"] == 1] - 1]
    np.testing.assert_array_equal(vtu["force"][vertices], [0.8, 0.3])
    np.testing.assert_array_equal(vtu["radius"][vertices], [0.0, 5.0])
    assert np.count_nonzero(vtu["force"]) == 2
    places = np.array([(t.x, t.y) for t in TOUCHES])
    truth = np.column_stack([places, [0.5, 0.5]]) + state.displacement(places)
    np.testing.assert_allclose(vtu["points"][vertices], truth, atol=1e-14)


def test_a_plate_without_touches_is_a_file_of_its_surface_alone(state, tmp_path):
    write_vtu(tmp_path / "plate.vtu", state)
    vtu = read(tmp_path / "plate.vtu")
    assert (vtu["types"] == 9).all()
    assert not vtu["force"].any()


def test_a_large_touch_is_seen_like_a_small_one(tmp_path):
    plate = fe.Plate((90.0, 60.0), 1.0, 3000.0, 0.38)
    touch = fe.Touch(40.0, 25.0, 20.0)
    state = solve(plate, [touch], mesh=fe.grid(plate, 12))
    write_vtu(tmp_path / "plate.vtu", state, [touch])
    draw(state, [touch], tmp_path / "plate.png")
    points, moved = (read(tmp_path / "plate.vtu")[name][-1] for name in ("points", "displacement"))
    assert moved[2] < -0.5
    np.testing.assert_allclose(moved, state.displacement([(40.0, 25.0)])[0], atol=1e-14)
    np.testing.assert_allclose(points - moved, [40.0, 25.0, 0.5], atol=1e-13)


@pytest.mark.parametrize("name", ["plate.png", "plate.PDF", "plate.svg"])
def test_an_image_is_written_whole(state, tmp_path, name):
    draw(state, TOUCHES, tmp_path / name)
    start = (tmp_path / name).read_bytes()[:5]
    assert start in (b"\x89PNG\r", b"%PDF-", b"<?xml")
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_an_image_shows_more_colour_where_the_plate_is_bent(state, tmp_path):
    draw(state, TOUCHES, tmp_path / "bent.png")
    still = fe.deflect(PLATE, (), state.mesh)
    draw(still, (), tmp_path / "still.png")
    red = []
    for name in ("bent.png", "still.png"):
        pixels = imread(tmp_path / name)
        red.append(np.mean(pixels[..., 0] - pixels[..., 2] > 0.3))
    assert red[0] > red[1] + 0.02  # the colour bars are red in both


def test_an_svg_names_the_forces_and_the_units(state, tmp_path):
    draw(state, TOUCHES, tmp_path / "plate.svg")
    written = (tmp_path / "plate.svg").read_text(encoding="utf-8")
    for words in ("Deflection w, mm", "Strain exx, µε", "0.8 N", "0.3 N", "x, mm"):
        assert words in written


WRITERS = {
    ".vtu": lambda path, state: write_vtu(path, state, TOUCHES),
    ".png": lambda path, state: draw(state, TOUCHES, path),
}


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_bad_path_is_refused_with_a_sentence(state, tmp_path, suffix):
    write = WRITERS[suffix]
    with pytest.raises(FileNotFoundError, match=r"folder .*nowhere does not exist; create it"):
        write(tmp_path / "nowhere" / f"plate{suffix}", state)
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(IsADirectoryError, match="is a folder; give the name of a file in it"):
        write(tmp_path / f"folder{suffix}", state)
    with pytest.raises(ValueError, match=rf"must end in \{suffix}.*got 'plate.xyz'"):
        write(tmp_path / "plate.xyz", state)
    assert [path.name for path in tmp_path.iterdir()] == [f"folder{suffix}"]


def test_a_touch_outside_is_refused_and_an_older_file_stays(state, tmp_path):
    path = tmp_path / "plate.vtu"
    write_vtu(path, state)
    before = path.read_bytes()
    with pytest.raises(ValueError, match="touch 0 must lie on the plate"):
        write_vtu(path, state, [fe.Touch(91.0, 10.0, 1.0)])
    assert path.read_bytes() == before


def test_mechanics_draw_nothing_until_asked():
    code = "import sys, fe, fe.output.plot, fe.output.vtu; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_field_that_is_not_of_the_sheet_is_refused(tmp_path):
    points = np.zeros((3, 4, 3))
    with pytest.raises(ValueError, match=r"field exx must be of \(3, 4\) nodes"):
        fe.write_sheet(tmp_path / "sheet.vtu", points, {"exx": np.zeros((4, 3))})
    assert list(tmp_path.iterdir()) == []
