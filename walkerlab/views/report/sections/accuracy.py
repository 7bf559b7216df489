"""Section on the cost of accuracy: error against run time for each method."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.labels import join_words
from walkerlab.outcome import Outcome
from walkerlab.views.report import blocks as page
from walkerlab.views.report.numbers import NONE, format_integer, number, power_of_ten
from walkerlab.views.report.tables import Cell, Column, Table, grouped, table
from walkerlab.views.report.words import words

Row = Mapping[str, Any]


@page.stage_section("accuracy", "reference")
def section(results: page.Results, summary: Row) -> page.Section | None:
    conclusions = {scene: summary["conclusions"][scene].removeprefix(f"{scene}: ") for scene in summary["reference"]}
    concluded = tuple(page.Statement(scene, text[:1].upper() + text[1:]) for scene, text in conclusions.items())
    references = [{"scene": scene, **entry} for scene, entry in summary["reference"].items()]
    nearest = {scene: run for scene in summary["reference"] if (run := nearest_library(summary, scene))}
    origins = words("accuracy.references", list(summary["reference"].items()), nearest)
    blocks: tuple[page.PageBlock, ...] = (
        page.Paragraph(words("accuracy.introduction", summary)),
        page.Statements(concluded),
        costs(summary),
        table("References", REFERENCE_COLUMNS, references, note=origins),
        *(page.Gallery((picture,)) for picture in results.pictures if picture.name.startswith("accuracy")),
        not_run(summary),
    )
    fastest: dict[str, list[str]] = {}
    for scene, best in summary["best"].items():
        fastest.setdefault(join_words(dict.fromkeys(best.values())), []).append(scene)
    finding = words("accuracy.fastest", fastest)
    return page.Section.create("accuracy", "Error against run time", blocks, finding, page.COSTS)


def costs(summary: Row) -> Table:
    levels = sorted({float(level) for best in summary["best"].values() for level in best}, reverse=True)
    columns = (
        Column("method", "method"),
        *(Column(f"ms for {power_of_ten(level, 1)}", f"{level}", format_time, numeric=True) for level in levels),
        Column("smallest error", "smallest_error", numeric=True),
        Column("right-hand sides", "rhs_evaluations", format_integer, numeric=True),
        Column("failed runs", "failures", wide=True),
    )
    methods = {scene: list(method_rows(summary, scene, levels)) for scene in summary["reference"]}
    return table("Shortest run time for each error, by method", columns, methods, note=words("accuracy.costs", summary))


def method_rows(summary: Row, scene: str, levels: Sequence[float]) -> Iterator[Row]:
    """Yield a row for each method of a scene, with the fastest run for each level of error, and the smallest error."""
    # If an error is below the uncertainty of the reference, all we know is that it is below.
    best = summary["best"].get(scene, {}).values()
    bound = float(summary["reference"][scene]["agreement"])
    for method, runs in grouped((row for row in summary["rows"] if row["scene"] == scene), "method").items():
        ended = [run for run in runs if run["error"] is not None]
        exact: Row = min(ended, key=lambda run: float(run["error"]), default={})
        error = exact.get("error")
        within = {level: [run for run in ended if run["error"] <= level] for level in levels}
        failed = [f"{failure_text(run)} at {power_of_ten(run['tolerance'], 1)}" for run in runs if run["error"] is None]
        yield {
            "method": Cell(method, "good" if method in best else None),
            "smallest_error": number(error, 2) if error is None or error > bound else f"≤ {number(bound, 2)}",
            "rhs_evaluations": exact.get("rhs_evaluations"),
            "failures": join_words(failed),
            **{f"{level}": min(fine, key=lambda run: run["wall_s"], default=None) for level, fine in within.items()},
        }


def format_time(run: Row | None) -> Cell:
    """Format a run's median time (ms), with the range if it was repeated."""
    if run is None:
        return Cell(NONE)
    median, least, largest = (number(1e3 * run[name], 3) for name in ("wall_s", "least_wall_s", "largest_wall_s"))
    alone = run["repeats_of_wall_s"] == 1
    return Cell(median if alone else f"{median} ({least} to {largest})", value=1e3 * run["wall_s"])


def failure_text(run: Row) -> str:
    return "budget exhausted" if run["outcome"] == Outcome.BUDGET_EXHAUSTED.label else str(run["outcome"])


def nearest_library(summary: Row, scene: str) -> Row | None:
    """Return the run of a library that ends closest to the reference, or None if no library reached the end."""
    runs = [row for row in summary["rows"] if row["scene"] == scene and row["error"] is not None]
    library_runs = [row for row in runs if row["method"].startswith(("scipy", "cvode"))]
    return min(library_runs, key=lambda row: float(row["error"]), default=None)


def reference_origin(reference: Row) -> str:
    if reference["from_outside"]:
        return "heyoka, at machine precision"
    spent = f", {format_integer(reference['rhs_evaluations'])} right-hand sides"
    return f"ours, at {power_of_ten(reference['tolerance'], 1)}{spent}"


REFERENCE_COLUMNS = (
    Column("scene", "scene"),
    Column("reference", "method"),
    Column("computed by", reference_origin),
    Column("second method", "second_method"),
    Column("difference", "agreement", partial(number, digits=2), numeric=True),
)


NOT_RUN_COLUMNS = (
    Column("scene", "scene"),
    Column("method", "method"),
    Column("tolerances", "tolerances", lambda values: join_words(power_of_ten(value, 1) for value in values)),
    Column("reason", "why", wide=True),
)


def not_run(summary: Row) -> Table:
    """Tabulate the tolerances at which methods were not run, with a row for each scene, method and reason."""
    groups = grouped(summary.get("not_run", []), "scene", "method", "why").values()
    rows = [{**entries[0], "tolerances": [float(entry["tolerance"]) for entry in entries]} for entries in groups]
    return table("Not run", NOT_RUN_COLUMNS, rows, wordy=True)
