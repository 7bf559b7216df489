"""Judgement of cases. Each walk is repeated with a ten times tighter tolerance, another method and a scaled twin."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from walkerlab.config.analyses import Case
from walkerlab.config.schema import Config
from walkerlab.evidence.verification.catalogue import config_of, scaled, to_twin
from walkerlab.evidence.verification.ordinary import Choice, choices
from walkerlab.evidence.verification.starts import ContactStart, JudgedWalk, Start, case_tolerances, prepare_start
from walkerlab.evidence.verification.verdict import (
    BUDGET_USED,
    CaseResult,
    Measure,
    NotMeasured,
    allowed_difference,
    finite,
)
from walkerlab.outcome import Outcome
from walkerlab.physics.solvers.registry import METHODS, Method, method_named
from walkerlab.pipeline.run.workers import map_in_order

TIGHTER_FACTOR = 0.1
SAMPLED_STEPS = 100  # walks of more steps are not sampled
LIBRARY_METHODS: Final = ("scipy-bdf", "scipy-radau")
"""Libraries' methods, tried if our own fail; the multistep method comes first, because ours are one-step methods."""
LIBRARY_BUDGET: Final = 30_000  # right-hand sides; small, because the libraries' solvers run in Python


@dataclass(frozen=True)
class Second:
    """Walk of a case by a second method."""

    method: str  # empty if no method reached an answer
    walk: JudgedWalk | None
    tried: str  # failed methods with their outcomes, or the reason why none was tried


@dataclass(frozen=True)
class CaseCell:
    """A case to judge and to simulate by ordinary methods, possibly in another process."""

    case: Case
    config: Config | None = None  # config of a scene's variation; None if the case changes the paper config

    def run(self) -> tuple[CaseResult | Choice, ...]:
        """Return the judgement, then the results of the ordinary methods."""
        config = self.config or config_of(self.case)
        return (judge(self.case, config), *choices(self.case, config))


def run_cells(cells: Sequence[CaseCell], jobs: int) -> Iterator[tuple[CaseResult | Choice, ...]]:
    """Yield results in case order. One case per model runs first, to compile. The others start in
    order of decreasing budget.
    """
    models = [cell.case.model for cell in cells]
    first = [models.index(model) for model in ("contact", "rigid") if model in models]
    return map_in_order([cell.run for cell in cells], jobs, first, lambda place: -cells[place].case.budget)


def judge(case: Case, config: Config) -> CaseResult:
    """Simulate a case and judge its walk. Walks of more than `SAMPLED_STEPS` steps are not sampled."""
    about = case.name, case.family, case.model, case.reason, case.expected
    start = prepare_start(config, case)
    if start is None:
        return CaseResult(
            *about,
            outcome=Outcome.REJECTED.label,
            steps=0,
            energy_balance_residual_J=0.0,
            rhs_evaluations=0,
            wall_s=0.0,
            findings=(),
            second_tried="no start exists",
        )
    methods = case_tolerances(start, case)
    began = time.perf_counter()
    walk = start.walk(case, methods, sampled=case.steps <= SAMPLED_STEPS)
    wall_s = time.perf_counter() - began
    findings: list[Measure | NotMeasured] = [
        Measure("number of values that are not finite", float(np.count_nonzero(~np.isfinite(walk.numbers))), 0.0),
        Measure(f"{start.residual_name} over energy", finite(walk.residual_J / start.energy), case.balance),
        Measure(BUDGET_USED, walk.rhs_evaluations / case.budget, 1.0 + 20.0 / case.budget),
        *start.measures(walk, case),
    ]
    remarks: list[str] = []
    second = Second("", None, f"the walk itself ended as {walk.outcome.label}")
    if walk.outcome.answered:
        short = start.repeated_case(case)
        second = second_walk(
            methods.method,
            case.budget,
            lambda method, budget: start.walk(short, replace(methods, method=method.name, budget=budget)),
        )
        for what, again in repeat_walks(start, config, short, second):
            findings += time_difference(what, walk, again, case, methods.rtol)
            differs = again.outcome is not walk.outcome and again.outcome.label not in case.expected
            # A walk that was shortened may end in another way for that reason alone.
            if differs and short.steps == case.steps:
                remarks.append(f"{what}: {again.outcome.label}, not {walk.outcome.label}")
    if isinstance(start, ContactStart):
        findings.append(start.momentum(walk, case))
    numbers = int(walk.touches.size), finite(walk.residual_J), walk.rhs_evaluations, wall_s
    measures = tuple(finding for finding in findings if isinstance(finding, Measure))
    missing = tuple(finding for finding in findings if isinstance(finding, NotMeasured))
    second_walked = second.method, second.tried
    return CaseResult(*about, walk.outcome.label, *numbers, measures, tuple(remarks), *second_walked, missing)


def repeat_walks(start: Start, config: Config, case: Case, second: Second) -> list[tuple[str, JudgedWalk]]:
    """Return the walks that must agree with the first, as pairs (description, walk)."""
    tighter = start.walk(case, case_tolerances(start, case, TIGHTER_FACTOR))
    again = [("the walk with ten times tighter tolerance", tighter)]
    if second.walk is not None:
        again.append((f"the walk with {second.method}", second.walk))
    if case.twin:
        scale = to_twin(config)
        twin_case = case.model_copy(update={"lowered_m": case.lowered_m * scale.length})
        twin = prepare_start(scaled(config, scale), twin_case)
        if twin is not None:
            again.append(("the walk of the twin", twin.walk(case, case_tolerances(twin, case))))
    return again


def time_difference(what: str, first: JudgedWalk, second: JudgedWalk, case: Case, rtol: float) -> list[Measure]:
    """Compare the touch times of two walks, or their end times if one has no touch, or return an empty list if an end
    time is missing.
    """
    steps = min(first.touches.size, second.touches.size, case.compared_steps)
    if steps:
        difference = float(np.max(np.abs(first.touches[:steps] - second.touches[:steps])))
    elif first.end is None or second.end is None:
        return []
    else:
        difference = abs(first.end - second.end)
    limit = allowed_difference(case, rtol, first.accepted + second.accepted)
    return [Measure(f"difference in time from {what}, in pendulum times", finite(difference), limit)]


def other_methods(configured: str) -> tuple[Method, ...]:
    """Return the methods to try instead of the configured one: ours first, then the libraries'."""
    ours = [name for name, method in METHODS.items() if method.compiled]
    return tuple(method_named(name) for name in dict.fromkeys((*ours, *LIBRARY_METHODS)) if name != configured)


def second_walk(configured: str, budget: int, walk: Callable[[Method, int], JudgedWalk]) -> Second:
    """Simulate a walk with other methods until one has an answer. `budget` limits right-hand sides (libraries may get
    fewer).
    """
    tried: list[str] = []
    for method in other_methods(configured):
        result = walk(method, budget if method.compiled else min(budget, LIBRARY_BUDGET))
        if result.outcome.answered:
            return Second(method.name, result, ", ".join(tried))
        tried.append(f"{method.name} {result.outcome.label}")
    return Second("", None, ", ".join(tried))
