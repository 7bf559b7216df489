"""Numerical error of a walk: the change of its quantities at tighter tolerances."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from walkerlab.labels import ERROR_OF_EACH_STEP
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.physics.solvers.system import Floats

LEAST_RTOL: Final = 1e-14  # minimum that the schema allows
TIGHTER: Final = {100.0: "a hundred times tighter tolerances", 10.0: "ten times tighter tolerances"}
MORE_WORK: Final = 10  # factor on the evaluation budget at tighter tolerances
SAMPLE: Final = 16  # maximum number of walks to repeat
DEFAULT_TIGHTENING: Final = TIGHTER[100.0]
ROUNDING: Final = 1e-6  # relative rounding error allowed in a divided tolerance

Summary = Mapping[str, Any]
Values = Sequence[float | None]


def numerical_error(first: Summary, tolerances: Tolerances, walk: Callable[[Tolerances], Summary]) -> dict[str, Any]:
    """Repeat a walk at tighter tolerances and return the changes of its quantities.

    first       summary of the walk: its `outcome`, `steps`, `end_time_s`, and lists with one value per step
    tolerances  tolerances of the first walk
    walk        repeats the walk with other tolerances and returns its summary

    Returns the largest change of each step quantity, named as in `ERROR_OF_EACH_STEP`, the change of `end_time_s` (s)
    and, for a driven walk, the change of `cost_of_transport`; `of_steps` has the largest changes up to each step. `by`
    describes the tighter settings unless they are the usual ones. If the two walks end differently, only `reason` is
    returned.
    """
    tighter, by = tightened(tolerances)
    return change(first, walk(tighter), by)


def tightened(tolerances: Tolerances) -> tuple[Tolerances, str]:
    """Return tighter tolerances, or another method if they cannot be tightened, with more budget and a description."""
    tolerances = replace(tolerances, budget=min(MORE_WORK * tolerances.budget, ENDLESS))
    for factor, by in TIGHTER.items():
        rtol = tolerances.rtol / factor
        if rtol >= (1.0 - ROUNDING) * LEAST_RTOL:
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
        if np.isfinite(apart).any() and any(first[key]):  # skip a list of zeros, such as the rolling of point feet
            changes[name] = float(np.nanmax(apart))
            of_steps[name] = [None if math.isnan(error) else float(f"{error:.2g}") for error in apart.tolist()]
    changes["end_time_s"] = abs(first["end_time_s"] - second["end_time_s"])
    # A passive walk's cost of transport is always the sine of the slope, so its change does not measure the error.
    if any(work for giver, work in first.get("work_per_step_J", {}).items() if giver != "gravity"):
        changes["cost_of_transport"] = abs(first["cost_of_transport"] - second["cost_of_transport"])
    changes |= {"of_steps": of_steps} if of_steps else {}
    return changes if by == DEFAULT_TIGHTENING else {**changes, "by": by}


def steps_later(first: Summary, second: Summary) -> int | None:
    """Return the delay (steps) until a repeated walk repeats its steps like the first, or None if either never does."""
    period = first.get("repeats_after") or 0
    if not period or second.get("repeats_after") != period:
        return None
    cycle, other = (np.array(walk["step_periods_s"][-period:]) for walk in (first, second))
    return min(range(period), key=lambda steps: float(np.abs(np.roll(other, -steps) - cycle).max()))


def step_changes(first: Values, second: Values, period: int, later: int | None) -> Floats:
    """Return the largest change of the values (steps,) up to each step, or NaN where a walk has no value.

    period  steps after which the first walk repeats in the end, or 0
    later   delay (steps) with which the second walk takes the same steps, or None if it does not repeat

    Rounding decides at which step a walk begins to repeat itself. So the steps of a walk that has settled are compared
    with the same steps of the cycle, even if these come later. If the second walk has not settled yet, the error of
    the cycle is estimated by that of one step.
    """
    count = min(len(first), len(second))
    values, others = (np.array(each[:count], float) for each in (first, second))
    changes = np.abs(values - others)
    largest = np.where(np.isnan(changes), np.nan, np.fmax.accumulate(changes))
    if not period or count < 2 * period:
        return largest
    end = count - 1 - (later or 0)
    steps = np.arange(count)
    last = end - (end - steps) % period  # the last step with a counterpart in the second walk
    between = changes[0] if later is None else np.abs(values[last] - others[last + later])
    return np.asarray(np.fmin(largest, np.abs(values - values[last]) + between))


def evenly_spread(count: int, wanted: int) -> list[int]:
    """Return at most `wanted` evenly spaced indices from 0 to `count` - 1, both included."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, wanted)).tolist()})
