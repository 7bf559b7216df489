"""`walkerlab show STAGE`: what is stored."""

from dataclasses import asdict
from typing import Any

from walkerlab.cli.failures import print_json
from walkerlab.cli.request import Request
from walkerlab.errors import ConfigError, StaleError
from walkerlab.pipeline.graph import Graph
from walkerlab.pipeline.plan import survey
from walkerlab.report.tables import aligned
from walkerlab.report.text import described_summary
from walkerlab.store.artifact import NOT_THERE, Stored
from walkerlab.store.content import Variable

SHORT = 12
"""Characters of a digest that are shown to people."""


def print_stored(request: Request, graph: Graph, stage: str) -> None:
    """Print a stage's artifact, current or not; StaleError if there is none that can be read."""
    path = request.folder.artifact(stage)
    step = next(step for step in survey(request.resolved, request.folder, graph) if step.stage.name == stage)
    if not request.folder.path.is_dir():
        raise ConfigError(f"there is no run at {request.folder.path}.", f"`walkerlab {stage}` creates it.")
    if step.found is None:
        why = "there is none yet" if step.reason == NOT_THERE else step.reason
        raise StaleError(f"{path} cannot be shown: {why}.", f"`walkerlab {stage}` computes it.")
    if step.action != "reuse":
        request.console.warn(f"{path} is out of date: {step.reason}")
    if request.as_json:
        print_json(
            {"stage": stage, "artifact": str(path), "current": step.action == "reuse", "why": step.reason}
            | as_json(step.found)
        )
    else:
        print("\n".join([f"{stage}: {path}", *lines(step.found)]))


def as_json(stored: Stored) -> dict[str, Any]:
    """All but the arrays' values."""

    def labels(variable: Variable) -> dict[str, Any]:
        shape = list(variable.values.shape)
        return {
            "dims": list(variable.dims), "shape": shape, "units": variable.units, "long_name": variable.long_name
        }  # fmt: skip

    return {
        "complete": stored.complete,
        "summary": stored.summary,
        "groups": {
            path: {"attrs": dict(group.attrs), "variables": {n: labels(v) for n, v in group.variables.items()}}
            for path, group in stored.groups.items()
        },
        "key": stored.identity.key,
        "input_keys": dict(stored.identity.input_keys),
        "code_digest": stored.identity.code_digest,
        "content_digest": stored.digest(),
        "provenance": asdict(stored.provenance),
    }


def lines(stored: Stored) -> list[str]:
    """Summary, arrays and provenance for people."""
    result = ["summary", *described_summary(stored.summary)]
    for path, group in stored.groups.items():
        result.append(path)
        result += [f"  {line}" for line in described_summary(group.attrs)]
        result += [f"  {line}" for line in aligned([row(name, variable) for name, variable in group.variables.items()])]
    where = stored.provenance
    versions = {"walkerlab": where.package_version, **where.library_versions}
    facts = {
        "key": stored.identity.key[:SHORT],
        "content": stored.digest()[:SHORT],
        "made": f"{where.started_utc} to {where.ended_utc}",
        "command": where.command_line,
        "commit": where.git_commit,
        "platform": where.platform,
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
    }
    return [*result, "provenance", *described_summary(facts)]


def row(name: str, variable: Variable) -> list[str]:
    """A variable as a row: name, dimensions with lengths, unit, what it is."""
    sizes = ", ".join(f"{dim} {size}" for dim, size in zip(variable.dims, variable.values.shape, strict=True))
    return [name, f"({sizes})", variable.units, variable.long_name]
