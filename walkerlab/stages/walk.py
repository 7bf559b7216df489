"""What the stages that walk have in common: the walk, what is stored of it, and the walk again for its error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from walkerlab.errors import NoAnswer
from walkerlab.solvers.registry import Tolerances
from walkerlab.stages.numerical_error import numerical_error
from walkerlab.stages.progress import Progress
from walkerlab.stages.thinning import thinned
from walkerlab.store.content import Content, Group

Walk = Callable[[Tolerances, bool], Any]
"""Takes a walk with tolerances, sampled if that is asked for, and returns it: a `WalkRecord` with `samples`."""


def content_of_walk(
    stage: str,
    walk: Walk,
    tolerances: Tolerances,
    groups: Callable[[Any], dict[str, Group]],
    summary: Callable[[Any], dict[str, Any]],
    progress: Progress,
    again: bool,
) -> Content:
    """Take a walk and store it, long ones thinned; and take it again for the numerical error.

    groups   the datasets of a walk
    summary  what is printed of it
    again    whether the second walk is wanted, which takes about as long as two or three

    Raises NoAnswer, with what there is, if the integrator gives none.
    """
    taken = walk(tolerances, True)
    if taken.samples is not None:
        taken = replace(taken, samples=thinned(taken.samples, taken.samples.time_s, taken.touch_time_s, progress))
    stored, said = groups(taken), summary(taken)
    if not taken.outcome.answered:
        why = f"{stage}: {taken.outcome.label} after {taken.steps} steps, {taken.end_time_s:.4g} s"
        raise NoAnswer(why, said["advice"], Content(stored, said))
    if again:
        said["numerical_error"] = numerical_error(said, tolerances, lambda tighter: summary(walk(tighter, False)))
    return Content(stored, said)
