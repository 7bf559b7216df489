"""The walks of both models against each other, as `compare` stores and prints it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.hybrid.comparison import (
    IMPACT_PHASE,
    PHASES,
    Array,
    Motion,
    WalkDifference,
    between_impacts,
    difference_in_phase,
    difference_in_time,
    orbit_distances,
)
from walkerlab.paper.measured import Errors, LegErrors
from walkerlab.stages.walk import LEG, STEP, TIME, legs, over_time
from walkerlab.store.columns import numbered
from walkerlab.store.content import Group, Variable

PHASE = "phase"
LAST_STRIDE = 2  # steps
SENSE = "contact less rigid model"
WAYS = ("raw", "aligned", "between_impacts", "settled")


@dataclass(frozen=True)
class Comparison:
    """What came out.

    errors    in each way in which there was something to compare
    orbit     distance of each leg's orbits; None if there is none
    groups    of the artifact
    left_out  what could not be compared, and why
    """

    errors: Errors
    orbit: list[float] | None = None
    groups: dict[str, Group] = field(default_factory=dict)
    left_out: tuple[dict[str, str], ...] = ()

    @property
    def summary(self) -> dict[str, Any]:
        """What the command prints."""
        return {
            "max_angle_error_rad": largest({way: errors.angle for way, errors in self.errors.items()}),
            "max_velocity_error_rad_s": largest({way: errors.velocity for way, errors in self.errors.items()}),
            "orbit_distance": None if self.orbit is None else max(self.orbit),
            "orbit_distance_per_leg": self.orbit,
        }


def largest(of: Mapping[str, tuple[float, ...]]) -> dict[str, Any]:
    """The larger leg's error and both legs' errors in every way they are compared; None where they are not."""
    over_legs = {way: max(of[way]) if way in of else None for way in WAYS}
    return over_legs | {"per_leg": {way: list(of[way]) if way in of else None for way in WAYS}}


def compare_motion(rigid: Motion | None, contact: Motion | None) -> Comparison:
    """The contact model's walk less the rigid one's, in time, in phase, and as orbits."""
    if rigid is None or contact is None:
        why = "no record of both walks: outputs does not ask for states, or a walk ended at once"
        return Comparison({}, left_out=({"what": "differences of the walks", "why": why},))
    time, raw = difference_in_time(contact, rigid)
    groups, errors = {"errors": in_time(time, raw)}, {"raw": of_legs(raw)}
    if min(rigid.steps, contact.steps) == 0:
        return Comparison(errors, None, groups, (without("differences in phase, and of the orbits", "step"),))
    phases = np.linspace(0.0, 1.0, PHASES)
    aligned = difference_in_phase(contact, rigid, phases)
    smooth = between_impacts(contact, rigid, phases)
    groups["aligned"] = in_phase(phases, aligned)
    errors |= {"aligned": of_legs(aligned), "between_impacts": of_legs(part(aligned, smooth))}
    if min(rigid.steps, contact.steps) < LAST_STRIDE:
        missing = without("difference of the last stride, and of the orbits", "stride")
        return Comparison(errors, None, groups, (missing,))
    orbit = orbit_distances(contact, rigid)
    groups["orbit"] = orbit_group(orbit)
    last = slice(-LAST_STRIDE, None)
    settled = part(WalkDifference(aligned.angle[last], aligned.velocity[last]), smooth[last])
    return Comparison(errors | {"settled": of_legs(settled)}, orbit.tolist(), groups)


def without(what: str, needed: str) -> dict[str, str]:
    """What could not be compared because neither or only one model went so far."""
    return {"what": what, "why": f"no {needed} was completed by both models"}


def part(difference: WalkDifference, where: NDArray[np.bool_]) -> WalkDifference:
    """A difference at some of its steps and phases."""
    return WalkDifference(difference.angle[where], difference.velocity[where])


def of_legs(difference: WalkDifference) -> LegErrors:
    """The largest differences."""
    return LegErrors(tuple(difference.largest_angle.tolist()), tuple(difference.largest_velocity.tolist()))


def in_time(time: Array, raw: WalkDifference) -> Group:
    """Differences at the same time."""
    dims = (TIME, LEG)
    return Group(
        {
            **over_time(time=time),
            **legs(),
            "raw_angle_error_rad": Variable(raw.angle, dims, "rad", f"angle, {SENSE}, at the same time"),
            "raw_velocity_error_rad_s": Variable(raw.velocity, dims, "rad/s", f"velocity, {SENSE}, at the same time"),
        }
    )


def in_phase(phases: Array, aligned: WalkDifference) -> Group:
    """Differences at the same phase of each step."""
    dims, said = (STEP, PHASE, LEG), f"{SENSE}, at the same phase"
    return Group(
        {
            **numbered(len(aligned.angle), STEP, "step number"),
            PHASE: Variable(phases, (PHASE,), "1", "time within the step over the step's period"),
            **legs(),
            "aligned_angle_error_rad": Variable(aligned.angle, dims, "rad", f"angle, {said}"),
            "aligned_velocity_error_rad_s": Variable(aligned.velocity, dims, "rad/s", f"velocity, {said}"),
        },
        {"impact_phase": IMPACT_PHASE},
    )


def orbit_group(orbit: Array) -> Group:
    """Distances of the orbits."""
    text = "Hausdorff distance of the last stride's orbits, angle and velocity in units of the rigid orbit's ranges"
    return Group({**legs(), "orbit_distance": Variable(orbit, (LEG,), "1", text)})
