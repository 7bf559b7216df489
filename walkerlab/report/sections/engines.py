"""What other engines make of the same walk: their integrators on our law, and their own contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from operator import itemgetter
from typing import Any

from walkerlab.benchmarks.engines import rows as engines
from walkerlab.benchmarks.engines.rows import OWN_LAW, SAME_LAW
from walkerlab.report.blocks import Body, Column, Finding, Findings, Paragraph, Section, Table, body, table
from walkerlab.report.numbers import NONE, fixed, listed, number, power_of_ten
from walkerlab.report.results import Results
from walkerlab.report.shown import Row, Shown, head_of, heads, lines, shown

STAGE = "engines"
ABOUT = {SAME_LAW: "same law", OWN_LAW: "own contact"}


def section(results: Results) -> Section | None:
    """Conclusions in words, then a table for each experiment; None if the stage did not run."""
    summary = results.summary(STAGE)
    if summary is None or not summary.get("rows"):
        return None
    findings = [
        Finding(f"{scene}, {ABOUT[experiment]}", text)
        for scene, told in summary["conclusions"].items()
        for experiment, text in told.items()
        if text
    ]
    blocks = (
        Paragraph(introduction(summary)),
        Findings(tuple(findings)),
        same_law(summary),
        own_law(summary),
        *tuning(summary),
        swings(summary),
        limits(summary),
    )
    return Section("engines", "In other engines", blocks)


def introduction(summary: Mapping[str, Any]) -> str:
    """What was measured, and with what."""
    versions = listed(f"{name} {version}" for name, version in summary["versions"].items())
    return (
        f"The walker went over from its parts into {versions}, with tilted gravity for the slope. On the same law, "
        "this project's compiled contact force acts as an external force, and what is compared is the integrator. With "
        "its own contact each engine was first tuned to the same static penetration, damping ratio and friction, and "
        "what is compared is the model. Run times contain each engine's steps and the rules of the walk."
    )


SAME_LAW_COLUMNS = (
    Shown(Column("integrator"), lambda row: f"{row['engine']} {row['integrator']}"),
    shown(engines.Row, "step_s", "step", partial(number, digits=3), "µ"),
    shown(engines.Row, "tolerance", "tolerance", lambda value: NONE if value is None else power_of_ten(value, 1)),
    shown(engines.Row, "error", "error", partial(number, digits=2)),
    shown(engines.Row, "touch_error_s", "of touch times", partial(number, digits=2)),
    shown(engines.Row, "wall_s", "run time", partial(number, digits=3), "m"),
    Shown(Column("outcome"), itemgetter("outcome")),
)


def same_law(summary: Mapping[str, Any]) -> Table:
    """Each integrator's runs from coarse to fine."""
    bodies = tuple(
        body(lines(SAME_LAW_COLUMNS, rows_of(summary, scene, SAME_LAW)), scene) for scene in summary["reference"]
    )
    note = (
        "The error is the largest difference of the end state from the reference, SI; "
        "adapted steps are given by their mean."
    )
    return Table("ADAMS's law in each engine's integrators", heads(SAME_LAW_COLUMNS), bodies, note=note)


def rows_of(summary: Mapping[str, Any], scene: str, experiment: str) -> list[Row]:
    """The rows of one scene and experiment."""
    return [row for row in summary["rows"] if row["scene"] == scene and row["experiment"] == experiment]


OWN_LAW_COLUMNS = (
    Shown(Column("contact"), lambda row: f"{row['engine']} {row['integrator']}"),
    shown(engines.Row, "start", "start", partial(number, digits=3)),
    shown(engines.Row, "step_s", "step", partial(number, digits=3), "µ"),
    shown(engines.Row, "period_s", "period", partial(fixed, decimals=5)),
    shown(engines.Row, "step_length_m", "length", partial(fixed, decimals=4)),
    shown(engines.Row, "slip_m", "slip", partial(fixed, decimals=2), "m"),
    shown(engines.Row, "steps", "steps", number),
    shown(engines.Row, "wall_s", "run time", partial(number, digits=2)),
    Shown(Column("outcome"), itemgetter("outcome")),
)


def own_law(summary: Mapping[str, Any]) -> Table:
    """The walks with each engine's own contact, ADAMS's law among them."""
    bodies: list[Body] = []
    for scene, reference in summary["reference"].items():
        found = lines(OWN_LAW_COLUMNS, rows_of(summary, scene, OWN_LAW))
        if "rigid_period_s" in reference:
            period, length = fixed(reference["rigid_period_s"], 5), fixed(reference["rigid_step_length_m"], 4)
            found.insert(0, ["rigid gait", "1", NONE, period, length, "0", NONE, NONE, NONE])
        bodies.append(body(found, scene))
    note = (
        "Period, length and slip are those of the last step that was walked, of at most ten; the start is the gait's "
        "velocities times the number given. walkerlab impact is ADAMS's law."
    )
    return Table("The walk on each engine's own contact", heads(OWN_LAW_COLUMNS), tuple(bodies), note=note)


TUNING_COLUMNS = (
    Shown(Column("contact"), lambda row: f"{row['engine']} {row['contact']}, {row['scene']}"),
    Shown(Column("quantity"), lambda row: f"{row['quantity']} ({row['unit']})"),
    shown(engines.TuningRow, "target", "ADAMS's law", partial(number, digits=4)),
    shown(engines.TuningRow, "reached", "measured", partial(number, digits=4)),
    Shown(Column("residual", numeric=True), lambda row: f"{100.0 * row['residual']:+.2g} %"),
)


def tuning(summary: Mapping[str, Any]) -> tuple[Table, ...]:
    """What a ball and a block do on each contact, against what it was tuned to."""
    rows: Sequence[Row] = summary["tuning"]
    if not rows:
        return ()
    note = "Measured on a ball of the walker's mass dropped on the ground, and a block of that mass slid on it."
    tuned = lines(TUNING_COLUMNS, rows)
    return (table("Tuning of the engines' own contact", heads(TUNING_COLUMNS), tuned, note=note),)


def swings(summary: Mapping[str, Any]) -> Table:
    """The hinged walker's swing, from coarse to fine."""
    columns = [
        Column("integrator"),
        head_of(engines.SwingRow, "promised_order", "order promised"),
        Column("orders observed"),
        head_of(engines.SwingRow, "error", "smallest error"),
        head_of(engines.SwingRow, "energy_drift_j", "energy drift there"),
    ]
    swung = []
    keys = dict.fromkeys((row["scene"], row["engine"], row["integrator"]) for row in summary["swings"])
    for scene, engine, integrator in keys:
        mine = [
            row
            for row in summary["swings"]
            if (row["scene"], row["engine"], row["integrator"]) == (scene, engine, integrator)
        ]
        best = min(mine, key=lambda row: float(row["error"]))
        orders = [number(row["order"], 3) for row in mine if row["order"] is not None]
        swung.append(
            [
                f"{engine} {integrator}, {scene}",
                str(best["promised_order"]),
                ", ".join(orders) if orders else "adapted",
                number(best["error"], 2),
                number(best["energy_drift_j"], 2),
            ]
        )
    note = "The walker hinged at its stance foot, without ground, against this project's equations and SciPy's DOP853."
    return table("Without contact: a swing in each integrator", columns, swung, note=note)


def limits(summary: Mapping[str, Any]) -> Table:
    """What each engine cannot express."""
    columns = [Column("engine"), Column("cannot express", wide=True)]
    rows = [[name, "; ".join(told) + "."] for name, told in summary["cannot_express"].items()]
    return table("What the engines cannot express", columns, rows, wordy=True)
