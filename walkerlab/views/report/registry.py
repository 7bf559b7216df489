"""The sections of the report in order, including those of extensions.

Each entry is a function that builds a `Section` from the results, or returns None if it has nothing to show. It reads
`Results.summary(stage)` and `Results.group(stage, path)`. If the stage did not run, the summary is empty and
the group is None.
"""

import math

from walkerlab.config import drives, files, schema, walkers
from walkerlab.extensions import extensions, load
from walkerlab.views.report import gaits
from walkerlab.views.report.blocks import MAIN, Results, Section, SectionMaker
from walkerlab.views.report.page import Page
from walkerlab.views.report.sections import (
    accuracy,
    adjustment,
    closing,
    families,
    identification,
    motion,
    robustness,
    verdict,
    walks,
)
from walkerlab.views.report.words import words


def added_sections(slot: str) -> tuple[SectionMaker, ...]:
    """Return the functions that build the extensions' sections at a position (`SLOTS`) of the page."""
    return tuple(load(maker) for extension in extensions().values() for maker in extension.sections.get(slot, ()))


SECTIONS: tuple[SectionMaker, ...] = (
    verdict.section,
    motion.section,
    *added_sections("task"),
    motion.figures,
    *added_sections("walks"),
    gaits.section,
    families.section,
    walks.assumptions,
    walks.contact,
    adjustment.section,
    walks.steps,
    families.basin,
    robustness.section,
    identification.section,
    identification.plan_section,
    verdict.models_section,
    *added_sections("evidence"),
    accuracy.section,
    *added_sections("benchmarks"),
    adjustment.limit,
    closing.glossary,
    closing.omissions_section,
    closing.provenance_section,
)


def pages_of(results: Results, run: str) -> tuple[Page, ...]:
    """Build the report, and each further page that has content. `run` is the name of the run's folder."""
    sections = sections_of(results)
    main = [section for section in sections if section.page == MAIN]
    further = {file: tuple(section for section in sections if section.page == file) for file in closing.TITLES}
    further = {file: sections for file, sections in further.items() if sections}
    if (links := closing.link_pages(results, further)) is not None:
        main.insert([section.anchor for section in main].index("glossary"), links)
    relation = "After" if results.departures else "Redoes"
    option = "" if run == files.DEFAULT else run
    title = f"{'Driven' if drives.drives_of(results.config) else 'Passive'} walking: {run}"
    source = results.config.source
    return (
        Page(title, tuple(main), (lead(results.config, run),), MAIN, source, relation, results.pending, option),
        *(Page(f"{closing.TITLES[file]} · {run}", parts, file=file, run=option) for file, parts in further.items()),
    )


def lead(config: schema.Config, run: str) -> str:
    """Describe what was run: the walker, its slope and its task."""
    equations = config.equations if walkers.is_passive_compass(config) else ""
    change = run.partition("@")[2].replace(",", ", ")
    alone = walkers.why_rigid_alone(config.walker)
    acting = drives.drives_of(config), drives.springs_of(config)
    return words("lead.scene", config, change, math.degrees(config.slope_rad), equations, *acting, alone)


def sections_of(results: Results, makers: tuple[SectionMaker, ...] = SECTIONS) -> tuple[Section, ...]:
    return tuple(section for make in makers if (section := make(results)) is not None)
