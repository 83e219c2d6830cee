"""The report in a real browser: it draws, plays, copies, fits, and asks the network for nothing."""

import base64
import csv
import io
import shutil
import tomllib
from xml.etree import ElementTree

import pytest
from PIL import Image

from nested_agents.studies.report.page import page as rendered

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
CHROMIUM = next((path for name in NAMES if (path := shutil.which(name))), None)
WIDTHS = (1280, 390)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        CHROMIUM is None, reason=f"no browser: none of {', '.join(NAMES)} on the path"
    ),
]

PIXELS = "() => document.getElementById('stage').toDataURL()"
ACTIVE = """() => {
    const active = document.activeElement;
    return active.id || active.textContent.trim().slice(0, 20);
}"""
SCRUB = "(slider, to) => { slider.value = to; slider.dispatchEvent(new Event('input')); }"
OVERFLOW = "() => document.documentElement.scrollWidth - innerWidth"
READY = "() => document.getElementById('moment').textContent.startsWith('step 0 of')"


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield running
        running.close()


@pytest.fixture(scope="module")
def file(kept, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    path = folder / "report.html"
    path.write_text(rendered(kept(folder / "study", done=5, failed=1)), encoding="utf-8")
    return path


@pytest.fixture(params=WIDTHS)
def page(request, browser, file):
    """The report, opened at a width; whatever it complains of or asks for fails the test."""
    said, asked = [], []
    context = browser.new_context(
        viewport={"width": request.param, "height": 800},
        permissions=["clipboard-read", "clipboard-write"],
    )
    opened = context.new_page()
    opened.on("console", lambda message: said.append(message.text))
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.on("request", lambda asks: asked.append(asks.url))
    opened.goto(file.as_uri())
    opened.wait_for_function(READY)
    yield opened
    context.close()
    assert said == []
    assert [url for url in asked if not url.startswith(("blob:", "data:"))] == [file.as_uri()]


def clipboard(page):
    return page.evaluate("() => navigator.clipboard.readText()")


def test_it_fits_the_screen(page):
    assert page.evaluate(OVERFLOW) <= 0
    for section in ("table", "figures", "replay", "failed", "spec", "versions"):
        assert page.locator(f"#{section}").is_visible()
    page.locator("#failed details summary").first.click()
    assert page.get_by_text("RuntimeError: <off & away>").last.is_visible()
    assert page.evaluate(OVERFLOW) <= 0


def test_it_plays_and_pauses_and_plays_again(page):
    start = page.evaluate(PIXELS)
    drawn = Image.open(io.BytesIO(base64.b64decode(start.partition(",")[2])))
    assert len(drawn.getcolors(10**6)) > 20
    page.select_option("#speed", "1")  # two and a half minutes to the end, on any machine
    page.click("#play")
    page.wait_for_function("() => Number(document.getElementById('scrub').value) > 0.02")
    assert page.evaluate(PIXELS) != start
    page.click("#play")
    paused = page.evaluate(PIXELS)
    page.wait_for_timeout(200)
    assert page.evaluate(PIXELS) == paused
    page.select_option("#speed", "16")
    page.locator("#scrub").evaluate(SCRUB, 29.5)
    page.click("#play")
    page.wait_for_function("() => document.getElementById('play').textContent === 'Play'")
    assert "step 30 of 30" in page.inner_text("#moment")
    assert "goal" in page.inner_text("#moment").split("–")[1]


def test_scrub_and_keys_move_it(page):
    start = page.evaluate(PIXELS)
    page.locator("#scrub").evaluate(SCRUB, 20)
    assert page.inner_text("#moment").startswith("step 20 of 30, 102.4 s: box")
    assert "failed: robot1.rear-right" in page.inner_text("#moment")
    assert page.evaluate(PIXELS) != start
    page.focus("#stage")
    page.keyboard.press("ArrowLeft")
    assert page.inner_text("#moment").startswith("step 19 of 30")
    page.keyboard.press("Home")
    assert page.evaluate(PIXELS) == start
    page.keyboard.press("Space")
    page.wait_for_function("() => Number(document.getElementById('scrub').value) > 0")


def test_other_episodes_are_chosen(page):
    assert page.locator("#condition option").all_inner_texts() == ["default", "frozen"]
    page.select_option("#condition", "frozen")
    page.wait_for_function("() => document.getElementById('moment').textContent.includes('of 31')")
    assert page.locator("#seed option").all_inner_texts() == ["0", "1"]  # seed 2 failed
    page.select_option("#seed", "1")
    page.wait_for_function("() => document.getElementById('moment').textContent.includes('of 33')")
    assert page.locator("#episode option").all_inner_texts() == ["0 (first)", "3 (last)"]


def test_copies_can_be_read_elsewhere(page):
    page.get_by_role("button", name="Copy as CSV").click()
    page.get_by_role("status").get_by_text("Copied.").wait_for()
    rows = list(csv.DictReader(io.StringIO(clipboard(page))))
    assert [row["condition"] for row in rows] == ["default", "frozen"]
    assert all(0 <= float(row["evaluation success"]) <= 1 for row in rows)
    page.get_by_role("button", name="Copy as LaTeX").click()
    page.wait_for_function("async () => (await navigator.clipboard.readText()).includes('tabular')")
    lines = [line for line in clipboard(page).splitlines() if line.endswith(r"\\")]
    assert len(lines) == 3
    assert len({line.count("&") for line in lines}) == 1
    page.get_by_role("button", name="Copy", exact=True).click()
    page.wait_for_function("async () => (await navigator.clipboard.readText()).includes('sweep')")
    assert tomllib.loads(clipboard(page))["seeds"] == 3


def test_figures_are_saved(page):
    for kind, opening in (("SVG", b"<?xml"), ("PDF", b"%PDF")):
        with page.expect_download() as download:
            page.get_by_role("button", name=f"Download {kind}").click()
        assert download.value.suggested_filename == f"learning-curves.{kind.lower()}"
        with open(download.value.path(), "rb") as saved:
            content = saved.read()
        assert content.startswith(opening)
        if kind == "SVG":
            assert ElementTree.fromstring(content).tag == "{http://www.w3.org/2000/svg}svg"


def test_everything_is_reached_by_keyboard(page):
    page.evaluate("() => document.activeElement.blur()")
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate(ACTIVE))
    assert {"Copy as CSV", "Download SVG", "stage", "play", "scrub", "condition"} <= reached


@pytest.mark.parametrize("page", [1280], indirect=True)
def test_in_print_are_the_whole_episode_and_all_failures_but_no_controls(page):
    page.emulate_media(media="print")
    page.evaluate("() => dispatchEvent(new Event('beforeprint'))")
    assert not page.locator("#play").is_visible()
    assert page.locator("#stage").is_visible()
    assert page.inner_text("#which") == "default, seed 0, training episode 3"
    assert page.inner_text("#moment").startswith("step 30 of 30")
    assert page.get_by_text("RuntimeError: <off & away>").last.is_visible()


def test_without_scripts_nothing_is_dead(browser, file):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(file.as_uri())
    assert page.locator("button:visible").count() == 0
    assert page.get_by_text("The replay needs JavaScript").is_visible()
    context.close()
