"""What closes the report: what is one link away, what its words mean, and what is not in it, and why."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from walkerlab.report.blocks import CASES, COSTS, MAIN, PAPER, Cards, PageBlock, Paragraph, Section, Terms, Waiting
from walkerlab.report.numbers import count, listed
from walkerlab.report.results import Results
from walkerlab.report.tables import Column, table
from walkerlab.scene.left_out import LeftOut

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


def further(results: Results, elsewhere: Sequence[Section]) -> Section | None:
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


WORDS = (
    ("Step", "From one heel strike to the next; a stride is two of them, one with each leg."),
    ("Heel strike", "The instant in which the swing foot comes down ahead and the legs change roles."),
    ("Gait", "A walk in which every step is like the last: a fixed point of the step map."),
    ("Step map", "What takes the state just after one heel strike to the state just after the next."),
    (
        "Multiplier",
        "Eigenvalue of the step map’s derivative at a gait: the factor on a small disturbance in a step. "
        "A gait is stable if all are smaller than 1 in magnitude; the largest magnitude is the spectral radius.",
    ),
    ("Scuffing", "A straight swing leg passes below the ground near mid-swing. The rigid model ignores it."),
)
OF_CONTACT = (
    ("Rigid model", "A foot stands still on the ground until the other one comes down in a plastic impact."),
    ("Contact model", "Feet that sink into the ground and slip on it, by ADAMS’s laws of normal force and friction."),
    ("Penetration", "How deep a foot is in the ground; static, with the whole weight on one foot."),
    ("Slip", "How far a standing foot moves along the slope, rolling not counted."),
    ("Phase", "The part of a step that has gone by. At the same phase, a slower clock makes no difference."),
)


def glossary(results: Results) -> Section:
    """What the words mean."""
    words = WORDS if results.config.contact is None else (*WORDS, *OF_CONTACT)
    return Section("glossary", "Glossary", (Terms(words),), "The words of this report, in a line each.")


def left_out(results: Results) -> Section:
    """Results that were not computed, and parts of results that were left out."""
    rows = rows_of(everything_absent(results))
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


def everything_absent(results: Results) -> list[LeftOut]:
    """What is missing as a whole, then what results say that they left out."""
    found = list(results.absent)
    for result in results.stored.values():
        found += [LeftOut(**one) for one in result.summary.get("left_out", [])]
    return list(dict.fromkeys(found))
