"""The program: one command for each stage of the pipeline, and the house-keeping commands."""

import atexit
import gc
import re
import warnings
from dataclasses import replace
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from walkerlab import __version__
from walkerlab.cli import housekeeping, lifecycle, sweep
from walkerlab.cli import runs as whole_runs
from walkerlab.cli.failures import exit_on_failure
from walkerlab.cli.request import OF_A_RUN, OF_TALK, Request, command, keys_to_vary
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
        add_stage(app, stage, graph)
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


Over = Annotated[
    str | None,
    typer.Option(
        "--over", metavar="KEY", help="Key to follow gaits over, e.g. slope_deg.", autocompletion=keys_to_vary
    ),
]
From = Annotated[float | None, typer.Option("--from", metavar="A", help="Where the span begins, in the key's unit.")]
To = Annotated[float | None, typer.Option("--to", metavar="B", help="Where the span ends.")]
Model = Annotated[
    str | None, typer.Option("--model", metavar="rigid|contact|both", help="Which model's gaits to ask about.")
]
Periods = Annotated[int | None, typer.Option("--periods", metavar="N", help="Steps of the longest gaits wanted.")]
Full = Annotated[
    bool, typer.Option("--full", help="Run the long campaign too; if interrupted, it resumes the next time.")
]


Least = Annotated[str | None, typer.Option("--minimise", metavar="QUANTITY", help="Number of the gait to make least.")]
Most = Annotated[str | None, typer.Option("--maximise", metavar="QUANTITY", help="Number of the gait to make largest.")]
Within = Annotated[
    list[str] | None,
    typer.Option("--over", metavar="KEY=A:B", help="Number of the config that may change, and its bounds."),
]
Keep = Annotated[
    list[str] | None, typer.Option("--keep", metavar="QUANTITY=A:B", help="Number of the gait to keep within bounds.")
]


def add_stage(app: typer.Typer, stage: Stage, graph: Graph) -> None:
    """Add the command of one stage to a program, with the options that mean something to it."""
    last = stage is graph.stages[-1]
    shared = [*OF_A_RUN, "jobs", "force", "dry_run", "no_wait", *(["open_page"] if last else []), *OF_TALK]
    if not (stage.walks or last):
        shared.remove("strides")
    unasked: list[str] = [] if stage.follows else ["over", "begin", "end", "periods"]
    unasked += [] if stage.of_a_model else ["model"]
    unasked += [] if stage.designs else ["least", "most", "within", "keep"]
    meaningless = [*unasked, *([] if graph.campaigns_of(stage.name) else ["full"])]

    @command(app, *shared, name=stage.name, purpose=stage.purpose, without=meaningless)
    def run(
        request: Request,
        over: Over = None,
        begin: From = None,
        end: To = None,
        model: Model = None,
        periods: Periods = None,
        full: Full = False,
        least: Least = None,
        most: Most = None,
        within: Within = None,
        keep: Keep = None,
    ) -> None:
        own = designing if stage.designs else following
        given = (least, most, within, keep) if stage.designs else (over, begin, end, periods)
        whose = [] if model is None else [f"{stage.name}.model={model}"]
        settings = [*(request.sets or ()), *whose, *own(*given)]
        with exit_on_failure(stage.name, replace(request, sets=settings)) as asked:
            # Imported here: help loads neither a config nor an array.
            from walkerlab.cli.stage import run_stage

            run_stage(asked, stage, graph, full)


def designing(least: str | None, most: str | None, within: list[str] | None, keep: list[str] | None) -> tuple[str, ...]:
    """The options of a design as settings of the config; typer.BadParameter for bounds that are none."""
    given = {"minimise": least, "maximise": most}
    said = tuple(f"design.{name}={value}" for name, value in given.items() if value is not None)
    return (
        *said,
        *(f"design.{name}={bounds(name, each)}" for name, each in (("over", within), ("keep", keep)) if each),
    )


def bounds(option: str, given: list[str]) -> str:
    """Bounds KEY=A:B as a block in YAML."""
    parts = [re.fullmatch(r"([^=]+)=([^:]+):([^:]+)", one) for one in given]
    if None in parts:
        raise typer.BadParameter("give a name and its bounds, NAME=A:B", param_hint=f"--{option}")
    return "{" + ", ".join(f"{one[1]}: [{one[2]}, {one[3]}]" for one in parts if one) + "}"


def following(over: str | None, begin: float | None, end: float | None, periods: int | None) -> tuple[str, ...]:
    """The options of a stage that follows gaits as settings of the config; typer.BadParameter if some are missing."""
    if over is not None and (begin is None or end is None):
        raise typer.BadParameter("a span goes with a key: give --from and --to, in its unit", param_hint="--over")
    given = {"over": over, "from": begin, "to": end, "periods": periods}
    return tuple(f"continuation.{name}={value}" for name, value in given.items() if value is not None)
