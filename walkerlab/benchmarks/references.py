"""The truth that methods are measured by, and how well it is known."""

from dataclasses import dataclass

import numpy as np

from walkerlab.benchmarks import taylor_reference
from walkerlab.benchmarks.trials import RigidTrial, Trial
from walkerlab.outcome import Outcome
from walkerlab.paper.appendix_a import RigidWalker
from walkerlab.solvers.system import Floats

BUDGET = 20_000_000  # right-hand sides: a million explicit steps, which stiff ground takes, and some to spare
# on stiff ground an explicit step errs by rounding alone: asked for less, it shrinks without end and gains nothing
TIGHTEST = {"dop853": 1e-12, "radau5": 1e-11}
TIGHTEST_RIGID = {"dop853": 1e-14, "radau5": 1e-12}


@dataclass(frozen=True)
class End:
    """Where a walk ends, by which method.

    tolerance        relative; 0 for Taylor series at machine precision
    rhs_evaluations  that it took; 0 where they are not counted
    """

    method: str
    state: Floats
    tolerance: float = 0.0
    rhs_evaluations: int = 0


@dataclass(frozen=True)
class Reference:
    """The end of a walk by two different methods: their difference is what the end is known to."""

    first: End
    second: End

    @property
    def method(self) -> str:
        """The method of the end that others are measured by."""
        return self.first.method

    @property
    def state(self) -> Floats:
        """That end."""
        return self.first.state

    @property
    def second_method(self) -> str:
        """The other method."""
        return self.second.method

    @property
    def from_outside(self) -> bool:
        """Whether the first end comes from another program: not our solvers, event search or equations."""
        return self.method == taylor_reference.NAME

    @property
    def tolerance(self) -> float:
        """Relative tolerance of the first end."""
        return self.first.tolerance

    @property
    def rhs_evaluations(self) -> int:
        """Right-hand sides that the first end took."""
        return self.first.rhs_evaluations

    @property
    def agreement(self) -> float:
        """Largest difference of the two."""
        return float(np.max(np.abs(self.first.state - self.second.state)))

    def for_method(self, method: str) -> End:
        """The end to measure a method by: never its own."""
        return self.second if method == self.first.method else self.first


class WalkEndsError(Exception):
    """The walk does not reach its last step, or not at a bearable cost, so that there is no end state to compare."""


def reference_for(trial: Trial) -> Reference:
    """The reference of a trial; WalkEndsError if the walk does not reach its end."""
    by_second = second_end(trial)
    return Reference(first_end(trial), by_second)


def first_end(trial: Trial) -> End:
    """The end that all methods but one are measured by: Taylor series where they are installed and the scene is rigid.

    Else the explicit method, which shares nothing with those that are good at contact, and takes a million steps there.

    Raises WalkEndsError if the walk does not reach its end.
    """
    if isinstance(trial, RigidTrial) and (compass := compass_of(trial)) is not None:
        return End(taylor_reference.NAME, taylor_reference.walk_by_taylor(compass, trial.start, trial.steps))
    return tightest(trial, "dop853")


def second_end(trial: Trial) -> End:
    """The end by another method: quick, so that it also tells whether the walk has one.

    Raises WalkEndsError if it has not.
    """
    return tightest(trial, "radau5" if compass_of(trial) is None else "dop853")


def compass_of(trial: Trial) -> RigidWalker | None:
    """The walker in closed form, if Taylor series are there to walk it."""
    return trial.compass if isinstance(trial, RigidTrial) and taylor_reference.is_installed() else None


def tightest(trial: Trial, method: str) -> End:
    """The end by one of our methods at its tightest tolerance."""
    tolerances = TIGHTEST_RIGID if isinstance(trial, RigidTrial) else TIGHTEST
    result = trial.prepare(method, tolerances[method], BUDGET)()
    if result.outcome == Outcome.BUDGET_EXHAUSTED.label:
        why = f"{method} at {tolerances[method]:g} does not reach its end within {BUDGET // 1_000_000} million"
        raise WalkEndsError(f"{why} right-hand sides, so that nothing tells how well its end is known")
    if not result.state.size:
        raise WalkEndsError(f"the walk ends early ({result.outcome}), so that there is no end state to compare")
    return End(method, result.state, tolerances[method], result.rhs_evaluations)
