"""What an ordinary choice does with the same scenes: SciPy at its default tolerance, a game engine's fixed step.

The contact scene as one ordinary differential equation without events, as one writes it down who knows nothing of
switching points and pads' flanks, integrated to where the walk of this project ends, and compared with that walk at a
sharp tolerance, whatever the case asks for. The rigid scene as a script of one's own, with an event function.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.benchmarks.user_script import walk_as_a_script
from walkerlab.config.reads import RigidConfig, WalksConfig
from walkerlab.config.stability import Case
from walkerlab.config.walkers import is_plain_compass
from walkerlab.ground.on_pads import OnPads
from walkerlab.hybrid.contact_run import MethodSettings
from walkerlab.hybrid.recorded_walk import RecordedWalk, take_walk
from walkerlab.paper.appendix_a import RigidWalker
from walkerlab.solvers.registry import method_named
from walkerlab.solvers.scipy_methods import entry_point, right_hand_side
from walkerlab.solvers.semi_implicit_euler import RUNAWAY, semi_implicit_euler
from walkerlab.verification.contact_case import walked_with
from walkerlab.verification.contact_start import ContactStart, prepared
from walkerlab.verification.rigid_case import prepared as rigid_prepared
from walkerlab.verification.scaling import pendulum_time
from walkerlab.verification.verdict import finite

CAP: Final = 20_000  # right-hand sides
FINE: Final = 1e-2  # of a leg, of a radian, of their rates in pendulum times
SCIPY_DEFAULT: Final = (1e-3, 1e-6)  # tolerances of solve_ivp
RUNS_AWAY: Final = 10.0  # the same
STEPS: Final = 2
LIBRARY: Final = ("RK45", "LSODA", "Radau")
FIXED_STEPS_S: Final = (1e-3, 1e-4)
REFERENCE: Final = ("radau5", 1e-8, 1e-10)  # method, rtol, atol
REFERENCE_BUDGET: Final = 1_000_000  # at least
RIGID_REFERENCE: Final = ("dop853", 1e-12, 1e-14)


@dataclass(frozen=True)
class Choice:
    """One method on one case.

    verdict  fine, wrong silently, gives up, diverges
    error    of the state at the end; None if it did not get there
    """

    case: str
    method: str
    verdict: str
    error: float | None
    rhs_evaluations: int
    wall_s: float


class CapReachedError(Exception):
    """The evaluations are used up."""


def choices(case: Case, config: WalksConfig) -> tuple[Choice, ...]:
    """Every ordinary method on a case; none if it has no start or moves nowhere, or is another walker than a compass.

    A script without events describes no knee that locks, and Appendix A no other walker than the compass.
    """
    if not is_plain_compass(config.walker):
        return ()
    short = case.model_copy(update={"steps": min(case.steps, STEPS), "budget": max(case.budget, REFERENCE_BUDGET)})
    return rigid_choices(short, config) if case.model == "rigid" else contact_choices(short, config)


def contact_choices(case: Case, config: WalksConfig) -> tuple[Choice, ...]:
    """Every ordinary method on a case of the contact model; none if no equation without events describes it."""
    ready = prepared(config, case)
    if ready is None or ready.scene.pinned is not None or ready.scene.terrain.order_matters:
        return ()
    name, rtol, atol = REFERENCE
    walk = walked_with(MethodSettings(method_named(name), rtol, atol, case.budget), ready, case)
    end, reference = walk.end_time_s, np.array(walk.end_state)
    if end == 0.0:
        return ()
    units = natural_units(config)
    found = [library(case.name, name, ready, end, reference, units) for name in LIBRARY]
    found += [fixed(case.name, h, ready, end, reference, units) for h in FIXED_STEPS_S]
    return tuple(found)


def rigid_choices(case: Case, config: WalksConfig) -> tuple[Choice, ...]:
    """SciPy's methods in a script that walks a case of the rigid model, after as many steps as it takes."""
    ready = rigid_prepared(config)
    if ready is None or ready.compass is None:
        return ()
    name, rtol, atol = RIGID_REFERENCE
    walk = take_walk(
        ready.walker, method_named(name).new(len(ready.walker.blank), rtol, atol, case.budget), ready.start, case.steps
    )
    if not walk.steps:
        return ()
    units = np.array([1.0, 1.0, *[1.0 / pendulum_time(config)] * 2])
    return tuple(script(case.name, name, ready.compass, walk, units) for name in LIBRARY)


def script(case: str, method: str, compass: RigidWalker, walk: RecordedWalk, units: NDArray[np.float64]) -> Choice:
    """A method of SciPy's solve_ivp with nothing but its name given, its event function at every heel strike."""
    began = time.perf_counter()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            y, count = walk_as_a_script(compass, walk.start, walk.steps, *SCIPY_DEFAULT, CAP, method)
        except (ValueError, np.linalg.LinAlgError):
            y, count = None, CAP
    wall_s = time.perf_counter() - began
    return judged(case, f"SciPy {method}", y, np.array(walk.final_state), units, count, wall_s)


def natural_units(config: RigidConfig) -> NDArray[np.float64]:
    """What each number of the state is measured in: legs, radians, and these in pendulum times."""
    lengths = np.array([config.walker.leg_length_m] * 2 + [1.0] * 2)
    return np.concatenate([lengths, lengths / pendulum_time(config)])


def library(
    case: str, method: str, ready: ContactStart, end: float, reference: NDArray[np.float64], units: NDArray[np.float64]
) -> Choice:
    """A method of SciPy's solve_ivp with nothing but its name given."""
    from scipy.integrate import solve_ivp

    system = OnPads(ready.scene.walker, ready.scene.terrain)
    start = np.array(ready.start)
    code = entry_point(right_hand_side, system, 0.0, start, start)
    count = 0

    def fun(t: float, y: Any) -> Any:
        nonlocal count
        if count >= CAP:
            raise CapReachedError
        count += 1
        rate = np.empty(y.size)
        code(system, float(t), np.ascontiguousarray(y), rate)
        return rate

    began = time.perf_counter()
    y = None
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            solution = solve_ivp(fun, (0.0, end), start, method=method)
        if solution.success:
            y = solution.y[:, -1]
    except (CapReachedError, ValueError, np.linalg.LinAlgError):
        pass
    wall_s = time.perf_counter() - began
    return judged(case, f"SciPy {method}", y, reference, units, count, wall_s)


def fixed(
    case: str,
    h: float,
    ready: ContactStart,
    end: float,
    reference: NDArray[np.float64],
    units: NDArray[np.float64],
    cap: int = CAP,
) -> Choice:
    """Semi-implicit Euler with a fixed step, at most `cap` of them."""
    system = OnPads(ready.scene.walker, ready.scene.terrain)
    y = np.array(ready.start)
    began = time.perf_counter()
    taken = int(semi_implicit_euler(system, y, np.empty_like(y), end, h, cap))
    wall_s = time.perf_counter() - began
    arrived: NDArray[np.float64] | None = y
    if taken == cap and taken * h < end * (1.0 - 1e-9) and bool(np.all(np.abs(y) < RUNAWAY)):
        arrived = None
    return judged(case, f"semi-implicit Euler, {h:g} s", arrived, reference, units, taken, wall_s)


def judged(
    case: str,
    method: str,
    y: NDArray[np.float64] | None,
    reference: NDArray[np.float64],
    units: NDArray[np.float64],
    count: int,
    wall_s: float,
) -> Choice:
    """What is to be said of where a method arrived; it says none of that itself."""
    if y is None:
        return Choice(case, method, "gives up", None, count, wall_s)
    error = finite(float(np.max(np.abs((y - reference) / units))))
    scale = max(1.0, float(np.max(np.abs(reference / units))))
    if error > RUNS_AWAY * scale or float(np.max(np.abs(y[: y.size // 2]))) >= RUNAWAY:
        return Choice(case, method, "diverges", None, count, wall_s)
    return Choice(case, method, "fine" if error <= FINE * scale else "wrong silently", error, count, wall_s)
