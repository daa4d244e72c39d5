"""What the page is given: images and fields as they are, readings with σ, plain refusals."""

import json

import cv2
import h5py
import numpy as np
import pytest

import dic
from rig.view.viewed import ViewedTest, open_test
from rig.web.access import Access

STRETCH = 0.004  # a frame
ENDS = [30.0, 40.0, 120.0, 70.0]
ACROSS = {"name": "E1", "start": ENDS[:2], "end": ENDS[2:]}


def test_the_state_describes_frames_fields_and_points(viewed, client, result):
    state = client(viewed).get("/state").json()
    known = state["result"]
    assert [one["name"] for one in known["frames"]] == ["f1.png", "f2.png", "f3.png"]
    assert state["images"] == ["f0.png", "f1.png", "f2.png", "f3.png"]
    assert known["size"] == [150, 110]
    assert {one["name"] for one in known["fields"]} >= {"u", "exx", "von_mises", "status"}
    assert state["controls"]
    assert (known["settings"]["stills"], known["settings"]["scatter"]) == (1, [1.0, 1.0])
    with h5py.File(result) as file:
        assert (known["x"], known["y"]) == (file["x"][:].tolist(), file["y"][:].tolist())


def test_a_field_is_that_of_the_file_and_an_image_that_of_the_folder(viewed, client, result):
    ask = client(viewed)
    field = np.frombuffer(ask.get("/field", params={"name": "u", "frame": 2}).content, "<f4")
    with h5py.File(result) as file:
        np.testing.assert_array_equal(field, file["u"][2].ravel())
    for name, number in (("f2.png", 2), (None, 0)):
        given = ask.get("/image", params={} if name is None else {"name": name})
        seen = cv2.imdecode(np.frombuffer(given.content, np.uint8), cv2.IMREAD_GRAYSCALE)
        image = viewed.frames.read(number).astype(float)
        assert given.headers["x-size"] == "150,110"
        assert np.abs(seen - image).mean() < 3  # JPEG


def test_what_follows_from_fields_takes_them_as_they_are_kept(viewed):
    with viewed.result() as result:
        strain = result.field("exx", 1)
        result.field("exx", 1)[...] = 0.1
        result.field("eyy", 1)[...] = result.field("exy", 1)[...] = 0.0
        found = result.field("principal_1", 1)
    assert np.isfinite(strain).any()
    np.testing.assert_allclose(found, 0.1, rtol=1e-6)


def test_an_extensometer_reads_the_stretch_in_every_frame_and_in_one(viewed, client):
    ask = client(viewed)
    read = ask.post("/readings", content=json.dumps({"extensometer": [ACROSS]})).json()["E1"]
    along = np.array(ENDS[2:]) - ENDS[:2]
    truth = [np.hypot(along[0] * (1 + STRETCH * n), along[1]) for n in (1, 2, 3)]
    truth = np.array(truth) / np.hypot(*along) - 1
    assert (np.abs(np.array(read["values"]) - truth) < 4 * np.array(read["sigma"])).all()
    assert max(read["sigma"]) < 4e-4
    one = ask.post("/readings", content=json.dumps({"extensometer": [ACROSS], "frame": 1})).json()
    assert one["E1"]["values"] == read["values"][1:2]


def test_a_gauge_reads_the_strain_of_its_points_in_every_frame_and_in_one(viewed, client):
    ask = client(viewed)
    over = {"name": "G1", "points": [[40, 30], [110, 30], [110, 80], [40, 80]]}
    read = ask.post("/readings", content=json.dumps({"gauge": [over]})).json()
    for field, rate in (("exx", STRETCH), ("eyy", 0.0), ("principal_1", STRETCH)):
        found, sigma = (np.array(read[f"G1_{field}"][part]) for part in ("values", "sigma"))
        assert (np.abs(found - rate * np.arange(1, 4)) < 5 * sigma).all()
        assert (sigma < 5e-4).all()
    one = ask.post("/readings", content=json.dumps({"gauge": [over], "frame": 1})).json()
    assert one["G1_exx"]["values"] == read["G1_exx"]["values"][1:2]


def test_a_point_is_read_over_time_and_a_line_in_one_frame(viewed, client):
    ask = client(viewed)
    point = {"field": "u", "ends": [50.0, 60.0, 50.0, 60.0]}
    read = ask.post("/line", content=json.dumps(point)).json()
    truth = STRETCH * np.arange(1, 4) * (50.0 - 149 / 2)
    np.testing.assert_allclose(np.array(read["values"])[:, 0], truth, atol=0.05)
    line = {"field": "u", "ends": [30.0, 50.0, 120.0, 50.0], "frame": 2}
    read = ask.post("/line", content=json.dumps(line)).json()
    along = 30.0 + np.array(read["distance"])
    assert len(read["values"]) == 1
    np.testing.assert_allclose(read["values"][0], 3 * STRETCH * (along - 149 / 2), atol=0.06)
    assert all(0 < sigma < 0.1 for sigma in read["sigma"][0])


def test_what_is_seen_comes_as_files(viewed, client, result):
    ask = client(viewed)
    frame = ask.get("/files/frame.csv", params={"frame": 1})
    assert 'filename="frame-000001.csv"' in frame.headers["content-disposition"]
    head, *rows = frame.text.splitlines()
    table = np.array([row.split(",") for row in rows], dtype=float)
    with h5py.File(result) as file:
        np.testing.assert_allclose(table[:, head.split(",").index("v")], file["v"][1].ravel(), 1e-5)
    plot = ask.get("/files/field.png", params={"name": "exx", "frame": 1}).content
    assert cv2.imdecode(np.frombuffer(plot, np.uint8), cv2.IMREAD_COLOR).std() > 10
    lengths = {"asked": json.dumps({"extensometer": [ACROSS]})}
    readings = ask.get("/files/readings.csv", params=lengths).text.splitlines()
    assert readings[0] == "number,frame,E1,sigma_E1"
    assert len(readings) == 4
    assert ask.get("/files/readings.png", params=lengths).content.startswith(b"\x89PNG")
    asked = {"asked": json.dumps({"field": "exx", "ends": ENDS})}
    assert ask.get("/files/line.csv", params=asked).text.startswith("number,frame,x,y,distance_px")
    point = {"asked": json.dumps({"field": "exx", "ends": [60, 50, 60, 50]})}
    assert len(ask.get("/files/line.csv", params=point).text.splitlines()) == 4
    for params in (asked, point):
        assert ask.get("/files/line.png", params=params).content.startswith(b"\x89PNG")
    assert ask.get("/files/test.zip", params={"way": "npz"}).content.startswith(b"PK")


@pytest.mark.parametrize(
    ("path", "params", "word"),
    [
        ("/field", {"name": "nothing", "frame": 0}, "no field 'nothing'"),
        ("/field", {"name": "u", "frame": 3}, "frame 4 is not one of the 3"),
        ("/field", {"name": "u", "frame": "-1"}, "whole number"),
        ("/image", {"name": "../f0.png"}, "no image '../f0.png'"),
        ("/image", {"name": "/etc/passwd"}, "no image"),
        ("/limits", {}, "no field ''"),
        ("/files/field.png", {"name": "u", "frame": 0, "low": 2, "high": 1}, "limits must grow"),
        ("/files/field.png", {"name": "u", "frame": 0, "low": "x", "high": 1}, "must be a number"),
        ("/files/line.exe", {"asked": json.dumps({"field": "u", "ends": ENDS})}, "csv or png"),
        ("/files/line.csv", {"asked": "{"}, "correct it"),
        ("/files/readings.csv", {"asked": '{"extensometer": []}'}, "nothing to read, neither"),
        ("/files/test.zip", {"way": "exe"}, "not exported to 'exe'"),
    ],
)  # fmt: skip
def test_what_cannot_be_given_is_one_sentence(viewed, client, path, params, word):
    given = client(viewed).get(path, params=params)
    assert given.status_code == 400
    assert word in given.text
    assert "\n" not in given.text


@pytest.mark.parametrize(
    ("path", "body", "word"),
    [
        ("/line", {"field": "u", "ends": [900, 1, 950, 1]}, "misses all points"),
        ("/line", {"field": "u", "ends": [0, 0, 1]}, "correct it"),
        ("/readings", {}, "nothing to read, neither"),
        ("/readings", {"extensometer": [ACROSS, ACROSS]}, "needs a name of its own"),
        ("/preview", {"reference": "f0.png", "subset": 30}, "must be odd"),
        ("/preview", {"reference": "f0.png", "roi": [{"points": [[900, 0], [950, 0], [920, 90]]}]},
         "no pixel on the image"),
        ("/preview", {"reference": "f0.png", "roi": [{"points": [[1, 2]]}]}, "at least 3"),
        ("/preview", {"reference": "f0.png", "subset": 201}, "larger than the image"),
        ("/preview", {"reference": "f9.png"}, "no image 'f9.png'"),
        ("/correlate", {"reference": "f0.png", "roi": [{"points": [[0, 0], [8, 0], [0, 8]]}]},
         "no point can be measured"),
        ("/correlate", {"reference": "f0.png", "extensometer": [ACROSS, ACROSS]},
         "needs a name of its own"),
        ("/preview", {"reference": "f0.png", "step": "<b>"}, "step"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_one_sentence(viewed, client, path, body, word):
    given = client(viewed).post(path, content=json.dumps(body))
    assert given.status_code == 400
    assert word in given.text
    assert "\n" not in given.text


def test_a_number_that_is_none_and_what_is_no_json_are_refused(viewed, client):
    ask = client(viewed)
    for body in ('{"field": "u", "ends": [NaN, 0, 1, 1]}', "no json", "[]", b"\xff"):
        assert ask.post("/line", content=body).status_code == 400
    assert ask.post("/line", content=b"x" * (1 << 19)).status_code == 413


def test_other_pages_and_other_machines_stay_out_and_viewers_do_not_act(viewed, client):
    assert client(viewed).get("/state", headers={"origin": "http://evil.test"}).status_code == 403
    assert client(viewed).get("/state", headers={"host": "evil.test"}).status_code == 403
    assert client(viewed, peer="192.0.2.7").get("/state").status_code == 403
    assert client(viewed, Access("secret", alone=False)).get("/state").status_code == 403
    looks = client(viewed, Access("secret", control=False), peer="192.0.2.7")
    known = {"cookie": "touchplate-8765=secret"}
    assert looks.get("/state", headers=known).json()["controls"] is False
    assert looks.post("/correlate", headers=known, content="{}").status_code == 403


def test_every_answer_forbids_what_comes_from_outside(viewed, client):
    for path in ("/", "/app.js", "/state", "/shared/style.css", "/field?name=u&frame=0"):
        given = client(viewed).get(path)
        assert given.status_code == 200
        assert "default-src 'self'" in given.headers["content-security-policy"]


def test_a_damaged_frame_is_a_sentence_and_the_others_are_there(result, client, tmp_path):
    broken = tmp_path / "fields.h5"
    broken.write_bytes(result.read_bytes())
    with h5py.File(broken) as file:
        chunk = file["u"].id.get_chunk_info(1)
    with broken.open("r+b") as raw:
        raw.seek(chunk.byte_offset)
        raw.write(b"\x55" * chunk.size)
    with ViewedTest(None, broken, tmp_path / "test") as test:
        ask = client(test)
        bad = ask.get("/field", params={"name": "u", "frame": 1})
        assert bad.status_code == 400
        assert "damaged at frame 2" in bad.text
        assert ask.get("/field", params={"name": "u", "frame": 2}).status_code == 200


def test_what_cannot_be_opened_is_one_sentence(result, photographs, tmp_path):
    cut = tmp_path / "cut.h5"
    cut.write_bytes(result.read_bytes()[:-500])
    other = tmp_path / "other.h5"
    other.write_bytes(result.read_bytes())
    with h5py.File(other, "a") as file:
        file.attrs["version"] = 1
    (tmp_path / "empty").mkdir()
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "a.png").write_bytes((photographs / "f0.png").read_bytes())
    for what, frames, word in (
        (cut, None, "cut short"),
        (other, None, "has version 1"),
        (tmp_path / "none.h5", None, "does not exist"),
        (tmp_path / "empty", None, "holds no image"),
        (tmp_path / "one", None, "is one image"),
        (tmp_path / "no*.tif", None, "no image is called"),
        (result, str(tmp_path / "one"), "not among the 1 images"),
        (photographs, str(photographs), "is no result"),
    ):
        with pytest.raises((OSError, ValueError), match=word) as refusal:
            open_test(str(what), frames)
        assert "\n" not in str(refusal.value)


def test_the_folder_of_a_result_opens_it(result, tmp_path):
    with open_test(str(result.parent), out=tmp_path) as test, test.result() as opened:
        assert opened.path == result
        assert opened.fields[-1] == "status"
        stored = opened.frame(2)
    exx, eyy, exy = (stored[name].ravel().astype(float) for name in ("exx", "eyy", "exy"))
    turned = np.linalg.eigvalsh(np.moveaxis(np.array([[exx, exy], [exy, eyy]]), -1, 0))
    known = np.isfinite(exx)
    np.testing.assert_allclose(stored["principal_1"].ravel()[known], turned[known, 1], atol=1e-7)
    assert np.isnan(stored["principal_1"].ravel()[~known]).all()
    assert stored["status"].max() <= max(dic.Status)
