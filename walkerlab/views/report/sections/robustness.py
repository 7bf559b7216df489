"""Section on the disturbances that a gait survives, and the parameters that matter most."""

from collections.abc import Mapping
from typing import Any

from walkerlab.views.report.blocks import Paragraph, Results, Section, stage_section
from walkerlab.views.report.numbers import format_integer, length, number
from walkerlab.views.report.tables import Column, Table, table
from walkerlab.views.report.words import words

MIN_DECLINE = 0.01
"""Relative change above which a measure of robustness counts as worse."""
FIRST_TABLES = 2
"""Number of tables that the terminal shows by default."""
MAX_DERIVATIVES = 12
"""Maximum number of derivatives per table."""
BUILDER_KEYS = ("walker.", "push_off.")
"""Prefixes of the keys that a builder can change."""
NORM = "gait_sensitivity_norm_scaled"
"""Quantity that ranks the parameters. It is dimensionless, because a norm in s/m would depend on the walker's size."""
MODEL_COLUMN = Column("model", "model")
LEG_COLUMN = Column("swing leg", "leg")
NORM_COLUMNS = (
    Column("disturbance", "disturbance"),
    Column("indicator", lambda row: row["indicator"].replace("_", " ")),
    Column("norm", "value", lambda value: number(value, 6), numeric=True),
    Column("unit", "unit"),
    Column("direct", "direct", lambda value: number(value, 5), numeric=True),
    Column("scaled", "scaled", lambda value: number(value, 6), numeric=True),
)
BOUND_SIGNS = {"lower-bound": "> "}
ROUGH_COLUMNS = (
    MODEL_COLUMN,
    Column("roughness", "roughness_m", length, numeric=True),
    Column("mean steps", lambda row: BOUND_SIGNS.get(row["method"], "") + number(row["mean_steps"], 4), numeric=True),
    Column("standard error", "standard_error", lambda value: number(value, 2), numeric=True),
    Column("walks", "walks", format_integer, numeric=True),
    Column("cut off", "capped", format_integer, numeric=True),
    Column("at step", "cut_off_at", format_integer, numeric=True),
    Column("method", "method"),
)
DERIVATIVE_COLUMNS = (
    MODEL_COLUMN,
    Column("parameter", "to"),
    Column("gait quantity", "of"),
    Column("derivative", "value", number, numeric=True),
    Column("unit", "unit"),
    Column("% per %", "relative", lambda value: number(value, 3), numeric=True),
)


OPTIMUM_COLUMNS = (Column("parameter"), Column("best", written=lambda value: number(value, 7), numeric=True))
CONSTRAINT_COLUMNS = (
    Column("quantity", "quantity"),
    Column("minimum", "from", number, numeric=True),
    Column("maximum", "to", number, numeric=True),
    Column("at the optimum", "value", lambda value: number(value, 6), numeric=True),
)


COMPARISON_COLUMNS = (
    Column("robustness", "quantity"),
    Column("at the start", "start", lambda value: number(value, 4), numeric=True),
    Column("at the optimum", "best", lambda value: number(value, 4), numeric=True),
)


def design_blocks(summary: Mapping[str, Any]) -> list[str | Table]:
    compared = summary.get("robustness", ())
    worse = [row["quantity"] for row in compared if "start" in row and "best" in row and is_worse(row)]
    return [
        *words.parts("design.findings", summary, worse),
        table("Optimum", OPTIMUM_COLUMNS, list(summary["best"].items())),
        table("Constraints", CONSTRAINT_COLUMNS, summary["constraints"]),
        table("Robustness", COMPARISON_COLUMNS, compared),
    ]


def is_worse(row: Mapping[str, Any]) -> bool:
    """Whether the gait at the optimum survives less than that at the start of the search, or is more sensitive."""
    change = row["best"] / row["start"] - 1.0 if row["start"] else 0.0
    return (change if row["quantity"].startswith("largest") else -change) < -MIN_DECLINE


@stage_section("robustness", "gaits")
def section(_results: Results, summary: Mapping[str, Any]) -> Section | None:
    first, *rest = findings(summary) or [""]
    return Section.create("robustness", "Robustness of the gait", (Paragraph(" ".join(rest)), *tables(summary)), first)


def findings(summary: Mapping[str, Any]) -> list[str]:
    first: dict[str, Mapping[str, Any]] = {}
    for row in summary["sensitivity"]:
        if row["of"] == NORM and row["to"].startswith(BUILDER_KEYS) and can_be_ranked(row):
            first.setdefault(row["model"], row)
    return words.parts("robustness.findings", summary, [*first.values()])


def can_be_ranked(row: Mapping[str, Any]) -> bool:
    """Whether a derivative can be ranked by its relative effect."""
    return row.get("relative") is not None and not row.get("why")


def filled_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Return the tables that have rows."""
    return [each for each in tables(summary) if each]


def tables(summary: Mapping[str, Any]) -> list[Table]:
    rows = summary["sensitivity"]
    norms = summary["gait_sensitivity_norm"]
    legs_differ = any("leg" in row for row in norms)
    columns = (MODEL_COLUMN, *([LEG_COLUMN] if legs_differ else []), *NORM_COLUMNS)
    # The derivatives of both models are ranked together.
    ranked = sorted((row for row in rows if can_be_ranked(row)), key=lambda row: -abs(row["relative"]))
    built = [row for row in ranked if row["to"].startswith(BUILDER_KEYS)]
    environment = [row for row in ranked if not row["to"].startswith(BUILDER_KEYS)]
    zeros = [row for row in rows if row["of"] == NORM and "relative" not in row and row["value"] is not None]
    first = [row for row in built if row["of"] == NORM][:MAX_DERIVATIVES]
    top = built[:MAX_DERIVATIVES]
    omitted = len(rows) - len(top) - len(environment[:MAX_DERIVATIVES])
    return [
        table("Gait sensitivity norms", columns, norms, note=words("robustness.norms", legs_differ)),
        table("Most effective changes", DERIVATIVE_COLUMNS, first, note=words("robustness.first")),
        table("Steps on rough ground", ROUGH_COLUMNS, summary["rough_ground"], note=words("robustness.rough")),
        table("Effect of the parameters on the gait", DERIVATIVE_COLUMNS, top, note=words("robustness.moves", omitted)),
        table("Gravity, slope and ground", DERIVATIVE_COLUMNS, environment[:MAX_DERIVATIVES]),
        table("Parameters that are zero", DERIVATIVE_COLUMNS, zeros, note=words("robustness.zeros")),
    ]
