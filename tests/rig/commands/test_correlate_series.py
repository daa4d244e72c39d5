"""`touchplate correlate` on a whole test: every frame, after a kill too, into one file."""

import csv
import json
import subprocess
import sys
from xml.etree import ElementTree as ET

import cv2
import h5py
import numpy as np
import pytest
from PIL import Image

from models.field_net import field_net
from rig import cli
from rig.calibration.board import CharucoBoard
from rig.series.frames import coloured_file, open_frames
from rig.series.parts import path_of
from rig.series.photograph import read_photograph

SHAPE = (110, 140)
STRETCH = 0.004  # a frame


def speckle(stretch=0.0, seed=5):
    """Gaussian spots that move before they are drawn, (H, W) uint8."""
    rng = np.random.default_rng(seed)
    height, width = SHAPE
    middle = np.array([width - 1, height - 1]) / 2
    centres = rng.uniform(-10, [width + 10, height + 10], (1000, 2))
    centres = middle + (centres - middle) * (1 + stretch, 1.0)
    x = np.exp(-(((np.arange(width)[:, None] - centres[:, 0]) / 2.2) ** 2))
    y = np.exp(-(((np.arange(height)[:, None] - centres[:, 1]) / 2.2) ** 2))
    return np.rint(230 - 190 * (1 - np.exp(-0.9 * (y @ x.T)))).astype(np.uint8)


@pytest.fixture(scope="module")
def images():
    return [speckle(STRETCH * k) for k in range(4)]


@pytest.fixture
def series(tmp_path, images):
    """Folder with a reference and three frames, numbered without leading zeros."""
    (tmp_path / "frames").mkdir()
    Image.fromarray(images[0]).save(tmp_path / "ref.png")
    for name, image in zip((2, 9, 10), images[1:], strict=True):
        Image.fromarray(image).save(tmp_path / "frames" / f"f{name}.png")
    return tmp_path


@pytest.fixture
def correlate(series, monkeypatch, capsys):
    monkeypatch.chdir(series)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["touchplate", "correlate", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code, *capsys.readouterr()

    return run


def test_all_frames_of_a_pattern_go_into_one_file_in_their_order(series, correlate):
    code, said, text = correlate("ref.png", "frames/*.png", "--json", "--out", "o")
    assert code == 0, text
    assert json.loads(said)["frames"] == 3
    with h5py.File(series / "o" / "fields.h5") as file:
        assert [name.decode() for name in file["frame"][:]] == ["f2.png", "f9.png", "f10.png"]
        assert file["u"].shape == (3, len(file["y"]), len(file["x"]))
        strain = [np.nanmedian(file["exx"][n]) for n in range(3)]
        assert file.attrs["subset"] == 21
        assert file["status"].attrs["BROKEN"] == 10
    np.testing.assert_allclose(strain, STRETCH * np.arange(1, 4), atol=1.5e-4)
    assert sorted(p.name for p in (series / "o").iterdir()) == ["fields.h5", "fields.xdmf"]


def test_a_net_is_said_to_have_measured_which_points_of_which_frame(
    series, correlate, tmp_path, monkeypatch
):
    pytest.importorskip("torch")
    code, said, text = correlate("ref.png", "frames", "--field", "net", "--json", "--out", "o")
    assert code == 0, text
    with h5py.File(series / "o" / "fields.h5") as file:
        own, measured = np.asarray(file["by_net"]), np.isfinite(np.asarray(file["u"]))
    assert json.loads(said)["by_net_fraction"] == pytest.approx(own.sum() / measured.sum())
    assert own.any()
    half = tmp_path / "half.npz"
    half.write_bytes(field_net.SHIPPED.read_bytes()[:5000])
    monkeypatch.setattr(field_net, "SHIPPED", half)
    field_net.shipped_net.cache_clear()
    code, said, text = correlate("ref.png", "frames", "--field", "net", "--json", "--out", "p")
    field_net.shipped_net.cache_clear()
    assert code == 0, text
    assert "install touchplate again" in " ".join(text.split())
    assert json.loads(said)["by_net_fraction"] == 0


def test_the_xdmf_names_data_that_the_file_holds(series, correlate):
    correlate("ref.png", "frames", "--out", "o")
    root = ET.parse(series / "o" / "fields.xdmf").getroot()
    grids = root.findall(".//Grid[@GridType='Uniform']")
    assert len(grids) == 3
    with h5py.File(series / "o" / "fields.h5") as file:
        for item in root.findall(".//DataItem[@Format='HDF']"):
            name, path = item.text.split(":")
            assert name == "fields.h5"
            assert [int(n) for n in item.get("Dimensions").split()] == list(file[path].shape)


def test_the_xdmf_lays_the_points_into_the_plane_of_the_image(series, correlate):
    """By the rules of XDMF: dimensions, origin and spacing are those of z, y and x."""
    correlate("ref.png", "frames", "--out", "o")
    with h5py.File(series / "o" / "fields.h5") as file:
        xs, ys, step = file["x"][:], file["y"][:], file.attrs["step"]
    layer = [1, len(ys), len(xs)]

    def numbers(text):
        return [int(part) for part in text.split()]

    root = ET.parse(series / "o" / "fields.xdmf").getroot()
    for k, grid in enumerate(root.findall(".//Grid[@GridType='Uniform']")):
        assert grid.find("Topology").get("TopologyType") == "3DCoRectMesh"
        assert numbers(grid.find("Topology").get("Dimensions")) == layer
        assert grid.find("Geometry").get("GeometryType") == "ORIGIN_DXDYDZ"
        origin, spacing = (numbers(item.text) for item in grid.findall("Geometry/DataItem"))
        assert origin == [0, ys[0], xs[0]]
        assert spacing == [step] * 3
        for part in grid.findall("Attribute/DataItem"):
            assert numbers(part.get("Dimensions")) == layer
            start, stride, count = np.reshape(numbers(part[0].text), (3, 3)).tolist()
            assert (start, stride, count) == ([k, 0, 0], [1, 1, 1], layer)


def test_a_test_that_was_killed_ends_in_the_same_bytes(series, correlate, monkeypatch):
    assert correlate("ref.png", "frames/*.png", "--out", "whole")[0] == 0
    import rig.series.correlate as engine

    kept, done = engine.write_part, []

    def killed_after_one(folder, number, *rest):
        if done:
            raise KeyboardInterrupt
        done.append(number)
        kept(folder, number, *rest)

    monkeypatch.setattr(engine, "write_part", killed_after_one)
    correlate_killed = ("ref.png", "frames/*.png", "--out", "twice", "--workers", "1")
    try:
        code = correlate(*correlate_killed)[0]
    except KeyboardInterrupt:
        code = None
    assert code != 0
    assert not (series / "twice" / "fields.h5").exists()
    path_of(series / "twice" / "parts", 1).write_bytes(b"half a pa")
    monkeypatch.setattr(engine, "write_part", kept)
    assert correlate("ref.png", "frames/*.png", "--out", "twice")[0] == 0
    for name in ("fields.h5", "fields.xdmf"):
        assert (series / "twice" / name).read_bytes() == (series / "whole" / name).read_bytes()


@pytest.fixture
def stopped(series, correlate, monkeypatch):
    """Folder of a test of which one frame is done."""
    import rig.series.correlate as engine

    kept = engine.write_part

    def stop_after_one(folder, number, *rest):
        kept(folder, number, *rest)
        raise OSError("the disk is full")

    with monkeypatch.context() as full:
        full.setattr(engine, "write_part", stop_after_one)
        assert correlate("ref.png", "frames", "--out", "o", "--workers", "1")[0] == 2
    assert path_of(series / "o" / "parts", 0).is_file()
    return series / "o"


def test_frames_of_another_test_with_the_same_names_are_not_gone_on_with(
    series, stopped, correlate, images
):
    (series / "other").mkdir()
    for path, image in zip(sorted((series / "frames").iterdir()), images, strict=False):
        changed = image.copy()
        changed[50:60, 60:80] += 1
        Image.fromarray(changed).save(series / "other" / path.name)
    code, _, text = correlate("ref.png", "other", "--out", "o")
    assert code == 2
    assert "frames of other names or content; name another with --out" in " ".join(text.split())
    assert not (stopped / "fields.h5").exists()


def test_a_test_goes_on_where_its_frames_have_been_moved_to(series, stopped, correlate):
    first = path_of(stopped / "parts", 0).stat().st_mtime_ns
    (series / "frames").rename(series / "moved")
    for path in (series / "moved").iterdir():
        path.touch()
    import rig.series.run as engine

    seen = []
    with pytest.MonkeyPatch.context() as watched:
        write = engine.write_result
        watched.setattr(
            engine,
            "write_result",
            lambda path, parts, *rest: (
                seen.append(path_of(parts, 0).stat().st_mtime_ns),
                write(path, parts, *rest),
            ),
        )
        assert correlate("ref.png", "moved", "--out", "o")[0] == 0
    assert seen == [first]  # that frame was not correlated again


def test_parts_of_another_test_are_not_gone_on_with(series, correlate):
    (series / "o" / "parts").mkdir(parents=True)
    (series / "o" / "parts" / "settings.json").write_text("{}")
    code, _, text = correlate("ref.png", "frames/*.png", "--out", "o")
    assert code == 2
    assert "another" in text
    assert correlate("ref.png", "frames/*.png", "--out", "o", "--force")[0] == 0


def test_a_bad_frame_is_left_out_in_a_sentence_and_the_others_go_on(series, correlate, images):
    Image.fromarray(images[1][:50, :60]).save(series / "frames" / "f9.png")
    (series / "frames" / "f11.png").write_bytes(b"no image")
    Image.fromarray(np.zeros(SHAPE, np.uint8)).save(series / "frames" / "f12.png")
    Image.fromarray(images[3].astype(np.uint16) * 257).save(series / "frames" / "f13.png")
    code, said, text = correlate("ref.png", "frames/*.png", "--json", "--out", "o")
    assert code == 0
    assert json.loads(said)["left_out"] == 3
    assert "60x50 px" in text
    assert "f11.png is not an image" in text
    assert "f12.png: no point was measured, the frame is DARK" in text
    with h5py.File(series / "o" / "fields.h5") as file:
        status = file["status"][:]
        valid = (status == 0).mean(axis=(1, 2))
        assert (status[[1, 3]] == file["status"].attrs["NO_FRAME"]).all()
        assert file["error"][0] == b""
        assert b"60x50" in file["error"][1]
    assert (valid[[0, 2, 5]] > 0.7).all()  # 16 bit a pixel are only another gain
    assert valid[4] == 0  # black


def test_a_white_frame_is_called_saturated(series, correlate, images):
    white = np.where(images[1] > 40, 255, images[1]).astype(np.uint8)
    Image.fromarray(white).save(series / "frames" / "f11.png")
    _, _, text = correlate("ref.png", "frames/*.png", "--out", "o")
    assert "f11.png: no point was measured, the frame is SATURATED" in " ".join(text.split())


def test_the_summary_says_how_much_is_valid_and_what_became_of_the_rest(series, correlate, images):
    hidden = images[2].copy()
    hidden[:, 60:] = np.random.default_rng(1).integers(0, 255, (SHAPE[0], SHAPE[1] - 60))
    Image.fromarray(hidden).save(series / "frames" / "f9.png")
    (series / "frames" / "f11.png").write_bytes(b"no image")
    code, said, text = correlate("ref.png", "frames/*.png", "--json", "--out", "o")
    assert code == 0, text
    figures = json.loads(said)
    with h5py.File(series / "o" / "fields.h5") as file:
        status = file["status"][:]
    assert (status[3] < 0).all()
    valid = (status[:3] == 0).mean(axis=(1, 2))
    assert figures["valid"]["median"] == pytest.approx(np.median(valid))
    assert figures["valid"]["worst"] == pytest.approx(valid[1])
    assert figures["valid"]["worst_frame"] == "f9.png"
    assert valid[1] < 0.6
    lost = (status[:3] == 6).mean()
    assert figures["status"]["low_correlation"] == pytest.approx(lost)
    said = " ".join(correlate("ref.png", "frames/*.png", "--out", "p")[1].split())
    assert (
        f"{np.median(valid):.1%} in the median frame, {valid[1]:.1%} in the worst, f9.png" in said
    )
    assert "low_correlation: the pattern was not found again" in said


def test_what_of_the_roi_is_valid_is_counted_of_its_points_alone(series, correlate):
    (series / "r.toml").write_text("[[roi]]\npoints = [[30, 20], [110, 20], [110, 90], [30, 90]]")
    words = "ref.png", "frames/*.png", "--regions", "r.toml", "--json", "--out", "o"
    figures = json.loads(correlate(*words)[1])
    assert figures["valid"]["worst"] > 0.95
    assert figures["status"]["excluded"] > 0.3


def test_readings_of_an_earlier_test_go_when_it_is_replaced(series, correlate):
    (series / "r.toml").write_text(
        '[[extensometer]]\nname = "e"\nstart = [30, 50]\nend = [110, 50]\n'
    )
    assert correlate("ref.png", "frames", "--regions", "r.toml", "--out", "o")[0] == 0
    assert (series / "o" / "readings.csv").is_file()
    assert correlate("ref.png", "frames", "--out", "o", "--force")[0] == 0
    assert sorted(p.name for p in (series / "o").iterdir()) == ["fields.h5", "fields.xdmf"]


def test_an_earlier_test_stays_where_another_breaks_off(series, correlate, monkeypatch):
    (series / "r.toml").write_text(REGIONS)
    assert correlate("ref.png", "frames", "--regions", "r.toml", "--out", "o")[0] == 0

    def full(*given):
        raise OSError("the disk is full")

    monkeypatch.setattr("rig.series.run.write_result", full)
    assert correlate("ref.png", "frames", "--out", "o", "--force")[0] == 2
    assert (series / "o" / "readings.csv").is_file()


def test_frames_in_colour_are_taken_by_their_luminance(series, correlate, images):
    frames = open_frames(str(series / "frames"))
    for number, path in enumerate(frames.paths):
        grey = images[number + 1].astype(float)
        blue = (grey - 0.587 * grey - 0.299 * 0.9 * grey) / 0.114
        tinted = np.dstack([0.9 * grey, grey, blue]).clip(0, 255)
        Image.fromarray(np.rint(tinted).astype(np.uint8)).save(path)
    assert np.abs(frames.read(0).astype(float) - images[1]).mean() < 4  # blue that clips
    code, _, text = correlate("ref.png", "frames", "--out", "o")
    assert code == 0, text
    assert "f2.png is stored in colour" in " ".join(text.split())
    with h5py.File(series / "o" / "fields.h5") as file:
        assert np.nanmedian(file["exx"][2]) == pytest.approx(3 * STRETCH, abs=5e-4)


def test_of_pages_and_of_frames_among_grey_ones_colour_is_said(series, images, correlate):
    pages = [Image.fromarray(np.dstack([image, image // 2, image])) for image in images]
    pages[0].save(series / "pages.tif", save_all=True, append_images=pages[1:])
    assert coloured_file(open_frames(str(series / "pages.tif"))) == "pages.tif"
    assert coloured_file(open_frames(str(series / "*.*"))) == "pages.tif"  # joined
    assert coloured_file(open_frames(str(series / "frames"))) is None
    pages[0].save(series / "frames" / "f11.png")
    _, _, text = correlate("ref.png", "frames", "--out", "o")
    assert "f11.png is stored in colour" in " ".join(text.split())


@pytest.mark.parametrize("compression", ["raw", "tiff_deflate"])
@pytest.mark.parametrize("more", [0, 300])
def test_whole_pages_of_a_tiff_that_is_cut_short_go_on_and_the_cut_is_said(
    series, images, correlate, compression, more
):
    pages = [Image.fromarray(image) for image in [*images[1:], *images[1:]]]
    saved = {"save_all": True, "append_images": pages[1:4], "compression": compression}
    pages[0].save(series / "pages.tif", **saved)
    four = (series / "pages.tif").stat().st_size
    pages[0].save(series / "pages.tif", **saved | {"append_images": pages[1:]})
    cut = (series / "pages.tif").read_bytes()[: four + more]
    (series / "pages.tif").write_bytes(cut)
    code, said, text = correlate("ref.png", "pages.tif", "--json", "--out", "o")
    assert code == 0, text
    assert (json.loads(said)["frames"], json.loads(said)["left_out"]) == (5, 1)
    assert " ".join(text.split()).count("pages.tif is cut short after page 4") == 1
    with h5py.File(series / "o" / "fields.h5") as file:
        strain = [np.nanmedian(file["exx"][n]) for n in range(4)]
        assert b"cut short" in file["error"][4]
    np.testing.assert_allclose(strain, STRETCH * np.array([1, 2, 3, 1]), atol=1.5e-4)


def test_a_photograph_in_colour_that_is_cut_short_is_a_sentence(series, images):
    path = series / "cut.jpg"
    Image.fromarray(np.dstack([images[0], images[0] // 2, images[0]])).save(path)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(OSError, match=r"image 1 of .*cut.jpg cannot be read \("):
        read_photograph(path)


def test_a_guess_starts_every_frame_and_stands_in_the_file(series, correlate):
    words = "ref.png", "frames", "--guess", "0.4,-0.2", "--out"
    assert correlate(*words, "o")[0] == 0
    with h5py.File(series / "o" / "fields.h5") as file:
        assert file.attrs["guess"].tolist() == [0.4, -0.2]
        assert np.nanmedian(file["exx"][2]) == pytest.approx(3 * STRETCH, abs=1.5e-4)
    code, _, text = correlate(*words, "p", "--follow")
    assert code == 2
    assert "not from --guess" in text


def test_plots_of_a_test_are_refused_with_the_way_out(series, correlate):
    code, _, text = correlate("ref.png", "frames", "--plots", "--out", "o")
    assert code == 2
    assert "touchplate export --to png" in text


@pytest.mark.parametrize("what", ["nowhere/*.tif", "nowhere/"])
def test_frames_that_are_not_there_are_refused(correlate, what, series):
    code, _, text = correlate("ref.png", what)
    assert code == 2
    assert text.count("\n") == 1
    assert not (series / "results").exists()


def test_pages_of_a_tiff_and_frames_of_a_video_are_frames(series, images):
    pages = [Image.fromarray(image) for image in images[1:]]
    pages[0].save(series / "pages.tif", save_all=True, append_images=pages[1:])
    tiff = open_frames(str(series / "pages.tif"))
    assert tiff.names == ("pages.tif 1", "pages.tif 2", "pages.tif 3")
    np.testing.assert_array_equal(tiff.read(2), images[3])
    Image.fromarray(images[0]).save(series / "a.tif")
    both = open_frames(str(series / "*.tif"))
    assert both.names == ("a.tif", *tiff.names)
    for number, image in enumerate(images):
        np.testing.assert_array_equal(both.read(number), image)
    size = SHAPE[1], SHAPE[0]
    writer = cv2.VideoWriter(str(series / "v.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10, size)
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    video = open_frames(str(series / "v.avi"))
    assert len(video.names) == 4
    assert np.abs(video.read(1).astype(float) - images[1]).mean() < 6
    (series / "w.avi").write_bytes(b"no video")
    with pytest.raises(OSError, match="not a video"):
        open_frames(str(series / "w.avi"))


OPENED = """
import sys
from rig.camera.files import open_video
from rig.series.frames import open_frames

for open_it in (open_frames, open_video):
    try:
        open_it(sys.argv[1])
    except OSError as error:
        print(error)
"""


def test_a_video_that_is_cut_short_is_our_sentence_and_none_of_ffmpeg(series, images):
    path, size = series / "cut.mp4", (SHAPE[1], SHAPE[0])
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 10, size)
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    path.write_bytes(path.read_bytes()[:-1000])  # its table of contents stands last
    # FFmpeg takes its level once a process: in one of its own.
    done = subprocess.run([sys.executable, "-c", OPENED, path], capture_output=True, text=True)
    first, second = done.stdout.splitlines()
    assert "is not a video that can be read" in first
    assert "is no video that can be read" in second
    assert done.stderr == ""


REGIONS = """
[[roi]]
points = [[5, 5], [134, 5], [134, 104], [5, 104]]
[[roi]]
points = [[60, 40], [80, 40], [80, 60], [60, 60]]
hole = true
[[extensometer]]
name = "e"
start = [25.0, 85.0]
end = [112.5, 85.0]
[[gauge]]
name = "g"
points = [[90, 20], [120, 20], [120, 90], [90, 90]]
"""


def test_extensometer_and_gauge_read_the_strain_with_its_sigma(series, correlate):
    (series / "r.toml").write_text(REGIONS)
    code, _, text = correlate("ref.png", "frames", "--regions", "r.toml", "--out", "o")
    assert code == 0, text
    with (series / "o" / "readings.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["frame"] for row in rows] == ["f2.png", "f9.png", "f10.png"]
    for k, row in enumerate(rows, 1):
        for name in ("e", "g_exx"):
            off, sigma = float(row[name]) - STRETCH * k, float(row[f"sigma_{name}"])
            assert 0 < sigma < 5e-4
            assert abs(off) < 5 * sigma
    with h5py.File(series / "o" / "fields.h5") as file:
        x, y = np.meshgrid(file["x"], file["y"])
        hole = (np.abs(x - 70) < 8) & (np.abs(y - 50) < 8)
        assert not (file["status"][0][hole] == 0).any()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[roi]]\npoints = [[900, 900], [950, 900], [950, 950]]", "has no pixel"),
        ("[[roi]]\npoints = [[1, 1]]", "roi.0.points"),
        ("[[gage]]\nname = 1", "gage"),
        ("[[roi]\n", "not TOML"),
    ],
)
def test_regions_that_cannot_be_are_refused_in_a_sentence(series, correlate, text, words):
    (series / "r.toml").write_text(text)
    code, _, said = correlate("ref.png", "frames", "--regions", "r.toml")
    assert code == 2
    assert words in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("kind", "along"),
    [
        ("small", lambda s: s),
        ("green-lagrange", lambda s: s + s**2 / 2),
        ("logarithmic", np.log1p),
    ],
)
def test_invariants_of_a_stretch_are_those_of_its_closed_form(series, correlate, kind, along):
    code, _, text = correlate(
        "ref.png", "frames/*.png", "--kind", kind, "--invariants", "--out", "o"
    )
    assert code == 0, text
    with h5py.File(series / "o" / "fields.h5") as file:
        found = {name: np.nanmedian(file[name][2]) for name in file if "frame" not in name and
                 file[name].ndim == 3}  # fmt: skip
        assert file["principal_angle"].attrs["unit"] == "rad"
    true = along(3 * STRETCH)
    expected = {
        "principal_1": true, "principal_2": 0, "max_shear": true, "von_mises": 2 / 3**0.5 * true,
    }  # fmt: skip
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, abs=2e-4)
        assert 1e-6 < found[f"sigma_{name}"] < 2e-4
    assert abs(found["principal_angle"]) < 0.02


def test_invariants_of_a_pair_stand_in_its_csv(series, correlate):
    assert correlate("ref.png", "frames/f9.png", "--invariants", "--out", "o")[0] == 0
    with (series / "o" / "fields.csv").open() as file:
        rows = list(csv.DictReader(file))
    first = [float(row["principal_1"]) for row in rows]
    assert np.nanmedian(first) == pytest.approx(2 * STRETCH, abs=2e-4)
    assert {"sigma_von_mises", "principal_angle"} < set(rows[0])


def test_a_scale_of_two_points_stands_in_the_file_and_in_mm(series, correlate):
    code, _, text = correlate(
        "ref.png", "frames/*.png", "--scale", "20,30,120,30=25 mm", "--out", "o"
    )
    assert code == 0, text
    with h5py.File(series / "o" / "fields.h5") as file:
        assert file.attrs["mm_per_px"] == pytest.approx(0.25)
        assert file.attrs["scale"] == "two points, 20,30,120,30=25 mm"
        np.testing.assert_allclose(file["u_mm"][:], 0.25 * file["u"][:], rtol=1e-5, atol=1e-7)
        np.testing.assert_allclose(file["sigma_v_mm"][:], 0.25 * file["sigma_v"][:], rtol=1e-5)
        np.testing.assert_allclose(file["place"][0, :, 0], 0.25 * file["x"][:])
        assert file["u_mm"].attrs["unit"] == "mm"
        assert np.nanmedian(file["exx"][2]) == pytest.approx(3 * STRETCH, abs=1.5e-4)


BOARD = CharucoBoard((5, 4), 5.0, 4.0)
AS_PRINTED = "board.png=5x4,5,4 mm"
PX_PER_MM = 5.0


@pytest.fixture
def board(series):
    """Photograph of a board on the specimen, a little turned; gives the turn, rad."""
    turn = 0.06
    c, s = np.cos(turn), np.sin(turn)
    laid = np.array([[c, -s, 10.0], [s, c, 2.0]])  # about a corner, px
    image = cv2.warpAffine(BOARD.draw(PX_PER_MM), laid, SHAPE[::-1], borderValue=255)
    Image.fromarray(image.astype(np.uint16) * 100).save(series / "board.png")
    return turn


@pytest.mark.parametrize("frames", ["frames", "frames/f10.png"])
def test_a_board_scales_a_test_and_a_pair_along_its_sides(series, correlate, board, frames):
    code, _, text = correlate("ref.png", frames, "--board", AS_PRINTED, "--out", "o")
    assert code == 0, text
    stretch = 3 * STRETCH
    with h5py.File(series / "o" / "fields.h5") as file:
        assert file.attrs["mm_per_px"] == pytest.approx(1 / PX_PER_MM, rel=5e-3)
        assert "12 corners of the board in board.png" in file.attrs["scale"]
        u, v, u_mm = (file[name][-1].astype(float) for name in ("u", "v", "u_mm"))
        along = (np.cos(board) * u + np.sin(board) * v) / PX_PER_MM
        np.testing.assert_allclose(u_mm, along, rtol=5e-3, atol=2e-3)
        assert np.nanmedian(file["exx"][-1]) == pytest.approx(
            stretch * np.cos(board) ** 2, abs=3e-4
        )


def test_a_board_that_is_not_seen_ends_in_one_sentence(series, correlate, board):
    for given, words in (
        ("ref.png=5x4,5,4 mm", "shows no board of 5 × 4 squares; light it evenly"),
        ("mirror.png=5x4,5,4 mm", "shows no board of 5 × 4 squares but in a mirror"),
        ("none.png", "does not exist"),
        ("small.png", "small.png' has 40x40 px and the reference 140x110 px"),
        ("board.png=5x2,5,4 mm", "board needs 3 × 3 squares"),
    ):
        seen = np.asarray(Image.open(series / "board.png"))
        Image.fromarray(np.ascontiguousarray(seen[:, ::-1])).save(series / "mirror.png")
        Image.fromarray(seen[:40, :40].astype(np.uint8)).save(series / "small.png")
        code, _, text = correlate("ref.png", "frames", "--board", given)
        assert code == 2
        assert words in " ".join(text.split())
        assert text.count("\n") == 1
    code, _, text = correlate("ref.png", "frames", "--board", AS_PRINTED, "--scale", "1,2,9,2=5 mm")
    assert (code, "leave out one" in text) == (2, True)


def test_a_scale_that_is_none_ends_in_one_sentence(series, correlate):
    code, _, text = correlate("ref.png", "frames/*.png", "--scale", "here", "--out", "o")
    assert code == 2
    assert text.count("\n") == 1
    assert not (series / "o").exists()


def changing(images):
    """Frames at rest whose pattern turns into another one."""
    rng = np.random.default_rng(2)
    other = speckle(seed=6).astype(float)
    weights = np.linspace(0, 1, 9)
    frames = [(1 - w) * images[0] + w * other for w in weights]
    return [np.rint(f + rng.normal(0, 1, SHAPE)).clip(0, 255).astype(np.uint8) for f in frames]


@pytest.fixture
def worn(series, images):
    for path in (series / "frames").iterdir():
        path.unlink()
    for number, image in enumerate(changing(images)):
        Image.fromarray(image).save(series / "frames" / f"w{number}.png")
    (series / "frames" / "w2b.png").write_bytes(b"no image")
    return series


def test_a_pattern_that_wears_off_is_followed_by_renewed_references(worn, correlate):
    valid = {}
    for name, more in (("each", ()), ("in turn", ("--follow",))):
        code, _, text = correlate("ref.png", "frames/*.png", *more, "--out", name)
        assert code == 0, text
        with h5py.File(worn / name / "fields.h5") as file:
            last = file["status"][-1] == 0
            valid[name] = last.mean()
            if more:
                assert np.median(np.abs(file["u"][-1][last])) < 0.5  # what of both remains drags it
                assert np.median(file["sigma_u"][-1][last]) > np.nanmedian(file["sigma_u"][0])
                assert b"not an image" in file["error"][3]
    assert valid["in turn"] > valid["each"] + 0.4


def test_a_followed_test_that_was_killed_ends_in_the_same_bytes(worn, correlate, monkeypatch):
    command = ("ref.png", "frames/*.png", "--follow", "--out")
    assert correlate(*command, "whole")[0] == 0
    import rig.series.follow as engine

    kept = engine.write_part

    def killed_after_three(folder, number, *rest):
        if number == 5:
            raise KeyboardInterrupt
        kept(folder, number, *rest)

    monkeypatch.setattr(engine, "write_part", killed_after_three)
    try:
        code = correlate(*command, "twice")[0]
    except KeyboardInterrupt:
        code = None
    assert code != 0
    assert not (worn / "twice" / "fields.h5").exists()
    written = []
    monkeypatch.setattr(engine, "write_part", lambda *a: (written.append(a[1]), kept(*a)))
    assert correlate(*command, "twice")[0] == 0
    assert written == [5, 6, 7, 8, 9]
    for name in ("fields.h5", "fields.xdmf"):
        assert (worn / "twice" / name).read_bytes() == (worn / "whole" / name).read_bytes()


def test_following_windows_that_the_data_choose_is_refused(series, correlate):
    code, _, text = correlate("ref.png", "frames/*.png", "--follow", "--field", "adaptive")
    assert code == 2
    assert "leave out one" in text
    code, _, text = correlate("ref.png", "frames/f9.png", "--follow")
    assert code == 2
    assert "is one; leave it out" in text


def test_a_calibration_puts_displacement_and_extensometers_on_the_plate(series, correlate):
    """Under a camera straight above, x of the plate is to the right and y upwards."""
    import synthetic
    from rig.calibration.lens import Lens
    from rig.calibration.pose import Pose
    from rig.calibration.store import keep

    size, focal, height = (SHAPE[1], SHAPE[0]), 400.0, 200.0
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = -30, 25, height
    lens = Lens(size, focal, (70.0, 55.0), synthetic.Distortion(), 1.0, 0.1, 0.01, ())
    keep(series / "bench.json", lens)
    keep(series / "bench.json", Pose(lens.camera(pose), np.eye(6) * 1e-8, 0.1, 0.01))
    (series / "r.toml").write_text(
        '[[extensometer]]\nname = "e"\nstart = [30, 50]\nend = [110, 50]\n', encoding="utf-8"
    )
    code, _, text = correlate(
        "ref.png", "frames/*.png", "--camera", "bench.json", "--regions", "r.toml", "--out", "o"
    )
    assert code == 0, text
    scale = height / focal
    with h5py.File(series / "o" / "fields.h5") as file:
        assert file.attrs["mm_per_px"] == pytest.approx(scale)
        assert file.attrs["scale"] == "lens and pose of bench.json"
        np.testing.assert_allclose(file["u_mm"][:], scale * file["u"][:], rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(file["v_mm"][:], -scale * file["v"][:], rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(file["place"][0, :, 0], 30 + scale * (file["x"][:] - 70))
        assert np.nanmedian(file["exx"][2]) == pytest.approx(3 * STRETCH, abs=1.5e-4)
    with (series / "o" / "readings.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[2]["e"]) == pytest.approx(3 * STRETCH, abs=2e-4)
