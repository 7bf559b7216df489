"""One case of the contact model: walked, again with a tenfold tolerance and by another method, and as its twin."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.reads import WalksConfig
from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.hybrid.contact_run import ContactWalkResult, MethodSettings, walk_contact
from walkerlab.hybrid.outcome import Outcome
from walkerlab.solvers.registry import Method, method_named
from walkerlab.solvers.stepping import ACCEPTED, RHS
from walkerlab.verification.contact_start import ContactStart, prepared
from walkerlab.verification.momentum import MEASURE, momentum_finding
from walkerlab.verification.scaling import pendulum_time, scaled, to_twin
from walkerlab.verification.second_method import Second, promised, second_walk
from walkerlab.verification.verdict import BUDGET_USED, CaseResult, Measure, NotMeasured, finite

TENFOLD = 0.1
SAMPLED_STEPS = 100  # longer walks are not sampled
SAMPLES_PER_PENDULUM_TIME = 40
NEVER_LESS = 1e-3  # of the balance asked for: by how much what was dissipated may seem to fall, for the quadrature


def walked(ready: ContactStart, config: WalksConfig, case: Case, sharper: float, sampled: bool) -> ContactWalkResult:
    """Walk a case with the tolerances of its config times `sharper`."""
    settings, scene = config.solver.contact, ready.scene
    methods = MethodSettings(
        method_named(settings.method), sharper * settings.rtol, sharper * settings.atol, case.budget
    )
    interval = scene.frame.pendulum_time / SAMPLES_PER_PENDULUM_TIME if sampled else None
    return walked_with(methods, ready, case, interval)


def walked_with(
    methods: MethodSettings, ready: ContactStart, case: Case, interval: float | None = None
) -> ContactWalkResult:
    """Walk a case by a method, with samples at an interval (s) if there is one."""
    scene = ready.scene
    return walk_contact(
        scene.walker, scene.ground, scene.pinned, STANCE_FOOT, ready.start, methods, case.steps, interval
    )


def walked_otherwise(ready: ContactStart, config: WalksConfig, case: Case) -> Second[ContactWalkResult]:
    """Walk a case by another method than its config's, at the same tolerance."""
    settings = config.solver.contact

    def walk(method: Method, budget: int) -> ContactWalkResult:
        return walked_with(MethodSettings(method, settings.rtol, settings.atol, budget), ready, case)

    return second_walk(settings.method, case.budget, walk)


def judge_contact(case: Case, config: Config) -> CaseResult:
    """Run a case of the contact model and judge it."""
    ready = prepared(config, case)
    if ready is None:
        return without_start(case)
    started = time.perf_counter()
    result = walked(ready, config, case, 1.0, sampled=case.steps <= SAMPLED_STEPS)
    wall_s = time.perf_counter() - started
    findings = [*of_one_run(result, ready, case)]
    remarks: list[str] = []
    momentum = momentum_of(result, ready, config, case)
    second: Second[ContactWalkResult] = Second("", None, f"the walk itself ended {result.outcome.label}")
    if result.outcome.answered:
        second = walked_otherwise(ready, config, case)
        for what, again, unit in compared_walks(ready, config, case, second):
            findings.append(time_difference(what, result, pendulum_time(config), again, unit, case, config))
            remarks += outcome_differs(what, case, result.outcome, again.outcome)
    return CaseResult(
        name=case.name,
        family=case.family,
        model=case.model,
        reason=case.reason,
        expected=case.expected,
        outcome=result.outcome.label,
        steps=int(result.touch_time_s.size),
        energy_balance_residual_J=finite(result.energy_balance_residual_J),
        rhs_evaluations=int(result.work[RHS]),
        wall_s=wall_s,
        findings=(*findings, momentum) if isinstance(momentum, Measure) else tuple(findings),
        remarks=tuple(remarks),
        second_method=second.method,
        second_tried=second.tried,
        not_measured=(momentum,) if isinstance(momentum, NotMeasured) else (),
    )


def momentum_of(
    result: ContactWalkResult, ready: ContactStart, config: WalksConfig, case: Case
) -> Measure | NotMeasured:
    """The momentum's balance of a walk that has an outcome and a length."""
    if not result.outcome.answered or result.end_time_s <= 0.0:
        return NotMeasured(MEASURE, f"the walk ended as {result.outcome.label}")
    return momentum_finding(ready, config, case)


def compared_walks(
    ready: ContactStart, config: Config, case: Case, second: Second[ContactWalkResult]
) -> list[tuple[str, ContactWalkResult, float]]:
    """The walks that must do the same: what they are, and their pendulum times (s)."""
    tenfold = walked(ready, config, case, TENFOLD, sampled=False)
    compared = [("tenfold tolerance", tenfold, pendulum_time(config))]
    if second.walk is not None:
        compared.append((second.method, second.walk, pendulum_time(config)))
    if case.twin:
        scale = to_twin(config)
        other = scaled(config, scale)
        twin_ready = prepared(other, case.model_copy(update={"lowered_m": case.lowered_m * scale.length}))
        if twin_ready is not None:
            compared.append(("twin", walked(twin_ready, other, case, 1.0, sampled=False), pendulum_time(other)))
    return compared


def without_start(case: Case) -> CaseResult:
    """A case that asks for a gait where there is none."""
    rejected, none = Outcome.REJECTED.label, "there is no start"
    return CaseResult(
        case.name, case.family, case.model, case.reason, case.expected, rejected, 0, 0.0, 0, 0.0, (), (), "", none
    )


def of_one_run(result: ContactWalkResult, ready: ContactStart, case: Case) -> list[Measure]:
    """Measures that need no second run."""
    numbers = np.concatenate([result.end_state, result.touch_time_s, result.touch_along_m, result.dissipated_J])
    balance = finite(result.energy_balance_residual_J / ready.energy)
    found = [
        Measure("numbers that are not finite", float(np.count_nonzero(~np.isfinite(numbers))), 0.0),
        Measure("energy balance residual over energy", balance, case.balance),
        Measure(BUDGET_USED, float(result.work[RHS]) / case.budget, 1.0 + 20.0 / case.budget),
    ]
    if result.samples is not None and result.samples.dissipated_J.shape[0] > 1:
        by_channel = result.samples.dissipated_J[:, :2]
        found.append(
            Measure("energy won back from friction and damping", won_back(by_channel, ready), NEVER_LESS * case.balance)
        )
    return found


def won_back(dissipated: NDArray[np.float64], ready: ContactStart) -> float:
    """Largest fall of what was dissipated, as a share of the energy."""
    return finite(max(0.0, float(np.max(-np.diff(dissipated, axis=0)))) / ready.energy)


def time_difference(
    what: str,
    one: ContactWalkResult,
    unit: float,
    other: ContactWalkResult,
    other_unit: float,
    case: Case,
    config: WalksConfig,
) -> Measure:
    """How far two runs' touches are apart, each in its own pendulum time; their ends if there are none."""
    touches, others = one.touch_time_s / unit, other.touch_time_s / other_unit
    steps = min(touches.size, others.size, case.compared_steps)
    if steps:
        apart = float(np.max(np.abs(touches[:steps] - others[:steps])))
    else:
        apart = abs(one.end_time_s / unit - other.end_time_s / other_unit)
    limit = promised(case, config.solver.contact.rtol, int(one.work[ACCEPTED] + other.work[ACCEPTED]))
    return Measure(f"time apart from {what}, in pendulum times", finite(apart), limit)


def outcome_differs(what: str, case: Case, outcome: Outcome, again: Outcome) -> list[str]:
    """A remark if a second run ends in another way, and not in one that is right too."""
    return [] if outcome is again or again.label in case.expected else [f"{what}: {again.label}, not {outcome.label}"]
