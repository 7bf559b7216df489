"""Where the numbers come from: config, software, machine, and what determines each result."""

from __future__ import annotations

import datetime

from walkerlab.config.writer import to_yaml
from walkerlab.report.blocks import Block, Code, Column, Section, Table, table
from walkerlab.report.numbers import count, listed
from walkerlab.report.results import Results
from walkerlab.store.artifact import Stored


def section(results: Results) -> Section:
    """Config, and provenance of each result."""
    blocks: list[Block] = [Code("The config of this run, defaults included", to_yaml(results.config).strip())]
    if results.stored:
        blocks += [results_table(results), software_table(results), digests_table(results)]
        blocks.append(Code("Command lines", "\n".join(command_lines(results))))
    return Section("provenance", "Where this comes from", tuple(blocks), finding(results))


def finding(results: Results) -> str:
    """Which version made the results, and how many there are."""
    if not results.stored:
        return "The config of this run."
    versions = listed(dict.fromkeys(result.provenance.package_version for result in results.stored.values()))
    commits = dict.fromkeys(result.provenance.git_commit for result in results.stored.values())
    made_from = listed(commit[:9] for commit in commits if commit)
    at = f", commit {made_from}" if made_from else ""
    return f"{count(len(results.stored), 'result')} of walkerlab {versions}{at}; config, machine, keys and digests."


def results_table(results: Results) -> Table:
    """When and by what each result was made."""
    columns = [
        Column("result"),
        Column("begun (UTC)", numeric=True),
        Column("took (s)", numeric=True),
        Column("seed", numeric=True),
        Column("complete"),
    ]
    rows = [
        [
            name,
            result.provenance.started_utc.partition(".")[0].replace("T", " "),
            f"{took_s(result):.2f}",
            str(result.provenance.seed),
            "yes" if result.complete else "no",
        ]
        for name, result in results.stored.items()
    ]
    return table("When each result was made", columns, rows)


def took_s(result: Stored) -> float:
    """How long a stage ran, s."""
    begun, ended = (
        datetime.datetime.fromisoformat(time) for time in (result.provenance.started_utc, result.provenance.ended_utc)
    )
    return (ended - begun).total_seconds()


def software_table(results: Results) -> Table:
    """Versions, and the machine; more than one column only if results differ."""
    used: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for name, result in results.stored.items():
        used.setdefault(software(result), []).append(name)
    names = list(dict.fromkeys(name for versions in used for name, _ in versions))
    heads = [", ".join(stages) for stages in used.values()] if len(used) > 1 else ["version"]
    columns = [Column("software"), *(Column(head) for head in heads)]
    rows = [[name, *(dict(versions).get(name, "") for versions in used)] for name in names]
    return table("Software and machine", columns, rows)


def software(result: Stored) -> tuple[tuple[str, str], ...]:
    """What a result was made with."""
    made = result.provenance
    libraries = sorted(made.library_versions.items())
    commit = made.git_commit or "unknown"
    return (("walkerlab", made.package_version), ("commit", commit), *libraries, ("platform", made.platform))


def digests_table(results: Results) -> Table:
    """Key and digest of each result."""
    columns = [Column("result"), Column("stage key (sha256)", wide=True), Column("digest of its content", wide=True)]
    rows = [[f"{name}.h5", result.identity.key, result.digest()] for name, result in results.stored.items()]
    return table(
        "What determines each result, and what it holds",
        columns,
        rows,
        note="A key is made of config, inputs and code; equal keys give equal digests. Timings are in neither.",
    )


def command_lines(results: Results) -> list[str]:
    """The commands that made the results, each once."""
    return list(dict.fromkeys(result.provenance.command_line for result in results.stored.values()))
