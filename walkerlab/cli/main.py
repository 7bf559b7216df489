"""The program: one command for each stage of the pipeline, and the house-keeping commands."""

import inspect
from collections.abc import Callable
from typing import Annotated

import typer

from walkerlab import __version__
from walkerlab.cli import housekeeping, runs, sweep
from walkerlab.cli.failures import exit_on_failure
from walkerlab.cli.options import (
    RUNS,
    AsJson,
    ConfigFile,
    DryRun,
    Force,
    From,
    Full,
    Jobs,
    Model,
    NoWait,
    Over,
    Periods,
    Quiet,
    Runs,
    Sets,
    Strides,
    To,
    Verbose,
)
from walkerlab.stages.graph import PIPELINE, Graph, Stage


def main() -> None:
    """Run the program on this process's arguments, and exit with its code."""
    program()()


def program(graph: Graph = PIPELINE) -> typer.Typer:
    """The command line for a pipeline."""
    app = typer.Typer(
        name="walkerlab",
        help="Passive-dynamic walking as a reproducible experiment. Without --config, the paper's walker.",
        add_completion=False,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    app.callback()(options_of_the_program)
    for stage in graph.stages:
        app.command(stage.name, help=stage.purpose)(stage_command(stage, graph))
    housekeeping.add_to(app, graph)
    sweep.add_to(app, graph)
    runs.add_to(app, graph)
    return app


def print_version(asked: bool) -> None:
    """Print the version and exit, if asked."""
    if asked:
        typer.echo(f"walkerlab {__version__}")
        raise typer.Exit


def options_of_the_program(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=print_version, help="Print the version.")
    ] = False,
) -> None:
    """Nothing but `--version`, which is answered on sight."""


def stage_command(stage: Stage, graph: Graph) -> Callable[..., None]:
    """The command of one stage, with the options that mean something to it."""

    def command(
        config: ConfigFile = None,
        sets: Sets = None,
        strides: Strides = None,
        over: Over = None,
        begin: From = None,
        end: To = None,
        model: Model = None,
        periods: Periods = None,
        runs: Runs = RUNS,
        jobs: Jobs = 1,
        full: Full = False,
        force: Force = False,
        dry_run: DryRun = False,
        no_wait: NoWait = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        with exit_on_failure(stage.name, as_json):
            # Imported here: help loads neither a config nor an array.
            from walkerlab.cli.request import Request
            from walkerlab.cli.stage import run_stage

            asked = following(over, begin, end, model, periods)
            request = Request(config, (*(sets or ()), *asked), strides, runs, as_json, quiet, verbose)
            run_stage(request, stage, graph, force=force, dry_run=dry_run, wait=not no_wait, jobs=jobs, full=full)

    meant = {"strides": stage.walks, "jobs": uses_jobs(stage, graph), "full": bool(graph.campaigns_of(stage.name))}
    meant |= dict.fromkeys(("over", "begin", "end", "model", "periods"), stage.follows)
    meaningless = {name for name, has in meant.items() if not has}
    signature = inspect.signature(command)
    options = [option for name, option in signature.parameters.items() if name not in meaningless]
    command.__signature__ = signature.replace(parameters=options)  # type: ignore[attr-defined]
    return command


def following(
    over: str | None, begin: float | None, end: float | None, model: str | None, periods: int | None
) -> tuple[str, ...]:
    """The options of a stage that follows gaits as settings of the config; typer.BadParameter if some are missing."""
    if over is not None and (begin is None or end is None):
        raise typer.BadParameter("a span goes with a key: give --from and --to, in its unit", param_hint="--over")
    given = {"over": over, "from": begin, "to": end, "model": model, "periods": periods}
    return tuple(f"continuation.{name}={value}" for name, value in given.items() if value is not None)


def uses_jobs(stage: Stage, graph: Graph) -> bool:
    """Whether a stage has independent cells, or runs stages that have."""
    return stage.has_cells or (stage is graph.stages[-1] and any(other.has_cells for other in graph.stages))
