"""`walkerlab diff`: compare two runs."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from walkerlab.views.cli.command import Offer
from walkerlab.views.cli.failures import print_result
from walkerlab.views.cli.request import Request

if TYPE_CHECKING:
    from walkerlab.pipeline.headlines import Pair, RunDifference
    from walkerlab.pipeline.store.runfolder import RunFolder

SAME_CHANGE = 1e-12
"""Relative change below which two numbers are shown as equal."""
DIGITS = 6
"""Significant digits of a headline value."""
IS_ERROR = re.compile(r"residual|drift|error|balance|uncertainty")
"""Words in the names of error measures, whose relative change means nothing."""
ROUNDING_SI = 1e-9
"""Magnitude (SI units) below which values are at the level of rounding or of the solver's tolerance."""


def diff(
    request: Request,
    first: Annotated[str, typer.Argument(metavar="RUN_A", help="Name or folder of a run.")],
    second: Annotated[str, typer.Argument(metavar="RUN_B", help="Name or folder of another run.")],
) -> None:
    """Compare two runs: configs, headline values with relative change, both walks overlaid."""
    from walkerlab.errors import StaleError
    from walkerlab.pipeline.headlines import difference
    from walkerlab.pipeline.plan.survey import results_to_show
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
        figures = draw(folders, results)
    output = lines(folders, comparison, figures, request.every)
    print_result(request, as_object(folders, comparison, figures), output)


def run_labels(folders: tuple[RunFolder, RunFolder]) -> tuple[str, str]:
    """Return labels of two runs: their names or, if these are equal, their folders."""
    first, second = folders
    return (first.name, second.name) if first.name != second.name else (str(first.path), str(second.path))


def draw(folders: tuple[RunFolder, RunFolder], results: list[dict[str, Any]]) -> list[Path]:
    """Draw both runs' walks overlaid, store the images in the first run's figures folder, and return their paths."""
    from walkerlab.pipeline.store.files import make_folder, write_atomically
    from walkerlab.views.figures.walks import draw_runs

    images = draw_runs(results[0], results[1], run_labels(folders))
    if images is None:
        return []
    make_folder(folders[0].figures)
    paths = [folders[0].figures / f"diff-{folders[1].name}.{kind}" for kind in ("svg", "png")]
    for path, data in zip(paths, images, strict=True):
        write_atomically(path, data)
    return paths


def as_object(folders: tuple[RunFolder, RunFolder], found: RunDifference, figures: list[Path]) -> dict[str, Any]:
    return {
        "stage": "diff",
        "runs": [str(folder.path) for folder in folders],
        "config": [{"key": key, "first": first, "second": second} for key, first, second in found.config],
        "numbers": {stage: [vars(pair) for pair in pairs] for stage, pairs in found.numbers.items()},
        "only_first": list(found.only_first),
        "only_second": list(found.only_second),
        "figures": [str(path) for path in figures],
    }


def lines(
    folders: tuple[RunFolder, RunFolder], comparison: RunDifference, figures: list[Path], every: bool
) -> list[str]:
    """Describe changed config keys, and the headline values of changed stages or, with `every`, all changed values."""
    from walkerlab.views.report.numbers import number
    from walkerlab.views.report.tables import aligned
    from walkerlab.views.report.text import format_value

    def as_text(value: Any) -> str:
        return number(value, DIGITS) if isinstance(value, float) and not every else format_value(value)

    names = run_labels(folders)
    result = [
        "config",
        *aligned([["", *names], *([key, format_value(a), format_value(b)] for key, a, b in comparison.config)]),
    ]
    if not comparison.config:
        result[1:] = ["  the same"]
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


def differs(pair: Pair) -> bool:
    if pair.change is not None:
        return abs(pair.change) > SAME_CHANGE
    return bool(pair.first != pair.second)


def percent(pair: Pair) -> str:
    """Format a relative change in percent, or return '' for error measures and for values at rounding level."""
    if pair.change is None or IS_ERROR.search(pair.name) or max(abs(pair.first), abs(pair.second)) < ROUNDING_SI:
        return ""
    return f"{100.0 * pair.change:+.3g} %" if differs(pair) else "the same"


COMMANDS = (Offer(diff, ("runs", "every", "as_json")),)
