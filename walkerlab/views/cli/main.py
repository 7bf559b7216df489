"""The command-line program: one command for each stage of the pipeline, and the housekeeping commands."""

import atexit
import gc
import os
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

import walkerlab
from walkerlab.extensions import load
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.stage import STRIDES, Stage
from walkerlab.pipeline.run.workers import ONE_THREAD
from walkerlab.views.cli import housekeeping, lifecycle, sweep
from walkerlab.views.cli.request import OUTPUT_FIELDS, RUN_OPTIONS, Offer, Request, add_command


def main() -> None:
    """Run the program with this process's arguments, and exit with its code."""
    # Loaded modules stay until the command ends. It would take longer to search them for garbage again and again than
    # to find a gait with compiled code.
    gc.set_threshold(300_000, 50, 100)
    # All matrices are small, so threads that share one would spend more time waiting than computing.
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    # Python collects garbage once more when it ends. This takes no time if all objects are frozen.
    atexit.register(gc.freeze)
    as_python_has_it = warnings.formatwarning

    def format_warning(
        message: Any, category: type[Warning], filename: str, lineno: int, line: str | None = None
    ) -> str:
        # Imported here, because help must not load the compiler. No cache warning can appear before the compiler is
        # loaded.
        from walkerlab.physics.kernel_cache import CacheWarning

        own = category is CacheWarning
        return f"warning: {message}\n" if own else as_python_has_it(message, category, filename, lineno, line)

    warnings.formatwarning = format_warning
    tolerate_output_errors()
    program()()


def tolerate_output_errors() -> None:
    """Discard output to closed streams, and escape characters that cannot be encoded, such as those of odd file
    names."""
    for name in ("stdout", "stderr"):
        # Python sets the stream to None if it was closed when Python started.
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))
        getattr(sys, name).reconfigure(errors="backslashreplace")


GROUPS = {
    "Start": ("fixedpoint", "explore", "init", "draw", "report", "open"),
    "Walk": ("simulate", "contact-sim", "animate", "plot", "export"),
    "Explore families of gaits": ("continuation", "sweep", "basin", "robustness", "design"),
    "Measure and compare": (
        "check", "compare", "diff", "recorded-walk", "identify", "plan", "tune", "engines", "accuracy", "stability",
        "stability-maps", "known-problems",
    ),
    "Keep house": ("status", "show", "schema", "extensions", "rerun", "compile", "clean"),
}  # fmt: skip
"""Commands by purpose, in the order of the help. The help adds commands without a group to the last group."""


class Commands(TyperGroup):
    """Command group whose help shows the full purpose of each command, which click would truncate."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        commands = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        purposes = {name: str(command.help).split("\n\n")[0] for name, command in commands.items() if command}
        grouped = [name for names in GROUPS.values() for name in names]
        others = [name for name in purposes if name not in grouped]
        for title, names in GROUPS.items():
            shown = [*names, *(others if title == [*GROUPS][-1] else [])]
            with formatter.section(title):
                formatter.write_dl([(name, purposes[name]) for name in shown if name in purposes])


def program(graph: Graph = PIPELINE) -> typer.Typer:
    """Build the command line for a pipeline."""
    app = typer.Typer(
        name="walkerlab",
        cls=Commands,
        help="Simulate and analyse passive-dynamic walkers, by default the built-in compass walker.",
        add_completion=True,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    app.callback(invoke_without_command=True)(options_of_the_program)
    for stage in graph.stages:
        if stage.adds_command:
            add_command(app, graph, load(stage.adds_command))
        else:
            add_stage(app, stage, graph)
    for module in (housekeeping, lifecycle, sweep):
        for offer in module.COMMANDS:
            add_command(app, graph, offer)
    return app


def options_of_the_program(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and the commit.")] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="With --version: also print where compiled code comes from.")
    ] = False,
) -> None:
    """Print the version if `--version` is given. Otherwise do nothing, as a command follows."""
    if version:
        print_version(verbose)
    elif context.invoked_subcommand is None:
        context.fail("Missing command.")


def print_version(verbose: bool) -> None:
    """Print the version, with the code's commit if it is known, and exit."""
    # Imported here, because only this option needs git, and only its long form needs the compiler.
    from walkerlab.pipeline.store.commit import commit_of_package

    commit = commit_of_package(Path(walkerlab.__file__).parent)
    typer.echo(f"walkerlab {walkerlab.__version__}" + (f" (commit {commit})" if commit else ""))
    if verbose:
        from walkerlab.physics.kernel_cache import describe_origin

        typer.echo("\n".join(describe_origin()))
    raise typer.Exit


def add_stage(app: typer.Typer, stage: Stage, graph: Graph) -> None:
    """Add the command of a stage to a program, with the options that apply to it."""
    shared = [*RUN_OPTIONS, "jobs", "force", "dry_run", "no_wait", *OUTPUT_FIELDS]
    if STRIDES not in stage.options:
        shared.remove("strides")
    shared += ["open_page"] if stage is graph.stages[-1] else []
    shared += ["full"] if graph.campaigns_of(stage.name) else []
    own = [option for option in stage.options if option is not STRIDES]

    def run(request: Request) -> None:
        # Imported here, because help must load neither the config nor NumPy.
        from walkerlab.views.cli.stage import run_stage

        run_stage(request, graph[request.instead or stage.name])

    add_command(app, graph, Offer(run, shared, stage.name, purpose=stage.purpose, sets=own))
