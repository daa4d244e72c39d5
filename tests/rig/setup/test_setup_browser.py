"""The setup in a real browser: worked on by clicks and keys alone, left, and resumed."""

import threading
from queue import SimpleQueue
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import expect, sync_playwright

from rig.page import serve
from rig.setup.page_desk import PAGE, PageDesk
from rig.setup.rehearsal import RehearsedBench
from rig.setup.run import set_up
from rig.setup.session import read_state, state_beside
from rig.web.access import Access

pytestmark = pytest.mark.browser
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
PATIENCE = 120_000  # ms
MEASURING = 600_000  # ms: fifteen flashes are ten seconds of work, and the cores may be busy
expect.set_options(timeout=PATIENCE)


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as play:
        chromium = play.chromium.launch(executable_path="/usr/bin/chromium", args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser):
    """Open a page that remembers complaints and every address that it asked for."""
    context = browser.new_context(viewport={"width": 1280, "height": 800}, color_scheme="dark")
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.complaints, page.asked = [], []
    page.on("console", lambda message: page.complaints.append(message.text))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    yield page
    context.close()


def setting_up(path):
    """Run the setup of a rehearsal beside the page, which ends with it; gives the address."""
    addresses = SimpleQueue()

    def work():
        with serve(0) as publisher:
            addresses.put(publisher.address(PAGE))
            set_up(path, RehearsedBench(1), PageDesk(publisher))

    threading.Thread(target=work, daemon=True).start()
    return addresses.get()


def say(page):
    return page.locator("#say")


@pytest.mark.slow
def test_the_setup_is_worked_on_by_clicks_and_keys_left_and_resumed(page, tmp_path, desk):
    path = tmp_path / "my.toml"
    desk.begin(path)
    page.goto(setting_up(path))
    expect(say(page)).to_have_text("describe the plate and what looks at it")
    expect(page.locator("#steps .now")).to_have_text("Plate")
    expect(page.get_by_role("button", name="Known weight")).to_be_disabled()
    page.fill("[name=thickness]", "2 apples")
    page.keyboard.press("Enter")
    expect(page.locator("#trouble")).to_contain_text("give a number in mm")
    page.fill("[name=thickness]", "20")
    page.keyboard.press("Enter")
    expect(page.locator("#trouble")).to_contain_text("plate thickness must stay below")
    page.fill("[name=thickness]", "0.2 cm")
    page.keyboard.press("Enter")

    expect(page.locator("#steps .now")).to_have_text("Print")
    page.fill("[name=ruler]", "99.5")
    expect(say(page)).to_contain_text("print my-board.pdf and my-speckle.pdf")
    page.get_by_role("button", name="Next").click()

    expect(page.locator("#signs div")).to_have_count(3)
    expect(page.locator("#view-canvas")).to_be_visible()
    page.get_by_role("button", name="Next").click()

    expect(page.locator("[name=output]")).to_have_value("1 'HDMI-1' of 1280 x 800 px at 1366, 0")
    expect(say(page)).to_have_text("did this screen flash? then it is the projector")
    page.keyboard.press("Enter")
    expect(page.locator("#steps .now")).to_have_text("Lens", timeout=MEASURING)
    expect(page.locator("#steps .done").last).to_contain_text("ms")
    page.get_by_role("button", name="Leave").click()
    expect(page.locator("#trouble")).to_contain_text("the same command goes on from here")

    state = read_state(state_beside(path))
    assert state.done == ("plate", "print", "camera", "output", "latency")
    assert (state.answers.thickness, state.answers.ruler, state.answers.output) == (
        2,
        99.5,
        "HDMI-1",
    )
    for what in ("board", "speckle"):
        assert (tmp_path / f"my-{what}.pdf").read_bytes().startswith(b"%PDF")

    page.goto(setting_up(path))
    expect(page.locator("#steps .now")).to_have_text("Lens")
    expect(page.locator("#steps .done")).to_have_count(5)
    expect(page.locator("#taken")).to_contain_text(" of 10")
    expect(page.locator("#views li").first).to_be_visible()
    page.locator("#steps [value=plate]").click()
    expect(page.locator("[name=thickness]")).to_have_value("2")
    page.get_by_role("button", name="Leave").click()
    expect(page.locator("#link")).to_have_text("disconnected")

    unasked = [text for text in page.complaints if "ERR_CONNECTION_REFUSED" not in text]
    assert unasked == []
    hosts = {urlsplit(url).hostname for url in page.asked if not url.startswith("data:")}
    assert hosts == {"127.0.0.1"}


@pytest.mark.parametrize(("width", "lowest"), [(390, 44), (1280, 36)])
def test_every_control_is_high_enough_for_a_finger(page, tmp_path, width, lowest):
    page.set_viewport_size({"width": width, "height": 844})
    page.goto(setting_up(tmp_path / "my.toml"))
    expect(page.get_by_role("button", name="Next")).to_be_visible()
    heights = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select")]
            .filter((each) => each.offsetParent)
            .map((each) => [each.name || each.textContent, each.offsetHeight])"""
    )
    assert {"Next", "thickness", "material"} <= {name for name, _ in heights}
    assert [(name, high) for name, high in heights if high < lowest] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.get_by_role("button", name="Leave").click()
    expect(page.locator("#link")).to_have_text("disconnected")


def test_where_others_have_accounts_only_the_link_opens_the_page(page, tmp_path, desk):
    path = tmp_path / "my.toml"
    desk.begin(path)
    with serve(0, None, Access("secret", control=False, alone=False)) as publisher:
        given = path, RehearsedBench(1), PageDesk(publisher)
        work = threading.Thread(target=set_up, args=given, daemon=True)
        work.start()
        refused = page.goto(f"http://127.0.0.1:{publisher.port}/{PAGE}")
        assert refused.status == 403
        page.goto(publisher.address(PAGE))
        assert "secret" not in page.url
        expect(page.locator("[name=width]")).to_be_enabled()  # this machine, by its link
        publisher.ask({"do": "leave"})
        work.join(10)
        assert not work.is_alive()
