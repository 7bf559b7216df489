"""The commands around the pipeline: status, show, schema, clean."""

from typing import Annotated

import typer

from walkerlab.cli.failures import exit_on_failure, print_json
from walkerlab.cli.options import (
    RUNS,
    AllRuns,
    AsJson,
    Check,
    ConfigFile,
    DryRun,
    NoWait,
    Quiet,
    Runs,
    Sets,
    Strides,
    Verbose,
    Yes,
    typed_options,
)
from walkerlab.stages.graph import Graph


def add_to(app: typer.Typer, graph: Graph) -> None:
    """Add the commands to a program for a pipeline."""
    names = [stage.name for stage in graph.stages]

    @app.command()
    def status(
        run: Annotated[str | None, typer.Argument(metavar="[RUN]", help="Name or folder of a run.")] = None,
        config: ConfigFile = None,
        sets: Sets = None,
        strides: Strides = None,
        runs: Runs = RUNS,
        check: Check = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        """Say of each stage whether its result is current, and if not, why; and which runs there are."""
        with exit_on_failure("status", as_json, typed_options(config, sets, strides, runs)):
            from walkerlab.cli.request import Request
            from walkerlab.cli.status import print_status, print_status_of_run

            request = Request(config, tuple(sets or ()), strides, runs, as_json, quiet, verbose)
            if run is None:
                print_status(request, graph, check)
            else:
                print_status_of_run(request, graph, check, run)

    @app.command()
    def show(
        stage: Annotated[str, typer.Argument(metavar="STAGE", help=f"One of {', '.join(names)}.")],
        config: ConfigFile = None,
        sets: Sets = None,
        strides: Strides = None,
        runs: Runs = RUNS,
        as_json: AsJson = False,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        """Print what is stored of a stage: summary, arrays, and where it comes from."""
        if stage not in names:
            raise typer.BadParameter(f"{stage!r} is no stage; there are {', '.join(names)}.", param_hint="STAGE")
        with exit_on_failure(stage, as_json, typed_options(config, sets, strides, runs)):
            from walkerlab.cli.request import Request
            from walkerlab.cli.show import print_stored

            print_stored(Request(config, tuple(sets or ()), strides, runs, as_json, quiet, verbose), graph, stage)

    @app.command()
    def schema(
        key: Annotated[str, typer.Argument(metavar="[KEY]", help="A key or a block of keys; default: all.")] = "",
        as_json: AsJson = False,
    ) -> None:
        """Print the keys of a config: type, unit, bounds, default, meaning, source."""
        with exit_on_failure("schema", as_json):
            from walkerlab.config.reference import as_json_schema, as_paragraphs

            if as_json:
                print_json(as_json_schema(key))
            else:
                print(as_paragraphs(key))

    @app.command()
    def clean(
        config: ConfigFile = None,
        sets: Sets = None,
        strides: Strides = None,
        runs: Runs = RUNS,
        all_runs: AllRuns = False,
        yes: Yes = False,
        dry_run: DryRun = False,
        no_wait: NoWait = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        """Remove the results of a run, and what killed runs left; other files stay."""
        with exit_on_failure("clean", as_json, typed_options(config, sets, strides, runs)):
            from walkerlab.cli.clean import clean_all, clean_run
            from walkerlab.cli.request import Request

            request = Request(config, tuple(sets or ()), strides, runs, as_json, quiet, verbose)
            clean = clean_all if all_runs else clean_run
            clean(request, names, yes=yes, dry_run=dry_run, wait=not no_wait)
