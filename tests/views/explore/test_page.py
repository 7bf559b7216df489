"""Use the page of `walkerlab explore` in a real browser: drag, type, search, go back, save, and leave it alone."""

import itertools

import pytest
from browser import Browser, executable
from explored import Served

from walkerlab.config.loader import load

PATH = executable()
pytestmark = pytest.mark.skipif(PATH is None, reason="no Chromium is installed; `CHROMIUM` may name one")

MESSAGE = "document.getElementById('message').textContent"
SHOWN = "document.getElementById('shown').textContent"
STATE = "document.body.dataset.state"
TIME = "Number(document.querySelector('[data-player]')?.dataset.time)"
WALK = "document.querySelector('.walk').toDataURL()"
PERIOD = "document.querySelector('#results tbody td').textContent"


@pytest.fixture(scope="module")
def browser():
    browser = Browser(PATH)
    yield browser
    browser.close()


class Address:
    def __init__(self, text):
        self.text = text

    def as_uri(self):
        return self.text


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """Start another server with a changed config."""
    one = Served(tmp_path_factory.mktemp("other"), "--set", "slope_deg=3")
    yield one
    one.close()


def opened(browser, served, blocked=(), **seen):
    browser.open(Address("about:blank"))
    browser.call("Network.setBlockedURLs", urls=list(blocked))
    browser.open(Address(served.url), **seen)
    browser.until(f"{STATE} === 'shown'")
    return browser


@pytest.fixture
def page(browser, served):
    """Return the page at rest, without gait curves, because computing them for every test would take too long."""
    yield opened(browser, served, ["*/api/along"], calm=True)
    browser.call("Network.setBlockedURLs", urls=[])


@pytest.fixture
def whole_page(browser, served):
    """Return the complete page. Gait curves that are still being computed at the end are abandoned."""
    yield opened(browser, served)
    browser.open(Address("about:blank"))
    # A request that the page sent just before it was left may arrive after this one, which then counts as the older
    # one.
    assert 422 in (served.asked("/api/along", {"set": {"continuation.over": "nothing"}})[0] for _ in range(3))


def slider(key, value, kind="input"):
    return (
        f"(() => {{ const r = document.getElementById('turn-{key}'); r.value = {value};"
        f" r.dispatchEvent(new Event('{kind}')); return rows.get('{key}').fromRange(); }})()"
    )


def typed(page, key, text):
    page.evaluate(
        f"(() => {{ const t = rows.get('{key}').text; t.value = '{text}'; t.dispatchEvent(new Event('change')); }})()"
    )


def test_page_shows_a_walk_at_once_without_errors(whole_page, served):
    page = whole_page
    page.until(f"{TIME} > 0.2")
    assert page.evaluate(SHOWN) == "Shown: paper"
    assert page.complaints() == []
    assert {url.split("/")[2] for url in page.requests()} == {f"127.0.0.1:{served.port}"}


def test_dragging_a_slider_changes_the_walk_and_can_be_undone(whole_page):
    page = whole_page
    page.until(f"{TIME} > 0.2")
    before = page.evaluate("history.length")
    for place in range(400, 700, 10):
        value = page.evaluate(slider("slope_deg", place))
    assert page.evaluate("[history.length, location.hash]") == [before, ""]
    page.until(f"{SHOWN} === 'Shown: paper with slope_deg {value}'")
    assert page.evaluate(f"{TIME} > 0.2")  # The walk continued from where it was.
    page.evaluate(slider("slope_deg", 600, "change"))
    page.until(f"{SHOWN}.startsWith('Shown: paper with slope_deg')")
    hash_of_first = page.evaluate("location.hash")
    typed(page, "walker.hip_mass_kg", "20")
    page.until(f"{SHOWN}.endsWith('walker.hip_mass_kg 20')")
    page.evaluate("history.back()")
    page.until(f"!{SHOWN}.includes('hip_mass') && {STATE} === 'shown'")
    assert page.evaluate("location.hash") == hash_of_first
    page.evaluate("document.getElementById('reset').click()")
    page.until(f"{SHOWN} === 'Shown: paper'")


def test_reloading_the_page_address_restores_the_walk(page, served):
    page.open(Address(f"{served.url}#config=kneed&walker.hip_mass_kg=0.6"))
    page.evaluate("location.reload()")
    page.until(f"typeof rows !== 'undefined' && {SHOWN} === 'Shown: kneed with walker.hip_mass_kg 0.6'")
    assert page.evaluate("document.getElementById('config').value") == "kneed"
    assert page.evaluate("rows.get('walker.hip_mass_kg').text.value") == "0.6"


def test_picture_is_labelled_with_the_parameters_it_shows(page):
    first = page.evaluate(SHOWN)
    typed(page, "walker.leg_mass_kg", "-4")
    page.until(f"{STATE} === 'failed'")
    assert "from 1e-12 to 1e6 (kg)" in page.evaluate(MESSAGE)
    assert page.evaluate(SHOWN) == first
    assert page.evaluate("rows.get('walker.leg_mass_kg').root.classList.contains('wrong')")
    typed(page, "walker.leg_mass_kg", "5")
    page.until(f"{STATE} === 'shown'")
    typed(page, "slope_deg", "30")
    page.until(f"{MESSAGE}.startsWith('No gait at a slope')")
    assert page.evaluate("document.querySelector('.scenes').hidden")
    assert page.evaluate(f"{SHOWN} + {PERIOD}") == "No walk: paper with slope_deg 30–"


def test_any_key_can_be_searched_and_changed(page):
    page.evaluate("document.getElementById('search').value = 'gravity'; search()")
    page.evaluate("document.querySelector('#matches button').click()")
    page.evaluate(slider("gravity_m_s2", 0, "change"))
    page.until(f"{SHOWN} === 'Shown: paper with gravity_m_s2 1.962'")
    page.evaluate("document.getElementById('search').value = 'zebra'; search()")
    assert "No key" in page.evaluate("document.getElementById('matches').textContent")


def test_enter_selects_the_only_match_of_a_search(page):
    page.evaluate("document.getElementById('search').focus()")
    page.call("Input.insertText", text="gravity_m")
    page.press("Enter", 13)
    assert page.evaluate("document.activeElement.id") == "turn-gravity_m_s2"


def test_arriving_result_does_not_disturb_typing(page):
    page.evaluate(
        "(async () => { const late = refreshParameters(); window.typing = rows.get('slope_deg').text; typing.focus();"
        " typing.value = '2.'; await late; })()"
    )
    assert page.evaluate("typing.value") == "2."
    page.call("Input.insertText", text="5")
    page.evaluate("typing.blur()")
    page.until(f"{SHOWN} === 'Shown: paper with slope_deg 2.5'")


def test_outdated_result_does_not_replace_a_newer_one(page):
    first, value = page.evaluate(
        "(async () => { setParameter('slope_deg', 3, false);"
        " const late = refreshParameters(), first = rows.get('slope_deg').number.start;"
        " setParameter('slope_deg', first, false); await late;"
        " return [first, Number(rows.get('slope_deg').text.value)]; })()"
    )
    assert value == pytest.approx(first, rel=1e-6)
    page.until(f"{SHOWN} === 'Shown: paper'")


def test_camera_follows_the_model_that_still_walks(page):
    """This is the first part of the lesson in docs/explore.md: on pads of equal length the contact model trips."""
    typed(page, "slope_deg", "4.7")
    page.until(f"{SHOWN} === 'Shown: paper with slope_deg 4.7' && {STATE} === 'shown'")
    ends = page.evaluate("['simulate', 'contact-sim'].map((stage) => shown.answer[stage].touch_times_s.at(-1) ?? 0)")
    assert max(ends) > 7 > 3 > min(ends)
    for time in (3, 5, 7):
        page.evaluate(
            f"(() => {{ const s = document.querySelector('.time'); s.value = {time};"
            " s.dispatchEvent(new Event('input')); })()"
        )
        walks = "Rigid" if ends[0] > ends[1] else "Contact"
        [x, width] = page.evaluate(
            f"(() => {{ const hip = player.walk.points.find(({{ text }}) => text.startsWith('{walks} model, hip'));"
            " return [hip.at[0], player.walk.width]; })()"
        )
        assert x == pytest.approx(width / 2, abs=0.1 * width)


def test_clicking_a_gait_curve_sets_the_parameter(whole_page):
    page = whole_page
    page.until("along.series?.length > 0")
    page.evaluate("along.cursor.scrollIntoView()")
    box = page.evaluate(
        "(() => { const b = along.cursor.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()"
    )
    where = {"x": box[0] + 0.6 * box[2], "y": box[1] + 0.5 * box[3], "button": "left", "clickCount": 1}
    for kind in ("mousePressed", "mouseReleased"):
        page.call("Input.dispatchMouseEvent", type=kind, **where)
    page.until(
        f"{SHOWN}.startsWith('Shown: paper with slope_deg 2') || {SHOWN}.startsWith('Shown: paper with slope_deg 3')"
    )


def test_contact_gaits_are_plotted_over_a_ground_parameter_on_a_log_axis(whole_page):
    page = whole_page
    typed(page, "contact.stiffness", "50000")
    page.until("along.key === 'contact.stiffness' && along.gaits?.every(({ model }) => model === 'contact')")
    page.until("along.series.length > 0")
    # The rigid gait has no value of this parameter.
    assert page.evaluate("along.dot.getAttribute('visibility')") == "hidden"
    marked = page.evaluate("along.value(along.fromX(Number(along.line.getAttribute('x1'))))")
    assert marked == pytest.approx(50000)
    labels = page.evaluate("[...along.curves.querySelectorAll('text.middle')].map((one) => one.textContent)")
    assert "1e5" in labels


def test_each_model_can_be_hidden(page):
    both = page.evaluate(WALK)
    page.evaluate("document.getElementById('contact').click()")
    page.until(f"{WALK} !== '{both}'")
    assert page.evaluate("document.querySelectorAll('[data-view=phase] path').length") == 1
    page.evaluate("document.getElementById('contact').click()")
    page.until("document.querySelectorAll('[data-view=phase] path').length === 2")


def test_current_config_can_be_saved(page, served):
    typed(page, "slope_deg", "3")
    page.evaluate("document.getElementById('name').value = 'found.yaml'; document.getElementById('save').click()")
    page.until("document.getElementById('export-status').textContent.startsWith('Saved')")
    assert load(served.folder / "found.yaml").config == load(None, ["slope_deg=3", "name=found"]).config
    page.evaluate("document.getElementById('save').click()")
    page.until("document.getElementById('export-status').textContent.includes('already exists')")


def test_saved_picture_has_the_page_background_and_size(page):
    page.evaluate(
        "window.download = (name, address) => (window.left = address); document.getElementById('png').click()"
    )
    page.evaluate("window.seen = new Image(); seen.src = left; seen.decode()")
    corner, size = page.evaluate(
        "(() => { const c = document.createElement('canvas'); [c.width, c.height] = [seen.width, seen.height];"
        " const d = c.getContext('2d'); d.drawImage(seen, 0, 0);"
        " return [[...d.getImageData(2, 2, 1, 1).data], [c.width, c.height]]; })()"
    )
    assert corner == [255, 255, 255, 255]
    assert size == page.evaluate("(({ canvas }) => [canvas.width, canvas.height])(player.walk)")


def test_film_is_written_and_linked(page):
    typed(page, "strides", "1")
    page.until(f"{SHOWN} === 'Shown: paper with strides 1'")
    page.evaluate("document.getElementById('contact').click()")
    page.evaluate("document.getElementById('gif').click()")
    page.until(
        "!!document.querySelector('#export-status a')"
        " || document.getElementById('export-status').textContent.includes('rror')"
    )
    link = page.evaluate("document.querySelector('#export-status a')?.href")
    kind = page.evaluate(
        "fetch(document.querySelector('#export-status a').href).then((answer) => answer.headers.get('Content-Type'))"
    )
    assert link.partition("?")[0].endswith("simulate.gif")
    assert kind == "image/gif"


@pytest.mark.parametrize(("width", "dark"), [(400, True), (1440, False)])
def test_page_fits_the_screen_width(browser, served, width, dark):
    opened(browser, served, width=width, dark=dark, calm=True)
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert browser.evaluate(TIME) == 0  # Readers who prefer reduced motion start the walk themselves.


def test_keyboard_alone_can_change_a_parameter(page):
    page.evaluate("document.getElementById('turn-slope_deg').focus()")
    # Browsers cap history.length, so it cannot be used here.
    count = "function () { places++; push.apply(this, arguments) }"
    page.evaluate(f"places = 0; push = history.pushState; history.pushState = {count}")
    page.press("ArrowRight", 39)
    page.until(f"{SHOWN}.startsWith('Shown: paper with slope_deg 1.04')")
    assert page.evaluate("document.activeElement.id") == "turn-slope_deg"
    for _ in range(5):
        page.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight", windowsVirtualKeyCode=39)
    page.call("Input.dispatchKeyEvent", type="keyUp", key="ArrowRight", windowsVirtualKeyCode=39)
    assert page.evaluate("places") == 2  # Holding a key makes a single entry to go back to.


def test_skip_link_keeps_the_parameters(page):
    typed(page, "slope_deg", "2")
    page.until(f"{SHOWN} === 'Shown: paper with slope_deg 2'")
    page.evaluate("document.querySelector('.skip').click()")
    assert page.evaluate("[document.activeElement.id, location.hash]") == ["config", "#slope_deg=2"]
    typed(page, "slope_deg", "")
    page.until(f"{SHOWN} === 'Shown: paper'")


def test_typed_list_is_restored_from_the_address(page):
    page.evaluate("document.getElementById('search').value = 'heights'; search()")
    page.evaluate("document.querySelector('#matches button').click()")
    typed(page, "ground.heights_m", "[0.002, -0.001]")
    page.until(f"{SHOWN} === 'Shown: paper with ground.heights_m [0.002,-0.001]'")
    page.evaluate("window.old = true; location.reload()")
    page.until(f"!window.old && typeof rows !== 'undefined' && {SHOWN}.endsWith('[0.002,-0.001]')")
    assert page.evaluate("rows.get('ground.heights_m').text.value") == "[0.002,-0.001]"
    assert page.evaluate("shown.answer.scene.ground.length") > 2  # The player draws ground at several levels.


def test_looping_walk_continues_along_the_ground(whole_page):
    page = whole_page
    page.evaluate(
        "window.said = []; const drawn = CanvasRenderingContext2D.prototype.fillText;"
        "CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {"
        " const time = document.querySelector('.time').value;"
        " if (this.canvas.className === 'walk') said.push([time, Number(text.replace('−', '-').split(' ')[0]), x]);"
        " return drawn.call(this, text, x, y); };"
        "document.querySelector('.speed').value = '2'"
    )
    page.until("said.some((one, place) => place && Number(one[0]) < Number(said[place - 1][0]))")
    page.until("said.at(-1)[0] > 5")
    width = page.evaluate("document.querySelector('.walk').clientWidth")
    frames = {}
    for time, metres, x in page.evaluate("said"):
        frames.setdefault(time, []).append((metres, x))
    # The hip is drawn in the middle, so the labels on the ground tell its position.
    hips = [a + (width / 2 - x) * (b - a) / (y - x) for (a, x), (b, y), *_ in frames.values()]
    steps = [after - before for before, after in itertools.pairwise(hips)]
    assert min(steps) > -0.01
    assert max(steps) < 0.3


def test_page_shows_the_config_it_was_started_with(browser, other):
    opened(browser, other)
    assert browser.evaluate(SHOWN) == "Shown: paper with slope_deg=3"
    assert browser.evaluate("rows.get('slope_deg').text.value") == "3"
    assert "--set slope_deg=3" in browser.evaluate("document.getElementById('command').textContent")
    browser.evaluate(
        "document.getElementById('config').value = 'paper';"
        "document.getElementById('config').dispatchEvent(new Event('change'))"
    )
    browser.until(f"{SHOWN} === 'Shown: paper'")


def test_lost_server_is_reported(browser, other, tmp_path):
    opened(browser, other)
    other.close()
    typed(browser, "slope_deg", "2")
    browser.until(f"{MESSAGE}.startsWith('The server does not answer')")
    again = Served(tmp_path, "--port", str(other.port))
    try:
        browser.until(f"{MESSAGE}.includes('Open the address as it was printed')")
    finally:
        again.close()


def in_sight(selector):
    return (
        f"(box => box.top >= 0 && box.bottom <= innerHeight && "
        f"document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2).matches('{selector}'))"
        f"(document.querySelector('{selector}').getBoundingClientRect())"
    )


def test_phone_shows_walk_play_button_and_a_slider_together(browser, served):
    page = opened(browser, served, ["*/api/along"], width=390, height=800, calm=True)
    for name in ("slope_deg", "dynamic_friction"):
        slider = f"#sliders [aria-label*={name}], #sliders [id*={name}]"
        page.evaluate(f"document.querySelector('{slider}').closest('.turn').scrollIntoView({{block: 'center'}})")
        assert page.evaluate(in_sight(".walk"))
        assert page.evaluate(in_sight(".play"))
        middle = f"document.querySelector('{slider}').closest('.turn').getBoundingClientRect()"
        assert page.evaluate(f"document.querySelector('.walk').getBoundingClientRect().bottom <= {middle}.top")
        assert page.evaluate(f"{middle}.bottom <= document.querySelector('.controls').getBoundingClientRect().top")
    scrolling = (
        "[...document.querySelectorAll('#walk-section, #walk-section *')]"
        ".filter(one => one.scrollHeight > one.clientHeight + 1"
    )
    assert page.evaluate(f"{scrolling} && getComputedStyle(one).overflowY === 'auto').length") == 0
    page.evaluate("document.querySelector('.play').click()")
    page.until(f"{TIME} > 0")


def test_landscape_phone_can_scroll_to_the_sliders(browser, served):
    page = opened(browser, served, ["*/api/along"], width=800, height=390, calm=True)
    page.evaluate("document.querySelector('#sliders').scrollIntoView()")
    assert page.evaluate("document.querySelector('.walk').getBoundingClientRect().bottom") <= 0
    assert page.evaluate(in_sight(".play"))
    browser.call("Network.setBlockedURLs", urls=[])
