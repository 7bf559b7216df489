"""The disturbances that a gait survives, and the parameters that matter most."""

from collections.abc import Mapping
from typing import Any

from walkerlab.views.report.blocks import PageBlock, Paragraph, Section
from walkerlab.views.report.numbers import length, number, whole
from walkerlab.views.report.results import Results, of_stage
from walkerlab.views.report.tables import Column, Table, table
from walkerlab.views.report.words import words

SHOWN = 12
"""Derivatives per table."""
BUILT = ("walker.", "push_off.")
"""Prefixes of the keys that a builder can change."""
NORM = "gait_sensitivity_norm_scaled"
"""Quantity used to rank parameters; scaled, since a norm in s/m falls with leg length by its dimension alone."""
MODEL = Column("model", "model")
NORMS = (
    MODEL,
    Column("disturbance", "disturbance"),
    Column("indicator", lambda row: row["indicator"].replace("_", " ")),
    Column("norm", "value", lambda value: number(value, 6), numeric=True),
    Column("unit", "unit"),
    Column("direct", "direct", lambda value: number(value, 5), numeric=True),
    Column("scaled", "scaled", lambda value: number(value, 6), numeric=True),
)
BOUND = {"lower-bound": "> "}
ROUGH = (
    MODEL,
    Column("roughness", "roughness_m", length, numeric=True),
    Column("mean steps", lambda row: BOUND.get(row["method"], "") + number(row["mean_steps"], 4), numeric=True),
    Column("standard error", "standard_error", lambda value: number(value, 2), numeric=True),
    Column("walks", "walks", whole, numeric=True),
    Column("cut off", "capped", whole, numeric=True),
    Column("at step", "cut_off_at", whole, numeric=True),
    Column("method", "method"),
)
MOVES = (
    MODEL,
    Column("parameter", "to"),
    Column("gait quantity", "of"),
    Column("derivative", "value", number, numeric=True),
    Column("unit", "unit"),
    Column("% per %", "relative", lambda value: number(value, 3), numeric=True),
)


BEST = (
    Column("parameter", "to"),
    Column("best", "best", lambda value: number(value, 7), numeric=True),
)
KEPT = (
    Column("quantity", "quantity"),
    Column("minimum", "from", number, numeric=True),
    Column("maximum", "to", number, numeric=True),
    Column("at the optimum", "value", lambda value: number(value, 6), numeric=True),
)


def designed(summary: Mapping[str, Any]) -> list[str | Table]:
    """Describe the optimum of a design, with its parameters and constraints."""
    rows = [{"to": key, "best": value} for key, value in summary["best"].items()]
    kept = table("Constraints", KEPT, summary["constraints"])
    return [*words.parts("design.findings", summary), table("Optimum", BEST, rows), kept]


@of_stage("robustness", "gaits")
def section(_results: Results, summary: Mapping[str, Any]) -> Section | None:
    first, *others = findings(summary) or [""]
    blocks: tuple[PageBlock, ...] = (Paragraph(" ".join(others)), *tables(summary))
    return Section.of("robustness", "Robustness of the gait", blocks, first)


def findings(summary: Mapping[str, Any]) -> list[str]:
    """Summarise the findings, one sentence per item."""
    first: dict[str, Mapping[str, Any]] = {}
    for row in summary["sensitivity"]:
        if row["of"] == NORM and row["to"].startswith(BUILT) and ranks(row):
            first.setdefault(row["model"], row)
    return words.parts("robustness.findings", summary, [*first.values()])


def ranks(row: Mapping[str, Any]) -> bool:
    """Whether a derivative has a relative effect that can be ranked."""
    return row.get("relative") is not None and not row.get("why")


def tables(summary: Mapping[str, Any]) -> list[Table]:
    """Tabulate sensitivity norms, rough ground and derivatives."""
    rows = summary["sensitivity"]
    ranked = sorted((row for row in rows if ranks(row)), key=lambda row: -abs(row["relative"]))  # of both models
    built = [row for row in ranked if row["to"].startswith(BUILT)]
    around = [row for row in ranked if not row["to"].startswith(BUILT)]
    zeros = [row for row in rows if row["of"] == NORM and "relative" not in row and row["value"] is not None]
    first, shown = [row for row in built if row["of"] == NORM][:SHOWN], built[:SHOWN]
    left = len(rows) - len(shown) - len(around[:SHOWN])
    return [
        table("Gait sensitivity norms", NORMS, summary["gait_sensitivity_norm"], note=words("robustness.norms")),
        table("Steps on rough ground", ROUGH, summary["rough_ground"], note=words("robustness.rough")),
        table("Most effective changes", MOVES, first, note=words("robustness.first")),
        table("Effect of the parameters on the gait", MOVES, shown, note=words("robustness.moves", left)),
        table("Gravity, slope and ground", MOVES, around[:SHOWN]),
        table("Parameters that are zero", MOVES, zeros, note=words("robustness.zeros")),
    ]
