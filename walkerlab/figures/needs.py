"""What a figure needs of the stored results, and why it cannot be drawn if that is not there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from walkerlab.store.artifact import Stored

Results = Mapping[str, Stored]
"""Results by the name of their stage."""


@dataclass(frozen=True)
class Need:
    """Variables of a group of a stage's result; `or_else` is why a result may be without them, in words."""

    stage: str
    group: str
    variables: tuple[str, ...]
    or_else: str

    def missing_in(self, results: Results, absent: Mapping[str, str]) -> str | None:
        """Why the need is not met, in words; None if it is.

        absent  why results are not there, by stage
        """
        if self.stage not in results:
            why = absent.get(self.stage)
            return f"it needs {self.stage}" + (f": {why}" if why else "")
        group = results[self.stage].groups.get(self.group)
        there = group is not None and all(name in group.variables for name in self.variables)
        return None if there else f"{self.stage}: {self.or_else}"


def why_not(needs: Sequence[Need], results: Results, absent: Mapping[str, str]) -> str | None:
    """Why the first need that is not met is not; None if all are."""
    reasons = (need.missing_in(results, absent) for need in needs)
    return next((reason for reason in reasons if reason is not None), None)
