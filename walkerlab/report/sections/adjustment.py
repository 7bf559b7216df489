"""The paper's parameter adjustment: whether it was needed, how much, and what explains it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.report.blocks import COSTS, PageBlock, Paragraph, Section
from walkerlab.report.numbers import NONE, fixed, length, listed, number, quantity
from walkerlab.report.outcomes import tone
from walkerlab.report.results import Results
from walkerlab.report.sections.gaits import symbol
from walkerlab.report.symbols import in_signs
from walkerlab.report.tables import Cell, Column, Table, measured, side_by_side, table
from walkerlab.report.words import words

STAGE = "tune"
CAUSES = {
    "creep_s": "creep in the friction law",
    "penetration_and_finite_impact_s": "penetration and the finite impact",
    "foot_radius_s": "the round foot",
    "together_s": "what they do together",
    "rest_s": "creep in the friction law and what they do together, which could not be told apart",
}
"""Parts of the difference in period, and what they are called in a sentence."""
CHANNELS = {
    "damping": ("damping at touch-down", 4, "to damping", "in the impact, all"),
    "friction": ("friction", 3, "to friction", "none"),
    "knee_strikes": ("the knee's strike", 3, "in the knee's strike", "in the strike"),
    "knee_stop": ("the knees' stops", 3, "in the knees' stops", "none"),
}
"""Where a step dissipates energy, by the names under which it is stored: what that is called in a sentence, with digits
to show, what in a table, and what the rigid model has instead."""
POINT_FEET = "all, point foot"
"""The series of a walker whose feet are points in the rigid model and balls in the contact model."""
NOTHING = 1e-9
"""Imaginary part below which a multiplier is shown as real."""
Summary = Mapping[str, Any]


def section(results: Results) -> Section | None:
    """The verdict on the adjustment, with the tables behind it."""
    summary = results.summary(STAGE)
    if summary is None or "adjustment" not in summary:
        return None
    changed = results.of_the_paper or summary["adjustment"]["needed"]
    blocks: list[PageBlock] = [Paragraph(verdict(results, summary))]
    if changed:
        blocks.append(starts_table(results, summary))
    if summary["gait"]["found"]:
        blocks.append(gait_table(summary, results.summary("fixedpoint")))
    if summary["adjustment"].get("margins"):
        blocks.append(margins_table(summary))
    if changed:
        blocks.append(walks_table(results, summary))
    return Section("adjustment", "The parameter adjustment", tuple(blocks), needed(summary))


def limit(results: Results) -> Section | None:
    """What takes the contact model to the rigid one; None if nobody asked."""
    summary = results.summary(STAGE)
    if summary is None or not (summary.get("reaches") or summary.get("orders")):
        return None
    reaches = summary.get("reaches") or {}
    note = "The first three columns are factors on the config's contact; differences are from the rigid walk."
    blocks: list[PageBlock] = [
        table(f"Towards the rigid limit: {name}", LIMIT_COLUMNS, found["settings"], note=note)
        for name, found in reaches.items()
        if found["settings"]
    ]
    if orders := summary.get("orders"):
        rows = [[name, ", ".join(fixed(order, 2) for order in values) or NONE] for name, values in orders.items()]
        blocks.append(table("How fast the period converges when one knob is turned", ORDER_COLUMNS, rows))
    return Section("limit", "Towards the rigid limit", tuple(blocks), reached(summary), COSTS)


def verdict(results: Results, summary: Summary) -> str:
    """What explains the gait that it settles on, in one paragraph."""
    parts = [explained(summary), caused(summary)]
    if results.of_the_paper:
        parts.append(f"The start that the paper arrived at is not a gait's: {summary['paper_start']['reason']}.")
    return " ".join(part for part in parts if part)


def needed(summary: Summary) -> str:
    """Whether and by how much the start has to be changed."""
    found = summary["adjustment"]
    swing, stance = ("link 1", "link 2") if "paper_start" in summary else ("the swing leg", "the stance leg")
    if not found["found"]:
        return f"No adjustment of the two initial velocities helps: {found['reason']}."
    if found["needed"]:
        return words("adjustment.needed", found, summary["procedure"]["released"], swing, stance)
    down, up = (abs(found["margins"][f"dtheta_2 {way}"]["percent"]) for way in ("down", "up"))
    return words("adjustment.not_needed", found, stance, down, up)


def explained(summary: Summary) -> str:
    """The gait it settles on."""
    gait = summary["gait"]
    if not gait["found"]:
        return f"The contact model has no gait of its own: {gait['reason']}."
    goes = [
        f"{quantity(gait['lost_J'][key], 'J', digits)} into {name}"
        for key, (name, digits, *_) in CHANNELS.items()
        if gait["lost_J"].get(key)
    ]
    return words("adjustment.explained", gait, listed(goes).replace(" into ", " go into ", 1))


def caused(summary: Summary) -> str:
    """What makes the difference from the rigid gait; nothing if that was not asked."""
    causes = summary.get("causes")
    if not causes or not causes["total_s"]:
        return ""
    total = causes["total_s"]
    made = {key: causes[key] for key in CAUSES if causes.get(key) is not None}
    sizes = [f"{milliseconds(part)} ({number(100.0 * part / total, 3)} %)" for part in made.values()]
    first, *others = [f"from {CAUSES[key]}" for key in made]
    parts = listed([f"{sizes[0]} come {first}", *(" ".join(pair) for pair in zip(sizes[1:], others, strict=True))])
    return words("adjustment.caused", milliseconds(total), parts)


def reached(summary: Summary) -> str:
    """What the paper's claim would take; nothing if that was not asked."""
    reaches = summary.get("reaches", {})
    found = reaches.get(POINT_FEET, reaches.get("all"))
    if not found or not found["settings"]:
        return ""
    settings, within = found["settings"], found["first_within_claim"]
    chosen = settings[-1] if within is None else within
    return words(
        "adjustment.reached", found["claim_rad"], settings[0], chosen, within is not None, POINT_FEET in reaches
    )


def milliseconds(value_s: float) -> str:
    """A time in ms."""
    return quantity(1e3 * value_s, "ms", 3)


BESIDE_TABLE_2 = {
    "paper_matlab": "paper, MATLAB",
    "paper_adams": "paper, ADAMS",
    "paper_percent_of_matlab": "% of MATLAB",
    "paper_percent_of_adams": "% of ADAMS",
    "ours_rigid": "rigid gait",
    "ours_adjusted": "adjusted",
    "ours_percent_of_rigid": "change, % of rigid",
    "ours_percent_of_adjusted": "change, % of adjusted",
}
"""Columns beside the coordinates of the paper's Table 2."""


def starts_table(results: Results, summary: Summary) -> Table:
    """The start before and after; beside Table 2 if the paper is what is redone."""
    rows = [{"name": name, **row} for name, row in summary["table2"].items()]
    if not results.of_the_paper:
        coordinate = Column("coordinate", lambda row: f"{symbol(row['name'])} ({row['unit']})")
        starts = {"ours_rigid": "rigid gait", "ours_adjusted": "adjusted"}
        start = (Column(head, key, partial(number, digits=6), numeric=True) for key, head in starts.items())
        return table("The start before and after the adjustment", (coordinate, *start), rows)
    beside = (
        Column(head, key, partial(number, digits=3 if "percent" in key else 6), numeric=True)
        for key, head in BESIDE_TABLE_2.items()
    )
    row = Column("row", lambda row: in_signs(f"{row['name']} ({row['unit']})"))
    note = "The paper's percentages are those of the ADAMS value, without saying so."
    return table("Table 2 again: the start before and after the adjustment", (row, *beside), rows, note=note)


def lost(channel: str, gait: Summary) -> float | Cell | None:
    """What a gait dissipates in a channel (J); None of knees that take nothing."""
    into = gait["lost_J"].get(channel)
    return into if into or channel in ("damping", "friction") else None


def factors(multipliers: Sequence[tuple[float, float]]) -> str:
    """Multipliers, largest first; a complex one stands for itself and its conjugate."""
    return listed(
        fixed(real, 4) + (f" ± {fixed(imag, 4)}i" if imag > NOTHING else "")
        for real, imag in multipliers
        if imag >= 0.0
    )


GAIT_LINES = (
    Column("period", "period_s", lambda value: quantity(value, "s", 7)),
    Column("step length", "step_length_m", lambda value: quantity(value, "m", 7)),
    Column("largest multiplier", "spectral_radius", partial(number, digits=4)),
    Column("multipliers", "multipliers", factors),
    Column("stable", "stable"),
    Column("slip a step", "slip_m", length),
    *(
        Column(f"energy lost {said}", partial(lost, channel), partial(quantity, unit="J"))
        for channel, (_, _, said, _) in CHANNELS.items()
    ),
    Column("height lost", "height_lost_J", partial(quantity, unit="J")),
)


def gait_table(summary: Summary, rigid: Summary | None) -> Table:
    """The contact gait beside the rigid one."""
    gait = summary["gait"]
    note = f"Section of the contact gait: {gait['section']}."
    losses = {channel: Cell(said) for channel, (*_, said) in CHANNELS.items() if lost(channel, gait) is not None}
    beside = {**(rigid or {}), "slip_m": Cell("none"), "lost_J": losses, "height_lost_J": Cell("the same as lost")}
    gaits = {"contact model": gait, "rigid model": beside}
    return side_by_side("The contact model's own gait", GAIT_LINES, gaits, note=note)


MARGIN_COLUMNS = (
    Column("scaled", "name", in_signs),
    Column("last factor that walks", "factor", number, numeric=True),
    Column("beyond", "beyond", lambda outcome: outcome or "nothing, as far as searched"),
    Column("steps there", "steps_beyond", lambda steps: "" if steps is None else str(steps), numeric=True),
)


def margins_table(summary: Summary) -> Table:
    """How far the start may be scaled."""
    rows = [{"name": name, **margin} for name, margin in summary["adjustment"]["margins"].items()]
    return table("How far the start's velocities may change", MARGIN_COLUMNS, rows)


WALK_COLUMNS = (
    Column("walk", "walk"),
    Column("outcome", "outcome", lambda outcome: Cell(outcome, tone(outcome))),
    Column("steps", "steps", numeric=True),
    Column(
        "numerical error of a period (s)",
        lambda walk: walk.get("numerical_error", {}).get("step_period_s"),
        partial(number, digits=1),
        numeric=True,
    ),
)


def walks_table(results: Results, summary: Summary) -> Table:
    """The procedure, walk by walk."""
    names = {
        "hinged": "first step with a revolute joint, from the rigid state",
        "released": f"{'without the joint, ' if 'hinged' in summary['procedure'] else ''}from the rigid state",
        "adjusted": "from the adjusted start",
    }
    walks = [{"walk": names[name], **walk} for name, walk in summary["procedure"].items() if walk is not None]
    if results.of_the_paper:
        walks.append({"walk": "from the paper's ADAMS start", **summary["paper_start"]})
    return table("The procedure, walk by walk", WALK_COLUMNS, walks)


LIMIT_COLUMNS = tuple(
    measured(said, key, partial(number, digits=3))
    for key, said in {
        "stiffness_factor": "stiffness",
        "damping_factor": "damping",
        "stiction_velocity_factor": "stiction velocity",
        "period_error_s": "period error",
        "angle_error_rad": "angle, in phase",
        "velocity_error_rad_s": "velocity, in phase",
        "raw_angle_error_rad": "angle, same time",
        "numerical_time_s": "numerical error",
        "run_wall_s": "run time",
    }.items()
)


ORDER_COLUMNS = (Column("knob"), Column("observed orders, towards the limit", wide=True))
