"""The program: one command for each stage of the pipeline, and the house-keeping commands."""

import atexit
import gc
import os
import re
import sys
import warnings
from dataclasses import dataclass
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from walkerlab import __version__
from walkerlab.cli import housekeeping, lifecycle, sweep
from walkerlab.cli import runs as whole_runs
from walkerlab.cli.request import OF_A_RUN, OF_TALK, Request, SetByOption, command, keys_to_vary, option
from walkerlab.pipeline.graph import PIPELINE, Graph, Stage


def main() -> None:
    """Run the program on this process's arguments, and exit with its code."""
    # What a command loads stays to its end: to look for garbage in it, again and again and then once more, takes longer
    # than a warm search for gaits.
    gc.set_threshold(300_000, 50, 100)
    atexit.register(gc.freeze)
    as_python_has_it = warnings.formatwarning

    def worded(message: Any, category: type[Warning], filename: str, lineno: int, line: str | None = None) -> str:
        # Imported here: help loads no compiler, and who warns has loaded it.
        from walkerlab.kernel_cache import CacheWarning

        own = category is CacheWarning
        return f"warning: {message}\n" if own else as_python_has_it(message, category, filename, lineno, line)

    warnings.formatwarning = worded
    print_whatever_there_is_to_print()
    program()()


def print_whatever_there_is_to_print() -> None:
    """Have output go nowhere where it is closed, and escape what its encoding lacks, such as names that are no text."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))
        getattr(sys, name).reconfigure(errors="backslashreplace")


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
        add_stage(app, stage, graph)
    housekeeping.add_to(app, graph)
    lifecycle.add_to(app, graph)
    sweep.add_to(app, graph)
    whole_runs.add_to(app, graph)
    return app


def print_version(asked: bool) -> None:
    """Print the version with the commit that the code is from, if that is known, and exit, if asked."""
    if asked:
        # Imported here: nothing else that is answered on sight asks git.
        from walkerlab.store.provenance import git_commit

        commit = git_commit()
        typer.echo(f"walkerlab {__version__}" + (f" (commit {commit})" if commit else ""))
        raise typer.Exit


def options_of_the_program(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=print_version, help="Print the version and the commit.")
    ] = False,
) -> None:
    """Nothing but `--version`, which is answered on sight."""


@dataclass(frozen=True)
class StageRequest(Request):
    """What a stage's command is asked, with its question where it has one."""

    over: str | None = option(
        "--over", metavar="KEY", help="Key to follow gaits over, e.g. slope_deg.", autocompletion=keys_to_vary
    )
    begin: float | None = option("--from", metavar="A", help="Where the span begins, in the key's unit.")
    end: float | None = option("--to", metavar="B", help="Where the span ends.")
    model: str | None = option("--model", metavar="rigid|contact|both", help="Which model's gaits to ask about.")
    periods: int | None = option("--periods", metavar="N", help="Steps of the longest gaits wanted.")
    full: bool = option(
        "--full", default=False, help="Run the long campaign too; if interrupted, it resumes the next time."
    )
    least: str | None = option("--minimise", metavar="QUANTITY", help="Number of the gait to make least.")
    most: str | None = option("--maximise", metavar="QUANTITY", help="Number of the gait to make largest.")
    within: list[str] | None = option(
        "--over", metavar="KEY=A:B", help="Number of the config that may change, and its bounds."
    )
    keep: list[str] | None = option("--keep", metavar="QUANTITY=A:B", help="Number of the gait to keep within bounds.")
    designed: str | None = option("--model", metavar="rigid|contact", help="Which model's gait to design.")

    @property
    def settings(self) -> tuple[str, ...]:
        """The options as settings of the config, too; typer.BadParameter for a span or bounds that are none."""
        if self.over is not None and (self.begin is None or self.end is None):
            raise typer.BadParameter("a span goes with a key: give --from and --to, in its unit", param_hint="--over")
        given = [
            ("--model", f"{self.command}.model", self.model or self.designed),
            ("--over", "continuation.over", self.over),
            ("--from", "continuation.from", self.begin),
            ("--to", "continuation.to", self.end),
            ("--periods", "continuation.periods", self.periods),
            ("--minimise", "design.minimise", self.least),
            ("--maximise", "design.maximise", self.most),
        ]
        own = [
            SetByOption(f"{key}={value}", f"{flag} {str(value).removesuffix('.0')}")
            for flag, key, value in given
            if value is not None
        ]
        for name, given_bounds in (("over", self.within), ("keep", self.keep)):
            if given_bounds:
                typed = " ".join(f"--{name} {one}" for one in given_bounds)
                own.append(SetByOption(f"design.{name}={bounds(name, given_bounds)}", typed))
        return (*super().settings, *own)


def bounds(option: str, given: list[str]) -> str:
    """Bounds KEY=A:B as a block in YAML; typer.BadParameter where they have another form."""
    parts = [re.fullmatch(r"([^=]+)=([^:]+):([^:]+)", one) for one in given]
    if None in parts:
        raise typer.BadParameter("give a name and its bounds, NAME=A:B", param_hint=f"--{option}")
    return "{" + ", ".join(f"{one[1]}: [{one[2]}, {one[3]}]" for one in parts if one) + "}"


def add_stage(app: typer.Typer, stage: Stage, graph: Graph) -> None:
    """Add the command of one stage to a program, with the options that mean something to it."""
    shared = [*OF_A_RUN, "jobs", "force", "dry_run", "no_wait", *OF_TALK]
    last = stage is graph.stages[-1]
    if not (stage.walks or last):
        shared.remove("strides")
    shared += ["open_page"] if last else []
    shared += ["over", "begin", "end", "periods"] if stage.follows else []
    if stage.designs:
        shared += ["least", "most", "within", "keep", "designed"]
    elif stage.of_a_model:
        shared += ["model"]
    shared += ["full"] if graph.campaigns_of(stage.name) else []

    @command(app, *shared, name=stage.name, purpose=stage.purpose, asks=StageRequest)
    def run(request: StageRequest) -> None:
        # Imported here: help loads neither a config nor an array.
        from walkerlab.cli.stage import run_stage

        run_stage(request, stage, graph, request.full)
