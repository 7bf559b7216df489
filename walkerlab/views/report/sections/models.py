"""Differences between the two models, and the role of the knees."""

from functools import partial

from walkerlab.views.report.blocks import Section
from walkerlab.views.report.numbers import number
from walkerlab.views.report.results import Results
from walkerlab.views.report.tables import Column, measured, table
from walkerlab.views.report.words import words

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


def section(results: Results) -> Section | None:
    """Tabulate the largest differences of the legs' motions and, with knees, the effect of the release instant."""
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
    return Section.of("models", "The models compared", blocks, words("models.finding", angle))


def departure(results: Results) -> str:
    """Describe where the contact model departs from the rigid one, or return '' if they were not compared."""
    summary = results.summary("compare")
    if "steps" not in summary or summary["steps"]["contact"]["period_s"] is None:
        return ""
    return words("models.departure", summary, RELEASE_TEXTS)
