"""The page as HTML: whole in itself, well-formed, accessible, and made of text that never becomes markup."""

import base64
import hashlib
import itertools
import re

import pytest
from html_page import Page
from synthetic_results import EVERYTHING, PAPER_ROWS, compare, config, contact_sim, fixedpoint, simulate, stored

from walkerlab.report.blocks import Cell, Column, Finding, Findings, Paragraph, Picture, Section, Shares, table
from walkerlab.report.lead import lead
from walkerlab.report.page import render
from walkerlab.report.registry import sections_of
from walkerlab.report.results import Absent, Results

NASTY = "<script>alert('x')</script><b title=\"y\">&amp;"
DRAWN = Picture("Figure 7. Legs.", "Both legs.", "Figure 7: legs.", "data:image/svg+xml;base64,PHN2Zy8+", 518, 400)


def page_of(results):
    return render("Passive walking: paper", lead(results, "paper"), sections_of(results))


@pytest.fixture(scope="module")
def whole():
    return page_of(Results(config(), {name: make() for name, make in EVERYTHING.items()}, (DRAWN,)))


@pytest.fixture(scope="module")
def page(whole):
    return Page(whole)


def test_nothing_is_fetched_from_elsewhere(whole, page):
    links = [value for _, attrs in page.elements for name, value in attrs.items() if name in ("src", "href", "srcset")]
    assert links
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not {"link", "iframe", "object", "embed", "base"} & {tag for tag, _ in page.elements}
    assert not re.search(r"@import|url\(", whole)


def test_the_page_itself_forbids_fetching_and_foreign_scripts(page):
    (policy,) = [attrs["content"] for attrs in page.all("meta") if attrs.get("http-equiv") == "Content-Security-Policy"]
    script = base64.b64encode(hashlib.sha256("".join(page.words["script"]).encode()).digest()).decode()
    assert "default-src 'none'" in policy
    assert f"script-src 'sha256-{script}'" in policy


def test_every_id_is_unique_and_every_link_leads_to_one(page):
    assert len(set(page.ids)) == len(page.ids)
    assert {attrs["href"].removeprefix("#") for attrs in page.all("a")} <= set(page.ids)
    labels = [attrs["aria-labelledby"] for _, attrs in page.elements if "aria-labelledby" in attrs]
    assert set(labels) <= set(page.ids)


def test_every_picture_says_what_it_shows(page):
    assert page.all("img")
    assert all(attrs["alt"].strip() for attrs in page.all("img"))
    assert all(attrs["role"] == "img" and attrs["aria-label"].strip() for attrs in page.all("svg"))


def test_every_table_has_a_caption_and_every_head_a_scope(page):
    assert len(page.all("table")) == len(page.all("caption")) == len(page.said("caption"))
    assert {attrs.get("scope") for attrs in page.all("th")} == {"col", "row", "rowgroup"}


def test_headings_go_down_one_level_at_a_time(page):
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(later <= earlier + 1 for earlier, later in itertools.pairwise(levels))


def test_language_encoding_and_width_are_declared(whole, page):
    assert whole.startswith("<!DOCTYPE html>")
    assert page.all("html") == [{"lang": "en"}]
    assert {"charset": "utf-8"} in page.all("meta")
    assert any(attrs.get("name") == "viewport" for attrs in page.all("meta"))


def test_what_needs_scripts_is_hidden_until_they_run(page):
    (controls,) = [attrs for attrs in page.all("div") if attrs.get("class") == "controls"]
    assert "hidden" in controls
    assert all("hidden" in attrs for tag, attrs in page.elements if tag == "g" and "data-frames" in attrs)


def test_texts_of_results_never_become_markup():
    row = PAPER_ROWS[1] | {"where": NASTY, "quantity": NASTY, "evidence": NASTY, "printed": NASTY, "unit": NASTY}
    left_out = [{"what": NASTY, "why": NASTY}]
    results = Results(
        config(),
        {
            "fixedpoint": fixedpoint(),
            "simulate": simulate("fell", 1, advice=NASTY, left_out=left_out),
            "contact-sim": contact_sim(NASTY, 1, advice=NASTY),
            "compare": compare([row]),
        },
        (Picture(NASTY, NASTY, NASTY, "data:image/png;base64,", 1, 1),),
        (Absent(NASTY, NASTY, failed=True), Absent("tune", NASTY)),
    )
    html = render(NASTY, [NASTY, *lead(results, f"paper@{NASTY}")], sections_of(results))
    page = Page(html)
    assert NASTY not in html
    assert len(page.all("script")) == 1
    assert not page.all("b") or all("title" not in attrs for attrs in page.all("b"))
    assert page.said("h1") == [NASTY]


def test_command_lines_and_versions_never_become_markup():
    walk = stored("simulate", {}, simulate().summary, command_line=NASTY, platform=NASTY, git_commit=NASTY)
    page = Page(page_of(Results(config(), {"simulate": walk})))
    assert NASTY in page.text
    assert len(page.all("script")) == 1


def test_any_block_may_hold_any_text():
    section = Section(
        "nasty",
        NASTY,
        (
            Paragraph(NASTY, "bad"),
            Findings((Finding(NASTY, NASTY, NASTY, "fair"),)),
            Shares(NASTY, ((NASTY, 2, "good"), (NASTY, 1, "bad"))),
            table(NASTY, [Column(NASTY), Column(NASTY, numeric=True)], [[NASTY, NASTY]], wordy=True, note=NASTY),
        ),
    )
    html = render("t", [], [section])
    assert NASTY not in html
    assert Page(html).said("h2") == [NASTY]


@pytest.mark.parametrize("row", [[Cell("it", "good"), "other"], ["other", Cell("it", "good")]])
def test_a_cell_with_a_tone_is_a_badge_in_the_first_column_too(row):
    html = render("t", [], [Section("s", "S", (table("t", [Column("a"), Column("b")], [row]),))])
    assert '<span class="badge good">it</span>' in html


def test_the_same_results_give_the_same_bytes(whole):
    again = Results(config(), {name: make() for name, make in EVERYTHING.items()}, (DRAWN,))
    assert page_of(again) == whole


def test_two_sections_cannot_have_one_anchor():
    with pytest.raises(ValueError, match="one anchor"):
        render("t", [], [Section("a", "A"), Section("a", "B")])


def test_a_row_with_a_cell_too_few_is_refused():
    with pytest.raises(ValueError, match="2 cells"):
        table("t", [Column("a"), Column("b")], [["only one"]])
