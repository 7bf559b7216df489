"""Report section on other engines: their integrators under our law, and their native contact."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.evidence.benchmarks.engines import rows as engines
from walkerlab.evidence.benchmarks.engines.rows import OWN_LAW, SAME_LAW
from walkerlab.views.report.blocks import Paragraph, Results, Section, Statement, Statements, stage_section
from walkerlab.views.report.numbers import NONE, fixed, number, power_of_ten
from walkerlab.views.report.tables import Column, Table, grouped, measured, table
from walkerlab.views.report.words import words

EXPERIMENT_TITLES = {SAME_LAW: "same law", OWN_LAW: "own contact"}
Row = Mapping[str, Any]


@stage_section("engines", "rows")
def section(_results: Results, summary: Row) -> Section | None:
    """Build the conclusions and a table for each experiment, or return None if the stage did not run."""
    concluded = [
        Statement(f"{scene}, {EXPERIMENT_TITLES[experiment]}", text)
        for scene, items in summary["conclusions"].items()
        for experiment, text in items.items()
        if text
    ]
    rows = grouped(summary["rows"], "experiment", "scene")
    same_law, own_law = (
        {scene: rows.get(f"{law} {scene}", []) for scene in summary["reference"]} for law in (SAME_LAW, OWN_LAW)
    )
    for scene, reference in summary["reference"].items():
        if "rigid_period_s" in reference:
            gait = {"period_s": reference["rigid_period_s"], "step_length_m": reference["rigid_step_length_m"]}
            own_law[scene].insert(0, {"engine": "rigid", "integrator": "gait", "start": 1.0, "slip_m": 0.0, **gait})
    limits = [[name, "; ".join(items) + "."] for name, items in summary["cannot_express"].items()]
    blocks = (
        Paragraph(words("engines.introduction", summary["versions"])),
        Statements(tuple(concluded)),
        table("ADAMS's law in each engine's integrators", SAME_LAW_COLUMNS, same_law, note=words("engines.same_law")),
        table("The walk on each engine's own contact", OWN_LAW_COLUMNS, own_law, note=words("engines.own_law")),
        table("Tuning of the engines' own contact", TUNING_COLUMNS, summary["tuning"], note=words("engines.tuning")),
        swings(summary["swings"]),
        table("What the engines cannot express", LIMIT_COLUMNS, limits, wordy=True),
    )
    return Section.create("engines", "In other engines", blocks)


def engine_and_integrator(row: Row) -> str:
    return f"{row['engine']} {row['integrator']}"


RUN_COLUMN = partial(measured, labels=engines.EngineRow)
SAME_LAW_COLUMNS = (
    Column("integrator", engine_and_integrator),
    RUN_COLUMN("step", "step_s", partial(number, digits=3), prefix="µ"),
    RUN_COLUMN("tolerance", "tolerance", lambda value: NONE if value is None else power_of_ten(value, 1)),
    RUN_COLUMN("error", "error", partial(number, digits=2)),
    RUN_COLUMN("touch time error", "touch_error_s", partial(number, digits=2)),
    RUN_COLUMN("run time", "wall_s", partial(number, digits=3), prefix="m"),
    Column("outcome", "outcome"),
)


OWN_LAW_COLUMNS = (
    Column("contact", engine_and_integrator),
    RUN_COLUMN("start", "start", partial(number, digits=3)),
    RUN_COLUMN("step", "step_s", partial(number, digits=3), prefix="µ"),
    RUN_COLUMN("period", "period_s", partial(fixed, decimals=5)),
    RUN_COLUMN("length", "step_length_m", partial(fixed, decimals=4)),
    RUN_COLUMN("slip", "slip_m", partial(fixed, decimals=2), prefix="m"),
    RUN_COLUMN("steps", "steps", number),
    RUN_COLUMN("run time", "wall_s", partial(number, digits=2)),
    Column("outcome", "outcome"),
)


TUNING_COLUMNS = (
    Column("contact", lambda row: f"{row['engine']} {row['contact']}, {row['scene']}"),
    Column("quantity", lambda row: f"{row['quantity']} ({row['unit']})"),
    measured("ADAMS's law", "target", partial(number, digits=4), labels=engines.TuningRow),
    measured("measured", "reached", partial(number, digits=4), labels=engines.TuningRow),
    Column("residual", "residual", lambda value: f"{100.0 * value:+.2g} %", numeric=True),
)


SWING_COLUMN = partial(measured, labels=engines.SwingRow)
SWING_COLUMNS = (
    Column("integrator", lambda swing: f"{engine_and_integrator(swing)}, {swing['scene']}"),
    SWING_COLUMN("nominal order", "promised_order", str),
    Column("orders observed", "orders"),
    SWING_COLUMN("smallest error", "error", partial(number, digits=2)),
    SWING_COLUMN("energy drift of that run", "energy_drift_j", partial(number, digits=2)),
)


LIMIT_COLUMNS = (Column("engine"), Column("cannot express", wide=True))


def swings(runs: Sequence[Row]) -> Table:
    """Build the table of the pinned swing: the most accurate run of each integrator, and the orders of all its runs."""
    finest = []
    for swung in grouped(runs, "scene", "engine", "integrator").values():
        orders = ", ".join(number(run["order"], 3) for run in swung if run["order"] is not None)
        finest.append({**min(swung, key=lambda run: float(run["error"])), "orders": orders or "adapted"})
    return table("Without contact: a swing in each integrator", SWING_COLUMNS, finest, note=words("engines.swings"))
