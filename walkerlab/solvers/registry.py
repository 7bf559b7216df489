"""Every method by name: one list, one signature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from walkerlab.solvers.dop853 import new_dop853
from walkerlab.solvers.events import CrossingFinder, new_crossing_finder
from walkerlab.solvers.radau5 import new_radau5
from walkerlab.solvers.scipy_methods import SCIPY_CLASSES, ScipyMethod, new_scipy_method
from walkerlab.solvers.stepping import dense_degree


@dataclass(frozen=True)
class Method:
    """An integration method.

    name      as in configs
    new       builds it: (equations, rtol, atol, budget of right-hand sides)
    compiled  whether whole walks compile with it; a library's method walks in Python
    """

    name: str
    new: Callable[[int, float, float, int], Any]
    compiled: bool
    implicit: bool


OWN = (
    Method("dop853", new_dop853, compiled=True, implicit=False),
    Method("radau5", new_radau5, compiled=True, implicit=True),
)
SCIPY = tuple(
    Method(name, new_scipy_method(name), compiled=False, implicit=entry.implicit)
    for name, entry in SCIPY_CLASSES.items()
)
METHODS = {method.name: method for method in (*OWN, *SCIPY)}


def method_named(name: str) -> Method:
    """The method of that name; KeyError names those there are."""
    if name not in METHODS:
        raise KeyError(f"no method named {name!r}; methods: {', '.join(METHODS)}")
    return METHODS[name]


def finder_for(method: Any, signals: int) -> CrossingFinder:
    """A crossing finder that fits a method's dense output."""
    return new_crossing_finder(dense_degree(method), signals)


__all__ = ["METHODS", "Method", "ScipyMethod", "finder_for", "method_named"]
