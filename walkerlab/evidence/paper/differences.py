"""Differences between two stored walks: in time, in phase, and between their orbits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from walkerlab.evidence.paper.measured import Errors
from walkerlab.physics.hybrid import comparison
from walkerlab.pipeline.stages.walk import LEG, STEP, TIME, leg_labels, variables_over_time
from walkerlab.pipeline.store.content import Content, Group, Variable, numbered

STEPS_PER_STRIDE = 2
ALIGNMENTS = ("raw", "aligned", "between_impacts", "settled")
QUANTITY_KEYS: dict[str, comparison.Quantity] = {"max_angle_error_rad": "angle", "max_velocity_error_rad_s": "velocity"}
PHASE = "phase"


def stored_variable(walk: Content, group: str, name: str) -> comparison.Array | None:
    variables = walk.groups.get(group, Group({}))
    return variables[name] if name in variables.variables else None


def times_of_steps(walk: Content, name: str) -> comparison.Array:
    """Return the times (s) of a walk's steps, or nothing if they were not stored."""
    times = stored_variable(walk, "steps", name)
    return np.zeros(0) if times is None else times


def motion_of(walk: Content) -> comparison.Motion | None:
    """Return the motion of the legs in a stored walk, or None if states were not stored or the walk ended
    immediately.
    """
    angle = stored_variable(walk, "trajectory", "angle")
    if angle is None or len(angle) < 2:
        return None
    trajectory = walk["trajectory"]
    strikes = times_of_steps(walk, "knee_strike_time_s")
    touches = times_of_steps(walk, "touch_time_s")
    # Where a knee does not lock, the time is NaN, which is not above 0.
    motion = comparison.Motion(trajectory["time"], angle, trajectory["velocity"], touches, strikes[strikes > 0.0])
    return comparison.add_strike_samples(motion)


@dataclass(frozen=True)
class Comparison:
    """Difference between the walks of both models."""

    errors: Errors  # differences by alignment; alignments that cannot be compared are absent
    orbit: list[float] | None = None  # distance between the orbits of each leg; None if no stride was completed
    groups: Mapping[str, Group] = field(default_factory=dict)
    left_out: tuple[dict[str, str], ...] = ()  # omitted comparisons, with reasons

    @property
    def summary(self) -> dict[str, Any]:
        """Largest errors of both legs by alignment, or None for an alignment without a comparison."""
        errors: dict[str, Any] = {}
        for name, quantity in QUANTITY_KEYS.items():
            per_leg = {way: self.errors[way].largest(quantity) if way in self.errors else None for way in ALIGNMENTS}
            errors[name] = {way: max(both) if both else None for way, both in per_leg.items()} | {"per_leg": per_leg}
        orbit = None if self.orbit is None else max(self.orbit)
        return {**errors, "orbit_distance": orbit, "orbit_distance_per_leg": self.orbit}


def compare_motion(
    rigid: comparison.Motion | None, contact: comparison.Motion | None, meaning: str = "contact less rigid model"
) -> Comparison:
    """Compare two walks in time, in phase and as orbits, second minus first. `meaning` describes the difference."""
    if rigid is None or contact is None:
        why = "states of both walks are not available: outputs omits them, or a walk ended immediately"
        return Comparison({}, left_out=({"what": "differences of the walks", "why": why},))
    steps = min(rigid.steps, contact.steps)
    orbit = None
    time, raw = comparison.difference_in_time(contact, rigid)
    errors = {"raw": raw}
    groups = {
        "errors": Group(
            {
                **variables_over_time(time=time),
                **leg_labels(),
                **differences("raw", raw, (TIME, LEG), f"{meaning}, at the same time"),
            }
        )
    }
    missing = ("differences in phase and between the orbits", "step")
    if steps:
        missing = ("differences of the last stride and between the orbits", "stride")
        phases = np.linspace(0.0, 1.0, comparison.PHASES)
        aligned = comparison.difference_in_phase(contact, rigid, phases)
        smooth = comparison.smooth_phases(contact, rigid, phases)
        errors |= {"aligned": aligned, "between_impacts": select(aligned, smooth)}
        coordinates = {
            **numbered(len(aligned.angle), STEP, "step number"),
            PHASE: Variable(phases, (PHASE,), "1", "time within the step as a fraction of its period"),
            **leg_labels(),
        }
        in_phase = differences("aligned", aligned, (STEP, PHASE, LEG), f"{meaning}, at the same phase")
        groups["aligned"] = Group({**coordinates, **in_phase}, {"impact_phase": comparison.IMPACT_PHASE})
        if steps >= STEPS_PER_STRIDE:
            last = slice(-STEPS_PER_STRIDE, None)
            errors["settled"] = select(select(aligned, last), smooth[last])
            distances = comparison.orbit_distances(contact, rigid)
            text = "Hausdorff distance of the last stride's orbits, angle and velocity in units of the rigid orbit's "
            groups["orbit"] = Group(
                {**leg_labels(), "orbit_distance": Variable(distances, (LEG,), "1", f"{text}ranges")}
            )
            orbit = distances.tolist()
    what, needed = missing
    lacking = {"what": what, "why": f"no {needed} was completed by both models"}
    return Comparison(errors, orbit, groups, () if steps >= STEPS_PER_STRIDE else (lacking,))


def select(difference: comparison.WalkDifference, where: Any) -> comparison.WalkDifference:
    return comparison.WalkDifference(difference.angle[where], difference.velocity[where])


def differences(
    way: str, difference: comparison.WalkDifference, dims: tuple[str, ...], meaning: str
) -> dict[str, Variable]:
    """Return differences of angles and velocities as variables to store. `way` is their alignment."""
    return {
        f"{way}_angle_error_rad": Variable(difference.angle, dims, "rad", f"angle, {meaning}"),
        f"{way}_velocity_error_rad_s": Variable(difference.velocity, dims, "rad/s", f"velocity, {meaning}"),
    }
