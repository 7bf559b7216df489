"""Reference end states of walks. Two methods compute each of them, and their difference is the uncertainty.

For a rigid compass, one of the two is the Taylor method of heyoka.
"""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from walkerlab.evidence.benchmarks.trials import RigidTrial, Trial
from walkerlab.evidence.paper.appendix_a import RigidWalker, impact
from walkerlab.outcome import Outcome
from walkerlab.physics.solvers.registry import METHODS
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.store.files import Numbers

TAYLOR_METHOD = "heyoka-taylor"
# heyoka's return code for a stop at the first terminal event. Failures and time limits have other codes.
STOPPED_BY_EVENT = -1


def walk_by_taylor(walker: RigidWalker, start: tuple[float, ...], steps: int) -> Floats | None:
    """Simulate a walk with heyoka. Return the state after `steps` heel strikes, or None if one does not occur."""
    limit = 10.0 * np.sqrt(walker.leg_length / walker.gravity)
    passing, striking = taylor_integrators(walker)
    state = np.array(start)
    for _ in range(steps):
        # At the start both feet are on the slope, which must not count as a heel strike. So the search begins after the
        # legs have passed.
        for integrator in (passing, striking) if state[0] < state[1] else (striking,):
            integrator.time, integrator.state[:] = 0.0, state
            # heyoka ignores an event for a while after it has occurred, even if we replace time and state.
            integrator.reset_cooldowns()
            if integrator.propagate_until(limit)[0].value != STOPPED_BY_EVENT:
                return None
            state = np.array(integrator.state)
        state = np.array(impact(walker, *state.tolist()))
    return state


def taylor_integrators(walker: RigidWalker) -> tuple[Any, Any]:
    """Build two Taylor integrators of the swing: the first stops when the legs pass, the second at heel strike."""
    import heyoka as hy

    th1, th2, w1, w2 = hy.make_vars("th1", "th2", "w1", "w2")
    L, a, m, M, inertia, g, slope, c21_sign = walker
    b = L - a
    d11 = m * b * b + inertia
    d22 = M * L * L + m * (L * L + a * a) + inertia
    d12 = -m * L * b * hy.cos(th2 - th1)
    r1 = -m * L * b * w2 * w2 * hy.sin(th2 - th1) - m * g * b * hy.sin(th1)
    r2 = -c21_sign * m * L * b * w1 * w1 * hy.sin(th2 - th1) + (M * L + m * (a + L)) * g * hy.sin(th2)
    determinant = d11 * d22 - d12 * d12
    equations = [
        (th1, w1),
        (th2, w2),
        (w1, (d22 * r1 - d12 * r2) / determinant),
        (w2, (d11 * r2 - d12 * r1) / determinant),
    ]
    passing = hy.t_event(th1 - th2, direction=hy.event_direction.positive)
    striking = hy.t_event(th1 + th2 + 2.0 * slope, direction=hy.event_direction.negative)
    return tuple(hy.taylor_adaptive(equations, [0.0] * 4, t_events=[event]) for event in (passing, striking))


REFERENCE_RUN_BUDGET = 20_000_000  # right-hand sides, enough for the million explicit steps that stiff ground takes
# On stiff ground the error of an explicit step is only rounding. A tighter tolerance would shrink steps, not errors.
TIGHTEST_CONTACT = {"dop853": 1e-12, "radau5": 1e-11}
TIGHTEST_RIGID = {"dop853": 1e-14, "radau5": 1e-12}

END_METHODS = (TAYLOR_METHOD, *METHODS)


@dataclass(frozen=True)
class End:
    """End state of a walk by one method."""

    method: str
    state: Floats
    tolerance: float = 0.0  # relative tolerance, or 0 for Taylor series at machine precision
    rhs_evaluations: int = 0  # 0 if they are not counted

    def pack(self) -> Numbers:
        """Convert the end state to numbers for a checkpoint. `unpack` converts them back."""
        return [END_METHODS.index(self.method), self.tolerance, self.rhs_evaluations, *self.state.tolist()]

    @classmethod
    def unpack(cls, numbers: Numbers) -> "End":
        method, tolerance, rhs_evaluations, *state = numbers
        return cls(END_METHODS[int(method)], np.array(state), tolerance, int(rhs_evaluations))


@dataclass(frozen=True)
class Reference:
    """End states of one walk, computed by two different methods. Their difference is the uncertainty."""

    first: End
    second: End

    @property
    def from_outside(self) -> bool:
        """Whether the first end state shares no solver, event search or equations with this project."""
        return self.first.method == TAYLOR_METHOD

    @property
    def agreement(self) -> float:
        """Largest difference between the two end states."""
        return float(np.max(np.abs(self.first.state - self.second.state)))

    def reference_for(self, method: str) -> End:
        """Return the end state to compare a method with, computed by another method."""
        return self.second if method == self.first.method else self.first


class WalkEndsError(Exception):
    """Raised if a walk does not reach its last step within the budget, so that there is no end state to compare."""


def reference_for(trial: Trial) -> Reference:
    by_second = second_end(trial)
    return Reference(first_end(trial), by_second)


def first_end(trial: Trial) -> End:
    """Compute the end state by Taylor series for a rigid compass if heyoka is installed, otherwise by dop853.

    dop853 has nothing in common with the implicit methods, but takes a million steps on stiff ground.

    Raises WalkEndsError if the walk does not reach its end.
    """
    if isinstance(trial, RigidTrial) and (compass := compass_of(trial)) is not None:
        state = walk_by_taylor(compass, trial.start, trial.steps)
        if state is None:
            raise WalkEndsError("the walk ends early (no heel strike), without an end state to compare")
        return End(TAYLOR_METHOD, state)
    return tightest_end(trial, "dop853")


def second_end(trial: Trial) -> End:
    """Compute the end state by a second, fast method. Raises WalkEndsError if the walk does not reach its end."""
    return tightest_end(trial, "radau5" if compass_of(trial) is None else "dop853")


def compass_of(trial: Trial) -> RigidWalker | None:
    """Return the Appendix A walker of a rigid trial, or None if the trial has no compass or heyoka is not installed."""
    return trial.compass if isinstance(trial, RigidTrial) and find_spec("heyoka") else None


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
