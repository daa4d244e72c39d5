"""The page of a test in a real browser: from photographs to a curve, by pointer and by keys."""

import base64
import csv
import io
import re
from urllib.parse import urlsplit

import cv2
import h5py
import numpy as np
import pytest
from playwright.sync_api import expect, sync_playwright

import dic
from rig.series.frames import open_frames
from rig.series.regions import Extensometer, Regions, read_regions
from rig.series.run import FIELDS, run_series
from rig.series.tabulate import StrainOptions
from rig.view import ViewedTest, serve
from rig.view.viewed import SomeFrames
from rig.web.access import Access

pytestmark = pytest.mark.browser

WIDE, HIGH = 150, 110  # px of the photographs
STRETCH = 0.004  # a frame
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as play:
        chromium = play.chromium.launch(executable_path="/usr/bin/chromium", args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser):
    """Open a page that remembers complaints and every address that it asked for."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.complaints, page.asked = [], []
    page.on("console", lambda message: page.complaints.append(message.text))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    yield page
    context.close()


@pytest.fixture
def photos(photographs, tmp_path):
    """Serve the photographs; gives the address."""
    with (
        ViewedTest(open_frames(str(photographs)), None, tmp_path / "test") as test,
        serve(test) as address,
    ):
        yield address


@pytest.fixture
def looked_at(viewed):
    """Serve the result with its images; gives the address."""
    with serve(viewed) as address:
        yield address


def open_page(page, address):
    page.goto(address)
    expect(page.locator("body")).to_have_attribute("data-ready", "yes", timeout=120_000)


def on_image(page, x, y):
    """Place in the window of a place of the image, which is fitted into the canvas."""
    box = page.locator("#view-canvas").bounding_box()
    scale = min(box["width"] / WIDE, box["height"] / HIGH)
    left, top = box["width"] - WIDE * scale, box["height"] - HIGH * scale
    return (
        box["x"] + left / 2 + (x + 0.5) * scale,
        box["y"] + top / 2 + (y + 0.5) * scale,
    )


def click(page, x, y):
    page.mouse.click(*on_image(page, x, y))


def wait_for_strain(value, expected):
    """Wait until what is shown lies within 5 of its σ of `expected`, µε: answers come in turn."""
    value.page.wait_for_function(
        """([shown, expected]) => {
            const [, strain, sigma] = shown.textContent.match(/(-?\\d+) ± (\\d+) µε/) ?? [];
            return Math.abs(strain - expected) < 5 * sigma;
        }""",
        arg=[value.element_handle(), expected],
    )


def drag(page, start, end):
    page.mouse.move(*on_image(page, *start))
    page.mouse.down()
    page.mouse.move(*on_image(page, *end), steps=4)
    page.mouse.up()


def pixels(page):
    """Canvas of the image, (H, W, 3) RGB."""
    png = page.evaluate(
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame("
        "() => done(document.getElementById('view-canvas').toDataURL()))))"
    ).partition(",")[2]
    return cv2.imdecode(np.frombuffer(base64.b64decode(png), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def downloaded(page, name):
    """Click on a file; gives its name and what it holds."""
    with page.expect_download() as found:
        page.locator(f'[data-file="{name}"]').click()
    return found.value.suggested_filename, found.value.path().read_bytes()


def test_from_photographs_to_a_curve_a_table_and_an_image(page, photos, tmp_path):
    open_page(page, photos)
    expect(page.locator("#status")).to_contain_text("4 images")
    page.keyboard.press("r")
    for corner in ((15, 14), (134, 14), (134, 95), (15, 95)):
        click(page, *corner)
    page.keyboard.press("Enter")
    expect(page.locator("#expected")).to_contain_text("mpx")
    before = page.locator("#expected").inner_text()
    page.locator("#subset").fill("31")
    expect(page.locator("#expected")).not_to_have_text(before)
    page.locator("#subset").fill("21")
    with page.expect_download() as found:
        page.locator("#save-roi").click()
    (tmp_path / "roi.toml").write_bytes(found.value.path().read_bytes())
    (polygon,) = read_regions(tmp_path / "roi.toml").roi
    np.testing.assert_allclose(polygon.points[1], (134, 14), atol=0.6)
    page.locator("#correlate").click()
    expect(page.locator("body")).to_have_attribute("data-mode", "result", timeout=120_000)
    page.keyboard.press("e")
    drag(page, (35, 50), (115, 50))
    expect(page.locator("#marks output")).to_contain_text("µε")
    expect(page.locator("#lengths-card")).to_be_visible()
    name, table = downloaded(page, "readings.csv")
    rows = list(csv.DictReader(io.StringIO(table.decode())))
    assert name == "readings.csv"
    assert [row["frame"] for row in rows] == ["f1.png", "f2.png", "f3.png"]
    for n, row in enumerate(rows, start=1):
        assert abs(float(row["E1"]) - STRETCH * n) < 5 * float(row["sigma_E1"]) < 3e-3
    for name in ("field.png", "screen.png", "readings.png"):
        plot = cv2.imdecode(np.frombuffer(downloaded(page, name)[1], np.uint8), cv2.IMREAD_COLOR)
        assert plot.std() > 10, name
    assert page.complaints == []
    assert {urlsplit(url).hostname for url in page.asked if not url.startswith(("data:", "blob:"))
            } == {"127.0.0.1"}  # fmt: skip


def shows_line(page, colour, start, end):
    """Whether at a third of the places between two the canvas has a colour: lines are dashed."""
    image, box = pixels(page), page.locator("#view-canvas").bounding_box()
    x, y = np.linspace(on_image(page, *start), on_image(page, *end), 200)[20:-20].T
    at = image[np.rint(y - box["y"]).astype(int), np.rint(x - box["x"]).astype(int)]
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return (np.abs(at.astype(int) - wanted).max(axis=1) < 40).mean() > 1 / 3


def test_marks_are_drawn_before_a_correlation_where_they_were_set(page, photographs, tmp_path):
    regions = Regions(extensometer=[Extensometer(name="e", start=(30, 20), end=(120, 20))])
    test = ViewedTest(open_frames(str(photographs)), None, tmp_path / "test", regions)
    with test, serve(test) as address:
        open_page(page, address)
        page.keyboard.press("e")
        drag(page, (30, 90), (120, 96))
        expect(page.locator("#marks input")).to_have_count(2)
        colours = [
            "#" + "".join(f"{int(part):02x}" for part in re.findall(r"\d+", colour))
            for colour in page.locator("#marks i").evaluate_all(
                "dots => dots.map((dot) => dot.style.background)"
            )
        ]
        assert shows_line(page, colours[0], (30, 20), (120, 20))
        assert shows_line(page, colours[1], (30, 90), (120, 96))
        page.keyboard.press("r")
        page.mouse.move(*on_image(page, 75, 55))
        expect(page.locator("#probe")).to_contain_text("x 75.0")  # drawn after the marks
        expect(page.locator("#bar-title")).not_to_be_empty()
    assert page.complaints == []


def test_the_probe_reads_what_the_file_holds(page, looked_at, result):
    open_page(page, looked_at)
    page.keyboard.press("End")
    with h5py.File(result) as file:
        xs, ys = file["x"][:], file["y"][:]
        row, column = len(ys) // 2, len(xs) // 2
        value, sigma = (1e6 * file[name][2, row, column] for name in ("exx", "sigma_exx"))
    page.mouse.move(*on_image(page, xs[column], ys[row]))
    expect(page.locator("#probe")).to_contain_text("ok")
    text = page.locator("#probe").inner_text().replace("−", "-")
    shown = re.search(r"exx (-?\d+) ± (\d+) µε", text)
    assert abs(int(shown[1]) - value) <= 1
    assert abs(int(shown[2]) - sigma) <= 1


def test_keys_choose_frame_field_part_and_what_lies_under(page, looked_at):
    open_page(page, looked_at)
    body = page.locator("body")
    expect(body).to_have_attribute("data-frame", "2")
    seen = {"exx": pixels(page)}
    page.keyboard.press("Home")
    expect(body).to_have_attribute("data-frame", "0")
    seen["first"] = pixels(page)
    page.keyboard.press("ArrowRight")
    expect(body).to_have_attribute("data-frame", "1")
    page.keyboard.press("End")
    expect(body).to_have_attribute("data-frame", "2")
    page.keyboard.press("s")
    expect(page.locator("#bar-title")).to_have_text("Standard deviation of exx")
    seen["sigma"] = pixels(page)
    page.keyboard.press("s")
    page.keyboard.press("f")
    expect(page.locator("#bar-title")).to_have_text("Strain eyy")
    page.keyboard.press("Shift+f")
    expect(page.locator("#bar-title")).to_have_text("Strain exx")
    page.keyboard.press("d")
    expect(page.locator("[name=under][value=frame]")).to_be_checked()
    page.locator("#field").select_option("status")
    expect(page.locator("#legend")).to_contain_text("ok")
    seen["status"] = pixels(page)
    rows = min(len(image) for image in seen.values())  # a legend of two lines leaves less room
    images = [image[:rows] for image in seen.values()]
    for n, one in enumerate(images):
        for other in images[n + 1 :]:
            assert np.abs(one.astype(int) - other).mean() > 1
    page.keyboard.press("?")
    expect(page.locator("#keys")).to_be_visible()
    page.keyboard.press("Escape")
    page.locator("#field").select_option("u")
    page.locator("#low").fill("1")  # keys that are typed into a field do nothing else
    page.keyboard.press("p")
    expect(page.locator("[name=tool][value=look]")).to_be_checked()
    assert page.complaints == []


def test_marks_are_dragged_typed_and_removed(page, looked_at):
    open_page(page, looked_at)
    page.keyboard.press("p")
    click(page, 60, 50)
    expect(page.locator("#points-card")).to_be_visible()
    page.keyboard.press("l")
    drag(page, (30, 70), (120, 72))
    expect(page.locator("#lines-card")).to_be_visible()
    page.keyboard.press("e")
    drag(page, (40, 40), (100, 40))
    expect(page.locator("#marks li")).to_have_count(3)
    ends = page.locator("#marks li").nth(2).locator("input")
    first = ends.input_value()
    drag(page, (100, 40), (120, 60))
    expect(ends).not_to_have_value(first)
    value = page.locator("#marks li").nth(2).locator("output")
    wait_for_strain(value, 3e6 * STRETCH * 80**2 / (80**2 + 20**2))
    ends.fill("45, 50, 105, 50")
    ends.press("Enter")
    wait_for_strain(value, 3e6 * STRETCH)
    ends.fill("45, 50, 900, 50")
    ends.press("Enter")
    expect(value).not_to_contain_text("12")
    page.locator("#marks li span").nth(0).click()
    page.keyboard.press("Delete")
    expect(page.locator("#marks li")).to_have_count(2)
    expect(page.locator("#points-card")).to_be_hidden()
    assert page.complaints == []


def test_a_gauge_reads_the_mean_strain_of_its_rectangle(page, looked_at, result):
    open_page(page, looked_at)
    page.keyboard.press("g")
    drag(page, (40, 30), (110, 80))
    expect(page.locator("#gauges-card")).to_be_visible()
    expect(page.locator("#gauges-title")).to_contain_text("exx")
    value = page.locator("#marks output")
    wait_for_strain(value, 3e6 * STRETCH)
    rows = list(csv.DictReader(io.StringIO(downloaded(page, "readings.csv")[1].decode())))
    for n, row in enumerate(rows, start=1):
        assert abs(float(row["G1_exx"]) - STRETCH * n) < 5 * float(row["sigma_G1_exx"]) < 3e-3
    with h5py.File(result) as file:
        x, y = np.meshgrid(file["x"][:], file["y"][:])
        inside = (x >= 40) & (x <= 110) & (y >= 30) & (y <= 80)
        assert float(rows[2]["G1_exx"]) == pytest.approx(file["exx"][2][inside].mean(), abs=2e-6)
    page.keyboard.press("f")
    expect(page.locator("#gauges-title")).to_contain_text("eyy")
    wait_for_strain(value, 0.0)
    corners = page.locator("#marks input")
    first = corners.input_value()
    drag(page, (110, 80), (120, 90))
    expect(corners).not_to_have_value(first)
    page.keyboard.press("Enter")
    expect(corners.nth(1)).to_have_value("37.5, 27.5 → 112.5, 27.5 → 112.5, 82.5 → 37.5, 82.5")
    corners.nth(1).fill("50, 30, 90, 30, 70, 60")
    corners.nth(1).press("Enter")
    expect(corners.nth(1)).to_have_value("50, 30 → 90, 30 → 70, 60")
    assert page.complaints == []


def test_a_mark_is_set_by_keys_alone_and_frames_play(page, looked_at):
    open_page(page, looked_at)
    page.keyboard.press("e")
    page.keyboard.press("Enter")
    expect(page.locator("#marks input")).to_have_value("37.5, 55 → 112.5, 55")
    expect(page.locator("#marks output")).to_contain_text("µε")
    page.keyboard.press("Home")
    expect(page.locator("body")).to_have_attribute("data-frame", "0")
    page.keyboard.press(" ")
    expect(page.locator("#play")).to_have_text("Pause")
    expect(page.locator("body")).to_have_attribute("data-frame", "2")
    page.keyboard.press(" ")
    expect(page.locator("#play")).to_have_text("Play")
    assert page.complaints == []


def test_a_result_alone_has_no_form_and_no_roi(page, result, tmp_path):
    with ViewedTest(None, result, tmp_path / "test") as test, serve(test) as address:
        open_page(page, address)
        expect(page.locator("#setup")).to_be_hidden()
        expect(page.locator("#under")).to_be_hidden()
        expect(page.locator("#tool").get_by_text("ROI")).to_be_hidden()
        page.keyboard.press("r")
        expect(page.locator("[name=tool][value=look]")).to_be_checked()


def test_a_reference_of_several_stills_is_said(page, photographs, tmp_path):
    frames = open_frames(str(photographs))
    ref = dic.prepare_stills([frames.read(0), frames.read(0)], 21, 9)
    run_series(tmp_path, ref, SomeFrames(frames, (1,)), Regions(), StrainOptions())
    with ViewedTest(None, tmp_path / FIELDS, tmp_path / "test") as test, serve(test) as address:
        open_page(page, address)
        expect(page.locator("#status")).to_contain_text("reference of 2 stills, σ × 1.00")


def test_the_wheel_zooms_and_the_image_comes_back(page, looked_at):
    open_page(page, looked_at)
    whole = pixels(page)
    page.mouse.move(*on_image(page, 75, 55))
    page.mouse.wheel(0, -600)
    near = pixels(page)
    assert np.abs(whole.astype(int) - near).mean() > 5
    page.keyboard.press("0")
    page.mouse.move(5, 5)
    assert np.abs(whole.astype(int) - pixels(page)).mean() < 1


def test_a_roi_that_cannot_be_used_is_a_sentence_that_goes_again(page, photos):
    open_page(page, photos)
    page.locator("#subset").fill("30")
    expect(page.locator("#complaint")).to_contain_text("must be odd")
    expect(page.locator("#correlate")).to_be_disabled()
    page.locator("#subset").fill("21")
    expect(page.locator("#complaint")).to_be_hidden()
    page.locator("#tool").get_by_text("ROI").click()
    for corner in ((2, 2), (9, 2), (2, 9)):
        click(page, *corner)
    page.keyboard.press("Enter")
    expect(page.locator("#expected")).to_contain_text("0 of")
    expect(page.locator("#correlate")).to_be_disabled()
    page.locator("#clear-roi").click()
    expect(page.locator("#correlate")).to_be_enabled()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_both_schemes_and_a_phone_show_all_of_it(page, looked_at, scheme):
    page.emulate_media(color_scheme=scheme)
    open_page(page, looked_at)
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    level = np.mean([int(part) for part in re.findall(r"\d+", ground)[:3]])
    assert (level > 200) if scheme == "light" else (level < 60)
    assert page.evaluate("document.documentElement.scrollHeight <= innerHeight")
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.locator("#view-canvas").bounding_box()["height"] > 150


def test_names_are_text_and_a_frame_that_was_left_out_says_why(
    page, photographs, tmp_path, browser
):
    folder = tmp_path / "named"
    folder.mkdir()
    for n in (0, 1):
        (folder / f"f{n}.png").write_bytes((photographs / f"f{n}.png").read_bytes())
    (folder / "f2 <b>x<b>.png").write_bytes(b"no image")
    with ViewedTest(open_frames(str(folder)), None, tmp_path / "test") as test:
        with serve(test) as address:
            open_page(page, address)
            page.locator("#correlate").click()
            expect(page.locator("body")).to_have_attribute("data-mode", "result", timeout=120_000)
            page.keyboard.press("End")
            expect(page.locator("#notice")).to_contain_text("left out")
            expect(page.locator("#notice")).to_contain_text("f2 <b>x<b>.png is not an image")
            page.keyboard.press("Home")
            expect(page.locator("#notice")).to_be_hidden()
        page.keyboard.press("s")
        page.keyboard.press("f")
        expect(page.locator("#complaint")).to_contain_text("start touchplate view again")


def test_a_machine_with_other_users_needs_the_link(page, viewed):
    with serve(viewed, access=Access("secret", control=True, network=False, alone=False)) as link:
        assert page.goto(link.partition("?")[0]).status == 403
        open_page(page, link)
        assert "secret" not in page.url
        expect(page.locator("#status")).to_contain_text("fields.h5")
