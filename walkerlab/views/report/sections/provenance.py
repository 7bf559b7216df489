"""Provenance: config, software, machine, and the key of each result."""

from collections.abc import Sequence

from walkerlab.config.writer import to_yaml
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.views.report.blocks import Code, Section
from walkerlab.views.report.results import Results
from walkerlab.views.report.tables import Column, Table, side_by_side, table
from walkerlab.views.report.words import words


def section(results: Results) -> Section | None:
    stored = [result for result in results.stored.values() if isinstance(result, Stored)]  # these have a provenance
    note = "A key covers config, inputs and code; equal keys give equal digests. Neither includes timings."
    blocks = (
        Code("The config of this run, defaults included", to_yaml(results.config).strip()),
        table("Computation of each result", RESULT_COLUMNS, stored),
        software_table(stored),
        table("Keys and digests of the results", DIGEST_COLUMNS, stored, note=note),
        Code("Command lines", "\n".join(dict.fromkeys(result.provenance.command_line for result in stored))),
    )
    finding = words("closing.provenance", [result.provenance for result in stored])
    return Section.of("provenance", "Provenance", blocks, finding)


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
    """Tabulate software versions and platform, in one column unless the results differ."""
    used: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for result in stored:
        origin = result.provenance
        versions = {"walkerlab": origin.package_version, "commit": origin.git_commit or "unknown"}
        versions |= {**dict(sorted(origin.library_versions.items())), "platform": origin.platform}
        used.setdefault(tuple(versions.items()), []).append(result.identity.stage)
    columns = {", ".join(stages) if len(used) > 1 else "version": dict(versions) for versions, stages in used.items()}
    lines = [Column(name, name) for name in dict.fromkeys(name for versions in columns.values() for name in versions)]
    return side_by_side("Software and machine", lines, columns, head="software", numeric=False)
