"""Registry of integration methods, and the tolerances of an integration."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from walkerlab.physics.solvers import cvode
from walkerlab.physics.solvers.dop853 import new_dop853
from walkerlab.physics.solvers.events import CrossingFinder, new_crossing_finder
from walkerlab.physics.solvers.radau5 import new_radau5
from walkerlab.physics.solvers.scipy_methods import DENSE_DEGREE, ScipyMethod


@dataclass(frozen=True)
class Method:
    name: str  # name in configs
    # factory, called with the number of equations, rtol, atol and the budget of right-hand sides
    new: Callable[[int, float, float, int], Any]
    stiff: bool  # whether the method suits stiff problems
    orders: tuple[int, int]  # minimum and maximum order, which are equal unless the method varies its order
    compiled: bool = False  # whether whole walks are compiled. With another library's method they run in Python


def scipy_factory(class_name: str, takes_jacobian: bool = True) -> Callable[[int, float, float, int], ScipyMethod]:
    """Return a factory for methods that use a class of scipy.integrate, with or without the Jacobian."""
    # SciPy is imported on first use.

    def new_solver(*problem: Any, **options: Any) -> Any:
        from scipy import integrate

        return getattr(integrate, class_name)(*problem, **options)

    return partial(ScipyMethod, new_solver, takes_jacobian)


def cvode_factory(family: str) -> Callable[[int, float, float, int], ScipyMethod]:
    """Return a factory for methods that use one of CVODE's families, "BDF" or "Adams"."""
    return partial(ScipyMethod, partial(cvode.CvodeSolver, family), True)


BUILT_IN_METHODS = (
    Method("dop853", new_dop853, stiff=False, orders=(8, 8), compiled=True),
    Method("radau5", new_radau5, stiff=True, orders=(5, 5), compiled=True),
)
SCIPY_METHODS = (
    Method("scipy-rk45", scipy_factory("RK45", takes_jacobian=False), stiff=False, orders=(5, 5)),
    Method("scipy-dop853", scipy_factory("DOP853", takes_jacobian=False), stiff=False, orders=(8, 8)),
    Method("scipy-lsoda", scipy_factory("LSODA"), stiff=True, orders=(1, 12)),
    Method("scipy-radau", scipy_factory("Radau"), stiff=True, orders=(5, 5)),
    Method("scipy-bdf", scipy_factory("BDF"), stiff=True, orders=(1, 5)),
)
CVODE_METHODS = (
    Method("cvode-bdf", cvode_factory("BDF"), stiff=True, orders=(1, 5)),
    Method("cvode-adams", cvode_factory("Adams"), stiff=False, orders=(1, 12)),
)
METHODS = {
    method.name: method
    for method in (*BUILT_IN_METHODS, *SCIPY_METHODS, *(CVODE_METHODS if cvode.is_installed() else ()))
}


def method_named(name: str) -> Method:
    """Return a method by name.

    Raises KeyError for an unknown name, with a list of all names.
    """
    if name in METHODS:
        return METHODS[name]
    if any(method.name == name for method in CVODE_METHODS):
        raise KeyError(f"{name} needs CVODE, which is not installed: pip install scikit-sundae")
    raise KeyError(f"no method named {name!r}; methods: {', '.join(METHODS)}")


ENDLESS = 2**62
"""Budget that is never exhausted, for walks that limit the right-hand-side evaluations per step rather than per
walk."""


@dataclass(frozen=True)
class Tolerances:
    """Method and tolerances of a walk's integration."""

    method: str  # name of the method
    # rtol, atol: tolerances on the error of a step
    rtol: float
    atol: float
    budget: int  # right-hand sides per walk
    # whether to check the energy balance of a contact walk. Comparisons of methods do not need this check
    track_energy: bool = True

    @property
    def compiled(self) -> bool:
        return method_named(self.method).compiled

    def new(self, n: int) -> Any:
        return method_named(self.method).new(n, self.rtol, self.atol, self.budget)


def share_counts(method: Any, clock: Any, counts: Any) -> Any:
    """Return the method with the clock and counts of another method, so that they can take turns
    integrating the same walk."""
    if isinstance(method, ScipyMethod):
        method.clock = clock
        method.counts = counts
        return method
    return method._replace(clock=clock, counts=counts)


def dense_degree(method: Any) -> int:
    return DENSE_DEGREE if isinstance(method, ScipyMethod) else len(method.dense)


def finder_for(method: Any, event_functions: int, state_size: int) -> CrossingFinder:
    return new_crossing_finder(dense_degree(method), event_functions, state_size)
