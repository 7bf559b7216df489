"""Commands on stored results, configs and extensions: status, show, schema, extensions, clean."""

from dataclasses import replace
from typing import Annotated

import typer

from walkerlab.extensions import registry
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.views.cli.command import Offer
from walkerlab.views.cli.failures import exit_on_failure, print_result
from walkerlab.views.cli.request import OF_A_RUN, OUTPUT_FIELDS, Request

STAGES = ", ".join(PIPELINE.names)


def status(
    request: Request,
    run: Annotated[str | None, typer.Argument(metavar="[RUN]", help="Name or folder of a run.")] = None,
    check: Annotated[bool, typer.Option("--check", help="Exit with 5 if a result is stale or missing.")] = False,
) -> None:
    """Show which results are up to date, why others are not, and all runs."""
    from walkerlab.views.cli.stored import print_status

    print_status(request, check, run)


def show(
    request: Request,
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="[RUN] STAGE", help=f"Name or folder of a run, then a stage: {STAGES}.", show_default=False
        ),
    ],
) -> None:
    """Print a stage's stored result: summary, arrays and provenance."""
    *runs, stage = words
    if stage not in request.graph.names:
        choice = f"choose from {', '.join(request.graph.names)}"
        raise typer.BadParameter(f"there is no stage {stage!r}; {choice}", param_hint="STAGE")
    if len(runs) > 1 or (runs and request.config is not None):
        raise typer.BadParameter("give only one run", param_hint="RUN")
    request_for_stage = replace(request, command=stage, config=runs[0] if runs else request.config)
    with exit_on_failure(request_for_stage):
        from walkerlab.pipeline.store.runs import run_named
        from walkerlab.views.cli.stored import print_stored

        located = (
            replace(request_for_stage, config=run_named(runs[0], request_for_stage.runs).explicit_path)
            if runs
            else request_for_stage
        )
        print_stored(located, stage)


def schema(
    request: Request,
    key: Annotated[str, typer.Argument(metavar="[KEY]", help="A key or a block of keys; default: all.")] = "",
) -> None:
    """Print the keys of a config: type, unit, bounds, default, meaning, source."""
    from walkerlab.config.reference import as_json_schema, as_paragraphs

    print_result(request, as_json_schema(key), [as_paragraphs(key)])


def list_extensions(request: Request) -> None:
    """List all extensions with their version, what they add, and why some are left out."""
    rows = []
    lines = []
    for each in registry():
        said = {
            "name": each.name,
            "source": each.origin,
            "code": each.code,
            "adds": each.adds,
            "left_out": each.reason,
        }
        rows.append(said)
        added = [f"{kind}: {', '.join(names)}" for kind, names in each.adds.items() if names and kind != "views"]
        lines.append(f"{each.name} ({each.origin}): {f'left out, {each.reason}' if each.reason else '; '.join(added)}")
    print_result(request, {"extensions": rows}, lines)


def clean(
    request: Request,
    all_runs: Annotated[bool, typer.Option("--all", help="Clean all runs in the runs folder.")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
) -> None:
    """Delete a run's results and leftovers of killed runs, and keep all other files."""
    from walkerlab.views.cli.clean import clean_folders

    clean_folders(request, all_runs, request.graph.names, yes)


COMMANDS = (
    Offer(status, (*OF_A_RUN, *OUTPUT_FIELDS)),
    Offer(show, (*OF_A_RUN, *OUTPUT_FIELDS)),
    Offer(schema, ("as_json",)),
    Offer(list_extensions, ("as_json",), name="extensions"),
    Offer(clean, (*OF_A_RUN, "dry_run", "no_wait", *OUTPUT_FIELDS)),
)
