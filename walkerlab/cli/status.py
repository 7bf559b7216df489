"""`walkerlab status`: which results are current."""

from __future__ import annotations

from collections import Counter
from typing import Any

import typer

from walkerlab.cli.failures import described, print_json, say
from walkerlab.cli.request import Request
from walkerlab.cli.runs import rows_of_runs, run_object
from walkerlab.config.schema import Config
from walkerlab.errors import StaleError
from walkerlab.report.tables import aligned
from walkerlab.stages.graph import Graph
from walkerlab.stages.plan import UP_TO_DATE, Step, survey
from walkerlab.stages.runs import RunSummary, config_of, run_named, runs_in
from walkerlab.store.artifact import NOT_THERE
from walkerlab.store.runfolder import RunFolder

NOT_CURRENT = ("stale", "missing", "damaged")


def print_status(request: Request, graph: Graph, check: bool) -> None:
    """Print the state of each stage, and all runs unless one config was asked about.

    With `check`, typer.Exit(5) if a stage's result is stale, missing or damaged.
    """
    asked = request.config is not None or request.sets or request.strides is not None
    listed = None if asked else list(runs_in(request.runs, graph))
    show(request, request.resolved, request.folder, graph, check, listed)


def print_status_of_run(request: Request, graph: Graph, check: bool, name: str) -> None:
    """The same of a run folder, under the config that its results are of.

    Raises ConfigError if there is no such run, StaleError if nothing tells its config.
    """
    folder = run_named(name, request.runs)
    config = config_of(folder)
    if config is None:
        raise StaleError(f"{folder.path} has no result that tells its config.", "`walkerlab status` lists all runs.")
    show(request, config, folder, graph, check, None)


def show(
    request: Request,
    config: Config,
    folder: RunFolder,
    graph: Graph,
    check: bool,
    listed: list[RunSummary] | None,
) -> None:
    """Print the state of each stage and the runs that are listed."""
    steps = survey(config, folder, graph)
    error = failing(steps, graph.stages[-1].name)
    if request.as_json:
        rows = [
            {
                "stage": step.stage.name,
                "state": state_of(step),
                "why": step.reason,
                "artifact": str(folder.artifact(step.stage.name)) if step.found is not None else None,
            }
            for step in steps
        ]
        status: dict[str, Any] = {"run_dir": str(folder.path), "current": error is None, "stages": rows}
        if listed is not None:
            status["runs"] = [run_object(run) for run in listed]
        print_json(status | ({"error": described(error)} if check and error is not None else {}))
    else:
        print(f"{folder.path}:")
        print("\n".join(aligned([["stage", "state", "why"], *([s.stage.name, state_of(s), why(s)] for s in steps)])))
        if listed:
            print("\n".join([f"\nall runs in {request.runs}:", *aligned(rows_of_runs(listed))]))
    if check and error is not None:
        say(error, request.typed)
        raise typer.Exit(error.exit_code)


def state_of(step: Step) -> str:
    """The state of a stage's result, in a word or two."""
    if step.action == "leave out":
        return "left out"
    if step.action == "reuse":
        return "current" if step.found is not None and step.found.complete else "no answer"
    if step.damaged:
        return "damaged"
    if step.stage.optional:
        return "not run" if step.found is None else "outdated"
    return "missing" if step.found is None else "stale"


def why(step: Step) -> str:
    """Why a stage's result is in its state; nothing where the state says it."""
    return "" if step.reason in (NOT_THERE, UP_TO_DATE) else step.reason.removeprefix(f"{state_of(step)}: ")


def failing(steps: tuple[Step, ...], last: str) -> StaleError | None:
    """What `--check` fails with, if it does."""
    counts = Counter(state for step in steps if (state := state_of(step)) in NOT_CURRENT)
    if not counts:
        return None
    spoken = ", ".join(f"{number} {state}" for state, number in counts.items())
    return StaleError(f"not every result is up to date: {spoken}.", f"`walkerlab {last}` computes them all.")
