"""Walks on which methods are measured. Each has a fixed start, a fixed step count and an end state to compare.

One method is a script for the rigid walk, written as a user of NumPy and SciPy would write it: with matrices, a linear
solve and an event. Contact walks have the contact of the config, or contact near the rigid limit.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from walkerlab.config.reads import ContactConfig
from walkerlab.evidence.paper.appendix_a import RigidWalker, impact
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import ContactWalker
from walkerlab.physics.hybrid.contact_result import walk_contact
from walkerlab.physics.hybrid.contact_state import JudgedGround
from walkerlab.physics.hybrid.rigid_record import new_idle_observer
from walkerlab.physics.hybrid.rigid_walk import EVENTS as RIGID_EVENTS
from walkerlab.physics.hybrid.rigid_walk import new_heel_strikes, walk
from walkerlab.physics.kernels import uncompiled
from walkerlab.physics.mechanics.rigid_model import RigidModel, models_in_turn
from walkerlab.physics.solvers.registry import METHODS, Tolerances, finder_for
from walkerlab.physics.solvers.stepping import ACCEPTED, H_NEXT, REJECTED, RHS, clear_counts
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.scene.contact import contact_scene, start_state


class ScriptBudgetError(Exception):
    """Raised if the script has exhausted its budget of right-hand sides."""


def walk_as_a_script(
    walker: RigidWalker,
    start: tuple[float, ...],
    steps: int,
    rtol: float,
    atol: float,
    budget: int,
    method: str = "DOP853",
    ends: tuple[Any, ...] = (),
) -> tuple[Floats | None, int]:
    """Simulate a walk with SciPy's solve_ivp, a NumPy right-hand side and terminal events.

    budget  limit on right-hand sides
    ends    further event functions that end the walk

    Returns the state after the last impact (None if not reached) and the number of right-hand sides.
    """
    from scipy.integrate import solve_ivp

    L, a, m, M, J, g, slope, c21_sign = walker
    b = L - a
    used = 0

    def right_hand_side(_t: float, x: Floats) -> Floats:
        nonlocal used
        used += 1
        if used > budget:
            raise ScriptBudgetError
        th1, th2, w1, w2 = x
        sine, cosine = np.sin(th2 - th1), np.cos(th2 - th1)
        D = np.array([[m * b**2, -m * L * b * cosine], [-m * L * b * cosine, M * L**2 + m * (L**2 + a**2)]])
        D += J * np.eye(2)
        C = np.array([[0.0, m * L * b * w2 * sine], [c21_sign * m * L * b * w1 * sine, 0.0]])
        G = np.array([m * g * b * np.sin(th1), -(M * L + m * (a + L)) * g * np.sin(th2)])
        return np.concatenate([x[2:], np.linalg.solve(D, -C @ x[2:] - G)])

    def heel_strike(_t: float, x: Floats) -> float:
        # At the start and when the legs scuff, both feet are on the slope as well, but the swing leg is not ahead.
        return float(x[0] + x[1] + 2.0 * slope) if x[0] > x[1] else 1.0

    event: Any = heel_strike
    event.terminal = True
    event.direction = -1.0
    state = np.array(start)
    limit = 10.0 * np.sqrt(L / g)
    try:
        for _ in range(steps):
            swing = solve_ivp(
                right_hand_side, (0.0, limit), state, method=method, rtol=rtol, atol=atol, events=[event, *ends]
            )
            if not swing.t_events[0].size:
                return None, used
            state = np.array(impact(walker, *swing.y[:, -1].tolist()))
    except ScriptBudgetError:
        return None, used
    return state, used


USER_SCRIPT = "scipy-dop853-numpy"
ATOL_PER_RTOL = 1e-2


@dataclass(frozen=True)
class TrialRun:
    outcome: str
    state: Floats  # end state, empty if it was not reached
    rhs_evaluations: int
    accepted: int
    rejected: int


@dataclass(frozen=True)
class RigidTrial:
    """Walk of the rigid model. Its end state is the state just after the last impact."""

    walker: RigidModel
    start: tuple[float, ...]
    steps: int
    compass: RigidWalker | None = None  # the walker in the form of Appendix A, which the user's script and heyoka need
    name: str = "rigid"

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of all methods of the registry, and of the user's script if it covers the walker."""
        return (*METHODS, USER_SCRIPT) if self.compass is not None else tuple(METHODS)

    def prepare(self, method: str, rtol: float, budget: int) -> Callable[[], TrialRun]:
        """Return a function that simulates the walk with a method. It reuses memory, so that its calls can be timed."""
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
        observer = new_idle_observer()
        strikes = new_heel_strikes(self.steps, n, self.walker.kneed)
        stride = walk if entry.compiled else uncompiled(walk)

        def run() -> TrialRun:
            clear_counts(solver)
            # Calls reuse the solver. The step size at the end of one walk must not help the next one.
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
        scene = self.walker, self.ground, False, STANCE_FOOT, self.start
        tolerances = Tolerances(method, rtol, rtol * ATOL_PER_RTOL, budget, track_energy=False)

        def run() -> TrialRun:
            result = walk_contact(*scene, tolerances, self.steps, None)
            return make_run(result.outcome, np.array(result.end_state), result.work)

        return run


Trial = RigidTrial | ContactTrial
"""A walk on which methods are measured."""


def make_run(outcome: Outcome, state: Floats, counts: Any) -> TrialRun:
    """Build the record of a run. It has an end state only if the outcome is `WALKED`."""
    end = state.copy() if outcome is Outcome.WALKED else np.zeros(0)
    return TrialRun(outcome.label, end, int(counts[RHS]), int(counts[ACCEPTED]), int(counts[REJECTED]))


# factors for stiffness and damping, and for creep velocities, that bring contact near the rigid limit
STIFFNESS_FACTOR = 100.0
CREEP_FACTOR = 0.01


def contact_trial(
    config: ContactConfig, state: State, length_m: float, steps: int, asymmetry: float = 0.0
) -> ContactTrial:
    """Set up the walk with the contact of the config.

    length_m   step length (m) of the rigid gait, which also serves as that of the contact gait
    asymmetry  as in `contact_scene`
    """
    scene = contact_scene(config, length_m, length_m, asymmetry)
    return ContactTrial(scene.walker, scene.ground, start_state(scene, state), steps, "contact")


def stiff_ground_trial(config: ContactConfig, state: State, length_m: float, steps: int) -> ContactTrial:
    """Set up a walk that is harder to integrate: on much stiffer ground with less creep."""
    trial = contact_trial(config, state, length_m, steps)
    friction = trial.walker.friction.scale_creep(CREEP_FACTOR)
    normal = trial.walker.normal.stiffen(STIFFNESS_FACTOR, STIFFNESS_FACTOR, 1.0)
    return replace(trial, walker=trial.walker._replace(normal=normal, friction=friction), name="contact-near-rigid")
