"""CVODE of SUNDIALS with the interface of SciPy's solvers, so that both stand behind the same functions.

Optional (extra `cvode`, package scikit-sundae). Hindmarsh and others: SUNDIALS, ACM TOMS 31 (2005) 363-396.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np

PACKAGE = "sksundae"
# CVODE asks where the walk is going to choose its first step; an event ends the walk long before
FAR_AHEAD = 1e3


def is_installed() -> bool:
    """Whether CVODE can be imported."""
    return importlib.util.find_spec(PACKAGE) is not None


class CvodeSolver:
    """One integration, step by step; fields and methods as of `scipy.integrate.OdeSolver`."""

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
        """Start at time t from y.

        family      "BDF" or "Adams"
        tolerances  rtol and atol
        """
        from sksundae.cvode import CVODE

        # arrays of CVODE's own memory, which may not be written to
        def rate(t: float, y: Any, dy: Any) -> None:
            dy[:] = fun(t, np.array(y))

        def slopes(t: float, y: Any, _dy: Any, J: Any) -> None:
            J[:, :] = jac(t, np.array(y))

        self.solver = CVODE(rate, method=family, jacfn=slopes, **tolerances)
        self.solver.init_step(t, y)
        self.t_old, self.t, self.y = t, t, y
        self.status = "running"
        self.looked_back = False

    def step(self) -> None:
        """Take one step of CVODE's own choice."""
        if self.looked_back:
            # CVODE first returns to the end of its step
            self.solver.step(self.t, "normal", None)
            self.looked_back = False
        ahead = self.solver.step(self.t + FAR_AHEAD, "onestep", None)
        if not ahead.success:
            self.status = "failed"
            return
        self.t_old, self.t, self.y = self.t, float(ahead.t), ahead.y

    def dense_output(self) -> LastStep:
        """The solution within the last step, until the next one is taken."""
        return LastStep(self)


class LastStep:
    """CVODE's own interpolating polynomial, which it keeps for the last step."""

    def __init__(self, of: CvodeSolver) -> None:
        """The last step of a solver."""
        self.of = of

    def __call__(self, times: Any) -> Any:
        """States (n,) at a time, or (n, times) at several."""
        self.of.looked_back = True
        if np.ndim(times) == 0:
            return self.at(float(times))
        return np.column_stack([self.at(time) for time in times.tolist()])

    def at(self, time: float) -> Any:
        """The state (n,) at a time of the step."""
        return self.of.solver.step(time, "normal", None).y
