"""Reference end states that methods are compared with, and their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from walkerlab.evidence.benchmarks import taylor_reference
from walkerlab.evidence.benchmarks.trials import RigidTrial, Trial
from walkerlab.evidence.paper.appendix_a import RigidWalker
from walkerlab.outcome import Outcome
from walkerlab.physics.solvers.registry import METHODS
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.store.checkpoint import Numbers

REFERENCE_RUN_BUDGET = 20_000_000  # right-hand sides, enough for the million explicit steps that stiff ground takes
# on stiff ground the error of an explicit step is all rounding: a tighter tolerance would only shrink the step
TIGHTEST_CONTACT = {"dop853": 1e-12, "radau5": 1e-11}
TIGHTEST_RIGID = {"dop853": 1e-14, "radau5": 1e-12}

END_METHODS = (taylor_reference.TAYLOR_METHOD, *METHODS)


@dataclass(frozen=True)
class End:
    """End state of a walk by one method."""

    method: str
    state: Floats
    tolerance: float = 0.0  # relative tolerance; 0 for Taylor series at machine precision
    rhs_evaluations: int = 0  # 0 if they are not counted

    def pack(self) -> Numbers:
        """Return the numbers that `unpack` takes, for a checkpoint."""
        return [END_METHODS.index(self.method), self.tolerance, self.rhs_evaluations, *self.state.tolist()]

    @classmethod
    def unpack(cls, numbers: Numbers) -> End:
        method, tolerance, rhs_evaluations, *state = numbers
        return cls(END_METHODS[int(method)], np.array(state), tolerance, int(rhs_evaluations))


@dataclass(frozen=True)
class Reference:
    """End states of a walk by two different methods. Their difference is the uncertainty."""

    first: End
    second: End

    @property
    def from_outside(self) -> bool:
        """Whether the first end state is independent of this project's solvers, event search and equations."""
        return self.first.method == taylor_reference.TAYLOR_METHOD

    @property
    def agreement(self) -> float:
        """Largest difference between the two end states."""
        return float(np.max(np.abs(self.first.state - self.second.state)))

    def reference_for(self, method: str) -> End:
        """Return the end state to compare a method with, always one computed by another method."""
        return self.second if method == self.first.method else self.first


class WalkEndsError(Exception):
    """The walk does not reach its last step within the budget, so there is no end state to compare."""


def reference_for(trial: Trial) -> Reference:
    by_second = second_end(trial)
    return Reference(first_end(trial), by_second)


def first_end(trial: Trial) -> End:
    """Compute the end state: by Taylor series for a rigid compass if heyoka is installed, otherwise by dop853.

    dop853 shares nothing with the implicit methods, but takes a million steps on stiff ground.

    Raises WalkEndsError if the walk does not reach its end.
    """
    if isinstance(trial, RigidTrial) and (compass := compass_of(trial)) is not None:
        state = taylor_reference.walk_by_taylor(compass, trial.start, trial.steps)
        if state is None:
            raise WalkEndsError("the walk ends early (no heel strike), without an end state to compare")
        return End(taylor_reference.TAYLOR_METHOD, state)
    return tightest_end(trial, "dop853")


def second_end(trial: Trial) -> End:
    """Compute the end state by a second, fast method. Raises WalkEndsError if the walk does not reach its end."""
    return tightest_end(trial, "radau5" if compass_of(trial) is None else "dop853")


def compass_of(trial: Trial) -> RigidWalker | None:
    """Return the Appendix A walker of a rigid trial, or None if the trial has no compass or heyoka is not installed."""
    return trial.compass if isinstance(trial, RigidTrial) and taylor_reference.is_installed() else None


def tightest_end(trial: Trial, method: str) -> End:
    """Compute the end state by one of our methods at its tightest useful tolerance.

    Raises WalkEndsError if the walk ends early.
    """
    tolerances = TIGHTEST_RIGID if isinstance(trial, RigidTrial) else TIGHTEST_CONTACT
    result = trial.prepare(method, tolerances[method], REFERENCE_RUN_BUDGET)()
    if result.outcome == Outcome.BUDGET_EXHAUSTED.label:
        budget = f"{REFERENCE_RUN_BUDGET // 1_000_000} million right-hand sides"
        why = f"{method} at {tolerances[method]:g} does not reach the end within {budget}"
        raise WalkEndsError(f"{why}, so the reference has no error estimate")
    if not result.state.size:
        raise WalkEndsError(f"the walk ends early ({result.outcome}), without an end state to compare")
    return End(method, result.state, tolerances[method], result.rhs_evaluations)
