"""The page in a real browser: what the operator sees follows the stream and the choices made."""

import base64
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import count
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect, sync_playwright

from models import Tap
from rig.calibration.guide import Progress
from rig.live.gestures import Gesture
from rig.live.learned import Learned
from rig.live.snapshot import Alarm, BaseReading, Mark, Sign, StableShape
from rig.page import serve
from rig.page.controls import (
    Measured,
    PageControls,
    PageSetting,
    Played,
    Recording,
    Recordings,
    Wizard,
)
from rig.projector.markers import fit_plate
from rig.web.access import Access

pytestmark = pytest.mark.browser

SCREEN = fit_plate((640, 400), (254.0, 200.0))
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as play:
        chromium = play.chromium.launch(executable_path="/usr/bin/chromium", args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser):
    """Open a page that remembers complaints and what it asked for; it may never throw."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.complaints, page.asked, thrown = [], [], []
    page.on("console", lambda message: page.complaints.append(message.text))
    page.on("pageerror", lambda error: thrown.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("websocket", lambda ws: page.asked.append(ws.url))
    yield page
    context.close()
    assert thrown == []


@contextmanager
def feed(publisher, draw):
    """Publish draw(0), draw(1), ... about 20 times a second while the block runs."""
    stop = threading.Event()

    def run():
        for sequence in count():
            publisher.publish(draw(sequence))
            if stop.wait(0.05):
                return

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def pixels(page):
    """Canvas of the image, (H, W, 3) RGB."""
    png = page.evaluate("document.getElementById('view-canvas').toDataURL()").partition(",")[2]
    return cv2.imdecode(np.frombuffer(base64.b64decode(png), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def open_live(page, publisher):
    page.goto(publisher.url)
    expect(page.locator("#link")).to_have_text("live")


def still(snapshot, **changes):
    """Publish one frame again and again, so that only choices change the image."""
    shot = snapshot(3, **changes)
    return lambda sequence: snapshot(3, **changes) if sequence else shot


def test_a_bent_plate_has_a_card_of_its_base(page, snapshot):
    shapes = (
        StableShape("up", 12.5, "STABLE", shown=True),
        StableShape("down", 12.5, "NEAR_LIMIT", shown=False),
    )
    numbers = 6.0, -8.0, 1e-3, 2e-3, 0.4, "STABLE", "FOUND"
    base = BaseReading(*numbers, shapes, all_sought=True)
    with serve(0, SCREEN) as publisher, feed(publisher, partial(snapshot, base=base)):
        open_live(page, publisher)
        expect(page.locator("#bend")).to_have_text("6.000 ± 0.0010 mm")
        expect(page.locator("#twist")).to_have_text("-8.000 ± 0.0020°")
        expect(page.locator("#shapes tr")).to_have_count(2)
        expect(page.locator("#shapes tr").first).to_have_text("▸ up12.5 N mm")
        expect(page.locator("#shapes tr").last).to_contain_text("cannot be known: near a limit")
    assert page.complaints == []


def test_bounds_of_a_force_and_a_tap_are_shown(page, snapshot):
    mark = Mark(12.0, 20.0, 1.5, (1.1, 0.7, 0.4), 0.03, force_interval=(1.25, float("inf")))
    taps = (
        Tap(10.0, 20.0, 4.5, 3.0, 99.5, (0.5, 0.25, 0.12)),
        Tap(10.0, 20.0, float("nan"), 1.5, 99.8, (0.5, 0.25, 9.0)),
    )
    draw = partial(snapshot, touches=(mark,), from_strain=None, truth=None)
    for recent, says in ((taps[:1], "tap 4.50 ± 0.12 N"), (taps, "tap above 1.50 N")):
        with serve(0, SCREEN) as publisher, feed(publisher, partial(draw, recent_taps=recent)):
            open_live(page, publisher)
            expect(page.locator("#touches tr")).to_contain_text("1.5001.25 … ∞")
            expect(page.locator("#status")).to_have_text(f"two touches · {says}")
    assert page.complaints == []


def test_a_frame_fills_every_part_of_the_page(page, snapshot):
    with serve(0, SCREEN) as publisher, feed(publisher, snapshot):
        open_live(page, publisher)
        expect(page.locator("#touches tr")).to_have_count(6)
        expect(page.locator("#touches")).to_contain_text("± 0.03")
        expect(page.locator("#status")).to_have_text("two touches")
        expect(page.locator("#fps")).to_have_text("29.7")
        expect(page.locator("#dropped")).to_have_text("3")
        expect(page.locator("#position-median")).to_have_text("0.79")
        expect(page.locator("#force-median")).to_have_text("0.031")
        expect(page.locator("#stages tr")).to_have_count(5)
        expect(page.locator("#base")).to_be_hidden()
        expect(page.locator("#signs div")).to_have_count(2)
        expect(page.locator("#signs .warning")).to_have_text("noise▲ <b>9</b> gl")
        expect(page.locator("#stages tr").last).to_contain_text("9.413.1")
        expect(page.locator("#page-fps")).not_to_have_text("–")
        assert pixels(page).std() > 20
    assert page.complaints == []
    assert {urlsplit(url).hostname for url in page.asked if not url.startswith("data:")} == {
        "127.0.0.1"
    }


@pytest.mark.slow
def test_the_component_changes_map_and_bar_by_click_and_by_key(page, snapshot):
    with serve(0) as publisher, feed(publisher, still(snapshot)):
        open_live(page, publisher)
        expect(page.locator("#bar-high")).to_contain_text("µε")
        seen = {}
        for key, value in (("0", "none"), ("1", "exx"), ("y", "eyy"), ("3", "exy")):
            page.keyboard.press(key)
            expect(page.locator(f"[name=component][value={value}]")).to_be_checked()
            page.wait_for_timeout(300)
            seen[value] = pixels(page).astype(int)
        page.locator("label", has=page.locator("[value=eyy]")).click()
        page.wait_for_timeout(300)
        assert (pixels(page) == seen["eyy"]).all()
    for one, other in (("none", "exx"), ("exx", "eyy"), ("eyy", "exy")):
        assert (np.abs(seen[one] - seen[other]).max(-1) > 8).mean() > 0.1
    grey = np.abs(np.diff(seen["none"], axis=-1)).max(-1) < 8
    assert grey.mean() > 0.9  # with the map off only marks are coloured


def test_every_key_chooses_its_component(page, snapshot):
    with serve(0) as publisher, feed(publisher, still(snapshot)):
        open_live(page, publisher)
        expect(page.locator("#bar-high")).to_contain_text("µε")
        keys = {"s": "exy", "x": "exx", "y": "eyy", "0": "none", "3": "exy", "1": "exx", "2": "eyy"}
        for key, value in keys.items():
            page.keyboard.press(key)
            expect(page.locator(f"[name=component][value={value}]")).to_be_checked()


def test_strain_is_blue_where_negative_and_red_where_positive(page, snapshot):
    shot = snapshot(3, truth=None, touches=(), from_strain=())
    maps = [np.full_like(shot.strain.exx, sign * 2e-4) for sign in (1, -1, 0)]
    grid = type(shot.strain)(shot.strain.xs, shot.strain.ys, *maps, (1e-5, 1e-5, 1e-5))
    with serve(0) as publisher, feed(publisher, still(snapshot, strain=grid)):
        open_live(page, publisher)
        for key, side in (("1", 1), ("2", -1), ("3", 0)):
            page.keyboard.press(key)
            page.wait_for_timeout(300)
            red, _, blue = pixels(page).astype(float).mean((0, 1))
            assert np.sign(round((red - blue) / 20)) == side


def test_touches_are_drawn_where_the_homography_puts_them(page, snapshot):
    with serve(0) as publisher, feed(publisher, still(snapshot, truth=None, from_strain=())):
        open_live(page, publisher)
        page.keyboard.press("0")
        page.wait_for_timeout(300)
        seen, shot = pixels(page).astype(int), snapshot(3)
        scale = seen.shape[1] / shot.image.shape[1]
        for mark in shot.touches:
            x, y, w = shot.T_px_plate @ (mark.x, mark.y, 1)
            column, row = np.rint((np.array([x / w, y / w]) + 0.5) * scale).astype(int)
            red, green, blue = seen[row, column]
            assert green > 200
            assert green - red > 100
            assert blue > 100


def test_without_strain_the_choice_is_off_and_says_why(page, snapshot):
    with serve(0) as publisher, feed(publisher, still(snapshot, with_strain=False, truth=None)):
        open_live(page, publisher)
        expect(page.locator("#bar-note")).to_have_text(
            "No strain map: the scene asks for no strain"
        )
        expect(page.locator("[value=eyy]")).to_be_disabled()
        expect(page.locator("[value=projector]")).to_be_disabled()
        expect(page.locator("#touches")).not_to_contain_text("True")
    assert page.complaints == []


def test_the_projector_view_shows_the_projector_image(page, snapshot):
    with serve(0, SCREEN) as publisher, feed(publisher, snapshot):
        open_live(page, publisher)
        expect(page.locator("[value=projector]")).to_be_enabled()
        page.keyboard.press("p")
        page.wait_for_timeout(500)
        seen = pixels(page)
        assert seen.shape[1] / seen.shape[0] == pytest.approx(1.6, abs=0.01)
        assert (seen.max(-1) < 30).mean() > 0.8
        assert seen.max() > 60


def test_a_loop_that_gets_ready_says_for_what(page, snapshot):
    with serve(port=0) as publisher:
        page.goto(publisher.url)
        publisher.publish(snapshot(0, status="getting ready: one touch (1 of 7)", fresh=False))
        expect(page.locator("#link")).to_have_text("getting ready", timeout=60_000)
        expect(page.locator("#notice")).to_contain_text("getting ready: one touch (1 of 7), for")
        publisher.publish(snapshot(1))
        expect(page.locator("#link")).to_have_text("live")
        expect(page.locator("#notice")).to_be_hidden()


def test_a_stopped_stream_is_said_and_the_page_comes_back(page, snapshot):
    with serve(0) as publisher:
        port = publisher.port
        with feed(publisher, snapshot):
            open_live(page, publisher)
        expect(page.locator("#link")).to_have_text("no new frames")
        expect(page.locator("#notice")).to_contain_text("stands still")
    expect(page.locator("#notice")).to_contain_text("The loop has stopped")
    expect(page.locator("#link")).to_have_text("disconnected")
    with serve(port) as publisher, feed(publisher, snapshot):
        expect(page.locator("#link")).to_have_text("live", timeout=60_000)
        expect(page.locator("#notice")).to_be_hidden()


@pytest.mark.parametrize(("width", "height"), [(390, 844), (820, 1180), (1440, 900)])
def test_nothing_is_wider_than_the_window(page, snapshot, width, height):
    page.set_viewport_size({"width": width, "height": height})
    with serve(0, SCREEN) as publisher, feed(publisher, snapshot):
        open_live(page, publisher)
        page.wait_for_timeout(300)
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(("width", "height", "lowest"), [(390, 844, 44), (1440, 900, 36)])
def test_every_control_is_high_enough_for_a_finger(page, snapshot, width, height, lowest):
    page.set_viewport_size({"width": width, "height": height})
    shown = replace(CONTROLS_SHOWN, played=Played(2.5, 10.0, True), wizard=GUIDED.wizard)
    learned = Learned(3, 0, 0, 0, 0.02, None)
    with serve(0) as publisher, feed(Beside(publisher, shown), still(snapshot, learned=learned)):
        open_live(page, publisher)
        expect(page.locator("#wizard-views button")).to_be_visible()
        heights = page.evaluate(
            """() => [...document.querySelectorAll(
                "button, select, input[type=range], input[type=number], .choice label"
            )].filter((each) => each.offsetParent)
            .map((each) => [each.id || each.textContent.trim(), each.offsetHeight])"""
        )
    assert {"opacity", "seek", "record", "weight"} <= {name for name, _ in heights}
    assert [(name, high) for name, high in heights if high < lowest] == []


def test_the_page_says_how_far_the_learning_has_come(page, snapshot):
    learned = Learned(3, 2, 0, 1, 0.0213, None)
    with serve(0) as publisher, feed(publisher, still(snapshot, learned=learned)):
        open_live(page, publisher)
        expect(page.locator("#learned")).to_have_text(
            "learned from 3 touches, 2 more gathered, 1 of known weight, forces known to 2.1 %"
        )


def test_all_cards_of_a_flat_plate_are_seen_at_once_on_a_laptop(page, snapshot):
    stages = tuple((f"stage {number}", 1.0 * number, 2.0 * number) for number in range(7))
    signs = tuple(Sign(f"sign {number}", "good", warns=False) for number in range(6))
    with serve(0) as publisher, feed(publisher, still(snapshot, stages=stages, signs=signs)):
        open_live(page, publisher)
        expect(page.locator("#stages tr")).to_have_count(8)
        stages = page.locator("#stages")
        assert stages.evaluate("table => table.getBoundingClientRect().bottom") <= 900
        assert page.evaluate("document.getElementById('chart').clientHeight") >= 70
        aside = page.locator("aside")
        assert aside.evaluate("cards => cards.scrollHeight <= cards.clientHeight")


def test_the_colour_bar_is_seen_below_a_recording_that_is_played(page, snapshot):
    page.set_viewport_size({"width": 1280, "height": 800})
    with serve(0) as publisher, feed(beside := Beside(publisher, PageControls()), snapshot):
        open_live(page, publisher)
        beside.shown = PageControls(played=Played(2.5, 10.0, True))
        expect(page.locator("#played")).to_be_visible()
        expect(page.locator("#bar-low")).to_be_in_viewport(ratio=1.0)


def test_alarms_stand_out_among_the_notes(page, snapshot):
    shown = PageControls(notes=("lift it", "the disk is nearly full"))
    with (
        serve(0) as publisher,
        feed(Beside(publisher, shown), partial(snapshot, alarms=(Alarm("force", 1.0, "lift it"),))),
    ):
        open_live(page, publisher)
        expect(page.locator("#notes li")).to_have_count(2)
        expect(page.locator("#notes .alarm")).to_have_text("lift it")


def test_a_status_is_text_and_never_markup(page, snapshot):
    with (
        serve(0) as publisher,
        feed(publisher, still(snapshot, status="<img src=x onerror=alert(1)>")),
    ):
        open_live(page, publisher)
        expect(page.locator("#status")).to_have_text("<img src=x onerror=alert(1)>")


CONTROLS_SHOWN = PageControls(
    ("the disk is nearly full",),
    Recording(False, "nothing is recorded", 0, 0),
    (PageSetting("projector.mode", "Marks", "beside", ("on", "beside")),),
    (Measured("pose", 3, 0.081, "mm"), Measured("latency", 0, 0.0021, "s")),
    table="",
)
GUIDED = PageControls(
    wizard=Wizard("camera", Progress("hold it still", 6, 10, 0.083, ((4, "80 corners"),)), "mm")
)


def with_controls(publisher, snapshot, page_controls):
    """Publish one frame again and again, and what stands beside it."""
    return feed(Beside(publisher, page_controls), still(snapshot))


class Beside:
    def __init__(self, publisher, shown):
        self._publisher, self.shown = publisher, shown

    def publish(self, snapshot):
        self._publisher.publish(snapshot, self.shown)


def wait_for_wish(publisher):
    end = time.monotonic() + 10
    while not (wishes := list(publisher.asked())):
        assert time.monotonic() < end, "nothing was asked for"
        time.sleep(0.02)
    return wishes


def test_notes_settings_and_calibration_are_shown_and_what_is_chosen_is_asked_for(page, snapshot):
    with serve(0) as publisher, with_controls(publisher, snapshot, CONTROLS_SHOWN):
        open_live(page, publisher)
        expect(page.locator("#notes")).to_have_text("the disk is nearly full")
        expect(page.locator("#calibration tr").first).to_contain_text("3 days old± 0.081 mm")
        expect(page.locator("#calibration tr").last).to_contain_text("today± 2.1 ms")
        page.get_by_role("button", name="Record").click()
        assert wait_for_wish(publisher) == [{"do": "record"}]
        page.keyboard.press("r")
        assert wait_for_wish(publisher) == [{"do": "record"}]
        page.get_by_role("button", name="Tare").click()
        assert wait_for_wish(publisher) == [{"do": "tare"}]
        page.keyboard.press("t")
        assert wait_for_wish(publisher) == [{"do": "tare"}]
        page.get_by_role("button", name="Snapshot").click()
        assert wait_for_wish(publisher) == [{"do": "snapshot"}]
        page.keyboard.press("f")
        assert wait_for_wish(publisher) == [{"do": "snapshot"}]
        page.get_by_role("button", name="CSV").click()
        assert wait_for_wish(publisher) == [{"do": "csv"}]
        expect(page.locator("#played")).to_be_hidden()
        page.get_by_label("Marks").select_option("on")
        assert wait_for_wish(publisher) == [{"do": "set", "key": "projector.mode", "value": "on"}]
        expect(page.locator("#wizard")).to_be_hidden()
    assert page.complaints == []


def test_a_recording_is_paused_sought_and_changed(page, snapshot):
    choice = PageSetting("recording", "Recording", "a.h5", ("a.h5", "b.h5"))
    shown = PageControls(settings=(choice,), played=Played(2.5, 10.0, True))
    with serve(0) as publisher, with_controls(publisher, snapshot, shown):
        open_live(page, publisher)
        expect(page.locator("#played-at")).to_have_text("2.5 of 10.0 s")
        expect(page.locator("#recording")).to_be_hidden()
        page.get_by_role("button", name="Pause").click()
        assert wait_for_wish(publisher) == [{"do": "play"}]
        page.locator("#view-canvas").click()
        page.evaluate("document.activeElement.blur()")
        page.keyboard.press("Space")
        assert wait_for_wish(publisher) == [{"do": "play"}]
        page.get_by_label("Place in the recording").evaluate(
            "seek => { seek.value = 7.5; seek.dispatchEvent(new Event('input')); }"
        )
        assert wait_for_wish(publisher) == [{"do": "seek", "to": 7.5}]
        page.locator("select[name=recording]").select_option("b.h5")
        assert wait_for_wish(publisher) == [{"do": "set", "key": "recording", "value": "b.h5"}]
    assert page.complaints == []


def test_the_wizard_says_what_to_do_and_a_view_can_be_dropped(page, snapshot):
    with serve(0) as publisher, with_controls(publisher, snapshot, GUIDED):
        open_live(page, publisher)
        expect(page.locator("#wizard-say")).to_have_text("hold it still")
        expect(page.locator("#wizard")).to_contain_text("6 of 10 · error 0.083 mm")
        page.get_by_role("button", name="Drop view 4").click()
        assert wait_for_wish(publisher) == [{"do": "drop", "view": 4}]


def test_who_may_only_look_finds_the_controls_off(browser, snapshot):
    with (
        serve(0, access=Access("token")) as publisher,
        with_controls(publisher, snapshot, CONTROLS_SHOWN),
    ):
        context = browser.new_context()
        page = context.new_page()
        name = f"http://bench.localhost:{publisher.port}"  # resolves here, and is no own name
        page.goto(f"{name}/?token=token")
        expect(page.locator("#link")).to_have_text("live")
        expect(page.get_by_role("button", name="Record")).to_be_disabled()
        expect(page.get_by_label("Marks")).to_be_disabled()
        page.keyboard.press("r")
        page.wait_for_timeout(200)
        assert list(publisher.asked()) == []
        context.close()


def test_a_mark_lies_in_the_middle_of_its_pixel(page, snapshot):
    # So few pixels that half of one is many of the canvas.
    T = np.array([[0.1, 0.0, 2.0], [0.0, -0.1, 20.0], [0.0, 0.0, 1.0]])
    few = {
        "image": np.full((24, 30), 90, np.uint8),
        "T_px_plate": T,
        "plate_outline": np.array([[2.0, 20.0], [27.4, 20.0], [27.4, 0.0], [2.0, 0.0]]),
        "touches": (Mark(100.0, 80.0, 4.0),),
        "from_strain": (),
        "truth": None,
    }
    with (
        serve(0) as publisher,
        feed(publisher, still(snapshot, with_strain=False, **few)),
    ):
        open_live(page, publisher)
        expect(page.locator("#touches")).to_contain_text("100.0")
        image = pixels(page).astype(int)
    scale = image.shape[1] / 30
    green = np.abs(image - (0x1F, 0xE3, 0xBB)).max(axis=-1) < 24
    rows, columns = np.nonzero(green)
    middle = np.array([columns.min() + columns.max(), rows.min() + rows.max()]) / 2 / scale
    assert middle == pytest.approx([12.0 + 0.5, 12.0 + 0.5], abs=0.2)


def chart_dots(page):
    """Rows of the chart's dots over its height, from the top, of the newest two seconds."""
    png = page.evaluate("document.getElementById('chart').toDataURL()").partition(",")[2]
    drawn = cv2.imdecode(np.frombuffer(base64.b64decode(png), np.uint8), cv2.IMREAD_UNCHANGED)
    _, green, red, alpha = np.moveaxis(drawn.astype(int), -1, 0)
    rows, columns = np.nonzero((alpha > 200) & (green - red > 60))
    return rows[columns > 0.85 * drawn.shape[1]] / drawn.shape[0]


def moving(snapshot, **changes):
    """Publish frames that differ in their time alone."""
    return lambda sequence: snapshot(3, captured=100.0 + sequence / 20, **changes)


def test_the_chart_shows_force_or_place(page, snapshot):
    touches = (Mark(254.0 / 4, 200.0 * 3 / 4, 3.0, identity=1),)
    with serve(0) as publisher, feed(publisher, moving(snapshot, touches=touches, truth=None)):
        open_live(page, publisher)
        seen = {}
        for quantity, unit in (("force", "N"), ("x", "mm"), ("y", "mm")):
            page.locator("#quantity").select_option(quantity)
            expect(page.locator("#chart-unit")).to_have_text(unit)
            page.wait_for_timeout(300)
            seen[quantity] = np.median(chart_dots(page))
        high = page.evaluate("document.getElementById('chart').clientHeight")
    fraction = {name: (1 - row - 18 / high) * high / (high - 26) for name, row in seen.items()}
    assert fraction["force"] == pytest.approx(1.0, abs=0.05)
    assert fraction["x"] == pytest.approx(0.25, abs=0.05)
    assert fraction["y"] == pytest.approx(0.75, abs=0.05)
    assert page.complaints == []


@pytest.mark.slow
def test_the_chart_shows_the_strain_at_the_point_that_is_pinned(page, snapshot):
    shot = snapshot(3, truth=None, touches=(), from_strain=())
    columns = np.linspace(-1e-4, 1e-4, shot.strain.exx.shape[1], dtype=np.float32)
    exx = np.broadcast_to(columns, shot.strain.exx.shape).copy()
    grid = type(shot.strain)(shot.strain.xs, shot.strain.ys, exx, 0 * exx, 0 * exx, (0.0, 0.0, 0.0))
    changes = {"strain": grid, "truth": None, "touches": (), "from_strain": ()}
    with serve(0) as publisher, feed(publisher, moving(snapshot, **changes)):
        open_live(page, publisher)
        page.locator("#quantity").select_option("strain")
        expect(page.locator("#chart-note")).to_contain_text("click on the plate to pin a point")
        canvas = page.locator("#view-canvas")
        box = canvas.bounding_box()
        seen = {}
        for key, part in (("1", 0.25), ("1", 0.75), ("0", 0.75), ("2", 0.75)):
            page.keyboard.press(key)
            canvas.click(position={"x": part * box["width"], "y": 0.5 * box["height"]})
            expect(page.locator("#chart-note")).to_contain_text("mm")
            page.wait_for_timeout(700)
            seen[key, part] = np.median(chart_dots(page))
        canvas.click(position={"x": 2, "y": 2})
        expect(page.locator("#chart-note")).to_contain_text("click on the plate")
    zero = seen["2", 0.75]
    assert seen["1", 0.25] > zero + 0.1
    assert seen["1", 0.75] < zero - 0.1
    assert seen["0", 0.75] == pytest.approx(seen["1", 0.75], abs=0.02)  # the map is off, not it
    assert page.complaints == []


def test_a_gesture_is_written_where_it_happened(page, snapshot):
    quiet = {"touches": (), "truth": None, "from_strain": (), "with_strain": False}
    quiet["image"] = np.full((520, 640), 60, np.uint8)
    hold = Gesture("hold", 99.5, 127.0, 100.0, 0.6, 0.0, (1,))
    gesture = Gesture("hard press", 100.0, 127.0, 100.0, 3.0, 0.0, (1,))
    with serve(0) as publisher:
        images = []
        for gestures in ((), (gesture,), (hold, gesture)):
            with feed(publisher, still(snapshot, gestures=gestures, **quiet)):
                open_live(page, publisher)
                page.wait_for_timeout(400)
                images.append(pixels(page).astype(int))
    rows, columns = np.nonzero(np.abs(images[1] - images[0]).max(-1) > 100)
    T, scale = snapshot(3).T_px_plate, images[0].shape[1] / 640
    x, y, w = T @ (127.0, 100.0, 1.0)
    assert (columns.min() + columns.max()) / 2 == pytest.approx((x / w + 0.5) * scale, abs=4)
    assert 0 < rows.mean() - (y / w + 0.5) * scale < 40
    assert np.ptp(columns) > 40
    np.testing.assert_array_equal(images[2], images[1])  # not one over the other


def test_recordings_are_listed_and_one_is_opened_on_a_page_of_its_own(page, snapshot):
    names = ("<b>new</b>.h5", "old.h5")
    with serve(0) as publisher:
        listed = PageControls(recordings=Recordings(names))
        with with_controls(publisher, snapshot, listed):
            open_live(page, publisher)
            page.get_by_text("Recordings", exact=True).click()
            assert wait_for_wish(publisher) == [{"do": "recordings"}]
            page.get_by_role("button", name="<b>new</b>.h5").click()
            assert wait_for_wish(publisher) == [{"do": "playback", "name": "<b>new</b>.h5"}]
        opened = Recordings(names, "old.h5", "http://bench:1234/?token=a")
        with with_controls(publisher, snapshot, PageControls(recordings=opened)):
            link = page.get_by_role("link", name="Watch old.h5")
            expect(link).to_have_attribute("href", "http://127.0.0.1:1234/?token=a")
        broken = Recordings(names, "old.h5", trouble="the file is damaged")
        with with_controls(publisher, snapshot, PageControls(recordings=broken)):
            expect(page.locator("#playback")).to_have_text("the file is damaged")
    assert page.complaints == []
