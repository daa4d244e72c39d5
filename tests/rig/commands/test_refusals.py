"""Wrong files and folders, refused in a sentence before anything long begins."""

import pytest
from typer.testing import CliRunner

from rig import cli


@pytest.fixture
def refused(tmp_path, monkeypatch):
    """Give what a command says of arguments that it refuses, in a folder with some to name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.png").write_text("no image")

    def say(*arguments):
        done = CliRunner().invoke(cli.application(arguments), arguments)
        assert isinstance(done.exception, ValueError | OSError), done.output
        return cli.sentence(done.exception)

    return say


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            "correlate empty/a.png text.png",
            "image 'empty/a.png' does not exist; check the path",
        ),
        (
            "correlate empty empty --roi empty",
            "folder 'empty' holds no image; PNG, TIFF, BMP and JPEG are read",
        ),
        *(
            (
                f"train {name} --from presses.h5",
                f"--from corrects the bench of a scene by presses, and the net of '{name}' is "
                "trained on drawn data alone; leave --from out, or name the scene whose bench was "
                "pressed",
            )
            for name in ("dic-net", "image-net", "touch-net")
        ),
        *(
            (
                f"train {name} --curves empty/none/curves.png",
                "curves 'empty/none/curves.png' must be a *.png in a folder that exists; name such "
                "a one",
            )
            for name in ("dic-net", "paper-one")
        ),
        ("replay empty", "recording 'empty' is a folder; name a file *.h5 in it"),
        (
            "profile empty --line 1,2,3,4",
            "result 'empty' is a folder; name the fields.h5 in it",
        ),
        ("report --compare empty", "'empty' holds no report; build one with touchplate report"),
        ("diagnose twin --images empty", "folder empty holds no images; PNG, TIFF, BMP and JPEG"),
        ("dataset paper-one --out x.csv", "data set must be a file *.h5, got 'x.csv'; name it so"),
        ("train paper-one --out x.npz", "model must be a file *.h5, got 'x.npz'; name it so"),
        ("train touch-net --out x.h5", "model must be a file *.npz, got 'x.h5'; name it so"),
    ],
)
def test_a_wrong_file_or_folder_is_named_with_its_remedy(refused, arguments, says):
    assert refused(*arguments.split()).startswith(says)


def test_a_name_with_spaces_can_be_copied_from_what_is_said(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["new", "desk ü.toml"]
    done = CliRunner().invoke(cli.application(arguments), arguments)
    assert "touchplate design 'desk ü.toml'" in " ".join(done.output.split())
