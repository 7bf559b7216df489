"""Sections at the end of the page: glossary, links to further pages, what was left out, and provenance."""

from collections.abc import Iterator, Mapping, Sequence

from walkerlab.config.drives import drives_of
from walkerlab.config.writer import to_yaml
from walkerlab.labels import join_words
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.report.blocks import CASES, COSTS, PAPER_PAGE, Cards, Code, Paragraph, Results, Section, Terms
from walkerlab.views.report.numbers import count
from walkerlab.views.report.tables import Column, Table, side_by_side, table
from walkerlab.views.report.words import words


def provenance_section(results: Results) -> Section | None:
    # Only stored results have a provenance.
    stored = [result for result in results.stored.values() if isinstance(result, Stored)]
    note = "A key covers config, inputs and code. Equal keys give equal digests. Neither includes timings."
    blocks = (
        Code("The config of this run, defaults included", to_yaml(results.config).strip()),
        table("Computation of each result", RESULT_COLUMNS, stored),
        software_table(stored),
        table("Keys and digests of the results", DIGEST_COLUMNS, stored, note=note),
        Code("Command lines", "\n".join(dict.fromkeys(result.provenance.command_line for result in stored))),
    )
    finding = words("closing.provenance", [result.provenance for result in stored])
    return Section.create("provenance", "Provenance", blocks, finding)


def to_the_second(time_utc: str) -> str:
    return time_utc.partition(".")[0].replace("T", " ")


RESULT_COLUMNS = (
    Column("result", lambda result: result.identity.stage),
    Column("started (UTC)", lambda result: to_the_second(result.provenance.started_utc), numeric=True),
    Column("run time (s)", lambda result: f"{result.provenance.took_s:.2f}", numeric=True),
    Column("seed", lambda result: result.provenance.seed, numeric=True),
    Column("complete", lambda result: result.complete),
)
DIGEST_COLUMNS = (
    Column("result", lambda result: f"{result.identity.stage}.h5"),
    Column("stage key (sha256)", lambda result: result.identity.key, wide=True),
    Column("content digest", lambda result: result.digest(), wide=True),
)


def software_table(stored: Sequence[Stored]) -> Table:
    """Tabulate software versions and platform, in one column if they are the same for all results."""
    used: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for result in stored:
        origin = result.provenance
        versions = {"walkerlab": origin.package_version, "commit": origin.git_commit or "unknown"}
        versions |= {**dict(sorted(origin.library_versions.items())), "platform": origin.platform}
        used.setdefault(tuple(versions.items()), []).append(result.identity.stage)
    columns = {", ".join(stages) if len(used) > 1 else "version": dict(versions) for versions, stages in used.items()}
    lines = [Column(name, name) for name in dict.fromkeys(name for versions in columns.values() for name in versions)]
    return side_by_side("Software and machine", lines, columns, head="software", numeric=False)


TITLES = {
    PAPER_PAGE: "The paper's values compared with computed ones",
    CASES: "Extreme cases and known problems",
    COSTS: "Accuracy: run time against error, and the rigid limit",
}
"""Titles of the further pages, in order."""


def link_pages(results: Results, pages: Mapping[str, Sequence[Section]]) -> Section | None:
    """Link to the further pages, quote the findings of their sections, and announce pending results."""
    items = []
    for file, sections in pages.items():
        findings = (section.finding for section in sections if file != PAPER_PAGE or results.claims)
        items.append((file, TITLES[file], " ".join(filter(None, findings))))
    waiting = (Paragraph(words("closing.pending", entry.what), "waiting") for entry in results.pending)
    title = "Further pages" if items else "Not computed yet"
    return Section.create("further", title, (Cards(tuple(items)) if items else None, *waiting))


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
    return Section.create("left-out", "Omitted results", (missing, nothing), finding)


def rows_by_reason(missing: Sequence[LeftOut]) -> Iterator[tuple[str, str, str]]:
    """For each reason, yield a row with the results that it affects directly and, if there are any, one with those that
    need them.

    A row has the results, the reason, and what leaving them out saves.
    """
    reasons = {absent.why for absent in missing}
    # The actual reason comes last: in 'it needs simulate: it needs fixedpoint: no gait', it is 'no gait'.
    causes = {absent.why: min(filter(absent.why.endswith, reasons), key=len) for absent in missing}
    for reason in dict.fromkeys(causes.values()):
        same_reason = [absent for absent in missing if absent.why == reason]
        first = join_words(absent.what for absent in same_reason)
        yield first, reason, "; ".join(dict.fromkeys(absent.saves for absent in same_reason if absent.saves))
        others = join_words(absent.what for absent in missing if absent.why != reason and causes[absent.why] == reason)
        if others:
            yield others, f"needs {first}", ""
