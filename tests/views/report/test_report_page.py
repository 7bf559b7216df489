"""Tests of the page as HTML: self-contained, well-formed, accessible, and safe from markup in texts."""

import base64
import hashlib
import itertools
import re

import pytest
from html_page import Page
from jinja2 import UndefinedError
from synthetic_results import EVERYTHING, PAPER_ROWS, compare, config, contact_sim, fixedpoint, simulate, stored

from walkerlab.evidence.paper.prose import prose
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.prose import parts
from walkerlab.views.report.blocks import MAIN, Paragraph, Picture, Results, Section, Shares, Statement, Statements
from walkerlab.views.report.page import Page as Sheet
from walkerlab.views.report.page import render, source, to_markup
from walkerlab.views.report.registry import pages_of
from walkerlab.views.report.tables import Cell, Column, table
from walkerlab.views.report.words import join_row, words

NASTY = "<script>alert('x')</script><b title=\"y\">&amp;"
PIXELS = "data:image/png;base64,"
DRAWN = Picture("Figure 7. Legs.", "Both legs.", "Figure 7: legs.", None, PIXELS, 518, 400, "figure-07")
READS_AS_TYPED = {"style", "script", "pre", "code"}


def pages(results):
    return {page.file: render(page) for page in pages_of(results, "paper")}


def page_of(results):
    return pages(results)[MAIN]


def sheet(*sections, title="t", lead=()):
    return render(Sheet(title, sections, lead))


@pytest.fixture(scope="module")
def whole():
    return page_of(Results(config(), {name: make() for name, make in EVERYTHING.items()}, (DRAWN,)))


@pytest.fixture(scope="module")
def page(whole):
    return Page(whole)


def test_page_fetches_nothing_from_elsewhere(whole, page):
    links = [value for _, attrs in page.elements for name, value in attrs.items() if name in ("src", "href", "srcset")]
    assert links
    beside = pages(Results(config(), {name: make() for name, make in EVERYTHING.items()}, (DRAWN,)))
    assert all(link.startswith(("#", "data:")) or link in beside for link in links)
    assert not {"link", "iframe", "object", "embed", "base"} & {tag for tag, _ in page.elements}
    assert not re.search(r"@import|url\(", whole)


def test_content_policy_forbids_fetching_and_foreign_scripts(page):
    (policy,) = [attrs["content"] for attrs in page.all("meta") if attrs.get("http-equiv") == "Content-Security-Policy"]
    script = base64.b64encode(hashlib.sha256("".join(page.words["script"]).encode()).digest()).decode()
    assert "default-src 'none'" in policy
    assert f"script-src 'sha256-{script}'" in policy


def test_every_id_is_unique_and_every_link_has_a_target(page):
    assert len(set(page.ids)) == len(page.ids)
    inside = {attrs["href"].removeprefix("#") for attrs in page.all("a") if attrs["href"].startswith("#")}
    assert inside <= set(page.ids)
    labels = [attrs["aria-labelledby"] for _, attrs in page.elements if "aria-labelledby" in attrs]
    assert set(labels) <= set(page.ids)


def test_every_picture_has_a_text_alternative(page):
    assert page.all("img")
    assert all(attrs["alt"].strip() for attrs in page.all("img"))
    assert all(attrs["role"] == "img" and attrs["aria-label"].strip() for attrs in page.all("svg"))
    assert all(attrs["role"] == "img" and attrs["aria-label"].strip() for attrs in page.all("canvas"))


def test_every_table_has_a_caption_and_every_header_a_scope():
    results = Results(config(), {name: make() for name, make in EVERYTHING.items()}, (DRAWN,))
    found = [Page(html) for html in pages(results).values()]
    for page in found:
        named = [attrs for attrs in page.all("table") if "aria-label" not in attrs]
        assert len(named) == len(page.all("caption")) == len(page.said("caption"))
    assert {attrs.get("scope") for page in found for attrs in page.all("th")} == {"col", "row", "rowgroup"}


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


def test_controls_that_need_scripts_are_hidden_until_they_run(page):
    (live,) = [attrs for attrs in page.all("div") if attrs.get("class") == "live"]
    assert "hidden" in live
    assert [attrs for attrs in page.all("svg") if attrs.get("class") == "stills"]


def test_texts_contain_no_backticks_or_raw_numbers(page):
    texts = [part for tag, parts in page.words.items() if tag not in READS_AS_TYPED for part in parts]
    assert not any("`" in text for text in texts)
    assert not any(re.search(r"\d[eE][-+]?\d", text) for text in texts if not re.search("[0-9a-f]{16}", text))


def test_commands_are_code_and_powers_are_superscripts():
    assert to_markup("`walkerlab x --at 1e-3` errs by 2.5e-07, 1e-03 and 10^-4") == (
        "<code>walkerlab x --at 1e-3</code> errs by 2.5 × 10⁻⁷, 10⁻³ and 10⁻⁴"
    )
    assert to_markup("`<b>` & <i>") == "<code>&lt;b&gt;</code> &amp; &lt;i&gt;"


def test_commands_on_the_page_name_their_run():
    section = Section("left-out", "Omitted results", (Paragraph("`walkerlab engines` makes it"),))
    commands = [Page(render(Sheet("t", (section,), run=run))).said("code") for run in ("", "round feet")]
    assert commands == [["walkerlab engines"], ["walkerlab engines -c 'round feet'"]]


def test_texts_of_results_are_escaped():
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
        (Picture(NASTY, NASTY, NASTY, None, PIXELS, 1, 1, NASTY, ((NASTY, NASTY),)),),
        (LeftOut(NASTY, NASTY), LeftOut("tune", NASTY)),
        failed=frozenset({NASTY}),
    )
    for one in pages_of(results, f"paper@{NASTY}"):
        html = render(one)
        page = Page(html)
        assert NASTY not in html
        assert len(page.all("script")) == 1
        assert not page.all("b") or all("title" not in attrs for attrs in page.all("b"))
        assert NASTY in " ".join(page.said("h1"))


def test_command_lines_and_versions_are_escaped():
    walk = stored("simulate", {}, simulate().summary, command_line=NASTY, platform=NASTY, git_commit=NASTY)
    page = Page(page_of(Results(config(), {"simulate": walk})))
    assert NASTY in page.text
    assert len(page.all("script")) == 1


def test_every_block_of_a_page_escapes_its_texts():
    section = Section(
        "nasty",
        NASTY,
        (
            Paragraph(NASTY, "bad"),
            Statements((Statement(NASTY, NASTY, NASTY, "fair"),)),
            Shares(NASTY, ((NASTY, 2, "good"), (NASTY, 1, "bad"))),
            table(NASTY, [Column(NASTY), Column(NASTY, numeric=True)], [[NASTY, NASTY]], wordy=True, note=NASTY),
        ),
    )
    html = sheet(section)
    assert NASTY not in html
    assert Page(html).said("h2") == [NASTY]


@pytest.mark.parametrize("row", [[Cell("it", "good"), "other"], ["other", Cell("it", "good")]])
def test_cell_with_a_tone_is_a_badge_in_every_column(row):
    html = sheet(Section("s", "S", (table("t", [Column("a"), Column("b")], [row]),)))
    assert '<span class="badge good">it</span>' in html


def test_equal_results_give_equal_bytes(whole):
    again = Results(config(), {name: make() for name, make in EVERYTHING.items()}, (DRAWN,))
    assert page_of(again) == whole


def test_duplicate_anchors_are_rejected():
    with pytest.raises(ValueError, match="share an anchor"):
        sheet(Section("a", "A"), Section("a", "B"))


def test_row_with_a_missing_cell_is_rejected():
    with pytest.raises(ValueError, match="2 cells"):
        table("t", [Column("a"), Column("b")], [["only one"]])


def test_script_of_the_page_is_small():
    assert len(source("page.js").encode()) + len(source("player.js").encode()) < 30_000


@pytest.mark.parametrize("templates", [words.templates, prose.templates], ids=["page", "paper"])
def test_templates_use_only_defined_names(templates):
    names = templates.list_templates(extensions=["j2"])
    assert names
    for name in names:
        templates.get_template(name)  # Loading raises an error for an unknown filter.
    with pytest.raises(UndefinedError):
        templates.from_string("{{ numbr }}").render()


def test_sentence_is_one_line_with_nonbreaking_spaces():
    assert words("gait.finding", fixedpoint().summary).count("\u00a0") == 2
    assert "\n" not in words("stability.judgement")


def test_parts_of_templates_are_separated_and_not_empty():
    assert parts("| one |\n two,\u00a0m | | three|four |") == ["one", "two,\u00a0m", "three|four"]
    assert join_row(" a |\n b | c |") == "a, b and c"
    assert words.terms("adjustment.walks", True)["released"] == "without the joint, from the rigid state"
