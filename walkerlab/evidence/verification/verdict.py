"""Measures and verdict of a case."""

import math
from dataclasses import dataclass
from typing import Annotated, Final

from walkerlab.config.stability import Case
from walkerlab.labels import Label

BUDGET_USED: Final = "right-hand sides over budget"
"""A measure of cost, not of correctness: left out where the largest of all is shown."""

MAGNIFIED: Final = 10.0  # by how much a walk may magnify the errors of its steps


@dataclass(frozen=True)
class Measure:
    """One independent measure of a run, dimensionless."""

    measure: str
    value: float
    limit: float  # up to which the value is right

    @property
    def ok(self) -> bool:
        """Whether the value is finite and within its limit."""
        return bool(math.isfinite(self.value) and self.value <= self.limit)

    def __str__(self) -> str:
        return f"{self.measure} {self.value:.3g} above {self.limit:.3g}"


@dataclass(frozen=True)
class NotMeasured:
    """A measure that could not be taken, and why."""

    measure: str
    why: str


@dataclass(frozen=True)
class CaseResult:
    """Outcome of a case and its judgement."""

    name: Annotated[str, Label("", "name of the case")]
    family: Annotated[str, Label("", "family of the case")]
    model: str
    reason: str
    expected: tuple[str, ...]
    outcome: Annotated[str, Label("", "how it ended")]
    steps: Annotated[int, Label("1", "steps walked")]
    energy_balance_residual_J: Annotated[float, Label("J", "largest residual of the energy balance")]  # noqa: N815
    rhs_evaluations: Annotated[int, Label("1", "right-hand sides evaluated")]
    wall_s: float
    findings: tuple[Measure, ...]  # measures taken
    remarks: tuple[str, ...] = ()  # further faults
    second_method: str = ""  # method compared with; empty if none could walk the case
    second_tried: str = ""  # methods that failed, or why none was tried
    not_measured: tuple[NotMeasured, ...] = ()  # measures that could not be taken

    @property
    def failures(self) -> tuple[str, ...]:
        """Descriptions of all faults; empty if the case passed."""
        failed = [] if self.outcome in self.expected else [f"ended as {self.outcome}, not {' or '.join(self.expected)}"]
        return (*failed, *self.remarks, *(str(finding) for finding in self.findings if not finding.ok))

    @property
    def ok(self) -> Annotated[bool, Label("1", "whether it ended as expected and passed every measure")]:
        return not self.failures


def finite(value: float) -> float:
    """The value, or 1e300 in place of one that is not finite: results hold no NaN."""
    return float(value) if math.isfinite(value) else 1e300


def promised(case: Case, rtol: float, steps: int) -> float:
    """Largest expected difference of two walks' times, in pendulum times.

    rtol   larger of their tolerances
    steps  of the solver, in both walks

    Each step may err by rtol times values of order one.
    """
    return min(case.agreement, MAGNIFIED * rtol * steps)
