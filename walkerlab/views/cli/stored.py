"""`walkerlab status` and `walkerlab show STAGE`: which results are current, and their content."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from walkerlab.errors import ConfigError, StaleError
from walkerlab.pipeline.plan.results import UP_TO_DATE, Step
from walkerlab.pipeline.plan.survey import RunSummary, runs_in, survey
from walkerlab.pipeline.run.executor import short_reason
from walkerlab.pipeline.store.artifact import NOT_THERE, Stored
from walkerlab.pipeline.store.content import Variable
from walkerlab.pipeline.store.runfolder import RunFolder
from walkerlab.pipeline.store.runs import config_of, run_named
from walkerlab.views.cli.failures import print_result
from walkerlab.views.cli.request import Request
from walkerlab.views.report.tables import aligned
from walkerlab.views.report.text import describe_summary

DIGEST_CHARACTERS = 12
"""Number of a digest's characters shown in text output."""
NOT_CURRENT = ("stale", "missing", "damaged")


def print_status(request: Request, check: bool, run: str | None) -> None:
    """Print the state of each stage, and of all runs unless one was selected.

    run  name or folder of a run, compared with the config stored in its results; None for the request's run
    Raises ConfigError for an unknown run, StaleError if its config is unreadable; with `check`, typer.Exit(5) for a
    stale, missing or damaged result.
    """
    folder = request.folder if run is None else run_named(run, request.runs)
    config = request.resolved if run is None else config_of(folder)
    if config is None:
        raise StaleError(f"{folder.path} has no result with a readable config.", "`walkerlab status` lists all runs.")
    is_selected = run is not None or request.config is not None or request.settings or request.strides is not None
    listed = None if is_selected else list(runs_in(request.runs, request.graph))
    steps = survey(config, folder, request.graph)
    error = check_error(steps, request.graph.stages[-1].name)
    rows = [
        {
            "stage": step.stage.name,
            "state": state_of(step),
            "why": step.reason,
            "artifact": str(folder.artifact(step.stage.name)) if step.found is not None else None,
        }
        for step in steps
    ]
    folders = [folder] if listed is None else [RunFolder.open_folder(path) for path in sorted(request.runs.glob("*/"))]
    working = {place.path: worker for place in folders if (worker := place.worker()) is not None}
    status: dict[str, Any] = {
        "run_dir": str(folder.path),
        "changes": list(folder.changes),
        "running": [{"run_dir": str(path), **asdict(worker)} for path, worker in working.items()],
        "current": error is None,
        "stages": rows,
    }
    names = [step.stage.name for step in steps]
    table = aligned(
        [["stage", "state", "why"], *map(list, zip(names, map(state_of, steps), explain_states(steps), strict=True))]
    )
    changed = [f"changed: {', '.join(folder.changes)}"] if folder.changes else []
    running = [f"running in {path}: {worker}" for path, worker in working.items()]
    lines = [*running, f"{folder.path}:", *changed, *table]
    if listed is not None:
        status["runs"] = [vars(run_summary) | {"run_dir": str(run_summary.run_dir)} for run_summary in listed]
    if listed:
        head = ["run", "results", "up to date", "sweeps", "size", "last written", "changed"]
        lines += ["", f"all runs in {request.runs}:", *aligned([head, *map(row_of, listed)])]
    print_result(request, status, lines, error if check else None)


def row_of(run: RunSummary) -> list[str]:
    unknown = "unknown config" if run.stages else "0"
    current = unknown if run.current is None else str(len([s for s in run.stages if s in run.current]))
    counts = [str(len(run.stages)), current, str(len(run.sweeps))]
    return [run.name, *counts, f"{run.bytes / 1e6:.1f} MB", run.changed_utc, ", ".join(run.changes)]


def state_of(step: Step) -> str:
    if step.action == "leave out":
        return "left out"
    if step.action == "reuse":
        return "current" if step.found is not None and step.found.complete else "no answer"
    if step.damaged:
        return "damaged"
    if step.stage.only_by:
        return "not run" if step.found is None else "outdated"
    return "missing" if step.found is None else "stale"


def why(step: Step) -> str:
    """Explain the state of a result, or return '' if it needs no explanation."""
    return "" if step.reason in (NOT_THERE, UP_TO_DATE) else step.reason.removeprefix(f"{state_of(step)}: ")


def explain_states(steps: Sequence[Step]) -> Iterator[str]:
    """Explain each stage's state. A repeated reason refers to the first stage that has it."""
    first: dict[str, str] = {}
    for step in steps:
        reason = short_reason(why(step)) if step.action == "leave out" else why(step)
        yield f"as {first[reason]}" if reason in first else reason
        if reason:
            first.setdefault(reason, step.stage.name)


def check_error(steps: tuple[Step, ...], last: str) -> StaleError | None:
    """Return the error for `--check`, or None if every result is current."""
    counts = Counter(state for step in steps if (state := state_of(step)) in NOT_CURRENT)
    if not counts:
        return None
    counted_states = ", ".join(f"{number} {state}" for state, number in counts.items())
    return StaleError(f"not every result is up to date: {counted_states}.", f"`walkerlab {last}` computes them all.")


def print_stored(request: Request, stage: str) -> None:
    """Print a stage's artifact, current or not.

    Raises StaleError if it cannot be read.
    """
    path = request.folder.artifact(stage)
    step = next(step for step in survey(request.resolved, request.folder, request.graph) if step.stage.name == stage)
    if not request.folder.path.is_dir():
        raise ConfigError(f"there is no run at {request.folder.path}.", f"`walkerlab {stage}` creates it.")
    if not isinstance(step.found, Stored):
        why = "it does not exist yet" if step.reason == NOT_THERE else step.reason
        raise StaleError(f"{path} cannot be shown: {why}.", f"`walkerlab {stage}` computes it.")
    if step.action != "reuse":
        request.console.warn(f"{path} is out of date: {step.reason}")
    about = {"stage": stage, "artifact": str(path), "current": step.action == "reuse", "why": step.reason}
    print_result(request, about | as_json(step.found), [f"{stage}: {path}", *lines(step.found)])


def as_json(stored: Stored) -> dict[str, Any]:
    """Describe an artifact as JSON, without the values of its arrays."""

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
    """Describe an artifact in lines: summary, arrays and provenance."""
    result = ["summary", *describe_summary(stored.summary)]
    for path, group in stored.groups.items():
        result.append(path)
        result += [f"  {line}" for line in describe_summary(group.attrs)]
        result += [f"  {line}" for line in aligned([row(name, variable) for name, variable in group.variables.items()])]
    where = stored.provenance
    versions = {"walkerlab": where.package_version, **where.library_versions}
    facts = {
        "key": stored.identity.key[:DIGEST_CHARACTERS],
        "content": stored.digest()[:DIGEST_CHARACTERS],
        "made": f"{where.started_utc} to {where.ended_utc}",
        "command": where.command_line,
        "commit": where.git_commit,
        "platform": where.platform,
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
    }
    return [*result, "provenance", *describe_summary(facts)]


def row(name: str, variable: Variable) -> list[str]:
    sizes = ", ".join(f"{dim} {size}" for dim, size in zip(variable.dims, variable.values.shape, strict=True))
    return [name, f"({sizes})", variable.units, variable.long_name]
