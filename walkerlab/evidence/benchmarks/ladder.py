"""Runs of one method on one scene, tolerance by tolerance: timing, budgets and stopping criteria."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Annotated, Any

import numpy as np

from walkerlab.evidence.benchmarks.references import Reference
from walkerlab.evidence.benchmarks.trials import Trial, TrialRun
from walkerlab.labels import Label
from walkerlab.outcome import Outcome
from walkerlab.physics.solvers.registry import METHODS
from walkerlab.pipeline.store.checkpoint import Checkpoint, Numbers

# sizes of runs, in right-hand sides
RUN_BUDGET = 200_000  # limit of a compiled run, which ends hopeless runs
# A library's right-hand sides take a hundred times as long, because its steps run in Python.
LIBRARY_RUN_BUDGET = 20_000  # limit of a library's run
LAST_RUN_SIZE = 12_000  # size of a library's run after which its ladder ends
WARM_UP_BUDGET = 2_000  # enough to compile and load everything
MAX_REPEATS = 7
REPEAT_TIME_S = 0.2
OWN_LADDER = tuple(10.0**-digits for digits in range(3, 13))
LIBRARY_LADDER = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
OUTCOMES = tuple(outcome.label for outcome in Outcome)
ERROR_LABEL = Label("1", "largest difference of the end state from the reference, SI units", absent=0.0)


@dataclass(frozen=True)
class MethodRun:
    tolerance: float
    result: TrialRun
    walls_s: tuple[float, ...]

    def pack(self) -> Numbers:
        """Return the numbers that `unpack` takes, for a checkpoint."""
        run = self.result
        counts = run.rhs_evaluations, run.accepted, run.rejected
        state = run.state.tolist()
        return [self.tolerance, OUTCOMES.index(run.outcome), *counts, len(state), *state, *self.walls_s]

    @classmethod
    def unpack(cls, numbers: Numbers) -> MethodRun:
        tolerance, outcome, *counts, size = numbers[:6]
        end = 6 + int(size)
        run = TrialRun(OUTCOMES[int(outcome)], np.array(numbers[6:end]), *map(int, counts))
        return cls(tolerance, run, tuple(numbers[end:]))


@dataclass(frozen=True)
class Ascent:
    """Runs of one method over its ladder of tolerances."""

    trial: Trial
    method: str
    ladder: tuple[float, ...]
    runs: tuple[MethodRun, ...]


@dataclass(frozen=True)
class MethodRow:
    scene: str
    method: Annotated[str, Label("1", "method")]
    tolerance: Annotated[float, Label("1", "relative tolerance")]
    outcome: Annotated[str, Label("1", "outcome")]
    error: Annotated[float | None, ERROR_LABEL]
    against: Annotated[str, Label("1", "method of the reference end state")]  # never the same method
    within_reference: bool  # whether the error is below the reference's uncertainty
    wall_s: Annotated[float, Label("s", "median run time", timing=True)]
    least_wall_s: Annotated[float, Label("s", "least run time", timing=True)]
    largest_wall_s: Annotated[float, Label("s", "largest run time", timing=True)]
    repeats_of_wall_s: Annotated[int, Label("1", "timed repeats", timing=True, name="repeats")]
    rhs_evaluations: Annotated[int, Label("1", "right-hand sides")]
    accepted: Annotated[int, Label("1", "accepted steps")]
    rejected: Annotated[int, Label("1", "rejected steps")]

    @property
    def reached(self) -> Annotated[int, Label("1", "whether the end state was reached")]:
        """1 if the run reached the end state, so that its error is known, otherwise 0."""
        return int(self.error is not None)


def unit_name(*parts: object) -> str:
    """Name a measurement in a checkpoint. One from another machine is not resumed, because run times are compared."""
    return "/".join(map(str, (platform.node(), *parts)))


def ascend(trial: Trial, method: str, checkpoint: Checkpoint) -> Ascent:
    """Run a method at tighter and tighter tolerances until a run is too expensive. Resume runs of the checkpoint."""
    ladder = OWN_LADDER
    budget = RUN_BUDGET
    last = RUN_BUDGET
    if method not in METHODS or not METHODS[method].compiled:
        ladder = LIBRARY_LADDER
        budget = LIBRARY_RUN_BUDGET
        last = LAST_RUN_SIZE
    trial.prepare(method, ladder[0], WARM_UP_BUDGET)()
    runs: list[MethodRun] = []
    for tolerance in ladder:
        unit = unit_name(trial.name, method, tolerance)
        if unit not in checkpoint.kept:
            checkpoint.keep(unit, measure(trial, method, tolerance, budget).pack())
        runs.append(MethodRun.unpack(checkpoint.kept[unit]))
        if runs[-1].result.rhs_evaluations >= last:
            break
    return Ascent(trial, method, ladder, tuple(runs))


def measure(trial: Trial, method: str, tolerance: float, budget: int) -> MethodRun:
    """Time a walk up to `MAX_REPEATS` times within `REPEAT_TIME_S`."""
    # the first walk serves as a warm-up and counts only if it is long
    walk = trial.prepare(method, tolerance, budget)
    first_s, result = time_walk(walk)
    walls = [first_s] if first_s > REPEAT_TIME_S else []
    while len(walls) < MAX_REPEATS and (not walls or sum(walls) + walls[-1] <= REPEAT_TIME_S):
        walls.append(time_walk(walk)[0])
    return MethodRun(tolerance, result, tuple(walls))


def time_walk(walk: Callable[[], TrialRun]) -> tuple[float, TrialRun]:
    start = time.perf_counter()
    result = walk()
    return time.perf_counter() - start, result


def make_row(ascent: Ascent, run: MethodRun, reference: Reference) -> MethodRow:
    end = reference.reference_for(ascent.method)
    result = run.result
    error = float(np.max(np.abs(result.state - end.state))) if result.state.size else None
    below_agreement = error is not None and error <= reference.agreement
    return MethodRow(
        scene=ascent.trial.name,
        method=ascent.method,
        tolerance=run.tolerance,
        outcome=result.outcome,
        error=error,
        against=end.method,
        within_reference=below_agreement,
        wall_s=median(run.walls_s),
        least_wall_s=min(run.walls_s),
        largest_wall_s=max(run.walls_s),
        repeats_of_wall_s=len(run.walls_s),
        rhs_evaluations=result.rhs_evaluations,
        accepted=result.accepted,
        rejected=result.rejected,
    )


def omitted_tolerances(ascent: Ascent) -> list[dict[str, Any]]:
    """List the tolerances that were not run, with the reason."""
    last = ascent.runs[-1]
    why = f"already {last.result.outcome} with {last.result.rhs_evaluations} right-hand sides at {last.tolerance:g}"
    return [
        {"scene": ascent.trial.name, "method": ascent.method, "tolerance": rtol, "why": why}
        for rtol in ascent.ladder[len(ascent.runs) :]
    ]
