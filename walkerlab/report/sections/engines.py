"""What other engines make of the same walk: their integrators on our law, and their own contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from walkerlab.report.blocks import Body, Column, Finding, Findings, Paragraph, Section, Table, body, table
from walkerlab.report.numbers import fixed, listed, number, power_of_ten
from walkerlab.report.results import Results

STAGE = "engines"
SAME_LAW, OWN_LAW = "same-law", "own-law"
ABOUT = {SAME_LAW: "same law", OWN_LAW: "own contact"}

Row = Mapping[str, Any]


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


def same_law(summary: Mapping[str, Any]) -> Table:
    """Each integrator's runs from coarse to fine."""
    heads = (
        Column("integrator"),
        Column("step (µs)", numeric=True),
        Column("tolerance", numeric=True),
        Column("error", numeric=True),
        Column("of touch times (s)", numeric=True),
        Column("run time (ms)", numeric=True),
        Column("outcome"),
    )
    bodies = tuple(
        body([same_law_line(row) for row in rows_of(summary, scene, SAME_LAW)], scene) for scene in summary["reference"]
    )
    note = (
        "The error is the largest difference of the end state from the reference, SI; "
        "adapted steps are given by their mean."
    )
    return Table("ADAMS's law in each engine's integrators", heads, bodies, note=note)


def rows_of(summary: Mapping[str, Any], scene: str, experiment: str) -> list[Row]:
    """The rows of one scene and experiment."""
    return [row for row in summary["rows"] if row["scene"] == scene and row["experiment"] == experiment]


def same_law_line(row: Row) -> list[str]:
    """One run."""
    return [
        f"{row['engine']} {row['integrator']}",
        number(1e6 * row["step_s"], 3),
        "–" if row["tolerance"] is None else power_of_ten(row["tolerance"], 1),
        number(row["error"], 2),
        number(row["touch_error_s"], 2),
        number(1e3 * row["wall_s"], 3),
        row["outcome"],
    ]


def own_law(summary: Mapping[str, Any]) -> Table:
    """The walks with each engine's own contact, ADAMS's law among them."""
    heads = (
        Column("contact"),
        Column("start", numeric=True),
        Column("step (µs)", numeric=True),
        Column("period (s)", numeric=True),
        Column("length (m)", numeric=True),
        Column("slip (mm)", numeric=True),
        Column("steps", numeric=True),
        Column("run time (s)", numeric=True),
        Column("outcome"),
    )
    bodies: list[Body] = []
    for scene, reference in summary["reference"].items():
        lines = [own_law_line(row) for row in rows_of(summary, scene, OWN_LAW)]
        if "rigid_period_s" in reference:
            period, length = fixed(reference["rigid_period_s"], 5), fixed(reference["rigid_step_length_m"], 4)
            lines.insert(0, ["rigid gait", "1", "–", period, length, "0", "–", "–", "–"])
        bodies.append(body(lines, scene))
    note = (
        "Period, length and slip are those of the last step that was walked, of at most ten; the start is the gait's "
        "velocities times the number given. walkerlab impact is ADAMS's law."
    )
    return Table("The walk on each engine's own contact", heads, tuple(bodies), note=note)


def own_law_line(row: Row) -> list[str]:
    """One walk."""
    return [
        f"{row['engine']} {row['integrator']}",
        number(row["start"], 3),
        number(1e6 * row["step_s"], 3),
        fixed(row["period_s"], 5),
        fixed(row["step_length_m"], 4),
        fixed(None if row["slip_m"] is None else 1e3 * row["slip_m"], 2),
        str(row["steps"]),
        number(row["wall_s"], 2),
        row["outcome"],
    ]


def tuning(summary: Mapping[str, Any]) -> tuple[Table, ...]:
    """What a ball and a block do on each contact, against what it was tuned to."""
    rows: Sequence[Row] = summary["tuning"]
    if not rows:
        return ()
    heads = [
        Column("contact"),
        Column("quantity"),
        Column("ADAMS's law", numeric=True),
        Column("measured", numeric=True),
        Column("residual", numeric=True),
    ]
    lines = [
        [
            f"{row['engine']} {row['contact']}, {row['scene']}",
            f"{row['quantity']} ({row['unit']})",
            number(row["target"], 4),
            number(row["reached"], 4),
            f"{100.0 * row['residual']:+.2g} %",
        ]
        for row in rows
    ]
    note = "Measured on a ball of the walker's mass dropped on the ground, and a block of that mass slid on it."
    return (table("Tuning of the engines' own contact", heads, lines, note=note),)


def swings(summary: Mapping[str, Any]) -> Table:
    """The hinged walker's swing, from coarse to fine."""
    heads = [
        Column("integrator"),
        Column("order promised", numeric=True),
        Column("orders observed"),
        Column("smallest error", numeric=True),
        Column("energy drift there (J)", numeric=True),
    ]
    lines = []
    keys = dict.fromkeys((row["scene"], row["engine"], row["integrator"]) for row in summary["swings"])
    for scene, engine, integrator in keys:
        mine = [
            row
            for row in summary["swings"]
            if (row["scene"], row["engine"], row["integrator"]) == (scene, engine, integrator)
        ]
        best = min(mine, key=lambda row: float(row["error"]))
        orders = [number(row["order"], 3) for row in mine if row["order"] is not None]
        lines.append(
            [
                f"{engine} {integrator}, {scene}",
                str(best["promised_order"]),
                ", ".join(orders) if orders else "adapted",
                number(best["error"], 2),
                number(best["energy_drift_j"], 2),
            ]
        )
    note = "The walker hinged at its stance foot, without ground, against this project's equations and SciPy's DOP853."
    return table("Without contact: a swing in each integrator", heads, lines, note=note)


def limits(summary: Mapping[str, Any]) -> Table:
    """What each engine cannot express."""
    heads = [Column("engine"), Column("cannot express", wide=True)]
    lines = [[name, "; ".join(told) + "."] for name, told in summary["cannot_express"].items()]
    return table("What the engines cannot express", heads, lines, wordy=True)
