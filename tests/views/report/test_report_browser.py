"""Tests of the report in a real browser: it loads no other files, the player plays, all views follow, and no table
overflows.
"""

import html
import itertools
from dataclasses import replace

import pytest
from browser import Browser, executable
from synthetic_results import (
    EVERYTHING,
    config,
    families_that_move,
    plotted,
    simulate,
    stored,
)

from walkerlab.config.schema import Source
from walkerlab.scene.omissions import STILL_COMPUTED, LeftOut
from walkerlab.views.report.stage import write_pages

PATH = executable()
pytestmark = pytest.mark.skipif(PATH is None, reason="no Chromium is installed; `CHROMIUM` may name one")

WIDTHS = (360, 768, 1440)
SEEN = {
    "walk": "document.querySelector('.walk').toDataURL()",
    "close-up": "document.querySelector('.foot').toDataURL()",
    "phase portrait": "document.querySelector('[data-view=phase] circle').getAttribute('cx')",
    "angles": "document.querySelector('[data-view=angles] .now').getAttribute('x1')",
    "energies": "document.querySelector('[data-view=energies] .now').getAttribute('x1')",
    "numbers": "document.querySelector('.readout').textContent",
    "clock": "document.querySelector('.clock').textContent",
}
TIME = "Number(document.querySelector('[data-player]').dataset.time)"
SCRUB = "(() => {{ const s = document.querySelector('.time'); s.value = {}; s.dispatchEvent(new Event('input')); }})()"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper")
    made = {name: make() for name, make in EVERYTHING.items()}
    figure = {"title": "Legs", "caption": "Both.", "number": 7, "alt": "Two lines.", "svg": "a.svg", "png": "a.png"}
    (folder / "a.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path d="M0 0L9 9"/></svg>'
    )
    (folder / "a.png").write_bytes(b"\x89PNG")
    made["continuation"] = families_that_move(made["simulate"])
    made["plot"] = stored("plot", {}, {"figures": [figure]})
    write_pages(config(), made, folder)
    return folder


@pytest.fixture(scope="module")
def browser():
    browser = Browser(PATH)
    yield browser
    browser.close()


@pytest.fixture
def page(browser, folder):
    browser.open(folder / "report.html")
    return browser


def test_page_makes_no_requests_and_logs_no_errors(page, folder):
    page.evaluate("document.querySelector('.play').click()")
    page.until(f"{TIME} > 0.1")
    assert page.requests() == [(folder / "report.html").as_uri()]
    assert page.complaints() == []


def test_additional_pages_log_no_errors(browser, folder):
    for file in sorted(folder.glob("report-*.html")):
        browser.open(file)
        assert browser.complaints() == []
        assert browser.requests() == [file.as_uri()]


HOSTILE = """</script><img src=x onerror="window.harmed = 1">'"><svg onload='window.harmed = 1'>&lt;b&gt;"""
"""Text that would run or become an element if a page took it for markup in a text, an attribute or a script."""
DRAWING = f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9" onload="window.harmed = 1">
<script>window.harmed = 1</script><a href="javascript:window.harmed = 1"><text>linked</text></a>
<image href="file:///etc/passwd"/><path d="M0 0L9 9" onclick="window.harmed = 1" style="fill: url(https://elsewhere)"/>
<text>{html.escape(HOSTILE)}</text></svg>"""


@pytest.fixture(scope="module")
def hostile_folder(tmp_path_factory):
    """Write a report in which every free text of the config, the results and the figures is hostile."""
    folder = tmp_path_factory.mktemp("hostile")
    source = {
        "title": HOSTILE,
        "authors": HOSTILE,
        "published": HOSTILE,
        "url": f"https://x/{HOSTILE.replace(' ', '/')}",
    }
    asked = config().model_copy(update={"name": HOSTILE, "source": Source(**source)})
    fallen = simulate("fell", advice=HOSTILE)
    made = {"fixedpoint": EVERYTHING["fixedpoint"](), "simulate": fallen}
    made = {name: replace(one, provenance=replace(one.provenance, command_line=HOSTILE)) for name, one in made.items()}
    figure = {"title": HOSTILE, "caption": HOSTILE, "alt": HOSTILE, "number": 7, "svg": "a.svg", "png": "a.png"}
    (folder / "a.svg").write_text(DRAWING)
    (folder / "a.png").write_bytes(b"\x89PNG")
    made["plot"] = stored("plot", {}, {"figures": [figure]})
    write_pages(asked, made, folder)
    return folder


def test_hostile_names_and_labels_are_shown_as_text(browser, hostile_folder):
    for file in sorted(hostile_folder.glob("report*.html")):
        browser.open(file)
        browser.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
        browser.evaluate("document.querySelectorAll('[data-large]').forEach((one) => one.click())")
        assert browser.evaluate("window.harmed") is None
        assert (
            browser.evaluate(
                "document.querySelectorAll('img, [onerror], [onload], [onclick], svg a, svg script').length"
            )
            == 0
        )
        assert browser.evaluate("document.scripts.length") == 1
        assert browser.complaints() == []  # The content policy had nothing to stop.
        assert browser.requests() == [file.as_uri()]
    browser.open(hostile_folder / "report.html")
    # The text occurs where it was put in: heading, source, advice, figure, command line.
    assert browser.evaluate("document.documentElement.textContent").count(HOSTILE) >= 8
    assert HOSTILE in browser.evaluate("document.querySelector('[data-large]').getAttribute('aria-label')")
    assert browser.evaluate("document.querySelector('cite a').protocol") == "https:"


def test_player_plays_and_pauses(page):
    assert page.evaluate(TIME) == 0
    page.evaluate("document.querySelector('.play').click()")
    page.until(f"{TIME} > 0.2")
    page.evaluate("document.querySelector('.play').click()")
    stopped = page.evaluate(TIME)
    page.evaluate("new Promise((done) => setTimeout(done, 150))")
    assert page.evaluate(TIME) == stopped


def test_player_does_not_start_by_itself(page):
    page.evaluate("new Promise((done) => setTimeout(done, 150))")
    assert page.evaluate(TIME) == 0


@pytest.mark.parametrize("view", SEEN)
def test_scrubbing_moves_every_view(page, view):
    page.evaluate(SCRUB.format(0.3))
    before = page.evaluate(SEEN[view])
    page.evaluate(SCRUB.format(0.62))
    assert page.evaluate(SEEN[view]) != before


def test_playback_restarts_only_when_looping(page):
    end = page.evaluate("Number(document.querySelector('.time').max)")
    page.evaluate(SCRUB.format(end - 0.05))
    page.evaluate("document.querySelector('.play').click()")
    page.until("document.querySelector('.play').textContent === 'Play'")
    assert page.evaluate(TIME) == pytest.approx(end, abs=1e-3)
    page.evaluate("document.querySelector('.loop').click()")
    page.evaluate(SCRUB.format(end - 0.05))
    page.evaluate("document.querySelector('.play').click()")
    page.until(f"{TIME} > 0.01 && {TIME} < 0.5 * {end}")


def test_keys_step_through_the_walk(page):
    page.evaluate("document.querySelector('.time').focus()")
    page.press("PageDown", 34)
    assert page.evaluate(TIME) == pytest.approx(0.7, abs=1e-3)
    page.press("ArrowRight", 39)
    assert page.evaluate(TIME) == pytest.approx(0.71, abs=1e-3)
    page.press("Home", 36)
    assert page.evaluate(TIME) == 0
    page.press(" ", 32)
    page.until(f"{TIME} > 0.05")


def test_values_under_the_pointer_are_shown(page):
    page.evaluate("document.querySelector('[data-view=angles] .cursor').scrollIntoView()")
    page.evaluate(
        "(() => { const at = document.querySelector('[data-view=angles] .cursor'), box = at.getBoundingClientRect();"
        "at.dispatchEvent(new PointerEvent('pointermove', {clientX: box.x + box.width / 2, clientY: box.y + 50})); })()"
    )
    told = page.evaluate("document.querySelector('[data-view=angles] .tip').textContent")
    assert "rigid leg 1" in told
    assert "contact leg 2" in told


@pytest.mark.parametrize(
    ("value", "said"), [("0", "0 m"), ("5.55e-17", "0 m"), ("-2.5e-8", "−25 nm"), ("1.2e-4", "120 µm")]
)
def test_rounding_errors_are_shown_as_zero_length(page, value, said):
    assert page.evaluate(f"metres({value})") == said


LETTERS = """[...document.querySelectorAll('.picture text, .diagram text, .sheet text')]
    .flatMap((text) => (text.querySelector('tspan') ? [...text.querySelectorAll('tspan')] : [text]))
    .filter((text) => text.textContent.trim())
    .map((text) => [parseFloat(getComputedStyle(text).fontSize), text.getScreenCTM()])
    .map(([size, { a, b }]) => size * Math.hypot(a, b))"""


@pytest.fixture(scope="module")
def folder_with_figures(tmp_path_factory):
    """Return a report with real figures."""
    folder = tmp_path_factory.mktemp("drawn")
    made = {name: make() for name, make in EVERYTHING.items()}
    made["continuation"] = families_that_move(made["simulate"])
    made["plot"] = plotted(folder)
    write_pages(config(), made, folder)
    return folder


@pytest.mark.parametrize("width", [400, 768, 1280])
def test_figure_text_is_at_least_nine_pixels_high(browser, folder_with_figures, width):
    seen = 0
    for file in sorted(folder_with_figures.glob("report*.html")):
        browser.open(file, width)
        browser.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
        sizes = browser.evaluate(LETTERS)
        seen += len(sizes)
        assert min(sizes, default=9.0) >= 9.0
        assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert seen > 200


def test_figures_fill_their_frames(browser, folder_with_figures):
    for name in ("report.html", "report-accuracy.html"):
        browser.open(folder_with_figures / name, 1280)
        shares = browser.evaluate(
            "[...document.querySelectorAll('.frame')].map((frame) =>"
            " frame.querySelector('svg, img').getBoundingClientRect().width / frame.clientWidth)"
        )
        assert min(shares, default=1.0) > 0.95
    browser.open(folder_with_figures / "report.html", 1280)
    boxes = browser.evaluate(
        "[...document.querySelectorAll('.picture')].map((one) => one.getBoundingClientRect())"
        ".map(({ left, top, bottom }) => [left, top, bottom])"
    )
    for (left, _, bottom), (next_left, top, _) in itertools.pairwise(boxes):
        assert left != next_left or top - bottom < 40


def test_figure_grows_on_a_click_and_escape_closes_it(page):
    page.evaluate("document.querySelector('[data-large]').click()")
    assert page.evaluate("document.getElementById('large').open")
    assert page.evaluate("document.querySelector('#large svg').getBoundingClientRect().height") > 600
    page.press("Escape", 27)
    page.until("!document.getElementById('large').open")


def test_link_to_a_folded_section_unfolds_it(page):
    assert not page.evaluate("document.querySelector('#gait details').open")
    page.evaluate("document.querySelector('nav a[href=\"#gait\"]').click()")
    page.until("document.querySelector('#gait details').open")


def test_gait_chosen_in_the_diagram_plays_and_the_walk_can_be_restored(page):
    walk = page.evaluate(SEEN["walk"])
    page.evaluate("document.querySelector('.diagram [data-gait]').dispatchEvent(new Event('click'))")
    assert "Gait of 1 step at 1" in page.evaluate("document.querySelector('.player .key').textContent")
    assert page.evaluate(SEEN["walk"]) != walk
    page.evaluate("document.querySelector('.play').click()")
    page.until(f"{TIME} > 0.1")
    page.evaluate("document.querySelector('.player .back').click()")
    assert page.evaluate(SEEN["walk"]) == walk
    assert page.complaints() == []


def test_diagram_can_be_browsed_with_keys(page):
    page.evaluate("document.querySelector('#families details').open = true")
    page.evaluate("document.querySelector('.diagram [data-gait]').focus()")
    page.press("ArrowRight", 39)
    chosen = page.evaluate("document.activeElement.getAttribute('aria-label')")
    page.press("Enter", 13)
    assert chosen == "Gait of 1 step at 5\u00a0deg, unstable"
    assert page.evaluate("document.querySelector('.player .key').textContent") == chosen


@pytest.mark.parametrize("width", WIDTHS)
def test_report_page_fits_every_screen_width(browser, folder, width):
    for file in sorted(folder.glob("report*.html")):
        browser.open(file, width)
        browser.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
        assert browser.evaluate("document.documentElement.scrollWidth") <= width
        sticking_out = (
            "[...document.querySelectorAll('table')].filter((one) => !one.closest('.scroll, .player')"
            " || one.closest('.scroll, .player').getBoundingClientRect().right > innerWidth + 1).length"
        )
        assert browser.evaluate(sticking_out) == 0


def test_colours_follow_the_dark_mode_of_the_system(browser, folder):
    seen = []
    for dark in (False, True):
        browser.open(folder / "report.html", dark=dark)
        seen.append(browser.evaluate("getComputedStyle(document.querySelector('button.drawn')).backgroundColor"))
        seen.append(browser.evaluate(SEEN["walk"]))
    assert seen[0] != seen[2]
    assert seen[1] != seen[3]


def test_player_runs_slower_for_readers_who_prefer_reduced_motion(browser, folder):
    browser.open(folder / "report.html", calm=True)
    assert float(browser.evaluate("document.querySelector('.speed').value")) < 1.0


def test_printed_page_has_stills_and_unfolded_sections(page):
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.call("Emulation.setEmulatedMedia", media="print")
    assert page.evaluate("getComputedStyle(document.querySelector('.stills')).display") == "block"
    assert page.evaluate("getComputedStyle(document.querySelector('.scenes')).display") == "none"
    assert page.evaluate("document.querySelectorAll('details:not([open])').length") == 0
    page.call("Emulation.setEmulatedMedia", media="")


def test_walk_is_on_the_first_printed_page(browser, folder):
    browser.open(folder / "report.html", width=680, height=1009)  # A4 without margins of 15 mm.
    browser.evaluate("dispatchEvent(new Event('beforeprint'))")
    browser.call("Emulation.setEmulatedMedia", media="print")
    assert browser.evaluate("document.querySelector('.stills').getBoundingClientRect().bottom") < 1009
    assert browser.evaluate("getComputedStyle(document.querySelector('.player')).breakInside") == "auto"
    assert browser.evaluate("getComputedStyle(document.querySelector('.stills')).breakInside") == "avoid"
    browser.call("Emulation.setEmulatedMedia", media="")


def test_printed_page_has_no_reload_hint(browser, folder_with_pending):
    browser.open(folder_with_pending / "report.html")
    assert "reload it" in browser.evaluate("document.querySelector('header').innerText")
    browser.call("Emulation.setEmulatedMedia", media="print")
    text = browser.evaluate("document.querySelector('header').innerText")
    assert "Not computed yet when this page was written: plot." in text
    assert "reload" not in text.lower()
    browser.call("Emulation.setEmulatedMedia", media="")


@pytest.fixture
def folder_with_pending(tmp_path):
    write_pages(config(), {"simulate": EVERYTHING["simulate"]()}, tmp_path, [LeftOut("plot", STILL_COMPUTED)])
    return tmp_path
