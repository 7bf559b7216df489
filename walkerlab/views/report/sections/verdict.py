"""The verdict on a run and on the values of a study, and the section on differences between the two models."""

import math
from collections import Counter
from collections.abc import Iterator
from functools import partial

from walkerlab.config.drives import drives_of, springs_of
from walkerlab.views.report.blocks import Paragraph, Results, Section, Statement, Statements
from walkerlab.views.report.numbers import number
from walkerlab.views.report.tables import Column, Tone, measured, table
from walkerlab.views.report.words import MODEL_NAMES, tone, words

DIFFERENCE_COLUMNS = (
    Column("contact minus rigid model"),
    Column("angle (rad)", written=partial(number, digits=3), numeric=True),
    Column("velocity (rad/s)", written=partial(number, digits=3), numeric=True),
)
RELEASE_TEXTS = {
    "compression": "when the leading foot stops sinking in, both knees rigid in the impact",
    "touch": "at the leading foot's first touch, free in the impact",
}
"""Texts for the instants at which the trailing knee may be released."""
RELEASE_COLUMNS = (
    Column("trailing knee released", "released"),
    Column("steps", lambda walk: f"{walk['steps']} of {walk['of']}, {walk['outcome']}" if "steps" in walk else None),
    measured("period", "period_s"),
    measured("length", "length_m", partial(number, digits=4)),
    measured("knee locks after", "knee_strike_s", partial(number, digits=4)),
    Column("knee strikes (J per step)", "dissipated_J_per_step/knee_strikes", partial(number, digits=3), numeric=True),
    measured("rigid period", "rigid/period_s"),
)


def models_section(results: Results) -> Section | None:
    """Tabulate the largest differences between the leg motions of the two models and, with knees, the effect of the
    release instant."""
    summary = results.summary("compare")
    angle = summary.get("max_angle_error_rad")
    velocity = summary.get("max_velocity_error_rad_s")
    if not angle or not velocity:
        return None
    rows = [(label, angle[key], velocity.get(key)) for key, label in words.terms("models.ways").items() if key in angle]
    note = words("models.differences", summary.get("orbit_distance"))
    walks = [{**walk, "released": RELEASE_TEXTS[name]} for name, walk in summary.get("releases", {}).items()]
    if walks:
        walks.insert(0, {**summary["steps"]["gait"], "released": "rigid gait"})
    blocks = (
        table("Largest differences of the legs’ motions", DIFFERENCE_COLUMNS, rows, note=note),
        table("Effect of the release instant", RELEASE_COLUMNS, walks, note=words("models.releases")),
    )
    return Section.create("models", "The models compared", blocks, words("models.finding", angle))


def departure(results: Results) -> str:
    """Describe where the contact model differs from the rigid one, or return '' if they were not compared."""
    summary = results.summary("compare")
    if "steps" not in summary or summary["steps"]["contact"]["period_s"] is None:
        return ""
    return words("models.departure", summary, RELEASE_TEXTS)


def section(results: Results) -> Section | None:
    walks = {model.lower(): summary for stage, model in MODEL_NAMES.items() if (summary := results.summary(stage))}
    misprint = any(erratum["where"].startswith("A.5") for erratum in results.summary("compare").get("errata", ()))
    arguments = (results.summary("fixedpoint"), Counter(row["verdict"] for row in results.claims), misprint)
    config = results.config
    opening = ""
    if walks:
        opening = words("verdict.opening", walks, *arguments, drives_of(config), springs_of(config), config.ground.even)
    statements = sorted(outcome_statements(results), key=lambda statement: statement.tone != "bad")
    blocks = (
        *(Paragraph(failure, "bad") for failure in failures(results)),
        Paragraph(opening),
        Statements(tuple(statements), "cards") if statements else None,
        Paragraph(departure(results)),
    )
    nothing = (Paragraph("There are no results to judge."),)
    return Section.create("verdict", "Verdict", blocks if any(blocks) else nothing)


def failures(results: Results) -> list[str]:
    """List failed stages with the results that depend on them, then stored results that report a failure."""
    failed = [absent for absent in results.absent if absent.what in results.failed]
    dependent = [absent for absent in results.absent if absent.what not in results.failed]
    sentences = [
        words("verdict.failure", absent, [missing.what for missing in dependent if absent.why in missing.why])
        for absent in failed
    ]
    errors = {name: result.summary.get("no_answer") for name, result in results.stored.items()}
    sentences += [f"{name}: {reason['message'].rstrip('.')}." for name, reason in errors.items() if reason is not None]
    return sentences


def outcome_statements(results: Results) -> Iterator[Statement]:
    """Yield a statement for each walk (outcome, important numbers, advice), for the gait, and for an adjustment that
    failed."""
    for stage, model in MODEL_NAMES.items():
        if summary := results.summary(stage):
            config = results.config
            outcome = summary["outcome"]
            tau = math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)
            text = words("verdict.walk", summary, 2 * config.strides, tau, *walk_end(results, stage))
            yield Statement(model, text, outcome, tone(outcome))
    if gait := results.summary("fixedpoint"):
        badge: tuple[str, Tone] = ("stable", "good") if gait["stable"] else ("unstable", "fair")
        yield Statement("Periodic gait", words("verdict.gait", gait), *badge)
    change = results.summary("tune").get("adjustment")
    if change is not None and not change["found"]:
        text = f"{change['reason'].capitalize()}. {change['advice']}"
        yield Statement("Parameter adjustment", text, "no start helps", "bad")


def walk_end(results: Results, stage: str) -> tuple[float | None, float | None]:
    """Return the time (s) at which a walk ends and the height (m) of the hip then. A value that is not stored is
    None."""
    summary = results.summary(stage)
    trajectory = results.group(stage, "trajectory")
    if trajectory is None or not trajectory["time"].size:
        return summary.get("end_time_s"), None
    height = float(trajectory["hip_height_m"][-1]) if "hip_height_m" in trajectory.variables else None
    return summary.get("end_time_s", float(trajectory["time"][-1])), height
