"""The paper's parameter adjustment: whether it was needed, how much, and what explains it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.report.blocks import Block, Cell, Column, Paragraph, Section, Table, table
from walkerlab.report.numbers import count, fixed, length, listed, number, quantity
from walkerlab.report.outcomes import tone
from walkerlab.report.results import Results
from walkerlab.report.symbols import in_signs

STAGE = "tune"
NOTHING = 1e-9
"""Imaginary part below which a multiplier is shown as real."""
Summary = Mapping[str, Any]


def section(results: Results) -> Section | None:
    """The verdict on the adjustment, with the tables behind it."""
    summary = results.summary(STAGE)
    if summary is None or "adjustment" not in summary:
        return None
    blocks: list[Block] = [Paragraph(verdict(summary)), starts_table(summary)]
    if summary["gait"]["found"]:
        blocks.append(gait_table(summary, results.summary("fixedpoint")))
    if summary["adjustment"].get("margins"):
        blocks.append(margins_table(summary))
    blocks.append(walks_table(summary))
    return Section("adjustment", "The parameter adjustment", tuple(blocks))


def verdict(summary: Summary) -> str:
    """Whether the adjustment was needed, and what explains it, in one paragraph."""
    return " ".join((needed(summary), explained(summary), papers_start(summary)))


def needed(summary: Summary) -> str:
    """Whether and by how much the start has to be changed."""
    found = summary["adjustment"]
    if not found["found"]:
        return f"No adjustment of the two initial velocities helps: {found['reason']}."
    if found["needed"]:
        released = summary["procedure"]["released"]
        return (
            f"This contact needs an adjustment: from the rigid start the walk ends as {released['outcome']} after "
            f"{count(released['steps'], 'step')}. The smallest change that walks {found['walked_steps']} steps scales "
            f"the velocities of link 1 and link 2 by {number(found['scale_dtheta1'], 4)} and "
            f"{number(found['scale_dtheta2'], 4)}."
        )
    down, up = (number(abs(found["margins"][f"dtheta_2 {way}"]["percent"]), 3) for way in ("down", "up"))
    return (
        f"No adjustment is needed: from the rigid start as it stands the contact model walks all "
        f"{found['walked_steps']} steps and settles on its own gait. It still does so if link 2 starts {down} % slower "
        f"or {up} % faster."
    )


def explained(summary: Summary) -> str:
    """The gait it settles on."""
    gait = summary["gait"]
    if not gait["found"]:
        return f"The contact model has no gait of its own: {gait['reason']}."
    lost, slip = gait["lost_J"], length(gait["slip_m"])
    damping, friction = quantity(lost["damping"], "J", 4), quantity(lost["friction"], "J", 3)
    size = f"{quantity(gait['period_s'], 's')} and {quantity(gait['step_length_m'], 'm')}"
    return (
        f"That gait takes {size} a step, its foot slips by {slip}; of the "
        f"{quantity(gait['height_lost_J'], 'J', 4)} that a step descends, {damping} go "
        f"into damping at touch-down and {friction} into friction."
    )


def papers_start(summary: Summary) -> str:
    """What becomes of the paper's own start."""
    start = summary["paper_start"]
    return f"The start that the paper arrived at is not a gait's: {start['reason']}."


def starts_table(summary: Summary) -> Table:
    """Table 2 with the adjusted start."""
    columns = [
        Column("row"),
        Column("paper, MATLAB", numeric=True),
        Column("paper, ADAMS", numeric=True),
        Column("% of MATLAB", numeric=True),
        Column("% of ADAMS", numeric=True),
        Column("rigid gait", numeric=True),
        Column("adjusted", numeric=True),
        Column("change, % of rigid", numeric=True),
        Column("change, % of adjusted", numeric=True),
    ]
    keys = (
        "paper_matlab",
        "paper_adams",
        "paper_percent_of_matlab",
        "paper_percent_of_adams",
        "ours_rigid",
        "ours_adjusted",
        "ours_percent_of_rigid",
        "ours_percent_of_adjusted",
    )
    rows = [
        [in_signs(f"{name} ({row['unit']})"), *(number(row[key], 3 if "percent" in key else 6) for key in keys)]
        for name, row in summary["table2"].items()
    ]
    note = "The paper's percentages are those of the ADAMS value, without saying so."
    return table("Table 2 again: the start before and after the adjustment", columns, rows, note=note)


def gait_table(summary: Summary, rigid: Summary | None) -> Table:
    """The contact gait beside the rigid one."""
    gait = summary["gait"]
    factors = listed(factor(real, imag) for real, imag in gait["multipliers"] if imag >= 0.0)
    rows = [
        ["period", quantity(gait["period_s"], "s", 7), other(rigid, "period_s", "s")],
        ["step length", quantity(gait["step_length_m"], "m", 7), other(rigid, "step_length_m", "m")],
        ["largest multiplier", number(gait["spectral_radius"], 4), other(rigid, "spectral_radius", "")],
        ["slip a step", length(gait["slip_m"]), "none"],
        ["energy lost to damping", quantity(gait["lost_J"]["damping"], "J"), "in the impact, all"],
        ["energy lost to friction", quantity(gait["lost_J"]["friction"], "J"), "none"],
        ["height lost", quantity(gait["height_lost_J"], "J"), "the same as lost"],
    ]
    columns = [Column("quantity"), Column("contact model", numeric=True), Column("rigid model", numeric=True)]
    note = f"Multipliers of the contact gait: {factors}. Section: {gait['section']}."
    return table("The contact model's own gait", columns, rows, note=note)


def factor(real: float, imag: float) -> str:
    """A multiplier; a complex one stands for itself and its conjugate."""
    return fixed(real, 4) + (f" ± {fixed(imag, 4)}i" if abs(imag) > NOTHING else "")


def other(rigid: Summary | None, key: str, unit: str) -> str:
    """The rigid gait's value."""
    return "" if rigid is None or key not in rigid else quantity(rigid[key], unit, 7 if unit else 4)


def margins_table(summary: Summary) -> Table:
    """How far the start may be scaled."""
    rows = [
        [
            in_signs(name),
            number(margin["factor"], 5),
            "nothing, as far as searched" if margin["beyond"] is None else margin["beyond"],
            "" if margin["steps_beyond"] is None else str(margin["steps_beyond"]),
        ]
        for name, margin in summary["adjustment"]["margins"].items()
    ]
    columns = [
        Column("scaled"),
        Column("last factor that walks", numeric=True),
        Column("beyond"),
        Column("steps there", numeric=True),
    ]
    return table("How far the start's velocities may change", columns, rows)


def walks_table(summary: Summary) -> Table:
    """The procedure, walk by walk."""
    names = {
        "hinged": "first step with a revolute joint, from the rigid state",
        "released": "without the joint, from the rigid state",
        "adjusted": "from the adjusted start",
    }
    rows: list[list[str | Cell]] = [
        [names[name], Cell(walk["outcome"], tone(walk["outcome"])), str(walk["steps"])]
        for name, walk in summary["procedure"].items()
        if walk is not None
    ]
    start = summary["paper_start"]
    rows.append(["from the paper's ADAMS start", Cell(start["outcome"], tone(start["outcome"])), str(start["steps"])])
    return table(
        "The procedure, walk by walk", [Column("walk"), Column("outcome"), Column("steps", numeric=True)], rows
    )
