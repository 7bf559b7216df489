"""What other engines make of the same walk: their integrators on our law, and their own contact."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from walkerlab.benchmarks.engines import rows as engines
from walkerlab.benchmarks.engines.rows import OWN_LAW, SAME_LAW
from walkerlab.report.blocks import PageBlock, Paragraph, Section, Statement, Statements
from walkerlab.report.numbers import NONE, fixed, number, power_of_ten
from walkerlab.report.results import Results
from walkerlab.report.tables import Column, Table, measured, table
from walkerlab.report.words import words

ABOUT = {SAME_LAW: "same law", OWN_LAW: "own contact"}
Row = Mapping[str, Any]


def section(results: Results) -> Section | None:
    """Conclusions in words, then a table for each experiment; None if the stage did not run."""
    summary = results.summary("engines")
    if not summary.get("rows"):
        return None
    concluded = [
        Statement(f"{scene}, {ABOUT[experiment]}", text)
        for scene, told in summary["conclusions"].items()
        for experiment, text in told.items()
        if text
    ]
    blocks: tuple[PageBlock, ...] = (
        Paragraph(
            words("engines.introduction", [f"{name} {version}" for name, version in summary["versions"].items()])
        ),
        Statements(tuple(concluded)),
        same_law(summary),
        own_law(summary),
        *tuning(summary),
        swings(summary),
        limits(summary),
    )
    return Section("engines", "In other engines", blocks)


def engine_and_integrator(row: Row) -> str:
    """Which engine, and by what it integrates or touches."""
    return f"{row['engine']} {row['integrator']}"


RUN = partial(measured, labels=engines.EngineRow)
SAME_LAW_COLUMNS = (
    Column("integrator", engine_and_integrator),
    RUN("step", "step_s", partial(number, digits=3), prefix="µ"),
    RUN("tolerance", "tolerance", lambda value: NONE if value is None else power_of_ten(value, 1)),
    RUN("error", "error", partial(number, digits=2)),
    RUN("of touch times", "touch_error_s", partial(number, digits=2)),
    RUN("run time", "wall_s", partial(number, digits=3), prefix="m"),
    Column("outcome", "outcome"),
)


def same_law(summary: Row) -> Table:
    """Each integrator's runs from coarse to fine."""
    runs = {scene: rows_of(summary, scene, SAME_LAW) for scene in summary["reference"]}
    return table("ADAMS's law in each engine's integrators", SAME_LAW_COLUMNS, runs, note=words("engines.same_law"))


def rows_of(summary: Row, scene: str, experiment: str) -> list[Row]:
    """The rows of one scene and experiment."""
    return [row for row in summary["rows"] if row["scene"] == scene and row["experiment"] == experiment]


OWN_LAW_COLUMNS = (
    Column("contact", engine_and_integrator),
    RUN("start", "start", partial(number, digits=3)),
    RUN("step", "step_s", partial(number, digits=3), prefix="µ"),
    RUN("period", "period_s", partial(fixed, decimals=5)),
    RUN("length", "step_length_m", partial(fixed, decimals=4)),
    RUN("slip", "slip_m", partial(fixed, decimals=2), prefix="m"),
    RUN("steps", "steps", number),
    RUN("run time", "wall_s", partial(number, digits=2)),
    Column("outcome", "outcome"),
)


def own_law(summary: Row) -> Table:
    """The walks with each engine's own contact, ADAMS's law among them."""
    walks = {
        scene: [*rigid_gait(reference), *rows_of(summary, scene, OWN_LAW)]
        for scene, reference in summary["reference"].items()
    }
    return table("The walk on each engine's own contact", OWN_LAW_COLUMNS, walks, note=words("engines.own_law"))


def rigid_gait(reference: Row) -> list[Row]:
    """The rigid model's gait as a row, if it is known."""
    if "rigid_period_s" not in reference:
        return []
    gait = {"period_s": reference["rigid_period_s"], "step_length_m": reference["rigid_step_length_m"]}
    return [{"engine": "rigid", "integrator": "gait", "start": 1.0, "slip_m": 0.0, **gait}]


TUNING_COLUMNS = (
    Column("contact", lambda row: f"{row['engine']} {row['contact']}, {row['scene']}"),
    Column("quantity", lambda row: f"{row['quantity']} ({row['unit']})"),
    measured("ADAMS's law", "target", partial(number, digits=4), labels=engines.TuningRow),
    measured("measured", "reached", partial(number, digits=4), labels=engines.TuningRow),
    Column("residual", "residual", lambda value: f"{100.0 * value:+.2g} %", numeric=True),
)


def tuning(summary: Row) -> tuple[Table, ...]:
    """What a ball and a block do on each contact, against what it was tuned to."""
    rows = summary["tuning"]
    if not rows:
        return ()
    return (table("Tuning of the engines' own contact", TUNING_COLUMNS, rows, note=words("engines.tuning")),)


SWING = partial(measured, labels=engines.SwingRow)
SWING_COLUMNS = (
    Column("integrator", lambda swing: f"{engine_and_integrator(swing)}, {swing['scene']}"),
    SWING("order promised", "promised_order", str),
    Column("orders observed", "orders"),
    SWING("smallest error", "error", partial(number, digits=2)),
    SWING("energy drift there", "energy_drift_j", partial(number, digits=2)),
)


def swings(summary: Row) -> Table:
    """The hinged walker's swing: of each integrator the finest run, with the orders observed on the way to it."""
    found: dict[tuple[str, ...], list[Row]] = {}
    for row in summary["swings"]:
        found.setdefault((row["scene"], row["engine"], row["integrator"]), []).append(row)
    rows = [
        {**min(runs, key=lambda run: float(run["error"])), "orders": ", ".join(orders_of(runs)) or "adapted"}
        for runs in found.values()
    ]
    return table("Without contact: a swing in each integrator", SWING_COLUMNS, rows, note=words("engines.swings"))


def orders_of(runs: list[Row]) -> list[str]:
    """The orders observed from run to run."""
    return [number(run["order"], 3) for run in runs if run["order"] is not None]


def limits(summary: Row) -> Table:
    """What each engine cannot express."""
    columns = [Column("engine"), Column("cannot express", wide=True)]
    rows = [[name, "; ".join(told) + "."] for name, told in summary["cannot_express"].items()]
    return table("What the engines cannot express", columns, rows, wordy=True)
