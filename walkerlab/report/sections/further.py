"""What is one link away, and what is still being computed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from walkerlab.report.blocks import CASES, COSTS, MAIN, PAPER, Cards, PageBlock, Section, Waiting
from walkerlab.report.results import Results

TITLES = {
    PAPER: "Number by number: the paper and what is found here",
    CASES: "Extreme cases and known problems",
    COSTS: "Accuracy: what an error costs, and the rigid limit",
}
"""The pages beside the report, in their order."""

WAITED_FOR = {
    "contact-sim": "the walk of the contact model",
    "compare": "both models compared, with each other and with the paper",
    "tune": "the parameter adjustment",
    "accuracy": "error against run time",
    "stability": "extreme cases and known problems",
    "continuation": "the family of gaits",
    "basin": "which starts walk",
    "plot": "the figures",
    "simulate": "the walk of the rigid model",
    "fixedpoint": "the periodic gait",
}
"""What a stage brings into the report."""


def section(results: Results, elsewhere: Sequence[Section]) -> Section | None:
    """Links to the other pages, each with what it comes to, and what will be there."""
    items = tuple(
        (file, title, "" if file == PAPER and not results.of_the_paper else brief(on(file, elsewhere)))
        for file, title in TITLES.items()
        if any(one.page == file for one in elsewhere)
    )
    blocks: list[PageBlock] = [Cards(items)] if items else []
    blocks += [Waiting(f"Still being computed: {WAITED_FOR.get(name, name)}.") for name in results.pending]
    title = "Further pages" if items else "Still to come"
    return Section("further", title, tuple(blocks)) if blocks else None


def brief(sections: Iterable[Section]) -> str:
    """What a page comes to, in a sentence for each of its sections."""
    return " ".join(section.finding for section in sections if section.finding)


def on(page: str, sections: Sequence[Section]) -> tuple[Section, ...]:
    """The sections of a page."""
    return tuple(section for section in sections if section.page == page)


def elsewhere(sections: Sequence[Section]) -> tuple[Section, ...]:
    """The sections of all other pages."""
    return tuple(section for section in sections if section.page != MAIN)
