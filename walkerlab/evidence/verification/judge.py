"""Judge the walks of cases, and try ordinary methods on the same cases.

Each walk is repeated with a ten times tighter tolerance, with another method and for a scaled twin of the walker.

The ordinary methods are those of SciPy at default tolerances, and that of game engines with fixed steps. They treat a
contact scene as one differential equation without events, as would a user who does not know of switching points and
pad edges. They integrate it to the end of our walk, which is recomputed at a tight tolerance for the comparison.
A rigid scene is simulated by a user's script with an event function.
"""

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from walkerlab.config.analyses import Case
from walkerlab.config.reads import RigidConfig, WalksConfig
from walkerlab.config.schema import Config
from walkerlab.config.walkers import is_passive_compass
from walkerlab.evidence.benchmarks.trials import walk_as_a_script
from walkerlab.evidence.paper.appendix_a import RigidWalker, compass_or_none
from walkerlab.evidence.verification.catalogue import config_of, pendulum_time, scale_config, to_twin
from walkerlab.evidence.verification.starts import ContactStart, JudgedWalk, RigidStart, Start, prepare_start
from walkerlab.evidence.verification.verdict import (
    BUDGET_USED,
    CaseResult,
    Measure,
    NotMeasured,
    allowed_difference,
    finite,
)
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.on_pads import OnPads
from walkerlab.physics.ground.walker import place_on_ground
from walkerlab.physics.hybrid.contact_result import ContactWalkResult
from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult
from walkerlab.physics.solvers.registry import METHODS, Method, Tolerances, method_named
from walkerlab.physics.solvers.scipy_methods import OutOfBudgetError, counting_rhs
from walkerlab.physics.solvers.semi_implicit_euler import DIVERGED, semi_implicit_euler
from walkerlab.physics.solvers.stepping import RHS, new_counts
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.run.workers import map_in_order

MAX_ORDINARY_EVALUATIONS: Final = 20_000  # right-hand sides
FINE_ERROR: Final = 1e-2  # largest error of a result that counts as fine, in leg lengths, rad and pendulum times
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
    verdict: str  # "fine", "wrong silently", "gives up" or "diverges"
    error: float | None  # error of the final state, or None if the method gave up or diverged
    rhs_evaluations: int
    wall_s: float


def choices(case: Case, config: WalksConfig) -> tuple[Choice, ...]:
    """Simulate a case with every ordinary method.

    Return () for a walker other than a passive compass, for a case without a start or without motion, and for ground
    that needs events (a pinned foot, or `after-mid-swing`).
    """
    # Knee locks are events, which ordinary methods do not handle, and the script for rigid scenes covers only the
    # walker of Appendix A.
    if not is_passive_compass(config):
        return ()
    changes = {"steps": min(case.steps, COMPARED_STEPS), "budget": max(case.budget, MIN_REFERENCE_BUDGET)}
    short = case.model_copy(update=changes)
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
    """End of a case's walk, with which the results of other methods are compared."""

    case: str
    time_s: float
    state: Floats
    units: Floats  # unit in which the error of each component of the state is measured

    def judge_end(self, method: str, y: Floats | None, count: int, wall_s: float) -> Choice:
        """Judge a method by its end state.

        y      end state, or None if the method did not reach it
        count  right-hand sides that the method evaluated
        """
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
    """Suppress the warnings of libraries, and the exceptions that they raise when they fail."""
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
    """Simulate a contact scene by semi-implicit Euler, with at most `cap` steps of size h (s)."""
    system = OnPads(place_on_ground(ready.scene.walker, (True, True)), ready.scene.ground.terrain)
    y = np.array(ready.start)
    began = time.perf_counter()
    steps = int(semi_implicit_euler(system, y, np.empty_like(y), arrival.time_s, h, cap))
    wall_s = time.perf_counter() - began
    # Even if the number of steps is just enough, rounding can leave their sum a little short. That must not count as
    # giving up.
    late = steps == cap and steps * h < arrival.time_s * (1.0 - 1e-9) and bool(np.all(np.abs(y) < DIVERGED))
    return arrival.judge_end(f"semi-implicit Euler, {h:g} s", None if late else y, steps, wall_s)


TIGHTER_FACTOR = 0.1
SAMPLED_STEPS = 100  # walks of more steps are not sampled
LIBRARY_METHODS: Final = ("scipy-bdf", "scipy-radau")
"""Methods of libraries, tried if ours fail. The multistep method comes first, because ours are one-step methods."""
LIBRARY_BUDGET: Final = 30_000  # right-hand sides, few because the solvers of libraries run in Python


@dataclass(frozen=True)
class Second:
    """Walk of a case with a second method."""

    method: str  # empty if no method reached an answer
    walk: JudgedWalk | None
    tried: str  # failed methods with their outcomes, or the reason why none was tried


@dataclass(frozen=True)
class CaseCell:
    """A case to judge and to simulate with ordinary methods. This may happen in another process."""

    case: Case
    config: Config | None = None  # config of a variation of a scene, or None if the case changes the paper config

    def run(self) -> tuple[CaseResult | Choice, ...]:
        """Return the judgement, then the results of the ordinary methods."""
        config = self.config or config_of(self.case)
        return (judge(self.case, config), *choices(self.case, config))


def run_cells(cells: Sequence[CaseCell], jobs: int) -> Iterator[tuple[CaseResult | Choice, ...]]:
    """Yield the results in the order of the cases.

    One case per model runs first, so that only one process compiles. The others start in order of decreasing budget.
    """
    models = [cell.case.model for cell in cells]
    first = [models.index(model) for model in ("contact", "rigid") if model in models]
    return map_in_order([cell.run for cell in cells], jobs, first, lambda place: -cells[place].case.budget)


def judge(case: Case, config: Config) -> CaseResult:
    """Simulate a case and judge its walk. Walks of more than `SAMPLED_STEPS` steps are not sampled."""
    about = case.name, case.family, case.model, case.reason, case.expected
    start = prepare_start(config, case)
    if start is None:
        return CaseResult(*about, outcome=Outcome.REJECTED.label, second_tried="no start exists")
    methods = start.tolerances(case)
    began = time.perf_counter()
    walk = start.walk(case, methods, sampled=case.steps <= SAMPLED_STEPS)
    wall_s = time.perf_counter() - began
    findings: list[Measure | NotMeasured] = [
        Measure("number of values that are not finite", float(np.count_nonzero(~np.isfinite(walk.numbers))), 0.0),
        Measure(f"{start.residual_name} over energy", finite(walk.residual_J / start.energy), case.balance),
        Measure(BUDGET_USED, walk.rhs_evaluations / case.budget, 1.0 + 20.0 / case.budget),
        *start.measures(walk, case),
    ]
    remarks: list[str] = []
    second = Second("", None, f"the walk itself ended as {walk.outcome.label}")
    if walk.outcome.answered:
        short = start.repeated_case(case)

        def repeat(method: Method, budget: int) -> JudgedWalk:
            return start.walk(short, replace(methods, method=method.name, budget=budget))

        second = second_walk(methods.method, case.budget, repeat)
        for what, again in repeat_walks(start, config, short, second):
            findings += time_difference(what, walk, again, case, methods.rtol)
            differs = again.outcome is not walk.outcome and again.outcome.label not in case.expected
            # A shortened walk may end differently just because it is shorter.
            if differs and short.steps == case.steps:
                remarks.append(f"{what}: {again.outcome.label}, not {walk.outcome.label}")
    if isinstance(start, ContactStart):
        findings.append(start.momentum(walk, case))
    numbers = int(walk.touches.size), finite(walk.residual_J), walk.rhs_evaluations, wall_s
    measures = tuple(finding for finding in findings if isinstance(finding, Measure))
    missing = tuple(finding for finding in findings if isinstance(finding, NotMeasured))
    second_walked = second.method, second.tried
    return CaseResult(*about, walk.outcome.label, *numbers, measures, tuple(remarks), *second_walked, missing)


def repeat_walks(start: Start, config: Config, case: Case, second: Second) -> list[tuple[str, JudgedWalk]]:
    """Repeat a walk in ways that must lead to the same times, and return pairs (description, walk)."""
    again = [("the walk with ten times tighter tolerance", start.walk(case, start.tolerances(case, TIGHTER_FACTOR)))]
    if second.walk is not None:
        again.append((f"the walk with {second.method}", second.walk))
    if case.twin:
        scale = to_twin(config)
        twin_case = case.model_copy(update={"lowered_m": case.lowered_m * scale.length})
        if (twin := prepare_start(scale_config(config, scale), twin_case)) is not None:
            again.append(("the walk of the twin", twin.walk(case, twin.tolerances(case))))
    return again


def time_difference(what: str, first: JudgedWalk, second: JudgedWalk, case: Case, rtol: float) -> list[Measure]:
    """Compare the touch times of two walks, or the end times if one of them has no touch.

    Return an empty list if an end time is needed and missing.
    """
    if steps := min(first.touches.size, second.touches.size, case.compared_steps):
        difference = float(np.max(np.abs(first.touches[:steps] - second.touches[:steps])))
    elif first.end is None or second.end is None:
        return []
    else:
        difference = abs(first.end - second.end)
    limit = allowed_difference(case, rtol, first.accepted + second.accepted)
    return [Measure(f"difference in time from {what}, in pendulum times", finite(difference), limit)]


def other_methods(configured: str) -> tuple[Method, ...]:
    """Return the methods to try instead of the configured one: ours first, then the libraries'."""
    ours = [name for name, method in METHODS.items() if method.compiled]
    return tuple(method_named(name) for name in dict.fromkeys((*ours, *LIBRARY_METHODS)) if name != configured)


def second_walk(configured: str, budget: int, walk: Callable[[Method, int], JudgedWalk]) -> Second:
    """Simulate a walk with other methods until one of them succeeds.

    budget  maximum number of right-hand-side evaluations, which may be lower for libraries
    walk    function that simulates the walk with a method and a budget
    """
    tried: list[str] = []
    for method in other_methods(configured):
        result = walk(method, budget if method.compiled else min(budget, LIBRARY_BUDGET))
        if result.outcome.answered:
            return Second(method.name, result, ", ".join(tried))
        tried.append(f"{method.name} {result.outcome.label}")
    return Second("", None, ", ".join(tried))
