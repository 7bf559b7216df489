"""Reference end states that methods are compared with, and their uncertainty."""

from dataclasses import dataclass

import numpy as np

from walkerlab.evidence.benchmarks import taylor_reference
from walkerlab.evidence.benchmarks.trials import RigidTrial, Trial
from walkerlab.evidence.paper.appendix_a import RigidWalker
from walkerlab.outcome import Outcome
from walkerlab.physics.solvers.system import Floats

REFERENCE_RUN_BUDGET = (
    20_000_000  # right-hand sides: a million explicit steps, which stiff ground takes, and some to spare
)
# on stiff ground an explicit step errs by rounding alone: asked for less, it shrinks without end and gains nothing
TIGHTEST_CONTACT = {"dop853": 1e-12, "radau5": 1e-11}
TIGHTEST_RIGID = {"dop853": 1e-14, "radau5": 1e-12}


@dataclass(frozen=True)
class End:
    """End state of a walk by one method."""

    method: str
    state: Floats
    tolerance: float = 0.0  # relative; 0 for Taylor series at machine precision
    rhs_evaluations: int = 0  # 0 where they are not counted


@dataclass(frozen=True)
class Reference:
    """End of a walk by two different methods; their difference is its uncertainty."""

    first: End
    second: End

    @property
    def from_outside(self) -> bool:
        """Whether the first end is independent of this project's solvers, event search and equations."""
        return self.first.method == taylor_reference.TAYLOR_METHOD

    @property
    def agreement(self) -> float:
        """Largest difference between the two ends."""
        return float(np.max(np.abs(self.first.state - self.second.state)))

    def for_method(self, method: str) -> End:
        """End to compare a method with, never computed by that method itself."""
        return self.second if method == self.first.method else self.first


class WalkEndsError(Exception):
    """The walk does not reach its last step within the budget, so there is no end state to compare."""


def reference_for(trial: Trial) -> Reference:
    by_second = second_end(trial)
    return Reference(first_end(trial), by_second)


def first_end(trial: Trial) -> End:
    """Compute the end by Taylor series for a rigid compass where heyoka is installed, otherwise by dop853.

    dop853 shares nothing with the implicit methods, but takes a million steps on stiff ground.

    Raises WalkEndsError if the walk does not reach its end.
    """
    if isinstance(trial, RigidTrial) and (compass := compass_of(trial)) is not None:
        return End(taylor_reference.TAYLOR_METHOD, taylor_reference.walk_by_taylor(compass, trial.start, trial.steps))
    return tightest_end(trial, "dop853")


def second_end(trial: Trial) -> End:
    """Compute the end by a second, quick method. Raises WalkEndsError if the walk does not reach its end."""
    return tightest_end(trial, "radau5" if compass_of(trial) is None else "dop853")


def compass_of(trial: Trial) -> RigidWalker | None:
    """Closed-form walker of a trial, if heyoka can walk it."""
    return trial.compass if isinstance(trial, RigidTrial) and taylor_reference.is_installed() else None


def tightest_end(trial: Trial, method: str) -> End:
    """Compute the end by one of our methods at its tightest useful tolerance."""
    tolerances = TIGHTEST_RIGID if isinstance(trial, RigidTrial) else TIGHTEST_CONTACT
    result = trial.prepare(method, tolerances[method], REFERENCE_RUN_BUDGET)()
    if result.outcome == Outcome.BUDGET_EXHAUSTED.label:
        budget = f"{REFERENCE_RUN_BUDGET // 1_000_000} million right-hand sides"
        why = f"{method} at {tolerances[method]:g} does not reach the end within {budget}"
        raise WalkEndsError(f"{why}, so the reference has no error estimate")
    if not result.state.size:
        raise WalkEndsError(f"the walk ends early ({result.outcome}), without an end state to compare")
    return End(method, result.state, tolerances[method], result.rhs_evaluations)
