"""The printed board: true to scale, and found where it is printed."""

import errno
import json
import re
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from rig import cli
from rig.calibration.board import CharucoBoard
from rig.calibration.board_print import MARGIN, SCALE, print_board

BOARD = CharucoBoard((7, 5), 18.0, 13.0)


def test_the_corners_of_a_printed_board_lie_where_they_measure(tmp_path):
    print_board(tmp_path / "board.png", BOARD)
    with Image.open(tmp_path / "board.png") as image:
        assert image.size == tuple(round(SCALE * (side + 2 * MARGIN)) for side in BOARD.size)
        small = image.convert("L").reduce(4)
    view = BOARD.find(np.asarray(small))
    assert len(view.mm) == 6 * 4
    printed = (view.px + 0.5) * 4 / SCALE - MARGIN
    assert np.abs(printed - view.mm).max() < 0.03  # mm


@pytest.mark.slow
def test_the_ruler_has_a_tick_every_millimetre(tmp_path):
    print_board(tmp_path / "board.png", BOARD)
    with Image.open(tmp_path / "board.png") as image:
        dark = np.asarray(image.convert("L")) < 160
    row = dark[-round(SCALE * (MARGIN - MARGIN / 4 - 1))]
    starts = np.flatnonzero(row[1:] & ~row[:-1]) / SCALE - MARGIN
    assert len(starts) == BOARD.size[0] + 1
    np.testing.assert_allclose(starts, np.arange(BOARD.size[0] + 1), atol=0.1)


def test_a_page_of_a_pdf_is_as_large_as_the_board_and_its_margin(tmp_path):
    print_board(tmp_path / "board.pdf", BOARD)
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pages(tmp_path / "board.pdf"))
    sides = [float(side) * 25.4 / 72 for side in box.groups()]
    np.testing.assert_allclose(sides, np.add(BOARD.size, 2 * MARGIN), atol=0.05)


def pages(path):
    content = path.read_bytes()
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL)
    for stream in streams:
        with suppress(zlib.error):
            content += zlib.decompress(stream)
    return content


def touchplate(*arguments):
    arguments = [str(argument) for argument in arguments]
    return CliRunner().invoke(cli.application(arguments), arguments)


def test_a_full_disk_leaves_no_half_of_a_board(tmp_path, monkeypatch):
    def full(path, content):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        print_board(tmp_path / "board.pdf", BOARD)
    assert [*tmp_path.iterdir()] == []


def test_the_commands_print_board_and_speckle(tmp_path):
    done = touchplate("print", "board", tmp_path / "b.pdf", "--squares", 5, 4, "--json")
    assert json.loads(done.stdout)["size_mm"] == [100.0, 80.0]
    done = touchplate(
        "print", "speckle", "twin", tmp_path / "s.pdf", "--json", "--set=plate.size=[30, 20]"
    )
    assert json.loads(done.stdout)["size_mm"] == [30.0, 20.0]
    assert (tmp_path / "s.pdf").read_bytes().startswith(b"%PDF")
    assert (tmp_path / "b.pdf").read_bytes().startswith(b"%PDF")


def test_another_kind_of_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"to \.pdf or \.png, got 'board\.svg'; rename the file"):
        print_board(tmp_path / "board.svg", BOARD)
