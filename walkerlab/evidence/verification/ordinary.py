"""Ordinary methods on the same cases: SciPy at its default tolerances, and a game engine's method with fixed steps.

A contact scene is one differential equation without events, like that of a user unaware of switching points and pad
edges. It is integrated up to the end of our own walk, which is recomputed at a tight tolerance for the comparison.
A rigid scene is run by a user's script with an event function.
"""

import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Final

import numpy as np

from walkerlab.config.analyses import Case
from walkerlab.config.reads import RigidConfig, WalksConfig
from walkerlab.config.walkers import is_passive_compass
from walkerlab.evidence.benchmarks.trials import walk_as_a_script
from walkerlab.evidence.paper.appendix_a import RigidWalker
from walkerlab.evidence.paper.walker import compass_or_none
from walkerlab.evidence.verification.catalogue import pendulum_time
from walkerlab.evidence.verification.starts import ContactStart, RigidStart, prepare_start
from walkerlab.evidence.verification.verdict import finite
from walkerlab.physics.ground.on_pads import OnPads
from walkerlab.physics.ground.walker import place_on_ground
from walkerlab.physics.hybrid.contact_result import ContactWalkResult
from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.scipy_methods import OutOfBudgetError, counting_rhs
from walkerlab.physics.solvers.semi_implicit_euler import DIVERGED, semi_implicit_euler
from walkerlab.physics.solvers.stepping import RHS, new_counts
from walkerlab.physics.solvers.system import Floats

MAX_ORDINARY_EVALUATIONS: Final = 20_000  # right-hand sides
FINE_ERROR: Final = 1e-2  # largest error of a fine result, in leg lengths, rad and pendulum times
SCIPY_DEFAULT: Final = (1e-3, 1e-6)  # default rtol and atol of solve_ivp
DIVERGED_ERROR: Final = 10.0  # error above which a result has diverged, in the same units
COMPARED_STEPS: Final = 2
SCIPY_CHOICES: Final = ("RK45", "LSODA", "Radau")
FIXED_STEPS_S: Final = (1e-3, 1e-4)
REFERENCE_SETTINGS: Final = ("radau5", 1e-8, 1e-10)  # method, rtol, atol
MIN_REFERENCE_BUDGET: Final = 1_000_000  # right-hand sides
RIGID_REFERENCE_SETTINGS: Final = ("dop853", 1e-12, 1e-14)


@dataclass(frozen=True)
class Choice:
    """Result of one method on one case."""

    case: str
    method: str
    verdict: str  # fine, wrong silently, gives up, diverges
    error: float | None  # error of the final state; None if the method gave up or diverged
    rhs_evaluations: int
    wall_s: float


def choices(case: Case, config: WalksConfig) -> tuple[Choice, ...]:
    """Simulate a case by every ordinary method.

    The result is empty for a walker other than a passive compass, for a case without a start or without motion, and for
    ground that needs events (a pinned foot, or `after-mid-swing`).
    """
    # knees need an event to lock, and the script for rigid scenes covers only the walker of Appendix A
    if not is_passive_compass(config):
        return ()
    short = case.model_copy(
        update={"steps": min(case.steps, COMPARED_STEPS), "budget": max(case.budget, MIN_REFERENCE_BUDGET)}
    )
    start = prepare_start(config, short)
    compass = compass_or_none(config, config.equations)
    if isinstance(start, RigidStart) and compass is not None:
        walk = start.walk(short, Tolerances(*RIGID_REFERENCE_SETTINGS, short.budget)).record
        if not walk.steps:
            return ()
        units = np.array([1.0, 1.0, *[1.0 / pendulum_time(config)] * 2])
        arrival = Arrival(case.name, float(walk.touch_time_s[-1]), np.array(walk.final_state), units)
        return tuple(scipy_script(arrival, compass, walk, name) for name in SCIPY_CHOICES)
    if not isinstance(start, ContactStart) or start.scene.pinned or start.scene.ground.terrain.order_matters:
        return ()
    walk = start.walk(short, Tolerances(*REFERENCE_SETTINGS, short.budget)).record
    arrival = arrival_of(case.name, walk, config)
    if arrival.time_s == 0.0:
        return ()
    by_library = [scipy_walk(arrival, start, name) for name in SCIPY_CHOICES]
    return (*by_library, *(euler(arrival, start, h) for h in FIXED_STEPS_S))


@dataclass(frozen=True)
class Arrival:
    """End of a case's walk, the reference for other methods."""

    case: str
    time_s: float
    state: Floats
    units: Floats  # unit of each component of the state

    def judge_end(self, method: str, y: Floats | None, count: int, wall_s: float) -> Choice:
        """Judge a method by its end state y (None if it was not reached) and the `count` of right-hand sides."""
        if y is None:
            return Choice(self.case, method, "gives up", None, count, wall_s)
        error = finite(float(np.max(np.abs((y - self.state) / self.units))))
        scale = max(1.0, float(np.max(np.abs(self.state / self.units))))
        if error > DIVERGED_ERROR * scale or float(np.max(np.abs(y[: y.size // 2]))) >= DIVERGED:
            return Choice(self.case, method, "diverges", None, count, wall_s)
        verdict = "fine" if error <= FINE_ERROR * scale else "wrong silently"
        return Choice(self.case, method, verdict, error, count, wall_s)


def arrival_of(case: str, walk: ContactWalkResult, config: RigidConfig) -> Arrival:
    return Arrival(case, walk.end_time_s, np.array(walk.end_state), natural_units(config))


def natural_units(config: RigidConfig) -> Floats:
    """Return the units of the state's components: leg length and radian, divided by the pendulum time for rates."""
    lengths = np.array([config.walker.leg_length_m] * 2 + [1.0] * 2)
    return np.concatenate([lengths, lengths / pendulum_time(config)])


@contextmanager
def suppress_warnings() -> Iterator[None]:
    """Suppress the libraries' warnings, and the exceptions with which they give up."""
    with (
        warnings.catch_warnings(),
        np.errstate(all="ignore"),
        suppress(OutOfBudgetError, ValueError, np.linalg.LinAlgError),
    ):
        warnings.simplefilter("ignore")
        yield


def scipy_script(arrival: Arrival, compass: RigidWalker, walk: RigidWalkResult, method: str) -> Choice:
    """Simulate a rigid scene with SciPy's solve_ivp at default settings, with an event function for heel strikes."""
    began = time.perf_counter()
    y = None
    count = MAX_ORDINARY_EVALUATIONS
    with suppress_warnings():
        y, count = walk_as_a_script(compass, walk.start, walk.steps, *SCIPY_DEFAULT, MAX_ORDINARY_EVALUATIONS, method)
    return arrival.judge_end(f"SciPy {method}", y, count, time.perf_counter() - began)


def scipy_walk(arrival: Arrival, ready: ContactStart, method: str) -> Choice:
    """Simulate a contact scene with SciPy's solve_ivp at default settings."""
    from scipy.integrate import solve_ivp

    system = OnPads(place_on_ground(ready.scene.walker, (True, True)), ready.scene.ground.terrain)
    start = np.array(ready.start)
    counts = new_counts(MAX_ORDINARY_EVALUATIONS)
    right_hand_side = counting_rhs(counts, system, start.size)
    began = time.perf_counter()
    y = None
    with suppress_warnings():
        solution = solve_ivp(right_hand_side, (0.0, arrival.time_s), start, method=method)
        if solution.success:
            y = solution.y[:, -1]
    return arrival.judge_end(f"SciPy {method}", y, int(counts[RHS]), time.perf_counter() - began)


def euler(arrival: Arrival, ready: ContactStart, h: float, cap: int = MAX_ORDINARY_EVALUATIONS) -> Choice:
    """Simulate a contact scene by semi-implicit Euler with at most `cap` steps of h (s)."""
    system = OnPads(place_on_ground(ready.scene.walker, (True, True)), ready.scene.ground.terrain)
    y = np.array(ready.start)
    began = time.perf_counter()
    steps = int(semi_implicit_euler(system, y, np.empty_like(y), arrival.time_s, h, cap))
    wall_s = time.perf_counter() - began
    # Rounding may leave the sum of just enough steps a little before the end.
    late = steps == cap and steps * h < arrival.time_s * (1.0 - 1e-9) and bool(np.all(np.abs(y) < DIVERGED))
    return arrival.judge_end(f"semi-implicit Euler, {h:g} s", None if late else y, steps, wall_s)
