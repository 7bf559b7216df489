"""How far the two models differ, and what the knees have to do with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.report.blocks import Block, Column, Section, Table, table
from walkerlab.report.numbers import NONE, length, listed, number, quantity
from walkerlab.report.outcomes import ends, walks
from walkerlab.report.results import Results

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
    rows = [[words, printed(angle, key), printed(velocity, key)] for key, words in MEASURES.items() if key in angle]
    columns = [Column("contact model less rigid model"), Column("angle (rad)", True), Column("velocity (rad/s)", True)]
    note = "The larger of both legs. A clock that runs slow makes the difference at the same time grow without bound."
    orbit = summary.get(ORBIT)
    if orbit is not None:
        note += f" Their limit cycles lie at most {quantity(100 * orbit, '%', 2)} of the rigid one’s size apart."
    differences = table("Largest differences of the legs’ motions", columns, rows, note=note)
    found = f"Their legs’ angles differ by at most {printed(angle, 'raw')} rad at the same time"
    if "aligned" in angle:
        found += f", and by {printed(angle, 'aligned')} rad at the same phase of each step"
    blocks: tuple[Block, ...] = (differences,)
    if summary.get("releases"):
        blocks += (releases_table(summary),)
    return Section("models", "The models compared", blocks, f"{found}.")


def printed(differences: Mapping[str, Any], key: str) -> str:
    """A largest difference."""
    value = differences.get(key)
    return NONE if value is None else number(float(value), 3)


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


def releases_table(summary: Mapping[str, Any]) -> Table:
    """Walks from the rigid gait with either instant of release, beside that gait."""
    heads = ("period (s)", "length (m)", "knee locks after (s)", "knee strikes (J a step)", "rigid period (s)")
    columns = [Column("trailing knee released"), Column("steps"), *(Column(head, True) for head in heads)]
    rows = [["rigid gait", NONE, *last_step(summary["steps"]["gait"]), NONE, NONE]]
    for name, walk in summary["releases"].items():
        lost = (walk["dissipated_J_per_step"] or {}).get("knee_strikes")
        steps = f"{walk['steps']} of {walk['of']}, {walk['outcome']}"
        rigid = (walk.get("rigid") or {}).get("period_s")
        rows.append([RELEASED[name], steps, *last_step(walk), number(lost, 3), number(rigid)])
    note = (
        "Each walk starts at the rigid gait; the numbers are those of its last step. The last column is the last step "
        "of the rigid model when its trailing knee is as rigid or as free in the impact."
    )
    return table("What the instant of release decides", columns, rows, note=note)


def last_step(step: Mapping[str, Any]) -> list[str]:
    """Period, length and when the knee locked."""
    return [number(step["period_s"]), number(step["length_m"], 4), number(step.get("knee_strike_s"), 4)]


def departure(results: Results) -> str:
    """Where the contact model departs from the rigid one, and what the knees have to do with it, in a paragraph.

    Empty without a comparison of this walker's models, or if the contact model took no step.
    """
    summary = results.summary("compare") or {}
    steps = summary.get("steps")
    if steps is None or steps["contact"]["period_s"] is None:
        return ""
    told = [last_step_in_words(steps), losses_in_words(summary["dissipated_J"])]
    if summary.get("releases"):
        told += [locking_in_words(steps), *releases_in_words(summary["releases"], float(steps["gait"]["period_s"]))]
    return " ".join(sentence for sentence in told if sentence)


def last_step_in_words(steps: Mapping[str, Mapping[str, Any]]) -> str:
    """The contact model's last step against the gait's, and its slip."""
    walk, gait = steps["contact"], steps["gait"]
    slips = "" if walk["slip_m"] is None else f"; its stance foot slips {length(walk['slip_m'])} a step on average"
    return (
        f"The contact model's last step takes {quantity(walk['period_s'], 's')} and is "
        f"{quantity(walk['length_m'], 'm')} long, {percent(walk['period_s'], gait['period_s'])} and "
        f"{percent(walk['length_m'], gait['length_m'])} against the rigid gait's {quantity(gait['period_s'], 's')} and "
        f"{quantity(gait['length_m'], 'm')}{slips}."
    )


def losses_in_words(dissipated: Mapping[str, float]) -> str:
    """What the walk dissipated, by channel, the largest first."""
    total = sum(dissipated.values())
    if total <= 0.0:
        return ""
    ranked = sorted(dissipated.items(), key=lambda one: -one[1])
    parts = listed(
        f"{quantity(100 * lost / total, '%', 3)} {CHANNELS.get(name, name)}" for name, lost in ranked if lost
    )
    return f"It dissipates {quantity(total, 'J', 4)} on the way, {parts}."


def locking_in_words(steps: Mapping[str, Mapping[str, Any]]) -> str:
    """When the knee locks in either model."""
    walk, gait = steps["contact"].get("knee_strike_s"), steps["gait"].get("knee_strike_s")
    if walk is None or gait is None:
        return ""
    in_gait = f"in the gait after {quantity(gait, 's')}"
    return f"In that step the swing knee locks {quantity(walk, 's')} after the touch; {in_gait}."


def releases_in_words(releases: Mapping[str, Mapping[str, Any]], gait_period: float) -> list[str]:
    """What becomes of the walk with either instant of release, and whether that instant decides it."""
    told = [release_in_words(name, walk, gait_period) for name, walk in releases.items()]
    ends = {end_of(walk, gait_period) for walk in releases.values()}
    decides = len(ends) > 1
    verdict = (
        "The instant of release decides which gait is walked."
        if decides
        else "The instant of release does not decide the gait here."
    )
    return [*told, verdict]


def end_of(walk: Mapping[str, Any], gait_period: float) -> str:
    """Whether a walk came to an end early, keeps to the rigid gait, or has gone over to another."""
    if walk["outcome"] != "walked":
        return "ended"
    off = abs(walk["period_s"] / gait_period - 1.0)
    return "another gait" if off > ANOTHER_GAIT else "this gait"


def release_in_words(name: str, walk: Mapping[str, Any], gait_period: float) -> str:
    """How far a walk with one instant of release gets, and how its last step differs from the gait's."""
    released = f"With the trailing knee released {RELEASED[name]},"
    if walk["period_s"] is None:
        return f"{released} the walker takes no step ({walk['outcome']})."
    last = f"the last in {quantity(walk['period_s'], 's')} ({percent(walk['period_s'], gait_period)})"
    end = end_of(walk, gait_period)
    if end == "ended":
        return (
            f"{released} the walker takes {walk['steps']} of {walk['of']} steps, {last}, and {ends(walk['outcome'])}."
        )
    came = "keeps to the rigid gait" if end == "this gait" else "goes over to another gait"
    return f"{released} the walker {came}: {walk['steps']} steps, {last}{as_rigid(walk)}."


def as_rigid(walk: Mapping[str, Any]) -> str:
    """What the rigid model does whose trailing knee is as rigid or as free in the impact."""
    rigid = walk.get("rigid")
    if not rigid:
        return ""
    if rigid["outcome"] != "walked":
        return f"; the rigid model by that rule {walks(rigid['steps'], rigid['outcome'])}"
    return f"; the rigid model by that rule walks steps of {quantity(rigid['period_s'], 's')}"


def percent(value: float, reference: float) -> str:
    """How much larger a value is than its reference, in percent with its sign."""
    share = 100.0 * (value / reference - 1.0)
    return f"{'+' if share > 0.0 else ''}{quantity(share, '%', 2)}"
