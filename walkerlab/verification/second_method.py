"""What tolerances promise, and who else can walk a case: agreement with a sharper tolerance and another method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, Protocol, TypeVar

from walkerlab.config.stability import Case
from walkerlab.hybrid.outcome import Outcome
from walkerlab.solvers.registry import METHODS, Method, method_named

LIBRARY: Final = ("scipy-bdf", "scipy-radau")
"""Asked where our other method gives up; multistep first, since its formulas are neither of ours."""
LIBRARY_BUDGET: Final = 30_000  # right-hand sides; a library's walks run in Python
MAGNIFIED: Final = 10.0  # by how much a walk may magnify the errors of its steps


class SecondWalk(Protocol):
    """A walk of either model."""

    @property
    def outcome(self) -> Outcome:
        """How it ended."""


W = TypeVar("W", bound=SecondWalk)


@dataclass(frozen=True)
class Second(Generic[W]):
    """A case walked by another method.

    method  that reached an answer; empty if none did
    walk    of it
    tried   what became of those asked before, in words; empty if the first answered
    """

    method: str
    walk: W | None
    tried: str


def others(configured: str) -> tuple[Method, ...]:
    """Whom to ask besides the configured method: our own first, then the libraries'."""
    own = [name for name, method in METHODS.items() if method.compiled]
    return tuple(method_named(name) for name in dict.fromkeys((*own, *LIBRARY)) if name != configured)


def second_walk(configured: str, budget: int, walk: Callable[[Method, int], W]) -> Second[W]:
    """The first other method's walk that answers.

    budget  right-hand sides of our own methods
    walk    walks the case with a method and a budget
    """
    tried: list[str] = []
    for method in others(configured):
        found = walk(method, budget if method.compiled else min(budget, LIBRARY_BUDGET))
        if found.outcome.answered:
            return Second(method.name, found, ", ".join(tried))
        tried.append(f"{method.name} {found.outcome.label}")
    return Second("", None, ", ".join(tried))


def promised(case: Case, rtol: float, steps: int) -> float:
    """How far two walks' times may be apart, in pendulum times.

    rtol   the looser of their tolerances
    steps  of the solver, both together

    A tolerance lets every step be wrong by its share of numbers of the order of one.
    """
    return min(case.agreement, MAGNIFIED * rtol * steps)
