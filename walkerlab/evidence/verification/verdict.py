"""Measures of a case's walk, and the result of judging it."""

import math
from dataclasses import dataclass
from typing import Annotated, Final

from walkerlab.config.analyses import Case
from walkerlab.labels import Label

BUDGET_USED: Final = "right-hand sides over budget"
"""Name of the measure of cost. It says nothing about correctness, so it never counts as the worst measure."""

MAGNIFIED: Final = 10.0  # factor by which a walk may magnify the errors of its steps


@dataclass(frozen=True)
class Measure:
    """A dimensionless measure of how correct or expensive a walk is."""

    measure: str
    value: float
    limit: float  # largest acceptable value

    @property
    def ok(self) -> bool:
        """Whether the value is finite and within its limit."""
        return bool(math.isfinite(self.value) and self.value <= self.limit)

    def __str__(self) -> str:
        return f"{self.measure} {self.value:.3g} above {self.limit:.3g}"


@dataclass(frozen=True)
class NotMeasured:
    """A measure that could not be computed, with the reason."""

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
    outcome: Annotated[str, Label("", "how the case ended")]
    steps: Annotated[int, Label("1", "steps walked")] = 0
    energy_balance_residual_J: Annotated[float, Label("J", "largest residual of the energy balance")] = 0.0  # noqa: N815
    rhs_evaluations: Annotated[int, Label("1", "right-hand sides evaluated")] = 0
    wall_s: float = 0.0
    findings: tuple[Measure, ...] = ()  # measures that were computed
    remarks: tuple[str, ...] = ()  # descriptions of further faults
    second_method: str = ""  # method of the second walk, empty if no other method had an answer
    second_tried: str = ""  # failed methods with their outcomes, or the reason why none was tried
    not_measured: tuple[NotMeasured, ...] = ()  # measures that could not be computed

    @property
    def failures(self) -> tuple[str, ...]:
        """Descriptions of all faults, or () if the case passed."""
        failed = [] if self.outcome in self.expected else [f"ended as {self.outcome}, not {' or '.join(self.expected)}"]
        return (*failed, *self.remarks, *(str(finding) for finding in self.findings if not finding.ok))

    @property
    def ok(self) -> Annotated[bool, Label("1", "whether the case ended as expected and passed every measure")]:
        return not self.failures


def finite(value: float) -> float:
    """Return the value, or 1e300 if it is not finite, because results may not contain NaN."""
    return float(value) if math.isfinite(value) else 1e300


def allowed_difference(case: Case, rtol: float, steps: int) -> float:
    """Return the largest expected difference between the times of two walks, in pendulum times.

    The error of a step may reach rtol, because values are of order one.

    rtol   relative tolerance of the less accurate walk
    steps  number of solver steps in both walks together
    """
    return min(case.agreement, MAGNIFIED * rtol * steps)
