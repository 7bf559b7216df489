"""The independent pieces that the stage is made of, run here or in several processes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.verification.catalogue import config_of
from walkerlab.verification.judge import judge
from walkerlab.verification.ordinary import Choice, choices
from walkerlab.verification.verdict import CaseResult
from walkerlab.workers import in_order


@dataclass(frozen=True)
class CaseCell:
    """A case to be judged, and tried with ordinary methods.

    config  of a scene's own case; None for a few lines over the paper's config
    """

    case: Case
    config: Config | None = None

    def run(self) -> tuple[CaseResult | Choice, ...]:
        """The verdict, then the ordinary methods."""
        config = self.config or config_of(self.case)
        return (judge(self.case, config), *choices(self.case, config))


Found = tuple[CaseResult | Choice, ...]


def cells_of(cases: Sequence[Case], own: Sequence[tuple[Case, Config]] = ()) -> list[CaseCell]:
    """Everything there is to run: a scene's own cases, then lines over the paper's config."""
    return [*(CaseCell(*case) for case in own), *(CaseCell(case) for case in cases)]


def run_cells(cells: Sequence[CaseCell], jobs: int) -> Iterator[Found]:
    """The pieces' results in their order, whoever ran them."""
    return in_order([cell.run for cell in cells], jobs, first_of_each_model(cells))


def first_of_each_model(cells: Sequence[CaseCell]) -> list[int]:
    """Places of the first case of each model."""
    models = [cell.case.model for cell in cells]
    return [models.index(model) for model in ("contact", "rigid") if model in models]
