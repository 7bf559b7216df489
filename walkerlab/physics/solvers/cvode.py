"""CVODE of SUNDIALS with the interface of SciPy's solvers.

Optional (extra `cvode`, package scikit-sundae). Source: Hindmarsh and others, SUNDIALS, ACM TOMS 31 (2005) 363-396.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np

SUNDIALS_PACKAGE = "sksundae"
# CVODE needs an end time to choose its first step. An event ends the walk long before that time.
FAR_AHEAD = 1e3


def is_installed() -> bool:
    return importlib.util.find_spec(SUNDIALS_PACKAGE) is not None


class CvodeSolver:
    """CVODE integrator that advances step by step, with the fields and methods of `scipy.integrate.OdeSolver`."""

    def __init__(
        self,
        family: str,
        fun: Callable[[float, Any], Any],
        t: float,
        y: Any,
        _t_bound: float,
        jac: Callable[[float, Any], Any],
        **tolerances: float,
    ) -> None:
        from sksundae.cvode import CVODE

        # Pass copies, because CVODE's arrays must not be written to.
        def rate(t: float, y: Any, dy: Any) -> None:
            dy[:] = fun(t, np.array(y))

        def slopes(t: float, y: Any, _dy: Any, J: Any) -> None:
            J[:, :] = jac(t, np.array(y))

        self.solver = CVODE(rate, method=family, jacfn=slopes, **tolerances)
        self.solver.init_step(t, y)
        self.t_old = t
        self.t = t
        self.y = y
        self.status = "running"
        self.interpolated = False

    def step(self) -> None:
        if self.interpolated:
            # After interpolation, CVODE must first return to the end of the step.
            self.solver.step(self.t, "normal", None)
            self.interpolated = False
        ahead = self.solver.step(self.t + FAR_AHEAD, "onestep", None)
        if not ahead.success:
            self.status = "failed"
            return
        self.t_old = self.t
        self.t = float(ahead.t)
        self.y = ahead.y

    def dense_output(self) -> Callable[[Any], Any]:
        """Return CVODE's interpolating polynomial of the last step, valid until the next step."""
        return self.interpolate

    def interpolate(self, times: Any) -> Any:
        """Evaluate the state (n,) at one time (s), or states (n, times) at several."""
        self.interpolated = True
        if np.ndim(times) == 0:
            return self.state_at(float(times))
        return np.column_stack([self.state_at(time) for time in times.tolist()])

    def state_at(self, time: float) -> Any:
        return self.solver.step(time, "normal", None).y
