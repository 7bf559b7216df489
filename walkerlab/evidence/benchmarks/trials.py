"""Walks on which methods are measured, each with a fixed start, a fixed step count and an end state to compare.

A rigid walk is also programmed as a user would with NumPy and SciPy: matrices, a linear solve, an event. Contact walks
have the config's contact or contact near the rigid limit. Reference end states come with their uncertainty; heyoka's
Taylor method computes one of them.
"""

import importlib.util
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
from walkerlab.physics.hybrid.rigid_record import unwatched
from walkerlab.physics.hybrid.rigid_walk import EVENTS as RIGID_EVENTS
from walkerlab.physics.hybrid.rigid_walk import new_heel_strikes, walk
from walkerlab.physics.kernels import uncompiled
from walkerlab.physics.mechanics.rigid_model import RigidModel, models_in_turn
from walkerlab.physics.solvers.registry import METHODS, Tolerances, finder_for
from walkerlab.physics.solvers.stepping import ACCEPTED, H_NEXT, REJECTED, RHS, clear_counts
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.pipeline.store.files import Numbers
from walkerlab.scene.contact import contact_scene, start_state


class ScriptBudgetError(Exception):
    """The script has exhausted its budget of right-hand sides."""


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

    ends  further event functions that end the walk

    Returns the state after the last impact (None if not reached) and the number of right-hand sides.
    """
    from scipy.integrate import solve_ivp

    L, a, m, M = walker.leg_length, walker.foot_to_mass, walker.leg_mass, walker.hip_mass
    b = L - a
    g = walker.gravity
    slope = walker.slope
    used = 0

    def right_hand_side(_t: float, x: Floats) -> Floats:
        nonlocal used
        used += 1
        if used > budget:
            raise ScriptBudgetError
        th1, th2, w1, w2 = x
        sine = np.sin(th2 - th1)
        cosine = np.cos(th2 - th1)
        D = np.array([[m * b**2, -m * L * b * cosine], [-m * L * b * cosine, M * L**2 + m * (L**2 + a**2)]])
        D += walker.leg_inertia * np.eye(2)
        C = np.array([[0.0, m * L * b * w2 * sine], [walker.c21_sign * m * L * b * w1 * sine, 0.0]])
        G = np.array([m * g * b * np.sin(th1), -(M * L + m * (a + L)) * g * np.sin(th2)])
        return np.concatenate([x[2:], np.linalg.solve(D, -C @ x[2:] - G)])

    def heel_strike(_t: float, x: Floats) -> float:
        # Both feet are also on the slope at the start and when the legs scuff, but then the swing leg is not ahead.
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
            # Calls reuse the solver, and the step size at the end of one walk must not help the next.
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
    """Build a run's record. It has an end state only if the outcome is `WALKED`."""
    end = state.copy() if outcome is Outcome.WALKED else np.zeros(0)
    return TrialRun(outcome.label, end, int(counts[RHS]), int(counts[ACCEPTED]), int(counts[REJECTED]))


# near-rigid contact: factors on stiffness and damping, and on creep velocities
STIFFNESS_FACTOR = 100.0
CREEP_FACTOR = 0.01


def contact_trial(
    config: ContactConfig, state: State, length_m: float, steps: int, asymmetry: float = 0.0
) -> ContactTrial:
    """Set up the walk with the config's contact, on pads of length `length_m`. `asymmetry` as in `contact_scene`."""
    scene = contact_scene(config, length_m, length_m, asymmetry)
    return ContactTrial(scene.walker, scene.ground, start_state(scene, state), steps, "contact")


def stiff_ground_trial(config: ContactConfig, state: State, length_m: float, steps: int) -> ContactTrial:
    """Set up a walk that is harder to integrate: on much stiffer ground with less creep."""
    trial = contact_trial(config, state, length_m, steps)
    friction = trial.walker.friction.scale_creep(CREEP_FACTOR)
    normal = trial.walker.normal.stiffen(STIFFNESS_FACTOR, STIFFNESS_FACTOR, 1.0)
    return replace(trial, walker=trial.walker._replace(normal=normal, friction=friction), name="contact-near-rigid")


TAYLOR_METHOD = "heyoka-taylor"


def has_heyoka() -> bool:
    return importlib.util.find_spec("heyoka") is not None


def walk_by_taylor(walker: RigidWalker, start: tuple[float, ...], steps: int) -> Floats | None:
    """Return the state after `steps` heel strikes, or None if one of them does not occur."""
    limit = 10.0 * np.sqrt(walker.leg_length / walker.gravity)
    passing, striking = taylor_integrators(walker)
    state = np.array(start)
    for _ in range(steps):
        # Both feet are also on the slope at the start, so the search for the heel strike begins when the legs have
        # passed.
        for integrator in (passing, striking) if state[0] < state[1] else (striking,):
            integrator.time, integrator.state[:] = 0.0, state
            # For a while after an event heyoka does not look for it again, even if time and state have been replaced.
            integrator.reset_cooldowns()
            outcome = integrator.propagate_until(limit)[0]
            if outcome.value >= 0 or abs(integrator.time) >= limit:
                return None
            state = np.array(integrator.state)
        state = np.array(impact(walker, *state.tolist()))
    return state


def taylor_integrators(walker: RigidWalker) -> tuple[Any, Any]:
    """Build two Taylor integrators of the swing phase: one stops when the legs pass, the other at heel strike."""
    import heyoka as hy

    th1, th2, w1, w2 = hy.make_vars("th1", "th2", "w1", "w2")
    L, a, m, M = walker.leg_length, walker.foot_to_mass, walker.leg_mass, walker.hip_mass
    b = L - a
    g = walker.gravity
    inertia = walker.leg_inertia
    d11 = m * b * b + inertia
    d22 = M * L * L + m * (L * L + a * a) + inertia
    d12 = -m * L * b * hy.cos(th2 - th1)
    r1 = -m * L * b * w2 * w2 * hy.sin(th2 - th1) - m * g * b * hy.sin(th1)
    r2 = -walker.c21_sign * m * L * b * w1 * w1 * hy.sin(th2 - th1) + (M * L + m * (a + L)) * g * hy.sin(th2)
    determinant = d11 * d22 - d12 * d12
    equations = [
        (th1, w1),
        (th2, w2),
        (w1, (d22 * r1 - d12 * r2) / determinant),
        (w2, (d11 * r2 - d12 * r1) / determinant),
    ]
    upward = hy.event_direction.positive
    downward = hy.event_direction.negative
    passing = hy.t_event(th1 - th2, direction=upward)
    striking = hy.t_event(th1 + th2 + 2.0 * walker.slope, direction=downward)
    return tuple(hy.taylor_adaptive(equations, [0.0] * 4, t_events=[event]) for event in (passing, striking))


REFERENCE_RUN_BUDGET = 20_000_000  # right-hand sides, enough for the million explicit steps that stiff ground takes
# On stiff ground the error of an explicit step is only rounding, so a tighter tolerance would only shrink the step.
TIGHTEST_CONTACT = {"dop853": 1e-12, "radau5": 1e-11}
TIGHTEST_RIGID = {"dop853": 1e-14, "radau5": 1e-12}

END_METHODS = (TAYLOR_METHOD, *METHODS)


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
    def unpack(cls, numbers: Numbers) -> "End":
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
        return self.first.method == TAYLOR_METHOD

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
    return trial.compass if isinstance(trial, RigidTrial) and has_heyoka() else None


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
