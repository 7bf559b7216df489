"""Parts shared by the stages that compute walks: start, stored groups, summary and numerical error.

Both models store a walk with the same names, shapes and meanings, but without quantities that the model lacks. For a
long walk, all samples of the first and last steps are stored, but fewer samples of the steps between. The numerical
error is the change of a walk's quantities at tighter tolerances.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from walkerlab.config.reads import SceneConfig, SimulateConfig
from walkerlab.config.schema import MidStep, state_of
from walkerlab.errors import NoAnswer
from walkerlab.labels import ERROR_OF_EACH_STEP, Label
from walkerlab.outcome import Outcome
from walkerlab.physics.energy_channels import SAMPLED
from walkerlab.physics.hybrid.recorded_walk import as_state
from walkerlab.physics.hybrid.walk_record import WalkRecord
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.store.content import UNEVEN, Content, Group, Variable, labelled, numbered
from walkerlab.scene.rigid import first_step_length, have_different_legs

MIN_RTOL: Final = 1e-14  # minimum that the schema allows
TIGHTER: Final = {100.0: "a hundred times tighter tolerances", 10.0: "ten times tighter tolerances"}
BUDGET_FACTOR: Final = 10  # factor by which the evaluation budget grows at tighter tolerances
SAMPLE: Final = 16  # maximum number of walks to repeat
DEFAULT_TIGHTENING: Final = TIGHTER[100.0]
ROUNDING: Final = 1e-6  # tolerances that differ by less than this (relative) are equal but for rounding

Summary = Mapping[str, Any]
Values = Sequence[float | None]


def numerical_error(first: Summary, tolerances: Tolerances, walk: Callable[[Tolerances], Summary]) -> dict[str, Any]:
    """Repeat a walk at tighter tolerances and return the changes of its quantities.

    first       summary of the walk: its `outcome`, `steps`, `end_time_s`, and lists with one value per step
    tolerances  tolerances of the first walk
    walk        repeats the walk with other tolerances and returns its summary

    Returns the largest change of each step quantity, named as in `ERROR_OF_EACH_STEP`, the change of `end_time_s` (s)
    and, for a driven walk, the change of `cost_of_transport`. `of_steps` has the largest changes up to each step. `by`
    describes the tighter settings unless they are the usual ones. If the two walks end differently, only `reason` is
    returned.
    """
    tighter, by = tightened(tolerances)
    return change(first, walk(tighter), by)


def tightened(tolerances: Tolerances) -> tuple[Tolerances, str]:
    """Return tighter tolerances with a larger budget (or another method, if they cannot be tightened), and a
    description."""
    tolerances = replace(tolerances, budget=min(BUDGET_FACTOR * tolerances.budget, ENDLESS))
    for factor, by in TIGHTER.items():
        rtol = tolerances.rtol / factor
        if rtol >= (1.0 - ROUNDING) * MIN_RTOL:
            return replace(tolerances, rtol=rtol, atol=tolerances.atol / factor), by
    method = "dop853" if tolerances.method == "radau5" else "radau5"
    return replace(tolerances, method=method), f"another method, {method}"


def change(first: Summary, second: Summary, by: str = DEFAULT_TIGHTENING) -> dict[str, Any]:
    """Return the largest changes between two summaries of a walk, in the form that `numerical_error` returns."""
    if (first["outcome"], first["steps"]) != (second["outcome"], second["steps"]):
        steps = f"{second['steps']} step{'' if second['steps'] == 1 else 's'}"
        return {"reason": f"with {by} the walk ends differently: {second['outcome']} after {steps}"}
    changes: dict[str, Any] = {}
    of_steps = dict[str, list[float | None]]()
    later = steps_later(first, second)
    for key, name in ERROR_OF_EACH_STEP.items():
        apart = step_changes(first.get(key) or (), second.get(key) or (), first.get("repeats_after") or 0, later)
        if np.isfinite(apart).any() and any(first[key]):  # for point feet, all values are zero
            changes[name] = float(np.nanmax(apart))
            of_steps[name] = [None if math.isnan(error) else float(f"{error:.2g}") for error in apart.tolist()]
    changes["end_time_s"] = abs(first["end_time_s"] - second["end_time_s"])
    # A passive walk's cost of transport is always the sine of the slope, so its change does not measure the error.
    if any(work for giver, work in first.get("work_per_step_J", {}).items() if giver != "gravity"):
        changes["cost_of_transport"] = abs(first["cost_of_transport"] - second["cost_of_transport"])
    changes |= {"of_steps": of_steps} if of_steps else {}
    return changes if by == DEFAULT_TIGHTENING else {**changes, "by": by}


def steps_later(first: Summary, second: Summary) -> int | None:
    """Return by how many steps the cycle of the second walk lags behind that of the first, or None if there is no
    cycle."""
    period = first.get("repeats_after") or 0
    if not period or second.get("repeats_after") != period:
        return None
    cycle, other = (np.array(walk["step_periods_s"][-period:]) for walk in (first, second))
    return min(range(period), key=lambda steps: float(np.abs(np.roll(other, -steps) - cycle).max()))


def step_changes(first: Values, second: Values, period: int, later: int | None) -> Floats:
    """Return the largest change of the values (steps,) up to each step, with NaN where a walk has no value.

    period  number of steps after which the end of the first walk repeats itself, or 0
    later   number of steps by which the second walk's cycle lags behind, or None if it has no cycle

    Rounding decides at which step a walk begins to repeat itself. So the steps of a walk that has settled are compared
    with the same steps of the cycle, even if these come later. If the second walk has not settled yet, the error of one
    step is the estimate for the whole cycle.
    """
    # The lists may differ in length: slips lack the last step of a walk if the foot has not lifted.
    count = min(len(first), len(second))
    values, others = (np.array(each[:count], float) for each in (first, second))
    changes = np.abs(values - others)
    largest = np.where(np.isnan(changes), np.nan, np.fmax.accumulate(changes))
    if not period or count < 2 * period:
        return largest
    end = count - 1 - (later or 0)
    steps = np.arange(count)
    # for each step, the last step that is at the same place in the cycle and has a counterpart in the second walk
    last = end - (end - steps) % period
    between = changes[0] if later is None else np.abs(values[last] - others[last + later])
    return np.asarray(np.fmin(largest, np.abs(values - values[last]) + between))


def evenly_spread(count: int, wanted: int) -> list[int]:
    """Return at most `wanted` evenly spaced indices from 0 to `count` - 1, both included."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, wanted)).tolist()})


FIRST_STEPS = 200
"""Every sample is stored for this many steps at the start of a walk."""
LAST_STEPS = 20
"""Every sample is stored for this many steps at the end of a walk."""
MAX_BETWEEN = 50_000
"""Maximum number of samples stored for the steps in between, besides those on both sides of every heel strike."""
MIN_REPEATED = 4
"""Walks with fewer steps are not tested for repetition."""
MAX_REPEATED = 32
"""Number of steps at the end of a walk that are tested for repetition, or a quarter of all steps if that is more."""
FEWEST_SETTLED = 8
"""Minimum number of steps, at the end of a walk, that are tested for repetition. Shorter walks are tested whole."""
REPEATED = 1e-5
"""Steps repeat if they differ by less than this, as a fraction of the first step."""
REPEATED_AFTER_SETTLING = 1e-2
"""If the period of repetition is two or more steps, the difference must also be less than this fraction of the spread
of the steps."""
ON_GAIT = 1e-6
"""A walk starts on a gait if its second step differs from the first by less than this (relative)."""
OFF_GAIT = 1e-2
"""A walk has left its gait as soon as a step differs from step 1 by more than this (relative)."""
STRIDE: Final = 2
"""Number of steps in a stride."""
STEP = "step"
TIME = "time"
LEG = "leg"
COORDINATE = "coordinate"
STEP_LABELS: Final = {
    "touch_time_s": Label("s", "time of the touch that ends the step"),
    "period_s": Label("s", "time from one touch to the next"),
    "length_m": Label("m", "distance along the slope from one touch to the next"),
    "touch_along_m": Label("m", "position of the touch along the slope from the first foothold"),
    UNEVEN: Label("m", "height of the touched foothold above the slope"),
    "knee_strike_time_s": Label("s", "time at which the swing leg's knee locked"),
    "slip_m": Label("m", "net material slip of the stance foot from its touch to its lift"),
    "rolling_m": Label("m", "rolling distance of the stance foot from its touch to its lift"),
    "state_before": Label("rad, rad/s", "state just before the touch", (COORDINATE,)),
    "state_after": Label("rad, rad/s", "state just after the touch, with the legs' roles exchanged", (COORDINATE,)),
}
# Columns whose value is missing if a knee does not lock, or if the last stance foot does not lift.
INCOMPLETE_COLUMNS: Final = ("knee_strike_time_s", "slip_m", "rolling_m")
TIME_LABELS: Final = {
    "time": Label("s", "time"),
    "step": Label("1", "step number"),
    "stance_leg": Label("1", "leg whose touch began the step"),
    "angle": Label("rad", "angle of the leg from the vertical"),
    "velocity": Label("rad/s", "angular velocity of the leg"),
    "hip_along_m": Label("m", "position of the hip along the slope"),
    "hip_height_m": Label("m", "height of the hip above the slope"),
    "knee_along_m": Label("m", "position of the knee along the slope"),
    "knee_height_m": Label("m", "height of the knee above the slope"),
    "foot_along_m": Label("m", "position of the foot along the slope"),
    "foot_height_m": Label("m", "height of the foot's lowest point above the slope"),
    "normal_force_N": Label("N", "normal force of the ground on the foot"),
    "friction_force_N": Label("N", "force of the ground on the foot along the slope, positive downhill"),
    "penetration_m": Label("m", "penetration of the foot, zero where no ground carries it"),
    "slip_velocity_m_s": Label("m/s", "velocity of the foot's lowest material point"),
    "kinetic_J": Label("J", "kinetic energy"),
    "potential_J": Label("J", "potential energy, which is zero at the step's foothold"),
    "mechanical_J": Label("J", "kinetic, potential (zero at the step's foothold) and elastic energy"),
    "total_energy_J": Label("J", "kinetic, potential (zero at a fixed origin) and elastic energy"),
    **{loss.variable: Label("J", loss.meaning) for loss in SAMPLED.values()},
    "push_off_J": Label("J", "cumulative energy supplied by the push-off"),
    "hip_J": Label("J", "cumulative energy supplied by the hip's torque and damper"),
    "residual_J": Label("J", "change of total energy plus energy lost minus energy supplied"),
}
OUTCOMES: Final = ", ".join(f"{outcome.value} {outcome.label}" for outcome in Outcome)
"""Meanings of the outcome codes on a map."""


def count_outcomes(outcomes: NDArray[np.int64]) -> dict[str, int]:
    """Count the walks of a map by outcome."""
    numbers, counts = np.unique(outcomes, return_counts=True)
    return {Outcome(int(number)).label: int(count) for number, count in zip(numbers, counts, strict=True)}


def rigid_start(config: SimulateConfig | SceneConfig, inputs: Mapping[str, Content]) -> tuple[float, State]:
    """Return the reference step length (m) and the rigid start state, from the config or the gait."""
    if "fixedpoint" in inputs:
        gait = inputs["fixedpoint"].summary
        state = gait["state"] if config.start == "fixed-point" else state_of(config.start)
        return float(gait["step_length_m"]), as_state(state)
    if config.start == "fixed-point":
        raise ValueError("neither a start state nor a fixed point")
    state = as_state(state_of(config.start))
    if isinstance(config.start, MidStep):
        return first_step_length(config, state), state
    return 2.0 * config.walker.leg_length_m * float(np.sin(0.5 * abs(state[1] - state[0]))), state


def step_asymmetry(config: SimulateConfig | SceneConfig, inputs: Mapping[str, Content]) -> float:
    """Return the difference between the gait's step lengths over their mean, or 0 for equal legs or without a gait."""
    if "fixedpoint" not in inputs or not have_different_legs(config):
        return 0.0
    return float(inputs["fixedpoint"].summary["asymmetry"]["step_length"])


def content_of_walk(
    stage: str,
    walk: Callable[[Tolerances, bool], Any],
    tolerances: Tolerances,
    groups: Callable[[Any], dict[str, Group]],
    summary: Callable[[Any], dict[str, Any]],
    progress: Progress,
    again: bool,
) -> Content:
    """Simulate a walk, choose the samples to store, and repeat the walk to measure the numerical error.

    walk     takes tolerances and whether to sample, and returns a `WalkRecord` with `samples`
    groups   returns the groups of a walk to store
    summary  returns the summary of a walk
    again    whether to repeat the walk, which takes two to three times as long as the walk itself

    Raises NoAnswer with partial results if the integrator fails.
    """
    result = walk(tolerances, True)
    if result.samples is not None:
        result = replace(result, samples=thin_samples(result.samples, result.touch_time_s, progress))
    stored = groups(result)
    answer = summary(result)
    if not result.outcome.answered:
        reason = f"{stage}: {result.outcome.label} after {result.steps} steps, {result.end_time_s:.4g} s"
        raise NoAnswer(reason, answer["advice"], Content(stored, answer))
    if again:
        answer["numerical_error"] = numerical_error(answer, tolerances, lambda tighter: summary(walk(tighter, False)))
    return Content(stored, answer)


def thin_samples(samples: Any, ends: NDArray[np.float64], progress: Progress) -> Any:
    """Return the samples to store: all of an ordinary walk, but fewer of a long one.

    samples  a NamedTuple of arrays whose first axis is time, `time_s` among them
    ends     (steps,) s, times at which steps ended
    """
    if ends.size <= FIRST_STEPS + LAST_STEPS:
        return samples
    step = np.searchsorted(ends, samples.time_s, side="right")
    stored = (step < FIRST_STEPS) | (step >= ends.size - LAST_STEPS)
    # Velocities jump at heel strikes, so the samples on both sides of them are needed.
    changes = np.flatnonzero(np.diff(step))
    stored[changes] = stored[changes + 1] = True
    between = np.flatnonzero(~stored)
    stored[between[:: max(1, -(-between.size // MAX_BETWEEN))]] = True
    progress.note(
        f"Of {step.size} samples in {ends.size} steps, {np.count_nonzero(stored)} are stored: all in the first "
        f"{FIRST_STEPS} and last {LAST_STEPS} steps, fewer between them, and both sides of every heel strike"
    )
    return select_samples(samples, stored)


def select_samples(samples: Any, mask: NDArray[Any]) -> Any:
    return type(samples)(*(each[mask] for each in samples))


def variables_over_time(**values: ArrayLike) -> dict[str, Variable]:
    """Build variables over time from values (samples,) or, by leg, (samples, 2), which are named as in
    `TIME_LABELS`."""
    return {
        name: labelled(column, TIME_LABELS[name], *(TIME, LEG)[: np.ndim(column)]) for name, column in values.items()
    }


def rotation_variables(name: str, angle: ArrayLike, velocity: ArrayLike) -> dict[str, Variable]:
    """Build the variables of angle and angular velocity of a torso (samples,) or the shanks (samples, 2)."""
    labels = Label("rad", f"angle of the {name} from the vertical"), Label("rad/s", f"angular velocity of the {name}")
    dims = (TIME, LEG)[: np.ndim(angle)]
    return {
        f"{name}_angle": labelled(angle, labels[0], *dims),
        f"{name}_velocity": labelled(velocity, labels[1], *dims),
    }


def leg_labels() -> dict[str, Variable]:
    """Build the coordinate of the legs. A leg has the same number, 1 or 2, in swing and in stance."""
    return {LEG: Variable(np.array([1, 2]), (LEG,), "1", "leg: 1 swings first, 2 stands first")}


def step_columns(touch_time_s: ArrayLike, **values: ArrayLike | None) -> dict[str, Variable]:
    """Build variables over steps, named as in `STEP_LABELS`.

    Short lists are padded, and the padding and NaN become missing values.
    """
    count = np.size(touch_time_s)
    if count == 0:
        return {}
    columns = numbered(count, STEP, "step number")
    for name, column in {"touch_time_s": touch_time_s, **values}.items():
        if column is not None:
            gaps = name in INCOMPLETE_COLUMNS
            rows = np.append(column, np.full(count - np.size(column), np.nan)) if gaps else column
            columns[name] = labelled(rows, STEP_LABELS[name], STEP, gaps=gaps)
    return columns


def steps_of(walk: WalkRecord, **values: ArrayLike | None) -> dict[str, Variable]:
    """Build the columns of a walk's steps: the columns common to both models, and `values`."""
    common = {
        "period_s": walk.periods_s,
        "length_m": walk.lengths_m,
        "touch_along_m": walk.touch_along_m,
        UNEVEN: walk.foothold_height_m,
        "knee_strike_time_s": walk.knee_strike_time_s,
    }
    return step_columns(walk.touch_time_s, **common, **values)


def measure_pace(config: SceneConfig | SimulateConfig, walk: WalkRecord) -> dict[str, float]:
    """Return the mean speed (m/s) up to the last touch, and its Froude number, or nothing if no step was completed."""
    if not walk.steps:
        return {}
    speed = float(walk.touch_along_m[-1] / walk.touch_time_s[-1])
    return {"speed_m_s": speed, "froude": speed / math.sqrt(config.gravity_m_s2 * config.walker.leg_length_m)}


def drive_measures(walk: WalkRecord) -> dict[str, Any]:
    """Return the work of each drive per step and the cost of transport, or nothing if the walk gets nowhere."""
    distance = float(walk.touch_along_m[-1]) if walk.steps else 0.0
    if distance <= 0.0:
        return {}
    driven = walk.driven
    return {
        "work_per_step_J": driven.work_per_step(walk.steps),
        "cost_of_transport": driven.cost_of_transport(distance),
    }


def describe_settling(walk: WalkRecord) -> dict[str, int | None]:
    """Find the period, in steps, with which a walk on even ground repeats at its end, and the step at which it leaves
    its gait.

    repeats_after  period in steps, 0 if the last steps do not repeat
    leaves_gait_at  number of the step at which a walk leaves the gait that it started on, or None if it stays or
                    started elsewhere
    """
    if walk.steps < MIN_REPEATED or walk.foothold_height_m is not None:
        return {"repeats_after": 0, "leaves_gait_at": None}
    steps = np.column_stack((walk.periods_s / walk.periods_s[0], walk.lengths_m / walk.lengths_m[0]))
    off = np.abs(steps - 1.0).max(axis=1)
    departures = np.flatnonzero(off > OFF_GAIT)
    on_gait = off[1] < ON_GAIT
    return {
        "repeats_after": steps_to_repeat_last(steps),
        "leaves_gait_at": int(departures[0]) + 1 if on_gait and departures.size else None,
    }


def steps_to_repeat_last(steps: Floats) -> int:
    """Return the number of steps after which the end of a walk (steps, n) repeats itself, or 0 if it does not.

    If there are several such numbers, it is the one that holds over the longest part of the walk.
    """
    longest = max(MAX_REPEATED, len(steps) // 4)
    ends = (longest >> halvings for halvings in range(longest.bit_length()))
    periods = (steps_to_repeat(steps[-end:]) for end in ends if end >= FEWEST_SETTLED)
    return next((period for period in periods if period), 0)


def steps_to_repeat(steps: Floats) -> int:
    """Return the period, in steps, of values (steps, n) relative to the first step, or 0 if they do not repeat."""
    spread = np.ptp(steps, axis=0).max()
    for period in range(1, len(steps) // 2 + 1):
        difference = np.abs(steps[period:] - steps[:-period]).max()
        # A slowly settling walk that alternates about its limit nearly repeats every two steps, but it is not a cycle.
        if difference < REPEATED and (period == 1 or difference < REPEATED_AFTER_SETTLING * spread):
            return period
    return 0


def summarise_walk(walk: WalkRecord) -> dict[str, Any]:
    """Summarise a walk of either model, with knee strikes for walkers with knees."""
    strikes = walk.knee_strike_time_s
    knee_strikes = (
        {} if strikes is None else {"knee_strike_times_s": [None if np.isnan(t) else t for t in strikes.tolist()]}
    )
    return {
        "outcome": walk.outcome.label,
        "advice": walk.advice,
        "steps": walk.steps,
        "step_periods_s": walk.periods_s.tolist(),
        "step_lengths_m": walk.lengths_m.tolist(),
        "touch_times_s": walk.touch_time_s.tolist(),
        **knee_strikes,
        **last_stride(walk),
        **describe_settling(walk),
        **drive_measures(walk),
        "end_time_s": walk.end_time_s,
        "rhs_evaluations": walk.work.rhs_evaluations,
        "accepted_steps": walk.work.accepted,
        "rejected_steps": walk.work.rejected,
    }


def last_stride(walk: WalkRecord) -> dict[str, Any]:
    """Return both steps of a walk's last stride and their differences, or {} if the walk has no complete stride."""
    if walk.steps < STRIDE:
        return {}
    count = walk.steps - walk.steps % STRIDE  # even, because leg 1 swings in the first step of a stride
    periods, lengths = (values[count - STRIDE : count].tolist() for values in (walk.periods_s, walk.lengths_m))
    steps = zip(periods, lengths, strict=True)
    return {
        "gait_steps": [{"period_s": period, "length_m": length} for period, length in steps],
        "step_period_s": sum(periods) / STRIDE,
        "step_length_m": sum(lengths) / STRIDE,
        "asymmetry": {"step_length": asymmetry_of(*lengths), "step_period": asymmetry_of(*periods)},
    }


def asymmetry_of(first: float, second: float) -> float:
    """Return the difference between two values, divided by their mean."""
    return (second - first) / (0.5 * (first + second))


def mean_step(walk: Mapping[str, Any]) -> dict[str, Any]:
    """Return the mean period (s) and length (m) of a walk's last stride, or those of its last step if the walk has no
    complete stride."""
    if "gait_steps" not in walk:
        return last_step(walk)
    return {"period_s": walk["step_period_s"], "length_m": walk["step_length_m"], "of_stride": True}


def last_step(walk: Mapping[str, Any]) -> dict[str, Any]:
    """Return period (s), length (m) and knee strike time (s) of a walk's last step. A value that does not exist is
    None."""
    periods = walk["step_periods_s"]
    lengths = walk["step_lengths_m"]
    strikes = walk.get("knee_strike_times_s")
    step = {"period_s": periods[-1] if periods else None, "length_m": lengths[-1] if lengths else None}
    if not strikes:
        return step
    start_s = walk["touch_times_s"][-2] if len(strikes) > 1 else 0.0
    return {**step, "knee_strike_s": None if strikes[-1] is None else strikes[-1] - start_s}
