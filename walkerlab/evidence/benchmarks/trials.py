"""Walks on which methods are measured, each with a fixed start, a fixed step count and an end state to compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from walkerlab.evidence.benchmarks.user_script import walk_as_a_script
from walkerlab.evidence.paper.appendix_a import RigidWalker
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.rigid_record import unwatched
from walkerlab.physics.hybrid.rigid_walk import EVENTS as RIGID_EVENTS
from walkerlab.physics.hybrid.rigid_walk import new_heel_strikes, walk
from walkerlab.physics.kernels import uncompiled
from walkerlab.physics.mechanics.rigid_model import RigidModel, models_in_turn
from walkerlab.physics.solvers.registry import METHODS, Tolerances, finder_for
from walkerlab.physics.solvers.stepping import ACCEPTED, H_NEXT, REJECTED, RHS, clear_counts
from walkerlab.physics.solvers.system import Floats

if TYPE_CHECKING:
    from walkerlab.physics.ground.walker import ContactWalker
    from walkerlab.physics.hybrid.contact_events import JudgedGround

USER_SCRIPT = "scipy-dop853-numpy"
ATOL_PER_RTOL = 1e-2


@dataclass(frozen=True)
class TrialRun:
    outcome: str
    state: Floats  # end state; empty if it was not reached
    rhs_evaluations: int
    accepted: int
    rejected: int


@dataclass(frozen=True)
class RigidTrial:
    """Walk of the rigid model. Its end state is the state just after the last impact."""

    walker: RigidModel
    start: tuple[float, ...]
    steps: int
    compass: RigidWalker | None = None  # the walker in Appendix A's form, for the user's script and heyoka
    name: str = "rigid"

    @property
    def methods(self) -> tuple[str, ...]:
        """All methods of the registry, and the user's script if it covers the walker."""
        return (*METHODS, USER_SCRIPT) if self.compass is not None else tuple(METHODS)

    def prepare(self, method: str, rtol: float, budget: int) -> Callable[[], TrialRun]:
        """Return a function that walks with a method, ready to be timed. Its calls reuse the same memory."""
        atol = rtol * ATOL_PER_RTOL
        if method == USER_SCRIPT:
            assert self.compass is not None, "the script is not among this walker's methods"
            compass = self.compass

            def as_a_script() -> TrialRun:
                state, evaluations = walk_as_a_script(compass, self.start, self.steps, rtol, atol, budget)
                ended = Outcome.BUDGET_EXHAUSTED if state is None else Outcome.WALKED
                return TrialRun(ended.label, np.zeros(0) if state is None else state, evaluations, 0, 0)

            return as_a_script
        n = len(self.walker.zero_state)
        entry = METHODS[method]
        solver = entry.new(n, rtol, atol, budget)
        finder = finder_for(solver, RIGID_EVENTS, n)
        walker = models_in_turn(self.walker)
        observer = unwatched()
        strikes = new_heel_strikes(self.steps, n, self.walker.kneed)
        stride = walk if entry.compiled else uncompiled(walk)

        def run() -> TrialRun:
            clear_counts(solver)
            solver.clock[H_NEXT] = 0.0
            status, _ = stride(walker, solver, finder, observer, np.array(self.start), strikes)
            return make_run(Outcome(status), strikes.after[-1], solver.counts)

        return run


@dataclass(frozen=True)
class ContactTrial:
    """Walk on compliant ground. Its end state is the state at the last touch."""

    walker: ContactWalker
    ground: JudgedGround
    start: tuple[float, ...]
    steps: int
    name: str

    @property
    def methods(self) -> tuple[str, ...]:
        return tuple(METHODS)

    def prepare(self, method: str, rtol: float, budget: int) -> Callable[[], TrialRun]:
        from walkerlab.physics.ground.terrain import STANCE_FOOT
        from walkerlab.physics.hybrid.contact_result import walk_contact

        scene = self.walker, self.ground, False, STANCE_FOOT, self.start
        tolerances = Tolerances(method, rtol, rtol * ATOL_PER_RTOL, budget, track_energy=False)

        def run() -> TrialRun:
            result = walk_contact(*scene, tolerances, self.steps, None)
            return make_run(result.outcome, np.array(result.end_state), result.work)

        return run


Trial = RigidTrial | ContactTrial
"""A walk on which methods are measured."""


def make_run(outcome: Outcome, state: Floats, counts: Any) -> TrialRun:
    """Build a run's record. It has an end state only if the outcome is `WALKED`."""
    end = state.copy() if outcome is Outcome.WALKED else np.zeros(0)
    return TrialRun(outcome.label, end, int(counts[RHS]), int(counts[ACCEPTED]), int(counts[REJECTED]))
