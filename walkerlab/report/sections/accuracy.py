"""What accuracy costs: error against run time, method by method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from walkerlab.report.blocks import (
    COSTS,
    Body,
    Cell,
    Column,
    Finding,
    Findings,
    Gallery,
    Paragraph,
    Section,
    Table,
    body,
    table,
)
from walkerlab.report.numbers import count, listed, number, power_of_ten, whole
from walkerlab.report.results import Results

STAGE = "accuracy"

Row = Mapping[str, Any]


def section(results: Results) -> Section | None:
    """The table of methods for each scene, with conclusions, references, and what was not run."""
    summary = results.summary(STAGE)
    if summary is None or not summary.get("reference"):
        return None
    scenes = list(summary["reference"])
    findings = [Finding(scene, spoken(summary["conclusions"][scene], scene)) for scene in scenes]
    levels = levels_of(summary)
    bodies = tuple(methods_of(summary, scene, levels) for scene in scenes)
    costs = Table("Least run time for an error, method by method", columns(levels), bodies, note=note(summary))
    blocks = (Paragraph(introduction(summary)), Findings(tuple(findings)), costs, references(summary))
    drawn = [Gallery((picture,)) for picture in results.pictures if picture.name.startswith("accuracy")]
    tables = (*blocks, *drawn, *not_run(summary))
    return Section("accuracy", "Error against run time", tables, fastest(summary), COSTS)


def fastest(summary: Mapping[str, Any]) -> str:
    """The fastest methods of each scene, in one sentence."""
    scenes: dict[str, list[str]] = {}
    for scene, best in summary["best"].items():
        scenes.setdefault(listed(dict.fromkeys(best.values())), []).append(scene)
    said = "; ".join(f"{methods} on {listed(found)}" for methods, found in scenes.items() if methods)
    return f"Fastest: {said}." if said else ""


def levels_of(summary: Mapping[str, Any]) -> list[float]:
    """The errors that some method reached on some scene, largest first."""
    return sorted({float(level) for best in summary["best"].values() for level in best}, reverse=True)


def columns(levels: Sequence[float]) -> tuple[Column, ...]:
    """The heads of the table of costs."""
    return (
        Column("method"),
        *(Column(f"ms for {power_of_ten(level, 1)}", numeric=True) for level in levels),
        Column("smallest error", numeric=True),
        Column("its right-hand sides", numeric=True),
        Column("ended otherwise", wide=True),
    )


def introduction(summary: Mapping[str, Any]) -> str:
    """What was measured."""
    return (
        "Each method walked each scene over a ladder of tolerances. The error is the largest difference of the end "
        "state from a reference of another kind, in SI units; the time is the median of up to "
        f"{summary['repeats']} warm runs. {slowed(summary)}"
        "Names without a prefix are compiled as a whole; scipy methods call the same "
        "compiled right-hand side, but for the one ending in numpy, which is as a user would script it."
    )


def slowed(summary: Mapping[str, Any]) -> str:
    """That the rigid scene does not start on its gait."""
    if "rigid_velocity_factor" not in summary:
        return ""
    return (
        f"The rigid scene starts with {summary['rigid_velocity_factor']:g} of the start’s angular velocities, so that "
        "no step repeats the one before. "
    )


def spoken(conclusion: str, scene: str) -> str:
    """A conclusion without the scene's name, which stands before it."""
    text = conclusion.removeprefix(f"{scene}: ")
    return text[:1].upper() + text[1:]


def methods_of(summary: Mapping[str, Any], scene: str, levels: Sequence[float]) -> Body:
    """A row for each method of a scene."""
    rows: list[Row] = [row for row in summary["rows"] if row["scene"] == scene]
    best = set(summary["best"].get(scene, {}).values())
    known = float(summary["reference"][scene]["agreement"])
    lines: list[list[str | Cell]] = []
    for method in dict.fromkeys(row["method"] for row in rows):
        mine = [row for row in rows if row["method"] == method]
        head = Cell(method, "good") if method in best else Cell(method)
        lines.append([head, *(milliseconds(mine, level) for level in levels), *smallest(mine, known), failures(mine)])
    return body(lines, scene)


def milliseconds(rows: Sequence[Row], level: float) -> str:
    """Least time of the runs that are exact enough; a dash if none is."""
    good = [row["wall_s"] for row in rows if row["error"] is not None and row["error"] <= level]
    return number(1e3 * min(good) if good else None, 3)


def smallest(rows: Sequence[Row], known: float) -> tuple[str, str]:
    """The smallest error reached, and what it cost; what the reference is known to bounds what can be told of it."""
    reached = [row for row in rows if row["error"] is not None]
    if not reached:
        return number(None), number(None)
    least = min(reached, key=lambda row: float(row["error"]))
    error = number(least["error"], 2) if least["error"] > known else f"≤ {number(known, 2)}"
    return error, whole(least["rhs_evaluations"])


def failures(rows: Sequence[Row]) -> str:
    """How the runs ended that have no end state."""
    return listed(f"{row['outcome']} at {power_of_ten(row['tolerance'], 1)}" for row in rows if row["error"] is None)


def note(summary: Mapping[str, Any]) -> str:
    """How to read the table, and on what it was measured."""
    machine = summary["environment"]
    return (
        "Marked: fastest at one of the levels. Measured on "
        f"{machine['processor']} with {count(machine['cores'], 'core')}, Python {machine['python']}; "
        "times differ from run to run, errors and counts do not."
    )


def references(summary: Mapping[str, Any]) -> Table:
    """Where the truth comes from and how well it is known."""
    heads = [Column("scene"), Column("reference"), Column("second method"), Column("they differ by", numeric=True)]
    rows = [
        [scene, entry["method"], entry["second_method"], number(entry["agreement"], 2)]
        for scene, entry in summary["reference"].items()
    ]
    note = (
        "The second method's end is what the reference's own method is measured by, where that is measured too. "
        "An error below their difference says nothing more than that."
    )
    return table("References", heads, rows, note=note)


def not_run(summary: Mapping[str, Any]) -> tuple[Table, ...]:
    """The tolerances that were not tried, a row for each reason."""
    found: dict[tuple[str, str, str], list[float]] = {}
    for entry in summary.get("not_run", []):
        found.setdefault((entry["scene"], entry["method"], entry["why"]), []).append(float(entry["tolerance"]))
    if not found:
        return ()
    heads = [Column("scene"), Column("method"), Column("tolerances"), Column("why", wide=True)]
    rows = [
        [scene, method, listed(power_of_ten(value, 1) for value in tolerances), why]
        for (scene, method, why), tolerances in found.items()
    ]
    return (table("Not run", heads, rows, wordy=True),)
