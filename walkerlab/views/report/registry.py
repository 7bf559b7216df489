"""The sections of the report in their order: an entry for each, those that evidence registers among them.

A section is a function that makes a `Section` of the results, or None if there is nothing to show. It finds what it
needs with `Results.summary(stage)` and `Results.group(stage, path)`, which give None for a stage that did not run.
"""

import math

from walkerlab.config.drives import drives_of, springs_of
from walkerlab.config.files import DEFAULT
from walkerlab.config.schema import Config
from walkerlab.config.walkers import is_passive_compass, why_rigid_alone
from walkerlab.registration import registered
from walkerlab.views.report.blocks import MAIN, Section
from walkerlab.views.report.page import Page
from walkerlab.views.report.results import Results, SectionMaker
from walkerlab.views.report.sections import (
    accuracy,
    adjustment,
    closing,
    families,
    gaits,
    models,
    motion,
    provenance,
    robustness,
    verdict,
    walks,
)
from walkerlab.views.report.words import words

SECTIONS: tuple[SectionMaker, ...] = (
    verdict.section,
    motion.section,
    registered("walkerlab.evidence.paper.sections", "paper_section"),
    motion.figures,
    gaits.section,
    families.section,
    walks.assumptions,
    walks.contact,
    adjustment.section,
    walks.steps,
    families.basin,
    robustness.section,
    models.section,
    registered("walkerlab.evidence.paper.sections", "numbers"),
    registered("walkerlab.evidence.paper.sections", "tables"),
    registered("walkerlab.evidence.paper.sections", "errors"),
    registered("walkerlab.evidence.verification.section", "section"),
    accuracy.section,
    registered("walkerlab.evidence.benchmarks.engines.section", "section"),
    adjustment.limit,
    closing.glossary,
    closing.left_out,
    provenance.section,
)


def pages_of(results: Results, run: str) -> tuple[Page, ...]:
    """The report and the pages beside it that there is something for.

    run  name of the run's folder
    """
    sections = sections_of(results)
    main = [section for section in sections if section.page == MAIN]
    beside = {file: tuple(one for one in sections if one.page == file) for file in closing.TITLES}
    beside = {file: found for file, found in beside.items() if found}
    links = closing.further(results, beside)
    if links is not None:
        main.insert([section.anchor for section in main].index("glossary"), links)
    redone = "After" if results.departures else "Redoes"
    of_run = "" if run == DEFAULT else run
    title, source = f"{'Driven' if drives_of(results.config) else 'Passive'} walking: {run}", results.config.source
    return (
        Page(title, tuple(main), (lead(results.config, run),), MAIN, source, redone, results.pending, of_run),
        *(Page(f"{closing.TITLES[file]} · {run}", found, file=file, run=of_run) for file, found in beside.items()),
    )


def lead(config: Config, run: str) -> str:
    """What was run: the walker, its slope and what it was to do."""
    equations = config.equations if is_passive_compass(config) else ""
    change = run.partition("@")[2].replace(",", ", ")
    degrees, alone = math.degrees(config.slope_rad), why_rigid_alone(config.walker)
    acting = drives_of(config), springs_of(config)
    return words("lead.scene", config, change, degrees, equations, *acting, alone)


def sections_of(results: Results, makers: tuple[SectionMaker, ...] = SECTIONS) -> tuple[Section, ...]:
    """The sections that these results have something for."""
    return tuple(section for make in makers if (section := make(results)) is not None)
