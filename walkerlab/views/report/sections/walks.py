"""Sections on the walks: quantities of the contact walk, assumptions of the rigid walk, and the steps of both."""

from collections.abc import Mapping
from itertools import zip_longest
from typing import Any

from walkerlab.labels import CONTACT_STAGE, ERROR_OF_EACH_STEP, RIGID_STAGE
from walkerlab.physics.energy_channels import CHANNELS
from walkerlab.views.report import numbers
from walkerlab.views.report.blocks import Paragraph, Results, Section, stage_section
from walkerlab.views.report.gaits import WORK_SOURCES
from walkerlab.views.report.tables import Cell, Column, table
from walkerlab.views.report.words import MODEL_NAMES, tone, words

QUANTITY_COLUMNS = (Column("quantity"), Column("value", numeric=True), Column("meaning", wide=True))


@stage_section(CONTACT_STAGE)
def contact(results: Results, summary: Mapping[str, Any]) -> Section | None:
    ground = results.config.contact
    text = "" if ground is None else words("walks.ground", ground, ground.to_si(), summary)
    quantities = table("The contact model's walk", QUANTITY_COLUMNS, contact_rows(summary), wordy=True)
    residual = joules(summary["energy_balance_residual_J"])
    finding = words("walks.finding", summary, 2 * results.config.strides, residual)
    return Section("contact", "The contact walk", (Paragraph(text), quantities), finding)


def contact_rows(summary: Mapping[str, Any]) -> list[tuple[str, str | Cell, str]]:
    get = summary.get
    losses = summary.get("dissipated_J") or {}
    work = get("work_per_step_J") or {}
    values: dict[str, str | Cell] = {
        "outcome": Cell(summary["outcome"], tone(summary["outcome"])),
        "largest penetration": numbers.length(get("max_penetration_m")),
        "static penetration": numbers.length(get("static_penetration_m")),
        "damping ratio": numbers.number(get("damping_ratio"), 3),
        "slip per step": numbers.length(get("slip_per_step_m")),
        "slip in each step": numbers.span([1e3 * slip for slip in get("slips_m") or ()], "mm", 3),
        "rolling per step": numbers.length(get("rolling_per_step_m") or None),
        **{f"work of {source}": joules(work[name]) for name, source in WORK_SOURCES.items() if work.get(name)},
        "speed": numbers.quantity(get("speed_m_s"), "m/s", 4),
        "Froude number": numbers.number(get("froude"), 4),
        "cost of transport": numbers.number(get("cost_of_transport"), 4),
        "energy balance error": joules(summary["energy_balance_residual_J"]),
        **{f"energy lost {CHANNELS.get(key, key)}": joules(value) for key, value in losses.items()},
        "solver work": numbers.format_integer(get("rhs_evaluations")),
    }
    meanings = words.terms("walks.meanings", summary)
    known = {name: value for name, value in values.items() if value != numbers.NONE}
    return [(name, value, meanings.get(name, meanings["energy lost"])) for name, value in known.items()]


def joules(value: float, digits: int = 4) -> str:
    """Format an energy (J). Below 1 mJ it may be only rounding error, so it is shown as a power of ten."""
    return f"{numbers.number(value, digits) if abs(value) >= 1e-3 or value == 0 else numbers.power_of_ten(value, 2)} J"


HOLDS = Cell("holds", "good")
FAILS = Cell("does not hold", "bad")
NOTED = Cell("does not hold (ignored)", "fair")
NEGLIGIBLE = 1e-6
"""Value up to which a relative energy drift, or a scuffing depth (leg lengths), counts as zero."""
ASSUMPTION_COLUMNS = (
    Column("assumption", "assumption"),
    Column("measured", "measured", wide=True),
    Column("value", "value", numeric=True),
    Column("verdict", "verdict"),
)


def assumptions(results: Results) -> Section | None:
    """Check the rigid model's assumptions against its own walk."""
    summary = results.summary(RIGID_STAGE)
    judged = []
    hip = results.config.walker.hip
    works = hip.torque_N_m != 0.0 or hip.damping_N_m_s_per_rad != 0.0
    for key, text in words.terms("walks.assumed").items():
        if summary.get(key) is not None and not (key == "energy_drift_J" and works):
            (assumption, _, measured), (value, verdict) = text.partition(": "), judgement(key, summary, results)
            judged.append({"assumption": assumption, "measured": measured, "value": value, "verdict": verdict})
    where = " (sections 3.1 and 3.2)" if results.claims else ""
    caption = f"Assumptions of the rigid model{where}, checked on its walk"
    checks = table(caption, ASSUMPTION_COLUMNS, judged, wordy=True)
    return Section.create("assumptions", "Assumptions, checked", (checks,), words("walks.assumptions", judged))


def judgement(key: str, summary: Mapping[str, Any], results: Results) -> tuple[str, Cell]:
    """Return the value by which an assumption is judged, and the verdict."""
    value = summary[key]
    ground = results.config.contact
    if key == "min_normal_force_N":
        return numbers.quantity(value, "N", 4), HOLDS if value > 0 else FAILS
    if key == "max_friction_ratio":
        if ground is None or not ground.has_friction:
            return numbers.number(value, 4), Cell("needs friction", "fair")
        return numbers.number(value, 4), HOLDS if value <= ground.static_friction else FAILS
    if key == "max_scuff_depth_m":
        seen = value > NEGLIGIBLE * results.config.walker.leg_length_m
        return numbers.length(value if seen else 0.0, 3), NOTED if seen else HOLDS
    return joules(value, 3), HOLDS if value <= NEGLIGIBLE * abs(summary.get("mean_energy_J") or 1.0) else FAILS


HEAD_STEPS = 20
"""The table of a long walk lists this many steps at its beginning."""
TAIL_STEPS = 4
"""The table of a long walk lists this many steps at its end."""
SERIES = {
    (RIGID_STAGE, "step_periods_s"): "rigid T (s)",
    (CONTACT_STAGE, "step_periods_s"): "contact T (s)",
    (RIGID_STAGE, "step_lengths_m"): "rigid S (m)",
    (CONTACT_STAGE, "step_lengths_m"): "contact S (m)",
    (CONTACT_STAGE, "slips_m"): "slip of the stance foot (mm)",
}
"""Titles of the columns in the table of steps, by stage and key of their values."""


def steps(results: Results) -> Section | None:
    series = {(stage, key): values for stage, key in SERIES if (values := results.summary(stage).get(key))}
    if not series:
        return None
    every = ((results.summary(stage), key, values) for (stage, key), values in series.items())
    written = [[format_step(index, key, summary) for index in range(len(values))] for summary, key, values in every]
    numbered = [(index, *step) for index, step in enumerate(zip_longest(*written, fillvalue=numbers.NONE), 1)]
    hidden = len(numbered) - HEAD_STEPS - TAIL_STEPS
    rows = numbered if hidden <= 0 else [*numbered[:HEAD_STEPS], *numbered[-TAIL_STEPS:]]
    columns = [Column("step", numeric=True), *(Column(SERIES[name], numeric=True) for name in series)]
    models = {stage: model.lower() for stage, model in MODEL_NAMES.items()}
    errors = {models[stage]: error for stage in models if (error := results.summary(stage).get("numerical_error"))}
    listed = table("Periods and lengths of the steps", columns, rows, note=words("walks.steps", HEAD_STEPS, hidden))
    blocks = (listed, Paragraph(words("error.of_models", errors) if errors else ""))
    periods = {models[stage]: values for (stage, key), values in series.items() if key == "step_periods_s"}
    return Section.create("steps", "Step by step", blocks, words("walks.periods", periods))


def format_step(place: int, key: str, summary: Mapping[str, Any]) -> str:
    """Format a quantity of one step (slips in mm) with the decimals that its numerical error allows.

    place  index of the step, from 0
    key    key of the quantity in the summary
    """
    value = summary[key][place]
    factor = 1e3 if key == "slips_m" else 1.0
    errors = summary.get("numerical_error") or {}
    name = ERROR_OF_EACH_STEP[key]
    error = errors["of_steps"][name][place] if name in errors.get("of_steps", ()) else errors.get(name)
    return numbers.fixed(value and factor * value, numbers.decimals_left(error and factor * error))
