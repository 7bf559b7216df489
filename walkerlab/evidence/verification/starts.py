"""Starts of cases: a walker in its initial state, its walk in either model, and checks of conservation laws."""

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np

from walkerlab.config.analyses import Case
from walkerlab.config.reads import WalksConfig
from walkerlab.config.schema import MidStep, state_of
from walkerlab.evidence.verification.catalogue import pendulum_time
from walkerlab.evidence.verification.momentum import (
    MEASURE,
    RigidMasses,
    energy_won,
    feet_off_the_slope,
    momentum_finding,
)
from walkerlab.evidence.verification.verdict import Measure, NotMeasured, finite
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.normal_force import elastic_energy
from walkerlab.physics.hybrid.contact_result import ContactWalkResult
from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult, as_state, take_walk
from walkerlab.physics.mechanics.rigid_model import RigidModel, swing_foot
from walkerlab.physics.orbits.fixed_point import RigidGait, find_gaits
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.stepping import ACCEPTED, RHS
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.scene.contact import ContactScene, contact_gait, contact_scene, start_state, wants_own_pitch
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import first_step_length, rigid_walker

CENTRE_HEIGHT = 1  # index of the height of the centre of mass in the free walker's state
STRIKE_TOLERANCE = 1e-9  # largest relative error of the conditions at a heel strike
SAMPLE_RATE = 40  # samples per pendulum time
REGAIN_TOLERANCE = 1e-3  # fraction of the allowed residual by which quadrature errors may lower the dissipated energy


@dataclass(frozen=True)
class JudgedWalk:
    """Walk to be judged, in either model. Times are in units of the walker's pendulum time.

    end         end time; None in the rigid model, whose walks end at a heel strike
    residual_J  residual of the energy balance or, in the rigid model without springs, energy drift within a swing
    numbers     values that must be finite
    """

    outcome: Outcome
    touches: Floats
    end: float | None
    residual_J: float  # noqa: N815
    rhs_evaluations: int
    accepted: int
    numbers: Floats
    record: Any


@dataclass(frozen=True)
class CaseStart:
    """A walker in the initial state of a case."""

    residual_name: ClassVar[str]  # description of `JudgedWalk.residual_J`
    config: WalksConfig
    start: State
    energy: float  # J, m g L plus kinetic and stored energy at the start; the scale of residuals

    def repeated_case(self, case: Case) -> Case:
        """Return the case for a repeated walk, with all its steps, because outcomes are also compared."""
        return case


@dataclass(frozen=True)
class RigidStart(CaseStart):
    residual_name: ClassVar[str] = "energy drift within a swing"
    walker: RigidModel

    def repeated_case(self, case: Case) -> Case:
        """Return the case for a repeated walk, with only the steps whose times are compared."""
        return case.model_copy(update={"steps": min(case.steps, max(case.compared_steps, 1))})

    def walk(self, case: Case, tolerances: Tolerances, sampled: bool = False) -> JudgedWalk:  # noqa: ARG002
        """Simulate a case. Only heel strikes are judged, so nothing is sampled."""
        walk = take_walk(self.walker, tolerances, self.start, case.steps)
        numbers = np.concatenate([walk.touch_time_s, walk.before.ravel(), walk.after.ravel()])
        touches = walk.touch_time_s / pendulum_time(self.config)
        work = walk.work
        cost = work.rhs_evaluations, work.accepted
        off = walk.energy_balance_residual if self.walker.sprung else walk.energy_drift
        return JudgedWalk(walk.outcome, touches, None, off, *cost, numbers, walk)

    def measures(self, walk: JudgedWalk, _case: Case) -> list[Measure]:
        """Check heel strikes: the foot lands on the slope, momentum is conserved and energy does not grow."""
        record: RigidWalkResult = walk.record
        if not record.steps:
            return []
        strikes = RigidMasses(assembly_of(self.config.walker, rigid=True), self.config.slope_rad)
        before = strikes.poses(record.before)
        after = strikes.poses(record.after, first=1)
        pushes = (float(self.walker.push_off), float(self.walker.exchanged.push_off))
        distance = feet_off_the_slope(before) / self.walker.leg_length
        momentum_change = strikes.momentum_change(before, after, pushes)
        # Push-offs may add energy.
        gain = 0.0 if any(pushes) else energy_won(before, after) / self.energy
        measured = {
            "distance of the feet from the slope at heel strike, in leg lengths": finite(distance),
            "momentum changed by a heel strike": momentum_change,
            "energy gained at a heel strike": finite(gain),
        }
        return [Measure(name, value, STRIKE_TOLERANCE) for name, value in measured.items()]


@dataclass(frozen=True)
class ContactStart(CaseStart):
    residual_name: ClassVar[str] = "energy balance residual"
    scene: ContactScene

    def walk(self, case: Case, tolerances: Tolerances, sampled: bool = False) -> JudgedWalk:
        scene = self.scene
        unit = pendulum_time(self.config)
        interval = scene.ground.frame.pendulum_time / SAMPLE_RATE if sampled else None
        walk = scene.walk(self.start, case.steps, tolerances, interval)
        numbers = np.concatenate([walk.end_state, walk.touch_time_s, walk.touch_along_m, walk.dissipated_J])
        touches = walk.touch_time_s / unit
        end = walk.end_time_s / unit
        cost = int(walk.work[RHS]), int(walk.work[ACCEPTED])
        return JudgedWalk(walk.outcome, touches, end, walk.energy_balance_residual_J, *cost, numbers, walk)

    def measures(self, walk: JudgedWalk, case: Case) -> list[Measure]:
        """Measure the energy that friction and damping seem to return, or return an empty list if the walk was not
        sampled.
        """
        record: ContactWalkResult = walk.record
        if record.samples is None or record.samples.dissipated_J.shape[0] < 2:
            return []
        falls = -np.diff(record.samples.dissipated_J[:, :2], axis=0)
        back = finite(max(0.0, float(np.max(falls))) / self.energy)
        return [Measure("energy regained from friction and damping", back, REGAIN_TOLERANCE * case.balance)]

    def momentum(self, walk: JudgedWalk, case: Case) -> Measure | NotMeasured:
        """Measure the momentum balance, unless the walk has no answer or no duration."""
        if not walk.outcome.answered or walk.record.end_time_s <= 0.0:
            return NotMeasured(MEASURE, f"the walk ended as {walk.outcome.label}")
        return momentum_finding(self.config, self.scene, self.start, case)


Start = RigidStart | ContactStart


def case_tolerances(start: Start, case: Case, tighter: float = 1.0) -> Tolerances:
    """Return the config's method and tolerances with the case's budget. `tighter` multiplies both tolerances."""
    solver = start.config.solver
    settings = solver.rigid if isinstance(start, RigidStart) else solver.contact
    return Tolerances(settings.method, tighter * settings.rtol, tighter * settings.atol, case.budget)


@cache
def gait_of(walker: RigidModel, seed: int) -> RigidGait | None:
    """Find the gait of a walker. It is cached, because most cases of a catalogue differ only in the ground."""
    return find_gaits(walker, seed).gait


def prepare_start(config: WalksConfig, case: Case) -> Start | None:
    """Prepare the start of a case, or return None if the start or the pad pitch needs a gait that does not exist."""
    walker = rigid_walker(config)
    if isinstance(config.start, str):
        gait = gait_of(walker, config.seed)
        if gait is None:
            return None
        state = as_state(gait.state)
        length = float(gait.step_length)
    else:
        state = as_state(state_of(config.start))
        length = abs(float(swing_foot(walker, state)[1]))
        if isinstance(config.start, MidStep):
            length = first_step_length(config, state)
    if case.model == "rigid":
        speed = walker.leg_length * max(abs(rate) for rate in state[len(state) // 2 :])
        energy = float(walker.mass * (walker.gravity * walker.leg_length + 0.5 * speed**2))
        return RigidStart(config, state, energy, walker)
    pitch = length
    if config.contact is not None and wants_own_pitch(config.contact):
        contact = contact_gait(config, length, state).gait
        if contact is None:
            return None
        pitch = float(contact.lengths_m.mean())
    behind = abs(float(swing_foot(walker, state)[1]))
    asymmetry = 2.0 * (behind / pitch - 1.0) if walker.legs_differ and not isinstance(config.start, MidStep) else 0.0
    scene = contact_scene(config, length, pitch, asymmetry)
    y = start_state(scene, state)
    y = (*y[:CENTRE_HEIGHT], y[CENTRE_HEIGHT] - case.lowered_m, *y[CENTRE_HEIGHT + 1 :])
    leg = config.walker.leg_length_m
    rates = y[len(y) // 2 :]
    speed = float(np.max(np.abs([*rates[:2], *(leg * rate for rate in rates[2:])])))
    # A lowered walker presses both feet into the ground.
    stored = 2.0 * elastic_energy(scene.walker.normal, case.lowered_m)
    energy = scene.walker.mass * (config.gravity_m_s2 * leg + 0.5 * speed**2) + stored
    return ContactStart(config, y, energy, scene)
