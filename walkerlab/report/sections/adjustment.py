"""The paper's parameter adjustment: whether it was needed, how much, and what explains it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.labels import unit_by_name, with_unit
from walkerlab.report.blocks import COSTS, Block, Cell, Column, Paragraph, Section, Table, table
from walkerlab.report.numbers import NONE, fixed, length, listed, number, quantity
from walkerlab.report.outcomes import tone, walks
from walkerlab.report.results import Results
from walkerlab.report.sections.gaits import symbol
from walkerlab.report.symbols import in_signs

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
    "damping": ("damping at touch-down", 4),
    "friction": ("friction", 3),
    "knee_strikes": ("the knee's strike", 3),
    "knee_stop": ("the knees' stops", 3),
}
"""Where a step dissipates energy, by the names under which it is stored: what that is called, and digits to show."""
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
    blocks: list[Block] = [Paragraph(verdict(results, summary))]
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
    blocks: list[Block] = [limit_table(name, found) for name, found in reaches.items() if found["settings"]]
    if summary.get("orders"):
        blocks.append(orders_table(summary["orders"]))
    return Section("limit", "Towards the rigid limit", tuple(blocks), reached(summary), COSTS)


def verdict(results: Results, summary: Summary) -> str:
    """What explains the gait that it settles on, in one paragraph."""
    parts = [explained(summary), caused(summary), *([papers_start(summary)] if results.of_the_paper else [])]
    return " ".join(part for part in parts if part)


def needed(summary: Summary) -> str:
    """Whether and by how much the start has to be changed."""
    found = summary["adjustment"]
    swing, stance = ("link 1", "link 2") if "paper_start" in summary else ("the swing leg", "the stance leg")
    if not found["found"]:
        return f"No adjustment of the two initial velocities helps: {found['reason']}."
    if found["needed"]:
        released = summary["procedure"]["released"]
        return (
            "This contact needs an adjustment: from the rigid start the walker "
            f"{walks(released['steps'], released['outcome'])}. "
            f"The smallest change that walks {found['walked_steps']} steps scales the velocities of "
            f"{swing} and {stance} by {number(found['scale_dtheta1'], 4)} and "
            f"{number(found['scale_dtheta2'], 4)}."
        )
    down, up = (number(abs(found["margins"][f"dtheta_2 {way}"]["percent"]), 3) for way in ("down", "up"))
    return (
        f"No adjustment is needed: from the rigid start as it stands the contact model walks all "
        f"{found['walked_steps']} steps and settles on its own gait. It still does so if {stance} starts {down} % "
        f"slower or {up} % faster."
    )


def explained(summary: Summary) -> str:
    """The gait it settles on."""
    gait = summary["gait"]
    if not gait["found"]:
        return f"The contact model has no gait of its own: {gait['reason']}."
    lost, slip = gait["lost_J"], length(gait["slip_m"])
    goes = (
        f"{quantity(lost[key], 'J', digits)} into {name}" for key, (name, digits) in CHANNELS.items() if lost.get(key)
    )
    into = listed(goes).replace(" into ", " go into ", 1)
    size = f"{quantity(gait['period_s'], 's')} and {quantity(gait['step_length_m'], 'm')}"
    return (
        f"That gait takes {size} a step, its foot slips by {slip}; of the "
        f"{quantity(gait['height_lost_J'], 'J', 4)} that a step descends, {into}."
    )


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
    differs = f"Its period differs from the rigid gait's by {milliseconds(total)}"
    return f"{differs}. With each cause switched off alone, {parts}."


def reached(summary: Summary) -> str:
    """What the paper's claim would take; nothing if that was not asked."""
    reaches = summary.get("reaches", {})
    found = reaches.get(POINT_FEET, reaches.get("all"))
    if not found or not found["settings"]:
        return ""
    first, last = found["settings"][0], found["settings"][-1]
    claim, differ = number(found["claim_rad"]), quantity(first["angle_error_rad"], "rad", 2)
    within = found["first_within_claim"]
    chosen = last if within is None else within
    stiffness, damping, stiction = (
        number(chosen[f"{name}_factor"], 3) for name in ("stiffness", "damping", "stiction_velocity")
    )
    contact = (
        f"{stiffness} times the config's stiffness, {damping} times its damping and {stiction} times its stiction "
        "velocity"
    )
    if POINT_FEET in reaches:
        contact = f"point feet, {contact}"
    if within is not None:
        return (
            f"To differ from the rigid walk by no more than {claim} rad in phase instead of {differ} takes {contact}."
        )
    left = quantity(last["angle_error_rad"], "rad", 3)
    return f"With {contact}, the angles still differ by {left} in phase instead of {differ}: {claim} is not reached."


def milliseconds(value_s: float) -> str:
    """A time in ms."""
    return quantity(1e3 * value_s, "ms", 3)


def papers_start(summary: Summary) -> str:
    """What becomes of the paper's own start."""
    start = summary["paper_start"]
    return f"The start that the paper arrived at is not a gait's: {start['reason']}."


def starts_table(results: Results, summary: Summary) -> Table:
    """The start before and after; beside Table 2 if the paper is what is redone."""
    if not results.of_the_paper:
        rows = [
            [
                f"{symbol(name)} ({row['unit']})",
                *(number(row[key], 6) for key in ("ours_rigid", "ours_adjusted")),
            ]
            for name, row in summary["table2"].items()
        ]
        heads = [Column("coordinate"), Column("rigid gait", numeric=True), Column("adjusted", numeric=True)]
        return table("The start before and after the adjustment", heads, rows)
    shown = {
        "paper_matlab": "paper, MATLAB",
        "paper_adams": "paper, ADAMS",
        "paper_percent_of_matlab": "% of MATLAB",
        "paper_percent_of_adams": "% of ADAMS",
        "ours_rigid": "rigid gait",
        "ours_adjusted": "adjusted",
        "ours_percent_of_rigid": "change, % of rigid",
        "ours_percent_of_adjusted": "change, % of adjusted",
    }
    columns = [Column("row"), *(Column(head, numeric=True) for head in shown.values())]
    rows = [
        [in_signs(f"{name} ({row['unit']})"), *(number(row[key], 3 if "percent" in key else 6) for key in shown)]
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
        *(
            [f"energy lost in {CHANNELS[key][0]}", quantity(gait["lost_J"][key], "J"), instead]
            for key, instead in (("knee_strikes", "in the strike"), ("knee_stop", "none"))
            if gait["lost_J"].get(key)
        ),
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


def walks_table(results: Results, summary: Summary) -> Table:
    """The procedure, walk by walk."""
    names = {
        "hinged": "first step with a revolute joint, from the rigid state",
        "released": f"{'without the joint, ' if 'hinged' in summary['procedure'] else ''}from the rigid state",
        "adjusted": "from the adjusted start",
    }
    rows: list[list[str | Cell]] = [
        [names[name], Cell(walk["outcome"], tone(walk["outcome"])), str(walk["steps"])]
        for name, walk in summary["procedure"].items()
        if walk is not None
    ]
    if results.of_the_paper:
        start = summary["paper_start"]
        ended = Cell(start["outcome"], tone(start["outcome"]))
        rows.append(["from the paper's ADAMS start", ended, str(start["steps"])])
    return table(
        "The procedure, walk by walk", [Column("walk"), Column("outcome"), Column("steps", numeric=True)], rows
    )


def limit_table(name: str, found: Summary) -> Table:
    """One way towards the rigid limit."""
    shown = {
        "stiffness_factor": "stiffness",
        "damping_factor": "damping",
        "stiction_velocity_factor": "stiction velocity",
        "period_error_s": "period error",
        "angle_error_rad": "angle, in phase",
        "velocity_error_rad_s": "velocity, in phase",
        "raw_angle_error_rad": "angle, same time",
        "numerical_time_s": "numerical error",
        "run_wall_s": "run time",
    }
    columns = [Column(with_unit(words, unit_by_name(key)), numeric=True) for key, words in shown.items()]
    rows = [[number(row[key], 3) for key in shown] for row in found["settings"]]
    note = "The first three columns are factors on the config's contact; differences are from the rigid walk."
    return table(f"Towards the rigid limit: {name}", columns, rows, note=note)


def orders_table(orders: Mapping[str, Any]) -> Table:
    """Observed orders of convergence, knob by knob."""
    rows = [[name, ", ".join(fixed(order, 2) for order in values) or NONE] for name, values in orders.items()]
    columns = [Column("knob"), Column("observed orders, towards the limit", wide=True)]
    return table("How fast the period converges when one knob is turned", columns, rows)
