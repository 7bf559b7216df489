"""`walkerlab status`: which results are current."""

from __future__ import annotations

from collections import Counter

import typer

from walkerlab.cli.failures import described, print_json, say
from walkerlab.cli.request import Request
from walkerlab.cli.text import aligned
from walkerlab.errors import StaleError
from walkerlab.stages.graph import Graph
from walkerlab.stages.plan import Step, survey

NOT_CURRENT = ("stale", "missing", "damaged")


def print_status(request: Request, graph: Graph, check: bool) -> None:
    """Print the state of each stage; with `check`, typer.Exit(5) if one is stale, missing or damaged."""
    folder = request.folder
    steps = survey(request.resolved, folder, graph)
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
        status = {"run_dir": str(folder.path), "current": error is None, "stages": rows}
        print_json(status | ({"error": described(error)} if check and error is not None else {}))
    else:
        print(f"{folder.path}:")
        print("\n".join(aligned([["stage", "state", "why"], *([s.stage.name, state_of(s), s.reason] for s in steps)])))
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
    if step.stage.campaign_of:
        return "not run" if step.found is None else "outdated"
    return "missing" if step.found is None else "stale"


def failing(steps: tuple[Step, ...], last: str) -> StaleError | None:
    """What `--check` fails with, if it does."""
    counts = Counter(state for step in steps if (state := state_of(step)) in NOT_CURRENT)
    if not counts:
        return None
    spoken = ", ".join(f"{number} {state}" for state, number in counts.items())
    return StaleError(f"not every result is current: {spoken}.", f"`walkerlab {last}` makes all of them.")
