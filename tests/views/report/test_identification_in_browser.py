"""Check in a real browser that the page of an identified walker plays both the measured and the identified walk."""

from pathlib import Path

import pytest
from browser import Browser, executable
from synthetic_results import config, stored

import walkerlab
from walkerlab.views.report.stage import write_pages

PATH = executable()
pytestmark = pytest.mark.skipif(PATH is None, reason="no Chromium is installed; `CHROMIUM` may name one")

FILM = Path(__file__).parents[3] / "docs" / "downloads" / "film.csv"
TIME = "Number(document.querySelector('[data-player]').dataset.time)"
PICTURE = "document.querySelector('.walk').toDataURL()"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("identified")
    prior = {"walker.leg_length_m": [1.0, 0.001]}
    fit = ["slope_deg", "walker.hip_mass_kg"]
    result = walkerlab.identify(FILM, "paper", fit, prior, level="angles", nuisance=["clock_rate"])
    write_pages(config(), {"identify": stored("identify", result.content.groups, result.summary)}, folder)
    browser = Browser(PATH)
    browser.open(folder / "report.html")
    yield browser
    browser.close()


def test_measured_walk_plays_over_the_identified_one(page):
    first = page.evaluate(PICTURE)
    page.evaluate("document.querySelector('.play').click()")
    page.until(f"{TIME} > 0.3")
    assert page.evaluate(PICTURE) != first
    text = page.evaluate("document.querySelector('[data-player]').textContent")
    assert "Identified walk" in text
    assert "Measured walk" in text
    assert page.complaints() == []
