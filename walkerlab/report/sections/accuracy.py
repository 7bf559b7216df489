"""What accuracy costs: error against run time, method by method."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from walkerlab.report.blocks import COSTS, Gallery, PageBlock, Paragraph, Section, Statement, Statements
from walkerlab.report.numbers import listed, number, power_of_ten, whole
from walkerlab.report.results import Results
from walkerlab.report.tables import Cell, Column, Table, grouped, table
from walkerlab.report.words import words

Row = Mapping[str, Any]


def section(results: Results) -> Section | None:
    """The table of methods for each scene, with conclusions, references, and what was not run."""
    summary = results.summary("accuracy")
    if not summary.get("reference"):
        return None
    scenes = list(summary["reference"])
    told = {scene: summary["conclusions"][scene].removeprefix(f"{scene}: ") for scene in scenes}
    concluded = tuple(Statement(scene, text[:1].upper() + text[1:]) for scene, text in told.items())
    blocks: tuple[PageBlock, ...] = (
        Paragraph(words("accuracy.introduction", summary)),
        Statements(concluded),
        costs(summary),
        references(summary),
        *(Gallery((picture,)) for picture in results.pictures if picture.name.startswith("accuracy")),
        *not_run(summary),
    )
    return Section("accuracy", "Error against run time", blocks, fastest(summary), COSTS)


def fastest(summary: Row) -> str:
    """The fastest methods of each scene, in one sentence."""
    scenes: dict[str, list[str]] = {}
    for scene, best in summary["best"].items():
        scenes.setdefault(listed(dict.fromkeys(best.values())), []).append(scene)
    said = "; ".join(f"{methods} on {listed(found)}" for methods, found in scenes.items() if methods)
    return f"Fastest: {said}." if said else ""


def costs(summary: Row) -> Table:
    """What each method costs for each error, by scene."""
    levels = sorted({float(level) for best in summary["best"].values() for level in best}, reverse=True)
    least = (
        Column(f"ms for {power_of_ten(level, 1)}", partial(least_ms, level), partial(number, digits=3), True)
        for level in levels
    )
    columns = (
        Column("method", lambda method: Cell(method["method"], "good" if method["best"] else None)),
        *least,
        Column("smallest error", smallest_error, numeric=True),
        Column("its right-hand sides", lambda method: most_exact(method).get("rhs_evaluations"), whole, True),
        Column("ended otherwise", failures, wide=True),
    )
    methods = {scene: methods_of(summary, scene) for scene in summary["reference"]}
    note = words("accuracy.costs", summary["environment"])
    return table("Least run time for an error, method by method", columns, methods, note=note)


def methods_of(summary: Row, scene: str) -> list[Row]:
    """The methods of a scene, each with its runs and with how well the reference is known."""
    best, known = summary["best"].get(scene, {}).values(), float(summary["reference"][scene]["agreement"])
    runs = grouped((row for row in summary["rows"] if row["scene"] == scene), "method")
    return [{"method": name, "best": name in best, "runs": mine, "known": known} for name, mine in runs.items()]


def reached(method: Row) -> list[Row]:
    """The runs that came to an end state."""
    return [run for run in method["runs"] if run["error"] is not None]


def least_ms(level: float, method: Row) -> float | None:
    """Least time (ms) of the runs that are exact enough; None if none is."""
    return min((1e3 * run["wall_s"] for run in reached(method) if run["error"] <= level), default=None)


def most_exact(method: Row) -> Row:
    """The run with the smallest error; nothing if none has one."""
    return min(reached(method), key=lambda run: float(run["error"]), default={})


def smallest_error(method: Row) -> str:
    """The smallest error reached; what the reference is known to bounds what can be told of it."""
    error = most_exact(method).get("error")
    return number(error, 2) if error is None or error > method["known"] else f"≤ {number(method['known'], 2)}"


def failures(method: Row) -> str:
    """How the runs ended that have no end state."""
    return listed(
        f"{run['outcome']} at {power_of_ten(run['tolerance'], 1)}" for run in method["runs"] if run["error"] is None
    )


REFERENCE_COLUMNS = (
    Column("scene", "scene"),
    Column("reference", "method"),
    Column("second method", "second_method"),
    Column("they differ by", "agreement", partial(number, digits=2), numeric=True),
)


def references(summary: Row) -> Table:
    """Where the truth comes from and how well it is known."""
    rows = [{"scene": scene, **entry} for scene, entry in summary["reference"].items()]
    return table("References", REFERENCE_COLUMNS, rows, note=words("accuracy.references"))


NOT_RUN_COLUMNS = (
    Column("scene", "scene"),
    Column("method", "method"),
    Column("tolerances", "tolerances", lambda values: listed(power_of_ten(value, 1) for value in values)),
    Column("why", "why", wide=True),
)


def not_run(summary: Row) -> tuple[Table, ...]:
    """The tolerances that were not tried, a row for each reason."""
    found: dict[tuple[str, ...], dict[str, Any]] = {}
    for entry in summary.get("not_run", []):
        key = (entry["scene"], entry["method"], entry["why"])
        found.setdefault(key, {**entry, "tolerances": []})["tolerances"].append(float(entry["tolerance"]))
    return (table("Not run", NOT_RUN_COLUMNS, list(found.values()), wordy=True),) if found else ()
