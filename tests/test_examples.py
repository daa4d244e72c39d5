"""The examples run as they are, and the figures that they print are right."""

import math
import os
import re
import subprocess
import sys
from configparser import ConfigParser
from pathlib import Path

import numpy as np
import pytest

import dic
from rig.cli import COMMANDS

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).parent.parent / "examples"
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]\d+)?"


class Printed(str):
    """What an example printed."""

    def line(self, start):
        """Give the numbers of the first line that starts so."""
        for line in self.splitlines():
            if line.strip().startswith(start):
                return [float(text) for text in re.findall(NUMBER, line.strip()[len(start) :])]
        raise AssertionError(f"no line starts with {start!r} in:\n{self}")

    def lines(self, start):
        """Give the numbers of every line that starts so."""
        those = [line for line in self.splitlines() if line.strip().startswith(start)]
        return [Printed(line).line(start) for line in those]


@pytest.fixture
def example(tmp_path):
    """Run an example by its number in an empty folder, where it may only make `results`."""

    def run(number):
        (script,) = FOLDER.glob(f"{number:02d}_*.py")
        threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(
            [sys.executable, script],
            cwd=tmp_path,
            env=os.environ | threads | {"PYTHONIOENCODING": "utf-8"},
            encoding="utf-8",
            capture_output=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert {path.name for path in tmp_path.iterdir()} <= {"results"}
        return Printed(done.stdout)

    return run


def test_the_unit_runs_a_scene_and_starts_it_again_after_a_fault():
    unit = ConfigParser(interpolation=None)
    unit.optionxform = str
    unit.read_string((FOLDER / "touchplate.service").read_text(encoding="utf-8"))
    program, *words = unit["Service"]["ExecStart"].split()
    assert Path(program).name == "touchplate"
    assert words[0] == "run"
    assert words[0] in COMMANDS
    assert Path(words[1]).suffix == ".toml"
    assert unit["Service"]["Restart"] == "on-failure"
    assert unit["Install"]["WantedBy"] == "default.target"


def test_examples_are_short_and_each_has_its_number():
    scripts = sorted(FOLDER.glob("*.py"))
    assert [int(script.name[:2]) for script in scripts] == list(range(1, len(scripts) + 1))
    for script in scripts:
        lines = script.read_text(encoding="utf-8").splitlines()
        assert len(lines) < 60, f"{script.name} has {len(lines)} lines"
        assert f"def test_{script.stem[3:]}(" in Path(__file__).read_text(encoding="utf-8")


def test_correlate(example):
    printed = example(1)
    measured, points = printed.line("points measured:")
    assert measured == points > 6000
    for component in "uv":
        bias, scatter, predicted = printed.line(f"{component}: bias")
        assert abs(bias) < 4  # mpx; measured 2.1
        assert 0.85 < scatter / predicted < 1.1


def test_strain(example):
    printed = example(2)
    for component in ("exx", "eyy", "exy"):
        kinds = printed.lines(component)
        assert len(kinds) == 3
        for mean, true, scatter, predicted in kinds:
            assert abs(mean - true) < 40  # µε; measured 20
            assert 0.8 < scatter / predicted < 1.15
    # Only a strain that forgets the rotation has no shear here.
    small, green, logarithmic = (row[1] for row in printed.lines("exy"))
    assert small > 300
    assert green == logarithmic == 0


def test_plate(example):
    printed = example(3)
    assert all(w < 0 for w in printed.line("deflection under the touches:"))
    assert printed.line("middle of the lower edge:")[1] > 100  # µε, tension
    assert max(printed.line("beside the first touch:")[:2]) < -50  # compression
    (difference,) = printed.line("influence against bending: relative difference")
    (gradient,) = printed.line("gradient against differences:")
    assert difference < 1e-10
    assert gradient < 1e-6


def test_touches_from_strain(example):
    printed = example(4)
    assert "touches found: 2" in printed
    for x, sx, true_x, y, sy, true_y, force, sf, true_force in printed.lines("x "):
        assert abs(x - true_x) < 4 * sx < 0.4  # mm
        assert abs(y - true_y) < 4 * sy < 0.4
        assert abs(force - true_force) < 4 * max(sf, 0.001)  # N
    count, farthest = printed.line("without one side of the ring:")
    assert count == 2
    assert farthest < 0.6  # mm; measured 0.15


def test_what_a_camera_sees(example, tmp_path):
    printed = example(5)
    whole, bending = printed.line("image moves by up to")
    assert 0 < bending < whole
    assert printed.line("exx that the camera shows ÷ exx of the plate:")[0] > 3
    plot = (tmp_path / "results" / "pressed_plate.png").read_bytes()
    assert plot.startswith(b"\x89PNG")


def test_touch_from_frame(example):
    printed = example(6)
    assert "touches found: 1" in printed
    for name, farthest in (("x", 2.0), ("y", 2.0), ("force", 0.1)):  # mm, mm, N
        found, sigma, true = printed.line(f"{name} ")
        assert abs(found - true) < 4 * sigma < farthest
    *shift, true_x, true_y = printed.line("camera has moved by")
    assert shift == pytest.approx([true_x, true_y], abs=0.01)  # px


def test_small_net(example):
    printed = example(7)
    assert printed.line("epoch 999: loss")[0] < printed.line("epoch 0: loss")[0] / 50
    mean, largest, touches = printed.line("net: mean error")
    assert mean < 1.5  # mm; measured 0.55
    assert largest < 6.0
    assert touches == 100
    assert printed.line("solver: mean error")[0] < 1e-6


def test_large_touches(example, tmp_path):
    printed = example(8)
    ratio, force, *_, off = printed.line("w/h is up to")
    (linear,) = printed.line("deflection by linear theory:")
    (shell,) = printed.line("deflection of the shell:")
    assert force == 5.0
    assert ratio == pytest.approx(-shell, abs=0.05)  # 1 mm thick, pressed 15 mm from the middle
    assert 100 * (linear / shell - 1) == pytest.approx(off, abs=8)
    assert "the equilibrium is stable" in printed
    # A point nearer to the east edge is pulled towards the touch, west of it.
    u, _, w = printed.line("the face at (100, 45): u")
    assert u < 0
    assert w < 0
    (bow,) = printed.line("the bent base bows to")
    # A clamped strip that is shortened by Δ bows to about (2/π) √(L Δ).
    assert bow == pytest.approx(2 / math.pi * math.sqrt(150.0 * 5.0), rel=0.02)
    eigenvalues = [line[-1] for name in ("base:", "touched:") for line in printed.lines(name)]
    assert len(eigenvalues) == 2
    assert min(eigenvalues) > 0
    assert {path.name for path in (tmp_path / "results").iterdir()} == {
        "large-touch.png",
        "bent-base.vtu",
    }


def test_live_loop(example):
    printed = example(9)
    rows = printed.lines("one touch in the last of")
    assert rows[0][1:] == [384, 320]
    place, force = printed.line("median error:")
    assert place < 6  # mm; measured 3.4, and σ is 3: the camera is small
    assert force < 0.3  # N; measured 0.05
    assert printed.line("missed:") == [0, 0]
    times = [line.split()[0] for line in printed.splitlines() if ": touch 1 at" in line]
    assert len(times) >= 10
    assert times == sorted(times, key=float)


def test_projector(example):
    printed = example(11)
    frames, touched = printed.line("frames:")
    assert frames >= touched == 5
    assert 0.5 < printed.line("largest load:")[0] < 2.5  # N, of touches of 1 to 2 N


def test_photographs(example, tmp_path):
    printed = example(10)
    pull, rim = printed.line("results/photographs: pull")
    assert rim == pytest.approx(3 * pull)  # the round hole of Kirsch
    folder = tmp_path / "results/photographs"
    before, after, roi = (dic.read_image(folder / f"{n}.png") for n in ("before", "after", "roi"))
    field = dic.correlate(dic.prepare(before, roi=roi > 0), after)
    strain = dic.strain(field)
    assert set(np.unique(roi)) == {0, 255}
    assert field.valid[field.status != dic.Status.EXCLUDED].mean() > 0.99
    far = strain.valid & (np.abs(field.xy[:, 0] - before.shape[1] / 2) > 250)  # px from the hole
    assert np.median(strain.exx[far]) == pytest.approx(1e-6 * pull, rel=0.1)
