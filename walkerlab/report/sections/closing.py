"""What closes the report: what is one link away, what its words mean, and what is not in it, and why."""

from __future__ import annotations

from collections.abc import Sequence

from walkerlab.report.blocks import CASES, COSTS, PAPER, Cards, PageBlock, Paragraph, Section, Terms, Waiting
from walkerlab.report.numbers import count, listed
from walkerlab.report.results import Results
from walkerlab.report.tables import Column, table
from walkerlab.report.words import words
from walkerlab.scene.left_out import LeftOut

TITLES = {
    PAPER: "Number by number: the paper and what is found here",
    CASES: "Extreme cases and known problems",
    COSTS: "Accuracy: what an error costs, and the rigid limit",
}
"""The pages beside the report, in their order."""


def further(results: Results, sections: Sequence[Section]) -> Section | None:
    """Links to the other pages, each with what it comes to in a sentence for each section, and what will be there."""
    items = []
    for file, title in TITLES.items():
        found = on(file, sections)
        silent = file == PAPER and not results.of_the_paper
        brief = "" if silent else " ".join(section.finding for section in found if section.finding)
        items += [(file, title, brief)] if found else []
    blocks: list[PageBlock] = [Cards(tuple(items))] if items else []
    blocks += [Waiting(words("closing.pending", name)) for name in results.pending]
    title = "Further pages" if items else "Still to come"
    return Section("further", title, tuple(blocks)) if blocks else None


def on(page: str, sections: Sequence[Section]) -> tuple[Section, ...]:
    """The sections of a page."""
    return tuple(section for section in sections if section.page == page)


def glossary(results: Results) -> Section:
    """What the words mean."""
    told = words("closing.glossary", results.config.contact is not None).split(" | ")
    terms = Terms(tuple((word, meaning) for word, _, meaning in (one.partition(": ") for one in told)))
    return Section("glossary", "Glossary", (terms,), "The words of this report, in a line each.")


def left_out(results: Results) -> Section:
    """Results that were not computed, and parts of results that were left out."""
    parts = [LeftOut(**one) for stored in results.stored.values() for one in stored.summary.get("left_out", [])]
    rows = rows_of(list(dict.fromkeys((*results.absent, *parts))))
    if not rows:
        said = Paragraph("Nothing is left out: every result of the pipeline is there.")
        return Section("left-out", "Left out", (said,), "Nothing.")
    columns = [Column("what"), Column("why", wide=True), Column("saves", wide=True)]
    missing = table("What was left out of this scene, why, and what that saves", columns, rows, wordy=True)
    return Section("left-out", "Left out", (missing,), f"{count(len(rows), 'thing')}, each with its reason.")


def rows_of(missing: Sequence[LeftOut]) -> list[list[str]]:
    """What is missing for one reason in a row, and in a row below it what is missing for want of that."""
    causes = dict.fromkeys(cause(absent.why, missing) for absent in missing)
    rows = []
    for why in causes:
        first = listed(absent.what for absent in missing if absent.why == why)
        saves = "; ".join(dict.fromkeys(absent.saves for absent in missing if absent.why == why and absent.saves))
        further = listed(absent.what for absent in missing if absent.why != why and cause(absent.why, missing) == why)
        rows += [[first, why, saves], *([[further, f"needs {first}", ""]] if further else [])]
    return rows


def cause(why: str, missing: Sequence[LeftOut]) -> str:
    """The reason at the bottom of a reason, such as 'it needs simulate: it needs fixedpoint: no gait'."""
    return min((absent.why for absent in missing if why.endswith(absent.why)), key=len)
