"""The program: one command for each stage of the pipeline, and the house-keeping commands."""

import inspect
import os
from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from walkerlab import __version__
from walkerlab.cli import housekeeping, lifecycle, sweep
from walkerlab.cli import runs as whole_runs
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
    Open,
    Over,
    Periods,
    Quiet,
    Runs,
    Sets,
    Strides,
    To,
    Verbose,
    typed_options,
)
from walkerlab.stages.graph import PIPELINE, Graph, Stage


def main() -> None:
    """Run the program on this process's arguments, and exit with its code."""
    program()()


class Commands(TyperGroup):
    """The commands, with their whole purpose in the list."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Wrapped to the width, where click would cut."""
        commands = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, str(command.help).split("\n\n")[0]) for name, command in commands.items() if command]
            )


def program(graph: Graph = PIPELINE) -> typer.Typer:
    """The command line for a pipeline."""
    app = typer.Typer(
        name="walkerlab",
        cls=Commands,
        help="Passive-dynamic walking as a reproducible experiment. Without --config, the paper's walker.",
        add_completion=True,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    app.callback()(options_of_the_program)
    for stage in graph.stages:
        app.command(stage.name, help=stage.purpose)(stage_command(stage, graph))
    housekeeping.add_to(app, graph)
    lifecycle.add_to(app, graph)
    sweep.add_to(app, graph)
    whole_runs.add_to(app, graph)
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
        jobs: Jobs = None,
        full: Full = False,
        force: Force = False,
        dry_run: DryRun = False,
        no_wait: NoWait = False,
        open_page: Open = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        with exit_on_failure(stage.name, as_json, typed_options(config, sets, strides, runs)) as asked:
            # Imported here: help loads neither a config nor an array.
            from walkerlab.cli.request import Request
            from walkerlab.cli.stage import run_stage

            settings = (*(sets or ()), *following(over, begin, end, model, periods))
            request = Request(config, settings, strides, runs, as_json, quiet, verbose, open_page)
            asked.run_dir = request.folder.path
            cores = jobs or all_cores()
            run_stage(request, stage, graph, force=force, dry_run=dry_run, wait=not no_wait, jobs=cores, full=full)

    last = stage is graph.stages[-1]
    meant = {
        "strides": stage.walks or last,
        "full": bool(graph.campaigns_of(stage.name)),
        "open_page": last,
    }
    meant |= dict.fromkeys(("over", "begin", "end", "model", "periods"), stage.follows)
    meaningless = {name for name, has in meant.items() if not has}
    signature = inspect.signature(command)
    options = [option for name, option in signature.parameters.items() if name not in meaningless]
    command.__signature__ = signature.replace(parameters=options)  # type: ignore[attr-defined]
    return command


def all_cores() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def following(
    over: str | None, begin: float | None, end: float | None, model: str | None, periods: int | None
) -> tuple[str, ...]:
    """The options of a stage that follows gaits as settings of the config; typer.BadParameter if some are missing."""
    if over is not None and (begin is None or end is None):
        raise typer.BadParameter("a span goes with a key: give --from and --to, in its unit", param_hint="--over")
    given = {"over": over, "from": begin, "to": end, "model": model, "periods": periods}
    return tuple(f"continuation.{name}={value}" for name, value in given.items() if value is not None)
