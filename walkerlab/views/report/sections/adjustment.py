"""Sections on the paper's parameter adjustment: whether it is needed, how large it is, and what explains it."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.config.drives import push_offs
from walkerlab.labels import join_words
from walkerlab.views.report.blocks import COSTS, Paragraph, Results, Section, stage_section
from walkerlab.views.report.gaits import symbol, work_columns
from walkerlab.views.report.numbers import NONE, fixed, length, number, quantity, typeset
from walkerlab.views.report.tables import Cell, Column, Table, measured, side_by_side, table
from walkerlab.views.report.words import tone, words

Summary = Mapping[str, Any]


@stage_section("tune", "adjustment")
def section(results: Results, summary: Summary) -> Section | None:
    changed = results.claims or summary["adjustment"]["needed"]
    blocks = (
        Paragraph(words("adjustment.explained", summary, results.claims)),
        starts_table(results, summary) if changed else None,
        gait_table(summary, results.summary("fixedpoint")) if summary["gait"]["found"] else None,
        margins_table(summary),
        walks_table(results, summary) if changed else None,
    )
    return Section.create("adjustment", "The parameter adjustment", blocks, words("adjustment.needed", summary))


ORDER_COLUMNS = (
    Column("parameter"),
    Column("observed orders of convergence, the last one nearest the limit", wide=True),
)


def limit(results: Results) -> Section | None:
    """Show how the contact model converges to the rigid one, or return None if that was not computed."""
    summary = results.summary("tune")
    reaches = summary.get("reaches") or {}
    orders = summary.get("orders") or {}
    pushes = any(push_offs(results.config.push_off))
    note = words("adjustment.factors", pushes)
    titles = words.terms("adjustment.distances").items()
    columns = [measured(title, key, partial(number, digits=3)) for key, title in titles]
    settings = {f"Towards the rigid limit: {name}": reach["settings"] for name, reach in reaches.items()}
    rows = [[name, ", ".join(fixed(order, 2) for order in values) or NONE] for name, values in orders.items()]
    blocks = (
        *(table(caption, columns, rungs, note=note) for caption, rungs in settings.items()),
        table("Convergence of the period when one parameter changes", ORDER_COLUMNS, rows),
    )
    finding = words("adjustment.reached", reaches, pushes)
    return Section.create("limit", "Towards the rigid limit", blocks, finding, COSTS)


def starts_table(results: Results, summary: Summary) -> Table:
    """Tabulate the start before and after the adjustment. If the scene is the paper's, include the paper's Table 2."""
    rows = [{"name": name, **row} for name, row in summary["table2"].items()]
    caption = f"{'Table 2 again: the' if results.claims else 'The'} start before and after the adjustment"
    head = "row" if results.claims else "coordinate"
    note = "The paper's percentages are relative to the ADAMS value, which it does not state." if results.claims else ""
    named = typeset if results.claims else symbol
    first = Column(head, lambda row: f"{named(row['name'])} ({row['unit']})")
    titles = words.terms("adjustment.starts", results.claims).items()
    digits = {key: 3 if "percent" in key else 6 for key, _ in titles}
    value_columns = (Column(title, key, partial(number, digits=digits[key]), numeric=True) for key, title in titles)
    return table(caption, (first, *value_columns), rows, note=note)


LOSS_HEADS = {
    "damping": ("to damping", "all in the impact"),
    "friction": ("to friction", "none"),
    "knee_strikes": ("in the knee's strike", "in the strike"),
    "knee_stop": ("in the knees' stops", "none"),
}
"""For each energy loss per step, by its stored name: its label, and what the table shows for the rigid model."""


def lost_energy(channel: str, gait: Summary) -> float | Cell | None:
    """Return the energy (J) that a gait loses in a channel, or None for a knee channel without losses."""
    energy = gait["lost_J"].get(channel)
    return energy if energy or channel in ("damping", "friction") else None


def factors(multipliers: Sequence[tuple[float, float]]) -> str:
    """Format multipliers (real, imaginary) as a list, in which ± stands for a conjugate pair."""
    pairs = ((fixed(real, 4), imag) for real, imag in multipliers if imag >= 0.0)
    return join_words(f"{real} ± {fixed(imag, 4)}i" if imag > 1e-9 else real for real, imag in pairs)


GAIT_LINES = (
    Column("period", "period_s", lambda value: quantity(value, "s", 7)),
    Column("step length", "step_length_m", lambda value: quantity(value, "m", 7)),
    Column("largest multiplier", "spectral_radius", partial(number, digits=4)),
    Column("multipliers", "multipliers", factors),
    Column("stable", "stable"),
    Column("slip per step", "slip_m", length),
    *(
        Column(f"energy lost {label}", partial(lost_energy, channel), partial(quantity, unit="J"))
        for channel, (label, _) in LOSS_HEADS.items()
    ),
    *work_columns(number),
)


def gait_table(summary: Summary, rigid: Summary) -> Table:
    gait = summary["gait"]
    note = f"Section of the contact gait: {gait['section']}."
    losses = {key: Cell(label) for key, (_, label) in LOSS_HEADS.items() if lost_energy(key, gait) is not None}
    gaits = {"contact model": gait, "rigid model": {**rigid, "slip_m": Cell("none"), "lost_J": losses}}
    return side_by_side("The contact model's own gait", GAIT_LINES, gaits, note=note)


MARGIN_COLUMNS = (
    Column("scaled velocity", "name", typeset),
    Column("largest change that still leads to walking (factor)", "factor", number, numeric=True),
    Column("outcome beyond", "beyond", lambda outcome: outcome or "no failure in the search range"),
    Column("steps beyond", "steps_beyond", lambda steps: "" if steps is None else str(steps), numeric=True),
)


def margins_table(summary: Summary) -> Table:
    rows = [{"name": name, **margin} for name, margin in (summary["adjustment"].get("margins") or {}).items()]
    return table("How far the start's velocities may change", MARGIN_COLUMNS, rows)


WALK_COLUMNS = (
    Column("walk", "walk"),
    Column("outcome", "outcome", lambda outcome: Cell(outcome, tone(outcome))),
    Column("steps", "steps", numeric=True),
    measured("numerical error of a period", "numerical_error/step_period_s", partial(number, digits=1)),
)


def walks_table(results: Results, summary: Summary) -> Table:
    names = words.terms("adjustment.walks", "hinged" in summary["procedure"])
    walks = [{"walk": names[name], **walk} for name, walk in summary["procedure"].items() if walk is not None]
    if results.claims:
        walks.append({"walk": "from the paper's ADAMS start", **summary["paper_start"]})
    return table("The procedure, walk by walk", WALK_COLUMNS, walks)
