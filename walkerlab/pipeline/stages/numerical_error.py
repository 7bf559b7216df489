"""Numerical error of a walk: the change of its quantities at tighter tolerances."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from walkerlab.labels import ERROR_OF_EACH_STEP
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances

LEAST_RTOL: Final = 1e-14  # minimum in the schema
TIGHTER: Final = {100.0: "a hundred times tighter tolerances", 10.0: "ten times tighter tolerances"}
MORE_WORK: Final = 10  # factor on the evaluation budget at tighter tolerances
SAMPLE: Final = 16  # number of many walks to repeat
USUAL: Final = TIGHTER[100.0]
ROUNDING: Final = 1e-6  # relative, of a divided tolerance

Summary = Mapping[str, Any]


def numerical_error(walked: Summary, tolerances: Tolerances, walk: Callable[[Tolerances], Summary]) -> dict[str, Any]:
    """How much a walk's numbers change when it is walked again, at a hundred times tighter tolerances if there are any.

    walked      summary of the walk: its `outcome`, `steps`, `end_time_s`, and lists with a number for each step
    tolerances  that it was walked with
    walk        the same walk with others, as its summary

    Returns the largest changes of what its steps have, named as in `ERROR_OF_EACH_STEP`, `end_time_s` (s), and of a
    driven walk its `cost_of_transport`; `by` tells what was changed if it is not the usual. Only `reason` if the second
    walk ends otherwise.
    """
    tighter, by = tightened(tolerances)
    return change(walked, walk(tighter), by)


def tightened(tolerances: Tolerances) -> tuple[Tolerances, str]:
    """Return tighter tolerances with a larger budget, and a description of the change.

    At the tightest tolerances the method changes instead.
    """
    tolerances = replace(tolerances, budget=min(MORE_WORK * tolerances.budget, ENDLESS))
    for factor, by in TIGHTER.items():
        rtol = tolerances.rtol / factor
        if rtol >= (1.0 - ROUNDING) * LEAST_RTOL:
            return replace(tolerances, rtol=rtol, atol=tolerances.atol / factor), by
    other = "dop853" if tolerances.method == "radau5" else "radau5"
    return replace(tolerances, method=other), f"another method, {other}"


def change(walked: Summary, again: Summary, by: str = USUAL) -> dict[str, Any]:
    """Return the largest changes between two summaries of a walk, as `numerical_error` does."""
    if (walked["outcome"], walked["steps"]) != (again["outcome"], again["steps"]):
        steps = f"{again['steps']} step{'' if again['steps'] == 1 else 's'}"
        return {"reason": f"with {by} the walk ends otherwise: {again['outcome']} after {steps}"}
    changes = {}
    for key, name in ERROR_OF_EACH_STEP.items():
        both = zip(walked.get(key) or (), again.get(key) or (), strict=False)  # the last foot may still stand
        apart = [abs(one - other) for one, other in both if one is not None and other is not None]
        if apart and any(walked[key]):  # point feet do not roll
            changes[name] = max(apart)
    changes["end_time_s"] = abs(walked["end_time_s"] - again["end_time_s"])
    # a passive walk's cost is the slope's sine, however large the walk's error
    if any(work for giver, work in walked.get("work_per_step_J", {}).items() if giver != "gravity"):
        changes["cost_of_transport"] = abs(walked["cost_of_transport"] - again["cost_of_transport"])
    return changes if by == USUAL else {**changes, "by": by}


def evenly_spread(count: int, wanted: int) -> list[int]:
    """Return at most `wanted` evenly spaced indices below `count`, both ends included."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, wanted)).tolist()})
