"""What both models store of a walk: under one name, in one shape, with one meaning; what a model has not is absent."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from walkerlab.hybrid.walk_record import WalkRecord
from walkerlab.labels import Label
from walkerlab.store.columns import labelled, numbered
from walkerlab.store.content import Variable

STEP, TIME, LEG, COORDINATE = "step", "time", "leg", "coordinate"
OF_STEPS: Final = {
    "touch_time_s": Label("s", "time of the touch that ends the step"),
    "period_s": Label("s", "time from touch to touch"),
    "length_m": Label("m", "distance along the slope from touch to touch"),
    "touch_along_m": Label("m", "where that touch is, along the slope from the first foothold"),
    "knee_strike_time_s": Label("s", "time at which the swing leg's knee locked"),
    "slip_m": Label("m", "net slip of the stance foot's material from its touch to its lift"),
    "rolling_m": Label("m", "how far the stance foot rolled from its touch to its lift"),
    "state_before": Label("rad, rad/s", "state just before that touch", (COORDINATE,)),
    "state_after": Label("rad, rad/s", "state just after it, roles changed", (COORDINATE,)),
}
WITH_GAPS: Final = ("knee_strike_time_s", "slip_m", "rolling_m")  # a knee may not lock, nor the last stance foot lift
OVER_TIME: Final = {
    "time": Label("s", "time"),
    "stance_leg": Label("1", "leg whose touch began the step"),
    "angle": Label("rad", "angle of the leg from the vertical"),
    "velocity": Label("rad/s", "angular velocity of the leg"),
    "hip_along_m": Label("m", "position of the hip along the slope"),
    "hip_height_m": Label("m", "height of the hip over the slope"),
    "knee_along_m": Label("m", "position of the knee along the slope"),
    "knee_height_m": Label("m", "height of the knee over the slope"),
    "foot_along_m": Label("m", "position of the foot along the slope"),
    "foot_height_m": Label("m", "height of the foot's lowest point over the slope"),
    "normal_force_N": Label("N", "normal force of the ground on the foot"),
    "friction_force_N": Label("N", "force of the ground on the foot along the slope, positive downhill"),
    "penetration_m": Label("m", "depth of the foot in the ground that carries it"),
    "slip_velocity_m_s": Label("m/s", "velocity of the foot's lowest material point"),
    "kinetic_J": Label("J", "kinetic energy"),
    "potential_J": Label("J", "potential energy from the current stance foot"),
    "mechanical_J": Label("J", "kinetic and potential energy from the current stance foot"),
}


def at_samples(values: ArrayLike, label: Label) -> Variable:
    """Numbers (samples,), or (samples, 2) of what each leg has."""
    return labelled(values, label, *(TIME, LEG)[: np.ndim(values)])


def over_time(**values: ArrayLike) -> dict[str, Variable]:
    """What the samples of a walk have, by names in `OVER_TIME`."""
    return {name: at_samples(found, OVER_TIME[name]) for name, found in values.items()}


def of_body(name: str, angle: ArrayLike, velocity: ArrayLike) -> dict[str, Variable]:
    """How a body beside the legs' own turns: a shank, a torso."""
    return {
        f"{name}_angle": at_samples(angle, Label("rad", f"angle of the {name} from the vertical")),
        f"{name}_velocity": at_samples(velocity, Label("rad/s", f"angular velocity of the {name}")),
    }


def legs() -> dict[str, Variable]:
    """The legs, which keep their numbers when they change roles."""
    return numbered(2, LEG, "leg: 0 swings first, 1 stands first")


def of_steps(touch_time_s: ArrayLike, **values: ArrayLike | None) -> dict[str, Variable]:
    """What the steps of a walk have, by names in `OF_STEPS`, a row a step; nothing of a walk without a step.

    None is left out; nan, and what the last steps do not have, is a gap.
    """
    count = np.size(touch_time_s)
    if count == 0:
        return {}
    known = {"touch_time_s": touch_time_s, **values}
    columns = {name: of_step(name, found, count) for name, found in known.items() if found is not None}
    return {**numbered(count, STEP, "step number"), **columns}


def of_step(name: str, values: ArrayLike, count: int) -> Variable:
    """A column of `OF_STEPS` for `count` steps."""
    gaps = name in WITH_GAPS
    found = np.append(values, np.full(count - np.size(values), np.nan)) if gaps else values
    return labelled(found, OF_STEPS[name], STEP, gaps=gaps)


def steps_of(walk: WalkRecord, **values: ArrayLike | None) -> dict[str, Variable]:
    """The steps of a walk as columns: what both models know of them, and what one of them adds."""
    return of_steps(
        walk.touch_time_s,
        period_s=walk.periods_s,
        length_m=walk.lengths_m,
        touch_along_m=walk.touch_along_m,
        knee_strike_time_s=walk.knee_strike_time_s,
        **values,
    )


def numbers_of(walk: WalkRecord) -> dict[str, Any]:
    """What `--json` says of a walk of either model; of legs without knees it says nothing about knees."""
    strikes = [] if walk.knee_strike_time_s is None else walk.knee_strike_time_s.tolist()
    known = [None if np.isnan(time) else time for time in strikes]
    return {
        "outcome": walk.outcome.label,
        "advice": walk.advice,
        "steps": walk.steps,
        "step_periods_s": walk.periods_s.tolist(),
        "step_lengths_m": walk.lengths_m.tolist(),
        "touch_times_s": walk.touch_time_s.tolist(),
        **({} if walk.knee_strike_time_s is None else {"knee_strike_times_s": known}),
        "end_time_s": walk.end_time_s,
        "rhs_evaluations": walk.work.rhs_evaluations,
        "accepted_steps": walk.work.accepted,
        "rejected_steps": walk.work.rejected,
    }
