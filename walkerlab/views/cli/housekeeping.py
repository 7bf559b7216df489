"""Commands about stored results, configs and extensions: status, show, diff, schema, extensions, clean."""

import contextlib
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from walkerlab.extensions import registry
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.views.cli.request import OUTPUT_FIELDS, RUN_OPTIONS, Offer, Request, exit_on_failure, print_result

if TYPE_CHECKING:
    from walkerlab.pipeline.headlines import Pair, RunDifference
    from walkerlab.pipeline.store.runs import RunFolder


STAGE_NAMES = ", ".join(PIPELINE.names)


def status(
    request: Request,
    run: Annotated[str | None, typer.Argument(metavar="[RUN]", help="Name or folder of a run.")] = None,
    check: Annotated[bool, typer.Option("--check", help="Exit with code 5 if a result is stale or missing.")] = False,
) -> None:
    """Show which results are up to date, why others are not, and all runs."""
    from walkerlab.views.cli.stored import print_status

    print_status(request, check, run)


def show(
    request: Request,
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="[RUN] STAGE", help=f"Name or folder of a run, then a stage: {STAGE_NAMES}.", show_default=False
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

        if runs:
            request_for_stage = replace(request_for_stage, config=run_named(runs[0], request.runs).explicit_path)
        print_stored(request_for_stage, stage)


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
        row = {"name": each.name, "source": each.origin, "code": each.code, "adds": each.adds, "left_out": each.reason}
        rows.append(row)
        added = [f"{kind}: {', '.join(names)}" for kind, names in each.adds.items() if names and kind != "views"]
        lines.append(f"{each.name} ({each.origin}): {f'left out, {each.reason}' if each.reason else '; '.join(added)}")
    print_result(request, {"extensions": rows}, lines)


def clean(
    request: Request,
    all_runs: Annotated[bool, typer.Option("--all", help="Clean all runs in the runs folder.")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
) -> None:
    """Delete a run's results and leftovers of killed runs, and keep all other files."""
    from walkerlab.views.cli.stored import clean_folders

    clean_folders(request, all_runs, request.graph.names, yes)


SAME_CHANGE = 1e-12
"""Relative change below which two numbers are shown as equal."""
DIGITS = 6
"""Significant digits of a headline value."""
IS_ERROR = re.compile(r"residual|drift|error|balance|uncertainty")
"""Words that mark the names of error measures. A relative change of an error means nothing."""
ROUNDING_SI = 1e-9
"""Magnitude (SI units) below which a value may be nothing but rounding or the error of the solver."""


def diff(
    request: Request,
    first: Annotated[str, typer.Argument(metavar="RUN_A", help="Name or folder of a run.")],
    second: Annotated[str, typer.Argument(metavar="RUN_B", help="Name or folder of another run.")],
) -> None:
    """Compare two runs: configs, headline values with relative change, both walks overlaid."""
    from walkerlab.errors import StaleError
    from walkerlab.pipeline.headlines import difference
    from walkerlab.pipeline.plan.planner import results_to_show
    from walkerlab.pipeline.store.runs import config_of, run_named

    folders = (run_named(first, request.runs), run_named(second, request.runs))
    names = request.graph.names
    with contextlib.ExitStack() as stack:
        shown = (results_to_show(folder, names, request.console.warn, request.graph) for folder in folders)
        results = [stack.enter_context(each) for each in shown]
        for folder, stored in zip(folders, results, strict=True):
            if not stored:
                raise StaleError(f"{folder.path} has no results.", "Run a stage first.")
        comparison = difference(results[0], results[1], [config_of(folder) for folder in folders])
        figures = draw_both(folders, results)
    output = comparison_lines(folders, comparison, figures, request.every)
    print_result(request, comparison_object(folders, comparison, figures), output)


def run_labels(folders: "tuple[RunFolder, RunFolder]") -> tuple[str, str]:
    """Return labels of two runs: their names or, if these are equal, their folders."""
    first, second = folders
    return (first.name, second.name) if first.name != second.name else (str(first.path), str(second.path))


def draw_both(folders: "tuple[RunFolder, RunFolder]", results: list[dict[str, Any]]) -> list[Path]:
    """Draw the walks of both runs overlaid, store the images in the figures folder of the first, and return their
    paths."""
    from walkerlab.pipeline.store.files import make_folder, write_atomically
    from walkerlab.views.figures.walks import draw_runs

    if (images := draw_runs(results[0], results[1], run_labels(folders))) is None:
        return []
    make_folder(folders[0].figures)
    paths = [folders[0].figures / f"diff-{folders[1].name}.{kind}" for kind in ("svg", "png")]
    for path, data in zip(paths, images, strict=True):
        write_atomically(path, data)
    return paths


def comparison_object(
    folders: "tuple[RunFolder, RunFolder]", found: "RunDifference", figures: list[Path]
) -> dict[str, Any]:
    return {
        "stage": "diff",
        "runs": [str(folder.path) for folder in folders],
        "config": [{"key": key, "first": first, "second": second} for key, first, second in found.config],
        "numbers": {stage: [vars(pair) for pair in pairs] for stage, pairs in found.numbers.items()},
        "only_first": list(found.only_first),
        "only_second": list(found.only_second),
        "figures": [str(path) for path in figures],
    }


def comparison_lines(
    folders: "tuple[RunFolder, RunFolder]", comparison: "RunDifference", figures: list[Path], every: bool
) -> list[str]:
    """Describe changed config keys, and changed values of the stages: headline values or, if `every` is true, all."""
    from walkerlab.views.report.numbers import number
    from walkerlab.views.report.tables import aligned, format_value

    def as_text(value: Any) -> str:
        return number(value, DIGITS) if isinstance(value, float) and not every else format_value(value)

    names = run_labels(folders)
    changed = [[key, format_value(a), format_value(b)] for key, a, b in comparison.config]
    result = ["config", *(aligned([["", *names], *changed]) if changed else ["  the same"])]
    unlisted = 0
    for stage, pairs in comparison.numbers.items():
        differing = [pair for pair in pairs if differs(pair)]
        listed = differing if every else list(comparison.headlines[stage]) if differing else []
        unlisted += 0 if every else len(differing) - sum(pair in differing for pair in listed)
        rows = [[pair.name, as_text(pair.first), as_text(pair.second), percent(pair)] for pair in listed]
        if rows or not differing:
            result += [stage, *(aligned([["", *names, "change"], *rows]) if rows else ["  the same"])]
    for name, only in zip(names, (comparison.only_first, comparison.only_second), strict=True):
        if only:
            result.append(f"only in {name}: {', '.join(only)}")
    more = [f"{unlisted} other values differ; list them with --all"] if unlisted else []
    return [*result, *more, *(f"figure: {path}" for path in figures[1:])]


def differs(pair: "Pair") -> bool:
    return abs(pair.change) > SAME_CHANGE if pair.change is not None else bool(pair.first != pair.second)


def percent(pair: "Pair") -> str:
    """Format a relative change in percent, or return '' for error measures and for values at rounding level."""
    if pair.change is None or IS_ERROR.search(pair.name) or max(abs(pair.first), abs(pair.second)) < ROUNDING_SI:
        return ""
    return f"{100.0 * pair.change:+.3g} %" if differs(pair) else "the same"


COMMANDS = (
    Offer(status, (*RUN_OPTIONS, *OUTPUT_FIELDS)),
    Offer(show, (*RUN_OPTIONS, *OUTPUT_FIELDS)),
    Offer(diff, ("runs", "every", "as_json")),
    Offer(schema, ("as_json",)),
    Offer(list_extensions, ("as_json",), name="extensions"),
    Offer(clean, (*RUN_OPTIONS, "dry_run", "no_wait", *OUTPUT_FIELDS)),
)
