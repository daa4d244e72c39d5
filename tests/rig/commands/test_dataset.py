"""`touchplate dataset` from scene to file, killed and gone on with."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import fe
import models
import rig
from fe.shell import Base, Shell, shell_mesh

SCENE = """
title = "An oblong plate with 16 gauges"
[plate]
size = [60.0, 40.0]
thickness = 1.0
young = "3 GPa"
poisson = 0.3
edges.kind = "clamped"
[gauges]
kind = "ring"
spacing = 10.0
[dataset]
touches = 2
force = "1 mN"
magnitudes = 4
samples = 9000
seed = 3
"""
MANY = ["--set", "dataset.places=random", "--set", "dataset.samples=600000"]
DISC = ["--set", "touches.force=[0.001, 0.004]", "--set", "touches.radius=6"]
EDGES = {"west": "clamped", "east": "clamped", "south": "free", "north": "free"}
BENT = ["--set", "plate.edges.kind=mixed"] + [
    word for side, kind in EDGES.items() for word in ("--set", f"plate.edges.{side}.kind={kind}")
]
RUN = [sys.executable, "-c", "from rig.cli import main; main()", "dataset", "oblong.toml"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a scene."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "oblong.toml").write_text(SCENE)
    return folder


@pytest.fixture
def bench(folder, in_process):
    """Return the folder, and a function that runs the command there."""
    return folder, lambda *arguments: in_process(folder, "dataset", "oblong.toml", *arguments)


def environment(folder):
    return os.environ | {"TOUCHPLATE_CACHE": str(folder / "cache")}


@pytest.fixture(scope="module")
def written(folder):
    done = subprocess.run(
        [*RUN, "--json"],
        cwd=folder,
        env=environment(folder),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / "results" / "oblong" / "dataset.h5", json.loads(done.stdout)


def test_the_file_holds_what_the_scene_says(written):
    path, figures = written
    data = models.read_dataset(path)
    assert figures["dataset"] == "results/oblong/dataset.h5"
    assert (figures["samples"], figures["touches"], figures["gauges"]) == (9000, 2, 16)
    assert figures["bytes"] == path.stat().st_size
    assert data.strain.shape == (9000, 16, 3)
    assert set(np.unique(data.touches[..., 0])) == set(np.arange(10.0, 51.0, 5.0))
    assert np.unique(data.touches[..., 2]) == pytest.approx([0.001, 0.002, 0.003, 0.004])
    assert data.about["dataset"]["seed"] == 3


def test_the_strains_are_those_of_the_plate_bent_by_both_touches(written):
    data = models.read_dataset(written[0])
    plate = fe.Plate((60.0, 40.0), 1.0, 3000.0, 0.3)
    solver = fe.Linear(plate, fe.default_mesh(plate))
    for row in (0, 4711, 8999):
        touches = [fe.Touch(*touch) for touch in data.touches[row].tolist()]
        strain = solver.deflect(touches).strain(data.gauges)
        np.testing.assert_allclose(data.strain[row], strain, rtol=1e-5, atol=1e-7 * strain.max())


def test_a_second_run_finds_all_of_it_there(bench, written):
    done = bench[1]("--json")
    assert json.loads(done.stdout)["found"] == 9000
    assert "9000 of 9000 samples are there already" in done.stderr


def test_the_same_scene_gives_the_same_bytes_and_another_seed_others(bench, written):
    folder, dataset = bench
    again, other = folder / "again.h5", folder / "other.h5"
    assert dataset("--out", str(again)).returncode == 0
    assert dataset("--out", str(other), "--set", "dataset.seed=4").returncode == 0
    assert again.read_bytes() == written[0].read_bytes()
    assert other.read_bytes() != written[0].read_bytes()


@pytest.mark.slow
def test_a_killed_run_is_gone_on_with_to_the_same_bytes(bench, written):
    folder, dataset = bench
    unbroken, killed = folder / "unbroken.h5", folder / "killed.h5"
    assert dataset("--out", str(unbroken), *MANY).returncode == 0
    arguments = [*RUN, "--out", str(killed), *MANY]
    moments = np.random.default_rng().uniform(0.0, 0.4, 3)
    for moment in moments:
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with subprocess.Popen(arguments, cwd=folder, env=environment(folder), **quiet) as process:
            while not killed.exists() and process.poll() is None:
                time.sleep(0.005)
            time.sleep(moment)
            os.kill(process.pid, signal.SIGKILL)
    done = dataset("--out", str(killed), "--json", *MANY)
    assert done.returncode == 0, done.stderr
    assert killed.read_bytes() == unbroken.read_bytes()
    for path in (unbroken, killed):
        path.unlink()


def test_discs_press_where_touches_have_a_radius(bench):
    folder, dataset = bench
    few = ["--set", "dataset.samples=5", "--out", str(folder / "disc.h5")]
    assert dataset(*DISC, *few).returncode == 0
    data = models.read_dataset(folder / "disc.h5")
    assert data.about["touches"] == {"radius": 6.0}
    plate = fe.Plate((60.0, 40.0), 1.0, 3000.0, 0.3)
    touches = [fe.Touch(*touch, radius=6.0) for touch in data.touches[2].tolist()]
    strain = fe.deflect(plate, touches).strain(data.gauges)
    np.testing.assert_allclose(data.strain[2], strain, rtol=1e-4, atol=1e-4 * strain.max())


@pytest.mark.slow
def test_on_a_bent_plate_touches_add_to_the_strain_of_the_base(bench):
    folder, dataset = bench
    path = folder / "bent.h5"
    few = ["--set", "dataset.samples=5", "--set", "dataset.magnitudes=2", "--out", str(path)]
    done = dataset(*BENT, "--set", "base.twist=2 deg", *few)
    assert done.returncode == 0, done.stderr
    assert "bent by its base: the equilibrium is stable" in " ".join(done.stderr.split())
    data = models.read_dataset(path)
    assert data.about["base"] == {"bend": 0.0, "twist": 2.0}
    clamped, free = fe.Clamped(), fe.Free()
    plate = fe.Plate((60.0, 40.0), 1.0, 3000.0, 0.3, fe.Edges(clamped, clamped, free, free))
    bent = Shell(plate, shell_mesh(plate)).at(Base(twist=2.0))
    strain = bent.touch([fe.Touch(*touch) for touch in data.touches[1].tolist()]).strain(
        data.gauges
    )
    np.testing.assert_allclose(data.strain[1], strain, rtol=1e-5, atol=1e-7 * abs(strain).max())
    assert abs(strain - bent.strain(data.gauges)).max() > 1e-4 * abs(strain).max()


@pytest.mark.slow
def test_large_touches_are_those_of_the_shell(bench):
    folder, dataset = bench
    path = folder / "large.h5"
    thin = ["--set", "plate.thickness=0.5 mm", "--set", "dataset.samples=12"]
    large = [*thin, "--set", "dataset.force=0.5 N"]
    done = dataset("--out", str(path), *large)
    assert done.returncode == 0, done.stderr
    assert "theory of large deflection: w/h is up to" in " ".join(done.stderr.split())
    data = models.read_dataset(path)
    assert data.about["theory"] == "large"
    plate = fe.Plate((60.0, 40.0), 0.5, 3000.0, 0.3)
    room = np.minimum(data.touches[:, :, :2], np.array(plate.size) - data.touches[:, :, :2])
    fullest = int(np.argmax((data.touches[:, :, 2] * room.min(axis=2)).sum(axis=1)))
    touches = [fe.Touch(*touch) for touch in data.touches[fullest].tolist()]
    strain = fe.solve(plate, touches).strain(data.gauges)
    assert np.linalg.norm(data.strain[fullest] - strain) < 0.02 * np.linalg.norm(strain)
    small = fe.deflect(plate, touches).strain(data.gauges)
    assert np.linalg.norm(small - strain) > 0.05 * np.linalg.norm(strain)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--set", "dataset.seed=9"], "was begun with dataset.seed = 3, got 9; delete it or"),
        (["--set", "dataset.samples=10000000"], "the lattice has 15840 combinations of 2"),
        (["--set", "dataset.spacing=7"], "spacing must divide the 40 mm between the margins"),
        (["--set", "dataset.places=random", "--set", "dataset.margin=20"], "margin"),
        (["--set", "plate.edges.kind=free"], "plate edges must hold the plate"),
        (["--out", "oblong.toml/set.h5"], "cannot be written"),
        (["--set", "base.bend=1"], "south edge must be free or on springs when the cl"),
        ([*BENT, "--set", "base.bend=40"], "bend of the base must stay below 32.58 mm"),
        (["--set", "base.twist=90"], "base.twist is 90 deg; give less than 90 deg"),
        (
            [*BENT, *DISC, "--set", "base.bend=1"],
            "touches on a bent plate are points, got a radius",
        ),
        (["--out", "cache"], "is a folder; give the name of a file in it"),
        (["--out", "oblong.toml"], "must be a file *.h5, got 'oblong.toml'"),
    ],
)
def test_bad_input_ends_in_one_sentence_with_the_remedy(bench, written, arguments, sentence):
    done = bench[1](*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert sentence in done.stderr
    assert done.stderr.startswith("touchplate: ")
    assert done.stderr.count("\n") == 1


def test_a_scene_that_insists_on_linear_theory_hears_what_it_costs(bench):
    folder, dataset = bench
    insist = ["--set", "plate.theory=linear", "--set", "dataset.force=1 N"]
    done = dataset("--out", str(folder / "insisted.h5"), *insist)
    assert done.returncode == 0
    assert "linear theory, as the scene insists: w/h is up to" in " ".join(done.stderr.split())


def test_a_scene_without_a_data_set_is_refused(folder, in_process):
    done = in_process(folder, "dataset", "twin")
    assert done.returncode == 2
    assert "has no data set; add [dataset] and [gauges], as paper-two-magn" in done.stderr


@pytest.mark.parametrize(
    ("name", "rows"),
    [("one", 289), ("two", 41616), ("three", 100000), ("two-magnitudes", 86400)],
)
def test_the_sets_of_the_paper_have_their_sizes(name, rows):
    scene = rig.load(f"paper-{name}")
    assert scene.dataset is not None
    assert scene.plate is not None
    plan = scene.dataset.build(scene.plate)
    assert plan.rows == rows
    block = plan.block(0)
    assert block[..., :2].min() == 10.0
    assert block[..., :2].max() == 90.0


@pytest.mark.parametrize(
    ("overrides", "rows"),
    [
        ({"dataset.places": "between"}, 196),
        ({"dataset.places": "random", "dataset.samples": 100}, 100),
        ({"dataset.places": "random", "dataset.samples": 3000}, 3000),
    ],
)
def test_the_sets_to_validate_and_test_the_first_model_have_their_sizes(overrides, rows):
    scene = rig.load("paper-one", overrides)
    assert scene.dataset is not None
    assert scene.plate is not None
    plan = scene.dataset.build(scene.plate)
    assert plan.rows == rows
    assert plan.touches == 1
