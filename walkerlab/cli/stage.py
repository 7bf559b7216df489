"""A stage's command: run it, or say what would happen; then print the result."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import typer

from walkerlab.cli.failures import described, print_json, say
from walkerlab.cli.request import Request
from walkerlab.cli.text import aligned, described_summary
from walkerlab.stages.graph import Graph, Stage
from walkerlab.stages.runner import StageReport, execute, preview


def run_stage(
    request: Request, stage: Stage, graph: Graph, *, force: bool, dry_run: bool, wait: bool, jobs: int, full: bool
) -> None:
    """Do what the command asks and print it; typer.Exit(4) if there is no answer, else as `execute` raises."""
    config, folder = request.resolved, request.folder
    if dry_run:
        report = preview(config, stage.name, folder, force=force, full=full, graph=graph)
        show(request, as_json(report) | {"dry_run": True}, planned(report))
        return
    report = execute(
        config, stage.name, folder, force=force, wait=wait, jobs=jobs, full=full, reporter=request.console, graph=graph
    )
    show(request, as_json(report), printed(report))
    if report.no_answer is not None:
        say(report.no_answer)
        raise typer.Exit(report.no_answer.exit_code)


def show(request: Request, value: dict[str, Any], text: str) -> None:
    """Print a result in the way that was asked for."""
    if request.as_json:
        print_json(value)
    else:
        print(text)


def as_json(report: StageReport) -> dict[str, Any]:
    """The one JSON object of a stage: the keys that all stages have, then those of its summary."""
    common: dict[str, Any] = {
        "stage": report.stage,
        "run_dir": str(report.run_dir),
        "artifact": None if report.artifact is None else str(report.artifact),
        "reused": report.reused,
        "wall_s": report.wall_s,
        "left_out": [asdict(entry) for entry in report.left_out],
    }
    own = {key: value for key, value in report.summary.items() if key not in (*common, "no_answer")}
    error = {} if report.no_answer is None else {"error": described(report.no_answer)}
    return common | own | {"stages": [asdict(done) for done in report.steps]} | error


def printed(report: StageReport) -> str:
    """The result for people."""
    where = f"{report.stage}: {report.artifact}" if report.artifact else f"{report.stage}: no result"
    own = {key: value for key, value in report.summary.items() if key != "no_answer"}
    return "\n".join([where, *described_summary(own), *left_out_lines(report)])


def planned(report: StageReport) -> str:
    """What would happen, for people."""
    rows = [[done.stage, done.action, done.reason] for done in report.steps]
    return "\n".join([f"in {report.run_dir}:", *aligned(rows), *left_out_lines(report)])


def left_out_lines(report: StageReport) -> list[str]:
    """What was left out, why, and what that saves."""
    return [
        f"left out: {entry.what} ({entry.why})" + (f"; saves {entry.saves}" if entry.saves else "")
        for entry in report.left_out
    ]
