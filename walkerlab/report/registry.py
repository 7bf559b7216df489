"""The sections of the report in their order: one file each, and one entry here.

A section is a function that makes a `Section` of the results, or None if there is nothing to show. It finds what it
needs with `Results.summary(stage)` and `Results.group(stage, path)`, which give None for a stage that did not run.
"""

from __future__ import annotations

from collections.abc import Callable

from walkerlab.report.blocks import Section
from walkerlab.report.results import Results
from walkerlab.report.sections import (
    accuracy,
    adjustment,
    assumptions,
    basin,
    contact_walk,
    engines,
    errata,
    figures,
    gaits,
    left_out,
    models,
    motion,
    paper_numbers,
    paper_tables,
    provenance,
    stability,
    steps,
    verdict,
)

SectionMaker = Callable[[Results], Section | None]

SECTIONS: tuple[SectionMaker, ...] = (
    verdict.section,
    motion.section,
    figures.section,
    gaits.section,
    assumptions.section,
    contact_walk.section,
    adjustment.section,
    steps.section,
    basin.section,
    models.section,
    accuracy.section,
    engines.section,
    paper_tables.section,
    paper_numbers.section,
    errata.section,
    stability.section,
    left_out.section,
    provenance.section,
)


def sections_of(results: Results, makers: tuple[SectionMaker, ...] = SECTIONS) -> tuple[Section, ...]:
    """The sections that these results have something for."""
    return tuple(section for make in makers if (section := make(results)) is not None)
