"""One case of the rigid model: walked, again with a tenfold tolerance and by another method, and as its twin."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from walkerlab.config.reads import WalksConfig
from walkerlab.config.schema import Config
from walkerlab.config.stability import Case
from walkerlab.hybrid.recorded_walk import RecordedWalk, as_state, take_walk
from walkerlab.mechanics.standing import Standing
from walkerlab.paper.appendix_a import RigidWalker
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import compass_or_none, rigid_walker
from walkerlab.solvers.registry import Method, method_named
from walkerlab.solvers.system import State
from walkerlab.verification.contact_case import TENFOLD, outcome_differs, without_start
from walkerlab.verification.contact_start import gait_of
from walkerlab.verification.rigid_momentum import RigidMasses
from walkerlab.verification.scaling import pendulum_time, scaled, to_twin
from walkerlab.verification.second_method import Second, promised, second_walk
from walkerlab.verification.verdict import BUDGET_USED, CaseResult, Measure, finite

ROUNDING = 1e-9  # share of the momentum by which a heel strike may seem to change it


@dataclass(frozen=True)
class RigidStart:
    """A walker and the state that it starts from."""

    walker: Standing
    masses: RigidMasses  # what its momenta and energies are summed up from
    compass: RigidWalker | None  # the walker of Appendix A, if it is that
    start: State
    energy: float  # J, m g L and the kinetic energy of the start


def prepared(config: WalksConfig) -> RigidStart | None:
    """Walker and start of a config; None if it starts from a gait that there is not."""
    walker = rigid_walker(config, config.equations)
    if isinstance(config.start, str):
        gait = gait_of(walker, config.seed)
        if gait is None:
            return None
        start: State = as_state(gait.state)
    else:
        start = config.start
    mass = walker.mass
    speed = walker.leg_length * max(abs(rate) for rate in start[len(start) // 2 :])
    energy = mass * (walker.gravity * walker.leg_length + 0.5 * speed**2)
    masses = RigidMasses(assembly_of(config.walker, rigid=True), config.slope_rad)
    return RigidStart(walker, masses, compass_or_none(config, config.equations), start, energy)


def walked(ready: RigidStart, config: WalksConfig, case: Case, sharper: float) -> RecordedWalk:
    """Walk a case with the tolerances of its config times `sharper`."""
    settings = config.solver.rigid
    return walked_with(method_named(settings.method), settings.rtol * sharper, settings.atol * sharper, ready, case)


def walked_with(method: Method, rtol: float, atol: float, ready: RigidStart, case: Case) -> RecordedWalk:
    """Walk a case by a method, within the case's budget."""
    solver = method.new(len(ready.walker.blank), rtol, atol, case.budget)
    return take_walk(ready.walker, solver, ready.start, case.steps, budget=case.budget)


def walked_otherwise(ready: RigidStart, config: WalksConfig, case: Case) -> Second[RecordedWalk]:
    """Walk a case by another method than its config's, at the same tolerance."""
    settings = config.solver.rigid

    def walk(method: Method, budget: int) -> RecordedWalk:
        within = case.model_copy(update={"budget": budget})
        return walked_with(method, settings.rtol, settings.atol, ready, within)

    return second_walk(settings.method, case.budget, walk)


def judge_rigid(case: Case, config: Config) -> CaseResult:
    """Run a case of the rigid model and judge it."""
    ready = prepared(config)
    if ready is None:
        return without_start(case)
    started = time.perf_counter()
    walk = walked(ready, config, case, 1.0)
    wall_s = time.perf_counter() - started
    findings = of_one_walk(walk, ready, case)
    remarks: list[str] = []
    second: Second[RecordedWalk] = Second("", None, f"the walk itself ended {walk.outcome.label}")
    short = case.model_copy(update={"steps": min(case.steps, max(case.compared_steps, 1))})
    if walk.outcome.answered:
        second = walked_otherwise(ready, config, short)
        for what, again, unit in compared_walks(ready, config, short, second):
            findings += time_difference(what, walk, pendulum_time(config), again, unit, case, config)
            if short.steps == case.steps:
                remarks += outcome_differs(what, case, walk.outcome, again.outcome)
    return CaseResult(
        name=case.name,
        family=case.family,
        model=case.model,
        reason=case.reason,
        expected=case.expected,
        outcome=walk.outcome.label,
        steps=walk.steps,
        energy_balance_residual_J=finite(walk.energy_drift),
        rhs_evaluations=walk.work.rhs_evaluations,
        wall_s=wall_s,
        findings=tuple(findings),
        remarks=tuple(remarks),
        second_method=second.method,
        second_tried=second.tried,
    )


def compared_walks(
    ready: RigidStart, config: Config, case: Case, second: Second[RecordedWalk]
) -> list[tuple[str, RecordedWalk, float]]:
    """The walks that must do the same: what they are, and their pendulum times (s)."""
    compared = [("tenfold tolerance", walked(ready, config, case, TENFOLD), pendulum_time(config))]
    if second.walk is not None:
        compared.append((second.method, second.walk, pendulum_time(config)))
    if case.twin:
        other = scaled(config, to_twin(config))
        twin_ready = prepared(other)
        if twin_ready is not None:
            compared.append(("twin", walked(twin_ready, other, case, 1.0), pendulum_time(other)))
    return compared


def of_one_walk(walk: RecordedWalk, ready: RigidStart, case: Case) -> list[Measure]:
    """Measures that need no second walk."""
    numbers = np.concatenate([walk.heel_strikes, walk.before.ravel(), walk.after.ravel()])
    found = [
        Measure("numbers that are not finite", float(np.count_nonzero(~np.isfinite(numbers))), 0.0),
        Measure("energy drift within a swing over energy", finite(walk.energy_drift / ready.energy), case.balance),
        Measure(BUDGET_USED, walk.work.rhs_evaluations / case.budget, 1.0 + 20.0 / case.budget),
    ]
    if walk.steps:
        masses, before, after = ready.masses, walk.before, walk.after
        off = masses.feet_off_the_slope(before) / ready.walker.leg_length
        won = masses.energy_won(before, after) / ready.energy
        found += [
            Measure("distance of the feet from the slope at heel strike, over the leg", finite(off), ROUNDING),
            Measure("momentum changed by a heel strike", masses.momentum_change(before, after), ROUNDING),
            Measure("energy won at a heel strike", finite(won), ROUNDING),
        ]
    return found


def time_difference(
    what: str,
    one: RecordedWalk,
    unit: float,
    other: RecordedWalk,
    other_unit: float,
    case: Case,
    config: WalksConfig,
) -> list[Measure]:
    """How far two walks' heel strikes are apart, each in its own pendulum time; nothing where there are none."""
    strikes, others = one.heel_strikes / unit, other.heel_strikes / other_unit
    steps = min(strikes.size, others.size, case.compared_steps)
    if steps == 0:
        return []
    apart = float(np.max(np.abs(strikes[:steps] - others[:steps])))
    limit = promised(case, config.solver.rigid.rtol, one.work.accepted + other.work.accepted)
    return [Measure(f"time apart from {what}, in pendulum times", finite(apart), limit)]
