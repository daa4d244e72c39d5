"""A correlation that a page starts: what it expects, what it writes, and how it is stopped."""

import json
import sys
import threading

import numpy as np
import pytest

import dic
from rig import cli
from rig.series.frames import open_frames
from rig.view import correlation
from rig.view.asked import AskedSettings
from rig.view.preview import preview
from rig.view.viewed import ViewedTest

CORNERS = [[20, 15], [130, 18], [128, 95], [22, 92]]
ASKED = {
    "reference": "f0.png",
    "subset": 21,
    "step": 7,
    "roi": [{"points": CORNERS}],
    "extensometer": [{"name": "E1", "start": [40, 50], "end": [110, 52]}],
    "gauge": [{"name": "G1", "points": [[40, 30], [110, 30], [110, 80], [40, 80]]}],
}


@pytest.fixture
def images(photographs, tmp_path):
    """Open the photographs, with a folder for their result."""
    with ViewedTest(open_frames(str(photographs)), None, tmp_path / "test") as test:
        yield test


def finished(test):
    """Wait for the end of a correlation."""
    for thread in threading.enumerate():
        if thread.name == "correlation":
            thread.join()
    return test.job.state


def test_a_preview_says_which_points_are_measured_and_how_well(images):
    asked = AskedSettings.model_validate(ASKED)
    expected = preview(images, asked)
    first, second = (images.image(f"f{n}.png") for n in (0, 1))
    ref = correlation.prepared(images, asked)
    found = dic.correlate(ref, second)
    eps = dic.strain(found, 5)
    assert expected.grid.shape == ref.grid.shape
    assert first.shape == (110, 150)
    assert 0.9 < found.valid.sum() / expected.measured <= 1
    middle, high = expected.levels
    stated = np.maximum(found.sigma_u, found.sigma_v)[found.valid]
    assert 0.8 < middle / np.median(stated) < 1.2
    assert 0.7 < high / np.percentile(stated, 95) < 1.4
    strain = np.nanmedian(eps.sigma[eps.valid].max(axis=1))
    assert 0.75 < expected.strain_sigma / strain < 1.25
    assert expected.gauge_length == eps.vsg


def test_a_preview_says_the_noise_and_what_the_images_pass_first(images, client):
    reason = client(images).post("/preview", content=json.dumps(ASKED)).json()["reason"]
    noise, prefilter = reason.split("; ")
    assert noise.startswith("noise ")
    assert "prefilter" in prefilter or "Gaussian" in prefilter
    assert "px is predicted" in prefilter


def test_settings_are_recommended_for_the_pattern(images, client):
    advice = client(images).get("/recommend", params={"reference": "f0.png"}).json()
    known = dic.recommend_settings(images.image("f0.png"), 1.5)
    assert abs(advice["subset"] - known.subset) <= 4
    assert advice["speckle"] == pytest.approx(known.speckle)


def test_the_page_writes_the_bytes_that_the_command_writes(
    images, client, photographs, tmp_path, monkeypatch
):
    ask = client(images)
    assert ask.get("/state").json()["result"] is None
    assert ask.post("/correlate", content=json.dumps(ASKED)).json()["running"]
    state = finished(images)
    assert (state.error, state.results, state.done) == ("", 1, 3)
    assert [one["name"] for one in ask.get("/state").json()["result"]["frames"]] == [
        "f1.png", "f2.png", "f3.png",
    ]  # fmt: skip
    own = tmp_path / "test"
    words = ["correlate", photographs / "f0.png", f"{photographs}/f[123].png", "--step", "7",
             "--regions", own / "regions.toml", "--out", tmp_path / "command"]  # fmt: skip
    monkeypatch.setattr(sys, "argv", ["touchplate", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    for name in ("fields.h5", "fields.xdmf", "readings.csv"):
        assert (own / name).read_bytes() == (tmp_path / "command" / name).read_bytes(), name


def test_a_scale_makes_lengths_those_of_the_object(images, client):
    ask = client(images)
    scaled = json.dumps(ASKED | {"scale": "20,50,120,50=50 mm"})
    assert ask.post("/correlate", content=scaled).status_code == 200
    finished(images)
    described = ask.get("/state").json()["result"]
    assert described["length"] == "mm"
    assert described["settings"]["mm_per_px"] == pytest.approx(0.5)
    line = {"field": "u_mm", "ends": [40.0, 50.0, 100.0, 50.0], "frame": 0}
    read = ask.post("/line", content=json.dumps(line)).json()
    assert read["distance"][-1] == pytest.approx(30.0)
    wrong = ask.post("/correlate", content=json.dumps(ASKED | {"scale": "100 mm"}))
    assert wrong.status_code == 400
    assert "two points" in wrong.text


def test_a_second_correlation_has_a_folder_of_its_own_and_the_first_stays(images, client, tmp_path):
    ask = client(images)
    ask.post("/correlate", content=json.dumps(ASKED))
    finished(images)
    kept = (tmp_path / "test" / "fields.h5").read_bytes()
    ask.post("/correlate", content=json.dumps(ASKED | {"subset": 31}))
    assert finished(images).results == 2
    assert (tmp_path / "test" / "fields.h5").read_bytes() == kept
    with images.result() as result:
        assert result.path == tmp_path / "test-2" / "fields.h5"
        assert result.grid.subset == 31


def test_what_was_stopped_goes_on_with_the_same_settings_and_no_others(
    images, client, tmp_path, monkeypatch
):
    ask, reached = client(images), threading.Event()
    usual = correlation.run_series

    def held(folder, ref, frames, regions, strain, report):
        def once(done, total):
            if done:
                reached.set()
                images.job.stopping.wait()
            report(done, total)

        return usual(folder, ref, frames, regions, strain, workers=1, report=once)

    monkeypatch.setattr(correlation, "run_series", held)
    ask.post("/correlate", content=json.dumps(ASKED))
    reached.wait()
    assert ask.post("/correlate", content=json.dumps(ASKED)).status_code == 400
    assert "stopped" in ask.post("/stop").json()["error"]
    assert not (tmp_path / "test" / "fields.h5").exists()
    monkeypatch.setattr(correlation, "run_series", usual)
    ask.post("/correlate", content=json.dumps(ASKED | {"step": 9}))
    finished(images)
    assert (tmp_path / "test-2" / "fields.h5").exists()
    ask.post("/correlate", content=json.dumps(ASKED))
    finished(images)
    assert (tmp_path / "test" / "fields.h5").exists()
    assert not (tmp_path / "test" / "parts").exists()


def test_a_correlation_that_fails_says_why_and_the_page_stays(images, client, monkeypatch):
    def full(*about, **more):
        raise OSError("the disk is full;\n make room")

    monkeypatch.setattr(correlation, "run_series", full)
    ask = client(images)
    ask.post("/correlate", content=json.dumps(ASKED))
    state = finished(images)
    assert (state.error, state.results) == ("the disk is full; make room", 0)
    assert ask.get("/state").json()["result"] is None
