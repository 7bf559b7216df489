"""The truth that methods are measured by, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walkerlab.scene import taylor_reference
from walkerlab.scene.trials import RigidTrial, Trial

ENDLESS = 100_000_000  # right-hand sides
TIGHTEST = {"dop853": 1e-14, "radau5": 1e-11}
TIGHTEST_RIGID = {"dop853": 1e-14, "radau5": 1e-12}


@dataclass(frozen=True)
class Reference:
    """An end state, where it comes from, and how far a second, different method is from it."""

    method: str
    second_method: str
    agreement: float  # largest difference of the two
    state: NDArray[np.float64]


class WalkEndsError(Exception):
    """The walk does not reach its last step, so that there is no end state to compare."""


def reference_for(trial: Trial) -> Reference:
    """The reference of a trial: Taylor series for the rigid scene where installed, else two methods at their tightest.

    Raises WalkEndsError if the walk does not reach its end.
    """
    if isinstance(trial, RigidTrial):
        second = tightest(trial, "dop853", TIGHTEST_RIGID)
        if taylor_reference.is_installed():
            state = taylor_reference.walk_by_taylor(trial.walker, trial.start, trial.steps)
            return compared(taylor_reference.NAME, state, "dop853", second)
        return compared("dop853", second, "radau5", tightest(trial, "radau5", TIGHTEST_RIGID))
    return compared("radau5", tightest(trial, "radau5", TIGHTEST), "dop853", tightest(trial, "dop853", TIGHTEST))


def compared(method: str, state: NDArray[np.float64], second: str, other: NDArray[np.float64]) -> Reference:
    """A reference with the difference of a second method from it."""
    return Reference(method, second, float(np.max(np.abs(state - other))), state)


def tightest(trial: Trial, method: str, tolerances: dict[str, float]) -> NDArray[np.float64]:
    """The end state by one of our methods at its tightest tolerance."""
    result = trial.prepare(method, tolerances[method], ENDLESS)()
    if not result.state.size:
        raise WalkEndsError(f"the walk ends early ({result.outcome}), so that there is no end state to compare")
    return result.state
