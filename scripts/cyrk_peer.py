"""Time ten rigid steps in CyRK, whose integrators, dense output and events are compiled C++, and in walkerlab.

    pip install CyRK==0.20.0 && python scripts/cyrk_peer.py

Both use a compiled right-hand side. CyRK calls it and the event functions, which numba has compiled, through Python.
The impact is a Python function. Each method runs at the loosest tolerance, in half decades, whose end state is correct
to 1e-9 rad and rad/s. The script prints medians of processor times, their ratio, and the errors.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import CyRK
import numba
import numpy as np
from benchmark import BUDGET, printed_trial

from walkerlab.evidence.paper.appendix_a import impact

# Rounded from two references that agree to 1e-36, see docs/numerics.md.
REFERENCE = np.array([-0.204388204282412, 0.169481619242526, -0.606147299375954, -0.861660164829674])
ALLOWED = 1e-9
TOLERANCES = 10.0 ** np.arange(-4.0, -13.5, -0.5)
SAMPLES = 15


def compiled_problem(compass: Any) -> tuple[Any, Any]:
    """Return the compass's right-hand side and heel-strike function, compiled with numba."""
    L, a, m, M = compass.leg_length, compass.foot_to_mass, compass.leg_mass, compass.hip_mass
    b, g, slope, inertia, sign = L - a, compass.gravity, compass.slope, compass.leg_inertia, compass.c21_sign

    @numba.njit(error_model="numpy")
    def right_hand_side(dy: Any, _t: float, y: Any) -> None:
        sine, cosine = np.sin(y[1] - y[0]), np.cos(y[1] - y[0])
        swing, coupling, stance = m * b**2 + inertia, -m * L * b * cosine, M * L**2 + m * (L**2 + a**2) + inertia
        first = -m * L * b * sine * y[3] ** 2 - m * g * b * np.sin(y[0])
        second = -sign * m * L * b * sine * y[2] ** 2 + (M * L + m * (a + L)) * g * np.sin(y[1])
        determinant = swing * stance - coupling**2
        dy[0], dy[1] = y[2], y[3]
        dy[2] = (stance * first - coupling * second) / determinant
        dy[3] = (swing * second - coupling * first) / determinant

    @numba.njit
    def strike(y: Any) -> float:
        return y[0] + y[1] + 2.0 * slope if y[0] > y[1] else 1.0

    def event(_t: float, y: Any, *_: Any) -> float:
        return float(strike(np.asarray(y)))

    event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    return right_hand_side, event


def cyrk_walk(trial: Any, method: str, rtol: float) -> Callable[[], Any]:
    """Return a function that simulates the steps with CyRK and returns the state at their end."""
    right_hand_side, event = compiled_problem(trial.compass)
    limit = 10.0 * np.sqrt(trial.compass.leg_length / trial.compass.gravity)

    def walk() -> Any:
        state = np.array(trial.start)
        for _ in range(trial.steps):
            swing = CyRK.pysolve_ivp(
                right_hand_side, (0.0, limit), state, method=method, rtol=rtol, atol=0.01 * rtol, events=[event],
                pass_dy_as_arg=True,
            )  # fmt: skip
            state = np.array(impact(trial.compass, *np.asarray(swing.y)[:, -1].tolist()))
        return state

    return walk


def our_walk(trial: Any, rtol: float) -> Callable[[], Any]:
    run = trial.prepare("dop853", rtol, BUDGET)
    return lambda: run().state


def seconds(walk: Callable[[], Any]) -> float:
    """Return the median processor time (s) of a call."""
    times = []
    for _ in range(SAMPLES):
        began = time.process_time()
        walk()
        times.append(time.process_time() - began)
    return float(np.median(times))


def main() -> None:
    trial = printed_trial()
    peers = {"walkerlab dop853": lambda rtol: our_walk(trial, rtol)}
    for method in ("DOP853", "RADAU"):
        peers[f"CyRK {CyRK.__version__} {method}"] = lambda rtol, method=method: cyrk_walk(trial, method, rtol)
    ours = None
    for name, at in peers.items():
        for rtol in TOLERANCES:
            state = at(rtol)()
            error = float(np.abs(state - REFERENCE).max()) if state.size == 4 else np.inf
            if error <= ALLOWED:
                took = seconds(at(rtol))
                ours = took if ours is None else ours
                print(f"{name:22} rtol {rtol:.1e}: {took * 1e3:8.3f} ms, error {error:.1e}, {took / ours:.1f} x")
                break
        else:
            print(f"{name:22} reaches no error below {ALLOWED:g}")


if __name__ == "__main__":
    main()
