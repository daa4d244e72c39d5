"""`touchplate collect --list`: presses of recorded images, in a folder or a video."""

import csv
import json

import cv2
import numpy as np
import pytest

import fe
import rig
from rig.calibration import store
from rig.calibration.bench_presses import COLUMNS
from rig.sources.twin import build_twin
from tests.rig.conftest import SMALL

REFERENCES, FRAMES = 16, 4
ASKED = "no press can be asked for in them; name the list of their presses with --list"


def drawn_presses(rng, count):
    """Draw presses all over the plate of the small twin."""
    places = rng.uniform((40, 35), (214, 168), (count, 2))
    forces = rng.uniform(2, 4, count)
    return [fe.Touch(*place, force) for place, force in zip(places, forces, strict=True)]


def images_of(scene, presses):
    """Render the plate at rest, and each press after an image in which it is let go of."""
    twin = build_twin(scene)
    images, ranges = [twin.frame(number, ()) for number in range(REFERENCES)], []
    for press in presses:
        first = len(images) + 1
        held = [() if press is None else (press,)] * FRAMES
        images += [twin.frame(first - 1 + k, held) for k, held in enumerate([(), *held])]
        ranges.append((first, first + FRAMES - 1))
    return images, ranges


def write_folder(path, images):
    path.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(path / f"shot_{number:06d}.png"), image)


def write_video(path, images):
    """Write a video that loses nothing."""
    size = images[0].shape[::-1]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"FFV1"), 30, size, isColor=True)
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()


def write_list(path, ranges, labels):
    rows = [
        (k, *frames, *label) for k, (frames, label) in enumerate(zip(ranges, labels, strict=True))
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])


def label(press):
    return press.x, press.y, press.force


def beside(rows, presses):
    """How far from their places a table has presses, and the standard deviation, (n, 2) mm each."""
    names = [[f"{kind}_{axis}_mm" for axis in "xy"] for kind in ("found", "sigma")]
    found, sigma = (
        np.array([[float(row[c]) for c in columns] for row in rows]) for columns in names
    )
    return found - [label(press)[:2] for press in presses], sigma


@pytest.mark.slow
def test_presses_of_a_folder_are_found_where_they_were(
    in_process, small_settings, live_cache, tmp_path, rng
):
    """Press 5 shows no touch and is left out; of press 2 only the force is listed."""
    presses = drawn_presses(rng, 10)
    shown = [None if k == 5 else press for k, press in enumerate(presses)]
    images, ranges = images_of(rig.load("twin", SMALL), shown)
    write_folder(tmp_path / "frames", images)
    labels = [("", "", press.force) if k == 2 else label(press) for k, press in enumerate(presses)]
    write_list(tmp_path / "frames/presses.csv", ranges, labels)
    before = {path: path.read_bytes() for path in (tmp_path / "frames").iterdir()}
    call = ["collect", "twin", "--list=frames/presses.csv", "--images=frames", "--table=t.csv"]
    done = in_process(tmp_path, *call, "--json", *small_settings, cache=live_cache)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert "9 of 10 presses are taken" in done.stderr
    assert said["presses"] == 9
    assert ["press 5" in sentence for sentence in said["left_out"]] == [True]
    assert store.read_calibration(tmp_path / "twin.calibration.json").bench is not None
    rows = list(csv.DictReader((tmp_path / "t.csv").open()))
    off, sigma = beside(rows, [press for k, press in enumerate(presses) if k != 5])
    assert np.abs(off).max() < 5.0
    assert np.abs(off / sigma).max() < 4.0
    assert (rows[2]["x_mm"], rows[2]["y_mm"]) == ("", "")
    assert {path: path.read_bytes() for path in (tmp_path / "frames").iterdir()} == before


@pytest.mark.slow
def test_presses_of_a_video_correct_a_bench_without_its_own_numbers(
    in_process, live_cache, tmp_path, rng
):
    """A plate that is softer than its scene takes less for the same."""
    presses = drawn_presses(rng, 9)
    small = {key: value for key, value in SMALL.items() if key != "estimator.modes"}
    images, ranges = images_of(rig.load("twin-net", small | {"plate.young": "2.7 GPa"}), presses)
    write_video(tmp_path / "v.avi", images)
    write_list(tmp_path / "p.csv", ranges, map(label, presses))
    settings = [f"--set={key}={value}" for key, value in small.items()]
    settings += ['--set=source={kind="video", path="v.avi"}']
    call = ["collect", "twin-net", "--list=p.csv", "--table=t.csv", "--json", *settings]
    done = in_process(tmp_path, *call, cache=live_cache)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["presses"] == 9
    assert said["gain"] == pytest.approx(0.9, rel=0.02)
    rows = list(csv.DictReader((tmp_path / "t.csv").open()))
    off, sigma = beside(rows, presses)
    # Of one frame, and four are taken: half of it is left.
    assert 0.3 < np.std(off / sigma) < 1.0


@pytest.mark.parametrize("kind", ["folder", "files", "video", "recording"])
def test_no_press_is_asked_for_in_recorded_images(in_process, tmp_path, kind):
    call = ["collect", "twin", f'--set=source={{kind = "{kind}", path = "there"}}']
    done = in_process(tmp_path, *call)
    assert done.returncode
    assert ASKED in done.stderr
    assert not (tmp_path / "twin.presses").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--list=p.csv"], "give their folder or video with --images"),
        (["--list=p.csv", "--images=f", "--presses=9"], "leave out --presses and --record"),
        (["--list=p.csv", "--images=f", "--record=s.h5"], "leave out --presses and --record"),
        (["--list=p.csv", "--images=f"], "there is no folder or video 'f'"),
        (["--images=v.avi"], "is no folder to keep presses in"),
    ],
)
def test_what_does_not_go_together_is_refused_in_a_sentence(in_process, tmp_path, arguments, says):
    write_list(tmp_path / "p.csv", [(16, 19)], [(60.0, 50.0, 2.0)])
    (tmp_path / "v.avi").write_bytes(b"RIFF")
    done = in_process(tmp_path, "collect", "twin", *arguments)
    assert done.returncode
    assert says in " ".join(done.stderr.split())
    assert {path.name for path in tmp_path.iterdir()} <= {"p.csv", "v.avi", "cache"}
