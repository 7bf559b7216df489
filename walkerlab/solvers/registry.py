"""Every method by name: one list, one signature."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from walkerlab.solvers import cvode
from walkerlab.solvers.dop853 import new_dop853
from walkerlab.solvers.events import CrossingFinder, new_crossing_finder
from walkerlab.solvers.radau5 import new_radau5
from walkerlab.solvers.scipy_methods import DENSE_DEGREE, ScipyMethod


@dataclass(frozen=True)
class Method:
    """An integration method.

    name      as in configs
    new       builds it: (equations, rtol, atol, budget of right-hand sides)
    stiff     whether it is meant for stiff problems
    orders    lowest and highest; the same but for methods that vary it
    compiled  whether whole walks compile with it; a library's method walks in Python
    """

    name: str
    new: Callable[[int, float, float, int], Any]
    stiff: bool
    orders: tuple[int, int]
    compiled: bool = False


def of_scipy(class_name: str, takes_jacobian: bool = True) -> Callable[[int, float, float, int], ScipyMethod]:
    """What builds methods with a class of scipy.integrate, which is loaded where one starts.

    takes_jacobian  whether there is use for the Jacobian
    """

    def new_solver(*problem: Any, **options: Any) -> Any:
        from scipy import integrate

        return getattr(integrate, class_name)(*problem, **options)

    return partial(ScipyMethod, new_solver, takes_jacobian)


def of_cvode(family: str) -> Callable[[int, float, float, int], ScipyMethod]:
    """What builds methods with one of CVODE's families of formulas."""
    return partial(ScipyMethod, partial(cvode.CvodeSolver, family), True)


OWN = (
    Method("dop853", new_dop853, stiff=False, orders=(8, 8), compiled=True),
    Method("radau5", new_radau5, stiff=True, orders=(5, 5), compiled=True),
)
SCIPY = (
    Method("scipy-rk45", of_scipy("RK45", takes_jacobian=False), stiff=False, orders=(5, 5)),
    Method("scipy-dop853", of_scipy("DOP853", takes_jacobian=False), stiff=False, orders=(8, 8)),
    Method("scipy-lsoda", of_scipy("LSODA"), stiff=True, orders=(1, 12)),
    Method("scipy-radau", of_scipy("Radau"), stiff=True, orders=(5, 5)),
    Method("scipy-bdf", of_scipy("BDF"), stiff=True, orders=(1, 5)),
)
CVODE = (
    Method("cvode-bdf", of_cvode("BDF"), stiff=True, orders=(1, 5)),
    Method("cvode-adams", of_cvode("Adams"), stiff=False, orders=(1, 12)),
)
METHODS = {method.name: method for method in (*OWN, *SCIPY, *(CVODE if cvode.is_installed() else ()))}


def method_named(name: str) -> Method:
    """The method of that name; KeyError names those there are."""
    if name in METHODS:
        return METHODS[name]
    if any(method.name == name for method in CVODE):
        raise KeyError(f"{name} needs CVODE, which is not installed: pip install scikit-sundae")
    raise KeyError(f"no method named {name!r}; methods: {', '.join(METHODS)}")


ENDLESS = 2**62
"""A budget for a walk that is given its right-hand sides step by step."""


@dataclass(frozen=True)
class Tolerances:
    """By which method a walk is integrated, and how exactly.

    method        its name
    rtol, atol    on the error of a step
    budget        right-hand sides of a walk
    track_energy  whether a contact walk keeps its energy balance, by which it is judged; ladders of methods do without
    """

    method: str
    rtol: float
    atol: float
    budget: int
    track_energy: bool = True

    @property
    def compiled(self) -> bool:
        """Whether whole walks compile with the method."""
        return method_named(self.method).compiled

    def new(self, n: int) -> Any:
        """The method with memory for n equations."""
        return method_named(self.method).new(n, self.rtol, self.atol, self.budget)


def sharing(method: Any, clock: Any, counts: Any) -> Any:
    """The method with another's clock and counts for its own: both integrate one walk, by turns."""
    if isinstance(method, ScipyMethod):
        method.clock, method.counts = clock, counts
        return method
    return method._replace(clock=clock, counts=counts)


def dense_degree(method: Any) -> int:
    """Degree of the polynomial that `interpolate` evaluates."""
    return DENSE_DEGREE if isinstance(method, ScipyMethod) else len(method.dense)


def finder_for(method: Any, event_functions: int, numbers: int) -> CrossingFinder:
    """A crossing finder that fits a method's dense output, for event functions of a state of some numbers."""
    return new_crossing_finder(dense_degree(method), event_functions, numbers)
