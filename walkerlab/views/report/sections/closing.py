"""The end of the report: links to further pages, glossary, and what is missing and why."""

from collections.abc import Iterator, Mapping, Sequence

from walkerlab.config.drives import drives_of
from walkerlab.labels import join_words
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.report.blocks import CASES, COSTS, PAPER_PAGE, Cards, Paragraph, Section, Terms
from walkerlab.views.report.numbers import count
from walkerlab.views.report.results import Results
from walkerlab.views.report.tables import Column, table
from walkerlab.views.report.words import words

TITLES = {
    PAPER_PAGE: "The paper's values compared with computed ones",
    CASES: "Extreme cases and known problems",
    COSTS: "Accuracy: run time against error, and the rigid limit",
}
"""Titles of the further pages, in order."""


def link_pages(results: Results, pages: Mapping[str, Sequence[Section]]) -> Section | None:
    """Link to the further pages, with the findings of their sections, and announce pending results."""
    items = []
    for file, sections in pages.items():
        findings = (section.finding for section in sections if file != PAPER_PAGE or results.claims)
        items.append((file, TITLES[file], " ".join(filter(None, findings))))
    waiting = (Paragraph(words("closing.pending", entry.what), "waiting") for entry in results.pending)
    title = "Further pages" if items else "Not computed yet"
    return Section.of("further", title, (Cards(tuple(items)) if items else None, *waiting))


def glossary(results: Results) -> Section:
    meanings = words.terms("closing.glossary", results.config.contact is not None, drives_of(results.config))
    return Section("glossary", "Glossary", (Terms(meanings),), "Terms used in this report.")


def omissions_section(results: Results) -> Section | None:
    parts = [LeftOut(**entry) for stored in results.stored.values() for entry in stored.summary.get("left_out", [])]
    rows = list(rows_by_reason(list(dict.fromkeys((*results.absent, *parts)))))
    columns = [Column("result"), Column("reason", wide=True), Column("saves", wide=True)]
    missing = table("Omitted results, with reasons and savings", columns, rows, wordy=True)
    nothing = Paragraph("" if rows else "Every result of the pipeline is available.")
    finding = f"{count(len(rows), 'item')}, each with its reason." if rows else "None."
    return Section.of("left-out", "Omitted results", (missing, nothing), finding)


def rows_by_reason(missing: Sequence[LeftOut]) -> Iterator[tuple[str, str, str]]:
    """Yield for each reason a row of results missing because of it, then a row of any results that depend on them."""
    reasons = {absent.why for absent in missing}
    # the innermost reason is the last part: 'no gait' in 'it needs simulate: it needs fixedpoint: no gait'
    causes = {absent.why: min(filter(absent.why.endswith, reasons), key=len) for absent in missing}
    for why in dict.fromkeys(causes.values()):
        alike = [absent for absent in missing if absent.why == why]
        first = join_words(absent.what for absent in alike)
        yield first, why, "; ".join(dict.fromkeys(absent.saves for absent in alike if absent.saves))
        dependents = join_words(absent.what for absent in missing if absent.why != why and causes[absent.why] == why)
        if dependents:
            yield dependents, f"needs {first}", ""
