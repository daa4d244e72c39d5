"""`touchplate correlate`: files in, fields and figures out, and a sentence for what is wrong."""

import json
import subprocess
import sys
from dataclasses import dataclass

import h5py
import numpy as np
import pytest
from PIL import Image

from rig import cli

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
    assert names == ["fields.csv", "fields.h5", "fields.png"]
    with h5py.File(out / "fields.h5") as stored:
        assert len(stored) > 0


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


def colour(path):
    image = np.zeros((*SHAPE, 3), np.uint8)
    image[..., 0] = 200
    Image.fromarray(image).save(path)


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


@pytest.mark.parametrize("spoil", [colour, smaller, truncated, no_image, missing])
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


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--subset", 30),
        ("--subset", 301),
        ("--step", 0),
        ("--order", 7),
        ("--window", 4),
        ("--roi", "no.png"),
    ],
)
def test_a_bad_option_ends_in_one_sentence(pair, correlate, tmp_path, option, value):
    assert_refused(correlate(*pair, option, value), tmp_path)


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
