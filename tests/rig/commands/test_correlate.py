"""`touchplate correlate`: files in, fields and figures out, and a sentence for what is wrong."""

import csv
import importlib
import json
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from PIL import Image

import dic
import models
from rig import cli
from rig.commands.compiling import compiling_announced
from rig.series.read import open_result

SHIFT = (0.37, -1.62)
SHAPE = (150, 190)


def speckle(shift):
    """Gaussian spots, moved by `shift` px before they are drawn, so no image is resampled."""
    rng = np.random.default_rng(5)
    height, width = SHAPE
    centres = rng.uniform(-10, [width + 10, height + 10], (1800, 2)) + shift
    x = np.exp(-(((np.arange(width)[:, None] - centres[:, 0]) / 2.2) ** 2))
    y = np.exp(-(((np.arange(height)[:, None] - centres[:, 1]) / 2.2) ** 2))
    return 230 - 190 * (1 - np.exp(-0.9 * (y @ x.T)))


@pytest.fixture
def pair(tmp_path):
    paths = tmp_path / "before.png", tmp_path / "after.png"
    for path, shift in zip(paths, ((0.0, 0.0), SHIFT), strict=True):
        Image.fromarray(np.rint(speckle(shift)).astype(np.uint8)).save(path)
    return paths


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def correlate(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["touchplate", "correlate", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return Done(ended.value.code, *capsys.readouterr())

    return run


def files_in(folder):
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_a_disk_without_space_is_said_and_left_as_it_was(pair, correlate, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=200_000))
    done = correlate(*pair, "--out", "out")
    assert done.returncode == 2
    assert "has 0.2 MB free, and the result may need 1." in done.stderr
    assert files_in(tmp_path) == ["after.png", "before.png"]


def test_it_writes_fields_a_plot_and_figures(pair, correlate, tmp_path):
    done = correlate(*pair, "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["u"]["mean"] == pytest.approx(SHIFT[0], abs=0.003)
    assert said["v"]["mean"] == pytest.approx(SHIFT[1], abs=0.003)
    assert said["status"]["ok"] > 0.9
    assert abs(said["exx"]["mean"]) < 5e-4
    assert said["vsg"] == 4 * 5 + 21
    out = tmp_path / "results" / "after"
    names = files_in(out)
    assert names == ["fields.csv", "fields.h5", "fields.png", "fields.xdmf"]
    with h5py.File(out / "fields.h5") as stored:
        assert np.nanmean(stored["u"][0]) == pytest.approx(SHIFT[0], abs=0.003)
        assert stored.attrs["vsg"] == said["vsg"]


@pytest.mark.parametrize("sigma", [0.0, 1.5])
def test_what_the_images_passed_first_is_said_and_kept(pair, correlate, tmp_path, sigma):
    done = correlate(*pair, "--prefilter", sigma, "--json")
    assert json.loads(done.stdout)["prefilter"] == sigma
    assert ("Gaussian of 1.5 px" if sigma else "no prefilter") in done.stderr
    assert "as asked for" in done.stderr
    with h5py.File(tmp_path / "results" / "after" / "fields.h5") as stored:
        assert stored.attrs["prefilter"] == sigma


def test_what_reads_a_test_reads_a_pair(pair, correlate, tmp_path, monkeypatch):
    assert correlate(*pair, "--out", "out").returncode == 0
    stored = tmp_path / "out" / "fields.h5"
    with open_result(stored) as result:
        assert result.names == ("after.png",)
        assert result.image.shape == SHAPE
        assert np.nanmean(result.field("v", 0)) == pytest.approx(SHIFT[1], abs=0.003)
        assert np.nanmedian(result.field("von_mises", 0)) < 2e-3
    words = "export", str(stored), str(tmp_path / "npz"), "--to", "npz"
    monkeypatch.setattr(sys, "argv", ["touchplate", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    assert np.load(tmp_path / "npz" / "fields.npz")["u"].shape[0] == 1


REGIONS = """
[[extensometer]]
name = "long"
start = [40, 60]
end = [150, 60]

[[gauge]]
name = "mid"
points = [[60, 40], [140, 40], [140, 110], [60, 110]]

[[gauge]]
name = "away"
points = [[800, 800], [900, 800], [900, 900]]
"""


def test_extensometers_and_gauges_of_a_pair_are_read(pair, correlate, tmp_path):
    (tmp_path / "r.toml").write_text(REGIONS)
    done = correlate(*pair, "--regions", "r.toml", "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    assert "gauge 'away' lies off the points" in " ".join(done.stderr.split())
    read = json.loads(done.stdout)["readings"]
    for name in ("long", "mid_exx", "mid_eyy", "mid_exy"):  # a shift alone
        assert abs(read[name]) < 5 * read[f"sigma_{name}"] < 1e-3
    assert read["away_exx"] is None
    with (tmp_path / "out" / "readings.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["long"]) == pytest.approx(read["long"], abs=1e-8)  # float32
    said = correlate(*pair, "--regions", "r.toml", "--out", "two").stdout
    assert "long: " in said
    assert "away_exx: nothing measured there" in said


def test_readings_of_an_earlier_run_go_when_it_is_replaced(pair, correlate, tmp_path):
    (tmp_path / "r.toml").write_text(REGIONS)
    assert correlate(*pair, "--regions", "r.toml", "--out", "out").returncode == 0
    assert correlate(*pair, "--out", "out", "--plots", "--force").returncode == 0
    assert "readings.csv" not in files_in(tmp_path / "out")
    assert correlate(*pair, "--out", "out", "--force").returncode == 0
    assert files_in(tmp_path / "out") == ["fields.csv", "fields.h5", "fields.png", "fields.xdmf"]


def test_an_earlier_run_stays_where_another_cannot_be_written(
    pair, correlate, tmp_path, monkeypatch
):
    (tmp_path / "r.toml").write_text(REGIONS)
    assert correlate(*pair, "--regions", "r.toml", "--out", "out", "--plots").returncode == 0
    before = files_in(tmp_path / "out")

    def full(*given):
        raise OSError("the disk is full")

    monkeypatch.setattr(dic.export, "draw_overview", full)
    assert correlate(*pair, "--out", "out", "--force").returncode == 2
    assert files_in(tmp_path / "out") == before


PERIOD = 16
"""px, of a pattern that repeats along both axes."""


def periodic(shift):
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    x, y = (2 * np.pi * (x - shift[0]) / PERIOD, 2 * np.pi * (y - shift[1]) / PERIOD)
    return 120 + 50 * np.cos(x) + 50 * np.cos(y) + 20 * np.cos(x + y)


def test_a_pattern_that_repeats_is_measured_from_a_guess(tmp_path, correlate):
    shift = (PERIOD + 2.3, -1.4)
    for name, moved in (("a.png", (0, 0)), ("b.png", shift)):
        Image.fromarray(np.rint(periodic(moved)).astype(np.uint8)).save(tmp_path / name)
    alone = correlate("a.png", "b.png", "--out", "alone")
    assert "ambiguous: the pattern repeats" in " ".join(alone.stdout.split())
    done = correlate("a.png", "b.png", "--guess", "20,-3", "--out", "o", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["status"]["ok"] > 0.5
    assert said["u"]["mean"] == pytest.approx(shift[0], abs=0.05)
    assert said["v"]["mean"] == pytest.approx(shift[1], abs=0.05)
    with h5py.File(tmp_path / "o" / "fields.h5") as stored:
        assert stored.attrs["guess"].tolist() == [20, -3]


def test_windows_that_the_data_choose_have_less_noise(pair, correlate, tmp_path):
    said = {}
    for field in ("subset", "adaptive"):
        done = correlate(*pair, "--field", field, "--out", tmp_path / field, "--json")
        assert done.returncode == 0
        said[field] = json.loads(done.stdout)
    for part, true in zip("uv", SHIFT, strict=True):
        assert abs(said["adaptive"][part]["mean"] - true) < 2e-3
        assert said["adaptive"][part]["sigma"] < 0.5 * said["subset"][part]["sigma"]
    assert said["adaptive"]["vsg"] > 40
    with h5py.File(tmp_path / "adaptive" / "fields.h5") as file:
        assert np.nanstd(np.asarray(file["exx"])) < 1e-4


@pytest.mark.parametrize("field", ["net", "image-net"])
def test_a_field_by_a_net_says_which_points_are_its_own(pair, correlate, tmp_path, field):
    pytest.importorskip("torch")
    done = correlate(*pair, "--field", field, "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    for part, true in zip("uv", SHIFT, strict=True):
        assert abs(said[part]["mean"] - true) < 2e-3
    with h5py.File(tmp_path / "out" / "fields.h5") as file:
        own, valid = np.asarray(file["by_net"]), np.isfinite(np.asarray(file["u"]))
        assert file.attrs["by_net_reason"] == said["by_net_reason"]
        assert file.attrs["by_net_fraction"] == pytest.approx(own.sum() / valid.sum())
    assert (said["by_net_fraction"] > 0.3) == (field == "net")  # the other one adds nothing here
    assert "points are" in said["by_net_reason"]
    header = (tmp_path / "out" / "fields.csv").read_text().splitlines()[0]
    assert "by_net" in header


@pytest.fixture
def half_a_net(tmp_path, monkeypatch):
    """Both nets of the package, cut short."""
    for shipped, module in (
        (models.shipped_net, "models.field_net.field_net"),
        (models.shipped_image_net, "models.image_net.image_net"),
    ):
        place = tmp_path / f"{module}.npz"
        place.write_bytes(importlib.import_module(module).SHIPPED.read_bytes()[:5000])
        monkeypatch.setattr(f"{module}.SHIPPED", place)
        shipped.cache_clear()
    yield
    models.shipped_net.cache_clear()
    models.shipped_image_net.cache_clear()


@pytest.mark.parametrize("field", ["net", "image-net"])
def test_a_damaged_net_leaves_the_adaptive_field_and_the_command_says_so(
    pair, correlate, half_a_net, field
):
    pytest.importorskip("torch")
    done = correlate(*pair, "--field", field, "--out", "out")
    assert done.returncode == 0, done.stderr
    shown = " ".join(done.stdout.split())
    assert "all points are of the adaptive field" in shown
    assert "damaged" in shown
    assert "install touchplate again" in shown


def test_a_net_of_ones_own_is_taken_for_what_its_file_says(pair, correlate, tmp_path):
    pytest.importorskip("torch")
    net = models.shipped_net()
    nothing = np.zeros_like(net.low)
    models.save_field_net("own.npz", replace(net, low=nothing, high=nothing))
    done = correlate(*pair, "--net", "own.npz", "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["by_net_fraction"] == 0  # it has seen nothing
    done = correlate(*pair, "--net", "own.npz", "--field", "image-net", "--out", "other")
    assert done.returncode == 2
    assert "--field net" in done.stderr
    (tmp_path / "own.npz").write_bytes(b"no net")
    done = correlate(*pair, "--net", "own.npz", "--out", "other")
    assert done.returncode == 2
    assert "damaged" in done.stderr


def test_each_field_is_drawn_alone_when_asked_for(pair, correlate, tmp_path):
    assert correlate(*pair, "--plots", "--out", "out").returncode == 0
    drawn = {name.removesuffix(".png") for name in files_in(tmp_path / "out")}
    assert drawn > {"fields", "u", "v", "exx", "eyy", "exy", "sigma_u", "zncc", "status"}


def test_the_summary_is_readable(pair, correlate, tmp_path):
    done = correlate(*pair, "--out", "out")
    assert done.returncode == 0, done.stderr
    for text in ("points: ok", "median σ", "µε", "gauge length 41 px", "written to out"):
        assert text in done.stdout


def test_dic_alone_is_imported(pair, tmp_path):
    code = (
        "import sys\n"
        f"sys.argv = ['touchplate', 'correlate', {str(pair[0])!r}, {str(pair[1])!r}]\n"
        "from rig.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print({'torch', 'fe', 'models', 'synthetic', 'rig.scene'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout.endswith("set()\n")


def test_a_mask_leaves_out_what_is_black(pair, correlate, tmp_path):
    mask = np.full(SHAPE, 255, np.uint8)
    mask[:, 95:] = 0
    Image.fromarray(mask).save(tmp_path / "mask.png")
    whole = json.loads(correlate(*pair, "--json", "--out", "a").stdout)
    done = correlate(*pair, "--roi", "mask.png", "--json", "--out", "b")
    half = json.loads(done.stdout)
    measured = [s["points"] * s["status"]["ok"] for s in (whole, half)]
    assert 0.3 < measured[1] / measured[0] < 0.7


def test_sixteen_bit_images_are_taken(pair, correlate, tmp_path):
    paths = []
    for path in pair:
        deep = np.asarray(Image.open(path)).astype(np.uint16) * 256
        paths.append(path.with_suffix(".tif"))
        Image.fromarray(deep).save(paths[-1])
    said = json.loads(correlate(*paths, "--json").stdout)
    assert said["u"]["mean"] == pytest.approx(SHIFT[0], abs=0.003)


def tinted(path):
    """Replace a grey image by one in colour of its luminance, to a grey level."""
    grey = np.asarray(Image.open(path)).astype(float)
    red, blue = 0.8 * grey, np.minimum(1.2 * grey, 255)
    green = (grey - 0.299 * red - 0.114 * blue) / 0.587
    image = np.rint(np.clip(np.dstack([red, green, blue]), 0, 255)).astype(np.uint8)
    Image.fromarray(image).save(path)


def test_photographs_in_colour_are_taken_by_their_luminance(pair, correlate):
    for path in pair:
        tinted(path)
    done = correlate(*pair, "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("is stored in colour; its luminance is taken") == 2
    said = json.loads(done.stdout)
    assert said["u"]["mean"] == pytest.approx(SHIFT[0], abs=0.01)
    assert said["v"]["mean"] == pytest.approx(SHIFT[1], abs=0.01)


def test_the_first_page_of_a_reference_is_said(pair, correlate, tmp_path):
    first, second = (Image.open(path) for path in pair)
    first.save(tmp_path / "ref.tif", save_all=True, append_images=[second])
    done = correlate("ref.tif", pair[1])
    assert done.returncode == 0
    assert "ref.tif has 2 pages; the first one is taken" in done.stderr


def test_a_folder_that_holds_something_is_kept_unless_forced(pair, correlate, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "u.png").write_text("mine")
    (out / "notes.txt").write_text("mine")
    refused = correlate(*pair, "--out", "out")
    assert refused.returncode == 2
    assert refused.stderr == (
        "touchplate: folder 'out' is not empty; pass --force to replace files in it\n"
    )
    assert files_in(out) == ["notes.txt", "u.png"]
    assert correlate(*pair, "--out", "out", "--force").returncode == 0
    assert (out / "notes.txt").read_text() == "mine"
    assert (out / "fields.h5").is_file()


def blank(path):
    Image.fromarray(np.full(SHAPE, 128, np.uint8)).save(path)


def smaller(path):
    Image.fromarray(np.rint(speckle((0.0, 0.0))[:100]).astype(np.uint8)).save(path)


def truncated(path):
    path.write_bytes(path.read_bytes()[:2000])


def no_image(path):
    path.write_text("not an image")


def missing(path):
    path.unlink()


@pytest.mark.parametrize("spoil", [smaller, truncated, no_image, missing])
@pytest.mark.parametrize("which", [0, 1])
def test_a_bad_image_ends_in_one_sentence(pair, correlate, tmp_path, spoil, which):
    spoil(pair[which])
    assert_refused(correlate(*pair), tmp_path)


def test_a_blank_reference_ends_in_one_sentence(pair, correlate, tmp_path):
    blank(pair[0])
    assert_refused(correlate(*pair), tmp_path)


def test_a_blank_frame_measures_nothing_and_says_so(pair, correlate, tmp_path):
    blank(pair[1])
    done = correlate(*pair, "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["status"]["ok"] == 0
    assert said["u"] is None
    assert "after.png: no point was measured, " in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--subset", 30),
        ("--subset", 301),
        ("--step", 0),
        ("--order", 7),
        ("--window", 4),
        ("--roi", "no.png"),
        ("--roi", "black.png"),
        ("--roi", "small.png"),
        ("--guess", "3"),
        ("--guess", "nan,1"),
        ("--guess", "0,-150"),
        ("--workers", 2),
        ("--follow", "--force"),
    ],
)
def test_a_bad_option_ends_in_one_sentence(pair, correlate, tmp_path, option, value):
    Image.new("L", SHAPE[::-1]).save(tmp_path / "black.png")
    Image.new("L", (30, 20), 255).save(tmp_path / "small.png")
    done = correlate(*pair, option, value)
    assert_refused(done, tmp_path)
    assert "True" not in done.stderr
    assert "bool" not in done.stderr


def test_a_roi_without_a_point_is_refused_at_once(pair, correlate, tmp_path):
    image = np.asarray(Image.open(pair[0])).copy()
    image[:, :90] = 0
    Image.fromarray(image).save(pair[0])
    (tmp_path / "r.toml").write_text("[[roi]]\npoints = [[0, 0], [45, 0], [45, 140], [0, 140]]")
    done = correlate(*pair, "--regions", "r.toml")
    assert_refused(done, tmp_path)
    assert "no point can be measured, most are DARK" in done.stderr


def test_kernels_that_are_compiled_are_announced_once(capsys):
    from dic.compiled import njit

    def one(x):
        return x + 1

    kernel = njit(cache=False, nogil=True)(one)
    with compiling_announced():
        assert (kernel(1), kernel(1.5)) == (2, 2.5)
        assert (kernel(2), kernel(2.5)) == (3, 3.5)
    assert capsys.readouterr().err.count("kernels are compiled") == 1


def assert_refused(done, folder):
    assert done.returncode == 2
    assert done.stderr.startswith("touchplate: ")
    assert done.stderr.count("\n") == 1
    assert not (folder / "results").exists()


def test_a_failure_while_writing_leaves_nothing(tmp_path):
    from rig.commands.output import folder_aside

    def fail():
        with folder_aside(tmp_path / "deep" / "out") as aside:
            (aside / "half.txt").write_text("half")
            raise OSError("the disk is full")

    with pytest.raises(OSError, match="disk"):
        fail()
    assert files_in(tmp_path) == []
    assert not (tmp_path / "deep" / "out").exists()


@pytest.fixture
def stills(tmp_path):
    """Folder of noisy images at rest; the frame after them is `after.png`."""
    rng = np.random.default_rng(12)
    (tmp_path / "stills").mkdir()
    images = {f"stills/{k}.png": (0.0, 0.0) for k in range(6)} | {"after.png": SHIFT}
    for name, shift in images.items():
        noisy = np.clip(speckle(shift) + rng.normal(0, 3.0, SHAPE), 0, 255)
        Image.fromarray(np.rint(noisy).astype(np.uint8)).save(tmp_path / name)
    return tmp_path / "stills"


BY_MEAN = np.sqrt(7 / 12)
"""Noise of a frame and of the mean of six stills, over that of a frame and one still."""


def test_several_images_at_rest_are_a_reference(stills, correlate, tmp_path):
    found = {}
    for name in ("stills/*.png", "stills", "stills/0.png"):
        done = correlate(name, "after.png", "--out", f"out{len(found)}", "--json")
        found[name] = json.loads(done.stdout)["u"]["sigma"]
    assert found["stills"] == found["stills/*.png"]
    assert found["stills"] / found["stills/0.png"] == pytest.approx(BY_MEAN, rel=0.15)
    for folder, count in (("out1", 6), ("out2", 1)):
        with h5py.File(tmp_path / folder / "fields.h5") as stored:
            assert stored.attrs["stills"] == count
            assert (stored.attrs["scatter"] >= 1).all()


def test_settings_are_chosen_by_the_mean_of_the_images_at_rest(stills, correlate):
    noise = {}
    for name in ("stills", "stills/0.png"):
        said = correlate(name, "after.png", "--auto", "--out", "out", "--force").stderr
        noise[name] = float(re.search(r"noise of (\S+) grey", " ".join(said.split()))[1])
    assert noise["stills"] / noise["stills/0.png"] == pytest.approx(BY_MEAN, rel=0.1)


def test_a_still_of_another_size_is_named(stills, correlate, tmp_path):
    Image.new("L", (30, 20), 255).save(stills / "3.png")
    done = correlate("stills", "after.png", "--auto")
    assert_refused(done, tmp_path)
    assert "'3.png' is 30x20 px" in done.stderr
