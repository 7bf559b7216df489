"""How far the two models differ, and what the knees have to do with it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from walkerlab.report.blocks import PageBlock, Section
from walkerlab.report.numbers import number, quantity
from walkerlab.report.results import Results
from walkerlab.report.tables import Column, measured, table
from walkerlab.report.words import words

MEASURES = {
    "raw": "at the same time",
    "aligned": "at the same phase of each step",
    "between_impacts": "at the same phase, outside the impacts",
    "settled": "at the same phase, on the last stride",
}
"""The ways in which `compare` takes the difference of the legs' motions."""

ANGLE, VELOCITY, ORBIT = "max_angle_error_rad", "max_velocity_error_rad_s", "orbit_distance"


def section(results: Results) -> Section | None:
    """Largest differences of angles and velocities, and the distance of the orbits."""
    summary = results.summary("compare") or {}
    angle, velocity = summary.get(ANGLE), summary.get(VELOCITY)
    if not angle or not velocity:
        return None
    rows = [(said, angle[key], velocity.get(key)) for key, said in MEASURES.items() if key in angle]
    columns = (
        Column("contact model less rigid model"),
        Column("angle (rad)", written=partial(number, digits=3), numeric=True),
        Column("velocity (rad/s)", written=partial(number, digits=3), numeric=True),
    )
    note = "The larger of both legs. A clock that runs slow makes the difference at the same time grow without bound."
    orbit = summary.get(ORBIT)
    if orbit is not None:
        note += f" Their limit cycles lie at most {quantity(100 * orbit, '%', 2)} of the rigid one’s size apart."
    differences = table("Largest differences of the legs’ motions", columns, rows, note=note)
    found = f"Their legs’ angles differ by at most {number(angle.get('raw'), 3)} rad at the same time"
    if "aligned" in angle:
        found += f", and by {number(angle['aligned'], 3)} rad at the same phase of each step"
    blocks: tuple[PageBlock, ...] = (differences,)
    if summary.get("releases"):
        walks = [{**walk, "released": RELEASED[name]} for name, walk in summary["releases"].items()]
        rows_of_steps = [{**summary["steps"]["gait"], "released": "rigid gait"}, *walks]
        note = words("models.releases")
        blocks += (table("What the instant of release decides", RELEASE_COLUMNS, rows_of_steps, note=note),)
    return Section("models", "The models compared", blocks, f"{found}.")


RELEASED = {
    "compression": "when the leading foot stops sinking in, both knees rigid in the impact",
    "touch": "at the leading foot's first touch, free in the impact",
}
"""The instants at which the trailing knee may be released, in words."""
ANOTHER_GAIT = 0.01
"""A last step off the gait's period by this share of it belongs to another gait: creep alone stays below."""
CHANNELS = {
    "damping": "in the ground's damping",
    "friction": "in friction",
    "edges": "at pads' edges",
    "knee_strikes": "in knee strikes",
    "knee_stop": "in the knees' stops",
}
"""Where a contact walk dissipates energy, by the names under which it is stored."""


RELEASE_COLUMNS = (
    Column("trailing knee released", "released"),
    Column("steps", lambda walk: f"{walk['steps']} of {walk['of']}, {walk['outcome']}" if "steps" in walk else None),
    measured("period", "period_s"),
    measured("length", "length_m", partial(number, digits=4)),
    measured("knee locks after", "knee_strike_s", partial(number, digits=4)),
    Column(
        "knee strikes (J a step)",
        lambda walk: (walk.get("dissipated_J_per_step") or {}).get("knee_strikes"),
        partial(number, digits=3),
        numeric=True,
    ),
    Column("rigid period (s)", lambda walk: (walk.get("rigid") or {}).get("period_s"), number, numeric=True),
)


def departure(results: Results) -> str:
    """Where the contact model departs from the rigid one, and what the knees have to do with it, in a paragraph.

    Empty without a comparison of this walker's models, or if the contact model took no step.
    """
    summary = results.summary("compare") or {}
    steps = summary.get("steps")
    if steps is None or steps["contact"]["period_s"] is None:
        return ""
    told = [words("models.last_step", steps["contact"], steps["gait"]), losses_in_words(summary["dissipated_J"])]
    if summary.get("releases"):
        walk, gait = steps["contact"].get("knee_strike_s"), steps["gait"].get("knee_strike_s")
        told += [] if walk is None or gait is None else [words("models.locking", walk, gait)]
        told += releases_in_words(summary["releases"], float(steps["gait"]["period_s"]))
    return " ".join(sentence for sentence in told if sentence)


def losses_in_words(dissipated: Mapping[str, float]) -> str:
    """What the walk dissipated, by channel, the largest first."""
    total = sum(dissipated.values())
    if total <= 0.0:
        return ""
    ranked = sorted(dissipated.items(), key=lambda one: -one[1])
    parts = [f"{quantity(100 * lost / total, '%', 3)} {CHANNELS.get(name, name)}" for name, lost in ranked if lost]
    return words("models.losses", total, parts)


def releases_in_words(releases: Mapping[str, Mapping[str, Any]], gait_period: float) -> list[str]:
    """What becomes of the walk with either instant of release, and whether that instant decides it."""
    ends = {name: end_of(walk, gait_period) for name, walk in releases.items()}
    told = [words("models.release", RELEASED[name], walk, ends[name], gait_period) for name, walk in releases.items()]
    return [*told, words("models.decides", len(set(ends.values())) > 1)]


def end_of(walk: Mapping[str, Any], gait_period: float) -> str:
    """Whether a walk came to an end early, keeps to the rigid gait, or has gone over to another."""
    if walk["outcome"] != "walked":
        return "ended"
    off = abs(walk["period_s"] / gait_period - 1.0)
    return "another gait" if off > ANOTHER_GAIT else "this gait"
