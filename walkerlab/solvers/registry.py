"""Every method by name: one list, one signature."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from walkerlab.solvers.dop853 import new_dop853
from walkerlab.solvers.events import CrossingFinder, new_crossing_finder
from walkerlab.solvers.radau5 import new_radau5
from walkerlab.solvers.scipy_methods import CVODE, LIBRARIES, ScipyMethod, new_scipy_method
from walkerlab.solvers.stepping import dense_degree


@dataclass(frozen=True)
class Method:
    """An integration method.

    name      as in configs
    new       builds it: (equations, rtol, atol, budget of right-hand sides)
    compiled  whether whole walks compile with it; a library's method walks in Python
    stiff     whether it is meant for stiff problems
    orders    lowest and highest; the same but for methods that vary it
    """

    name: str
    new: Callable[[int, float, float, int], Any]
    compiled: bool
    stiff: bool
    orders: tuple[int, int]


OWN = (
    Method("dop853", new_dop853, compiled=True, stiff=False, orders=(8, 8)),
    Method("radau5", new_radau5, compiled=True, stiff=True, orders=(5, 5)),
)
OF_LIBRARIES = tuple(
    Method(name, new_scipy_method(entry), compiled=False, stiff=entry.stiff, orders=entry.orders)
    for name, entry in LIBRARIES.items()
)
METHODS = {method.name: method for method in (*OWN, *OF_LIBRARIES)}


def method_named(name: str) -> Method:
    """The method of that name; KeyError names those there are."""
    if name in METHODS:
        return METHODS[name]
    if name in CVODE:
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


def finder_for(method: Any, event_functions: int) -> CrossingFinder:
    """A crossing finder that fits a method's dense output."""
    return new_crossing_finder(dense_degree(method), event_functions)


__all__ = ["ENDLESS", "METHODS", "Method", "ScipyMethod", "Tolerances", "finder_for", "method_named", "sharing"]
