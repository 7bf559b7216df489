"""Starts of cases: a walker in its initial state, its walk in either model, and checks of conservation laws.

The momentum balance compares the change of momentum during a walk with the impulse of ground and gravity. Momenta are
computed from positions and velocities of the masses, not from the equations of motion. Impulses are integrated from
forces at sampled states. An impact lasts only milliseconds, so sampling is refined until the integrals settle.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.analyses import Case
from walkerlab.config.reads import RigidConfig, WalksConfig
from walkerlab.config.schema import MidStep, state_of
from walkerlab.errors import NoAnswer
from walkerlab.evidence.verification.catalogue import pendulum_time
from walkerlab.evidence.verification.verdict import MAGNIFIED, Measure, NotMeasured, allowed_difference, finite
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.friction import steepest_change
from walkerlab.physics.ground.normal_force import elastic_energy
from walkerlab.physics.hybrid.contact_record import ContactSamples
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, sample_feet
from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult, as_state, take_walk
from walkerlab.physics.mechanics.parts import Anchor, Assembly, levers, masses
from walkerlab.physics.mechanics.rigid import find_hip, group_bodies, have_equal_legs
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING, RigidModel, swing_foot
from walkerlab.physics.orbits.fixed_point import RigidGait, find_gaits
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.stepping import ACCEPTED, RHS
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.scene.contact import ContactScene, scene_on_pads, start_state
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import first_step_length, rigid_walker


class Masses:
    """Point masses of a walker, with levers from a reference point. By default this is the centre of mass.

    mass     (masses,) kg
    levers   (masses, bodies, 2) m, from the reference point to each mass
    inertia  (bodies,) kg m^2, inertia of each body about its centre of mass
    """

    def __init__(self, assembly: Assembly, about: Anchor | None = None) -> None:
        point_masses = list(masses(assembly))
        self.mass = np.array([mass for mass, _ in point_masses])
        self.levers = np.array([levers(assembly, about or point_masses[0][1], anchor) for _, anchor in point_masses])
        if about is None:
            self.levers = self.levers - np.average(self.levers, axis=0, weights=self.mass)
        self.inertia = np.array([body.inertia_kg_m2 for body in assembly.bodies])

    def moving(self, psi: Floats, rate: Floats) -> tuple[Floats, Floats]:
        """Return positions (m) and velocities (m/s) of the masses (..., masses, 2) relative to the reference point.

        psi, rate  angles (rad) and rates (rad/s) of the bodies (..., bodies)
        """
        arms = rotate(self.levers, psi[..., None, :])
        swept = np.stack([-arms[..., 1], arms[..., 0]], axis=-1) * rate[..., None, :, None]
        return arms.sum(axis=-2), swept.sum(axis=-2)


def rotate(d: Floats, psi: Floats) -> Floats:
    """Rotate levers `d` (..., bodies, 2) by the angles `psi` of their bodies (..., bodies)."""
    s, c = np.sin(psi), np.cos(psi)
    return np.stack([c * d[..., 0] - s * d[..., 1], s * d[..., 0] + c * d[..., 1]], axis=-1)


@dataclass(frozen=True)
class Moving:
    """Motion of a walker's masses and bodies at an instant. The origin is on the ground under the stance foot."""

    mass: Floats  # (masses,) kg
    place: Floats  # (masses, 2) m
    velocity: Floats  # (masses, 2) m/s
    inertia: Floats  # (bodies,) kg m^2, about the centre of mass of each body
    rate: Floats  # (bodies,) rad/s
    hip: Floats  # (2,) m
    contact: Floats  # (2,) m, lowest point of the swing foot

    @property
    def kinetic(self) -> float:
        """Kinetic energy (J)."""
        return float(0.5 * self.mass @ (self.velocity**2).sum(axis=1) + 0.5 * self.inertia @ self.rate**2)

    def momentum_about(self, point: Floats, on_masses: Floats, on_bodies: Floats) -> float:
        """Return the angular momentum (kg m^2/s) of part of the walker about a point (2,).

        on_masses, on_bodies  fractions of each mass and of each inertia that belong to this part
        """
        arm = self.place - point
        orbital = self.mass * (arm[:, 0] * self.velocity[:, 1] - arm[:, 1] * self.velocity[:, 0])
        return float(on_masses @ orbital + on_bodies @ (self.inertia * self.rate))


class SwingMasses:
    """Momenta and energy of a walker in the rigid model while its first leg swings, computed from its point masses."""

    def __init__(self, assembly: Assembly, slope: float) -> None:
        """Measure all levers from the centre of the stance foot's arc. The slope is in rad."""
        foot = assembly.feet[STANCE]
        trailing = assembly.feet[SWING]
        hip = find_hip(assembly)
        root = Anchor(foot.body, foot.centre_m)
        self.assembly = assembly
        self.slope = slope
        self.radius = foot.radius_m
        self.raised = np.array([0.0, foot.radius_m - trailing.radius_m])
        self.members = group_bodies(assembly).members
        self.masses = Masses(assembly, root)
        self.owner = [assembly.index(anchor.body) for _, anchor in masses(assembly)]
        self.to_hip = levers(assembly, root, Anchor(hip.parent, hip.parent_point_m))
        self.to_foot = levers(assembly, root, Anchor(trailing.body, trailing.centre_m))
        self.shares = {leg: self.share_of(leg) for leg in (STANCE, SWING)}

    def pose(self, state: Floats) -> Moving:
        """Return the masses with their positions and velocities in a state of the rigid model (2 n,)."""
        n = self.members.shape[1]
        psi = self.members @ state[:n] + self.slope
        rate = self.members @ state[n:]
        centre = np.array([0.0, self.radius])
        rolling = np.array([-self.radius * state[n + STANCE], 0.0])
        place, velocity = self.masses.moving(psi, rate)
        hip = centre + rotate(self.to_hip, psi).sum(axis=0)
        contact = rotate(self.to_foot, psi).sum(axis=0) + self.raised
        return Moving(self.masses.mass, centre + place, rolling + velocity, self.masses.inertia, rate, hip, contact)

    def share_of(self, leg: int) -> Floats:
        """Return the fraction of each body that belongs to a leg (bodies,): 0 or 1, except for coupled bodies."""
        names = [body.name for body in self.assembly.bodies]
        of_leg = self.assembly.legs[leg]
        share = np.array([float(name in of_leg) for name in names])
        for coupling in self.assembly.couplings:
            turning = (weight for name, weight in zip(coupling.of, coupling.weights, strict=True) if name in of_leg)
            share[names.index(coupling.body)] = sum(turning)
        return share

    def momenta(self, moving: Moving, new: bool) -> tuple[float, float]:
        """Return the two angular momenta that a heel strike conserves (kg m^2/s).

        The first is that of the walker about the new foothold. The second is that of the lifting leg about the hip,
        including its share of bodies whose motion is coupled to the leg's, such as a torso.

        new  whether `moving` is the motion after the heel strike, when the legs have exchanged roles
        """
        share = self.shares[SWING if new else STANCE]
        foothold = np.zeros(2) if new else moving.contact
        walker_momentum = moving.momentum_about(foothold, np.ones(len(self.owner)), np.ones(share.size))
        return walker_momentum, moving.momentum_about(moving.hip, share[self.owner], share)


class RigidMasses:
    """Heel strikes of a walk, computed from point masses. The legs swing alternately, and may differ."""

    def __init__(self, assembly: Assembly, slope: float) -> None:
        exchanged = replace(assembly, legs=assembly.legs[::-1], feet=assembly.feet[::-1])
        own = SwingMasses(assembly, slope)
        self.turns = (own, own if have_equal_legs(assembly) else SwingMasses(exchanged, slope))

    def poses(self, states: Floats, first: int = 0) -> list[Moving]:
        """Return the motion of the masses in each of the states (strikes, 2 n).

        first  leg that swings in the first state, 0 or 1
        """
        return [self.turns[(first + k) % 2].pose(state) for k, state in enumerate(states)]

    def momentum_change(
        self, before: Sequence[Moving], after: Sequence[Moving], push_offs: tuple[float, float] = (0.0, 0.0)
    ) -> float:
        """Return the largest relative change of the conserved momenta over heel strikes.

        push_offs  impulse of the push-off of each leg (N s)
        """
        change = 0.0
        # A walker at rest has no momentum by which to divide.
        size = 1e-300
        for k, (old, new) in enumerate(zip(before, after, strict=True)):
            at_start = np.array(self.turns[k % 2].momenta(old, new=False))
            at_end = np.array(self.turns[(k + 1) % 2].momenta(new, new=True))
            # The push-off acts along the trailing leg. So it has no moment about the hip, and the second momentum does
            # not change.
            at_start[0] += moment_of(push_offs[(k + 1) % 2], old)
            change = max(change, *np.abs(at_end - at_start))
            size = max(size, *np.abs(at_start), *np.abs(at_end))
        return finite(change / size)


def moment_of(push_off: float, moving: Moving) -> float:
    """Return the moment (kg m^2/s) of a push-off about the new foothold.

    push_off  impulse (N s), from the rear foot to the hip
    """
    along, up = push_off * moving.hip / np.hypot(*moving.hip)
    return float(moving.contact[1] * along - moving.contact[0] * up)


def energy_gain(before: Sequence[Moving], after: Sequence[Moving]) -> float:
    """Return the largest gain of kinetic energy (J) in a heel strike, or 0 if all of them lose energy."""
    return max(0.0, *(new.kinetic - old.kinetic for old, new in zip(before, after, strict=True)))


def feet_off_the_slope(before: Sequence[Moving]) -> float:
    """Return the largest distance (m) of a landing foot from the slope at heel strike."""
    return float(max(abs(moving.contact[1]) for moving in before))


MEASURE: Final = "momentum change not explained by ground and gravity, relative to the walker's momentum"
BALANCE_STEPS: Final = 2  # enough for an impact and the motion after it
INITIAL_INTERVALS: Final = 256
MAX_PASSES: Final = 9  # limit on refinements, each of which splits unsettled intervals into four
MAX_INTERVALS: Final = 30_000  # a grid with more intervals is not refined further
# Largest total error of the impulse, as a fraction of the walker's momentum. Each interval may have an equal share.
SETTLED_IMPULSE_SHARE: Final = 1e-6
# A balance is inconclusive if the unknown part of the impulse exceeds this fraction of the walker's momentum.
MAX_UNKNOWN: Final = 1e-3


@dataclass(frozen=True)
class Balance:
    """Result of a momentum balance, as fractions of the walker's momentum."""

    residual: float  # largest difference between momentum change and impulse, over time and components
    unsure: float  # estimated error of the integrated impulse
    unresolved: float  # error of the friction impulse, because slip velocities are known only to within the tolerance
    steps: int  # solver steps


def momentum_finding(config: WalksConfig, scene: ContactScene, start: State, case: Case) -> Measure | NotMeasured:
    """Measure the momentum balance of a case's walk, or state why it cannot be judged."""
    if scene.pinned:
        return NotMeasured(MEASURE, "the pin transmits forces as well")
    balance = momentum_balance(config, scene, start, case)
    unknown = balance.unsure + balance.unresolved
    if unknown > MAX_UNKNOWN:
        shares = {
            "the impulse sums do not settle": balance.unsure,
            "friction depends on slip velocities below the tolerance": balance.unresolved,
        }
        why = " and ".join(reason for reason, share in shares.items() if share > 0.5 * MAX_UNKNOWN)
        return NotMeasured(MEASURE, why)
    # The balance holds along the computed path, even where this path departs from the exact one. So errors of steps
    # add up without growing, and MAGNIFIED does not apply.
    limit = allowed_difference(case, config.solver.contact.rtol, balance.steps) / MAGNIFIED + unknown
    return Measure(MEASURE, finite(balance.residual), limit)


def momentum_balance(config: WalksConfig, scene: ContactScene, start: State, case: Case) -> Balance:
    """Compare the change of momentum with the impulse over the first `BALANCE_STEPS` steps of a case."""
    leg = config.walker.leg_length_m
    rates = np.abs(start[len(start) // 2 :])
    speed = max(leg / pendulum_time(config), *rates[:2], leg * float(rates[2:].max()))
    scale = config.walker.total_mass_kg * np.array([speed, speed, speed * leg])
    settings = config.solver.contact
    steps = min(case.steps, BALANCE_STEPS)
    tolerances = Tolerances(settings.method, settings.rtol, settings.atol, case.budget)
    walk = scene.walk(start, steps, tolerances)
    grid = np.linspace(0.0, walk.end_time_s, INITIAL_INTERVALS + 1)
    if scene.walker.whole.push_off != 0.0:
        # A short pulse could lie between two points of the grid and be missed.
        pulse = scene.walker.whole.push_off_duration * np.linspace(0.0, 1.0, 9)
        pushed = (walk.touch_time_s[:, None] + pulse).ravel()
        grid = np.union1d(grid, pushed[pushed < walk.end_time_s])
    for _ in range(MAX_PASSES):
        samples = scene.walk(start, steps, tolerances, add_midpoints(grid)).samples
        assert samples is not None, "the walk is sampled"
        rates = impulse_rate(samples, scene, config, walk.touch_time_s) / scale
        change = integration_errors(samples.time_s, rates)
        unsettled = change > SETTLED_IMPULSE_SHARE / grid.size
        if not unsettled.any() or grid.size > MAX_INTERVALS:
            break
        grid = split(samples.time_s, unsettled)
    assert samples is not None, "the walk is sampled"
    momenta = momentum(samples, config) / scale
    differences = np.abs(momenta - momenta[0] - impulse(samples.time_s, rates))
    accepted = int(walk.work[ACCEPTED])
    # The slip velocity is known only to the tolerance. Its errors have random signs, so their effects add up like a
    # random walk, hence the square root.
    slip = tolerances.atol + tolerances.rtol * speed
    push = steepest_change(scene.walker.friction, slip) * config.gravity_m_s2 * walk.end_time_s / speed
    return Balance(float(differences.max()), float(change.sum()), push / max(1, accepted) ** 0.5, accepted)


def add_midpoints(grid: Floats) -> Floats:
    """Return the ends and midpoints of intervals in ascending order."""
    return np.sort(np.concatenate([grid, 0.5 * (grid[1:] + grid[:-1])]))


def split(times: Floats, coarse: NDArray[np.bool_]) -> Floats:
    """Return the ends of intervals after splitting those marked in `coarse` into four.

    times  ends and midpoints of the intervals, in ascending order
    """
    first = times[:-1:2]
    middle = times[1::2]
    last = times[2::2]
    halves = np.concatenate([middle, 0.5 * (first + middle), 0.5 * (middle + last)])
    return np.sort(np.concatenate([times[::2], halves[np.tile(coarse, 3)]]))


def impulse(times: Floats, rate: Floats) -> Floats:
    """Integrate a rate (times, components) by Simpson's rule from the start to each end of an interval.

    The result has the shape (ends, components).

    times  ends and midpoints of the intervals, in ascending order
    """
    widths = np.diff(times[::2])[:, None]
    pieces = widths / 6.0 * (rate[:-1:2] + 4.0 * rate[1::2] + rate[2::2])
    return np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(pieces, axis=0)])


def integration_errors(times: Floats, rate: Floats) -> Floats:
    """Estimate the error of each interval, in the worst component, as Simpson's rule minus the midpoint rule."""
    widths = np.diff(times[::2])[:, None]
    change = widths / 6.0 * (rate[:-1:2] - 2.0 * rate[1::2] + rate[2::2])
    return np.asarray(np.abs(change).max(axis=1))


def impulse_rate(samples: ContactSamples, scene: ContactScene, config: RigidConfig, touches: Floats) -> Floats:
    """Return the external force along and normal to the slope (N) and its torque about a point of the slope (N m).

    Ground, gravity and push-offs contribute. The result has the shape (times, 3).

    touches  (steps,) touch times (s), at which push-offs start
    """
    along, height, normal, friction, _ = np.moveaxis(sample_feet(scene.walker, samples), 2, 0)
    slope = config.slope_rad
    weight = config.walker.total_mass_kg * config.gravity_m_s2 * np.array([np.sin(slope), -np.cos(slope)])
    torque = (along * normal - height * friction).sum(axis=1) + cross(samples.states[:, :2], weight)
    rates = np.column_stack([friction.sum(axis=1) + weight[0], normal.sum(axis=1) + weight[1], torque])
    form = scene.walker.whole
    samples_range = np.arange(samples.time_s.size)
    if form.push_off != 0.0:
        pushing = 1 - samples.stance
        y = samples.states
        foot = np.column_stack([along[samples_range, pushing], height[samples_range, pushing]])
        angles = y[:, 2 : y.shape[1] // 2] + slope
        s, c = np.sin(angles), np.cos(angles)
        x = form.hip_x[: angles.shape[1]]
        up = form.hip_y[: angles.shape[1]]
        line = y[:, :2] + np.column_stack([c @ x - s @ up, s @ x + c @ up]) - foot
        u = np.clip((samples.time_s[:, None] - touches) / form.push_off_duration, 0.0, 1.0)
        # The integral of (u (1 - u))^2 from 0 to 1 is 1/30.
        bell = 30.0 * ((u * (1.0 - u)) ** 2).sum(axis=1) * form.push_offs[pushing] / form.push_off_duration
        push = (bell / np.hypot(*line.T))[:, None] * line
        rates += np.column_stack([push, cross(foot, push)])
    return rates


def momentum(samples: ContactSamples, config: RigidConfig) -> Floats:
    """Return the momentum along and normal to the slope (kg m/s) and about a point on the slope (kg m^2/s).

    It has the shape (ends, 3): the midpoints of the intervals are left out.
    """
    y = samples.states[::2]
    n = y.shape[1] // 2 - 2
    walker_masses = Masses(assembly_of(config.walker))
    rate = y[:, 4 + n :]
    place, velocity = walker_masses.moving(y[:, 2 : 2 + n] + config.slope_rad, rate)
    r, v = y[:, None, 0:2] + place, y[:, None, 2 + n : 4 + n] + velocity
    return np.column_stack([walker_masses.mass @ v, cross(r, v) @ walker_masses.mass + rate @ walker_masses.inertia])


def cross(r: Floats, v: Floats) -> Floats:
    """Return the planar cross product (...) of vectors (..., 2)."""
    return np.asarray(r[..., 0] * v[..., 1] - r[..., 1] * v[..., 0])


CENTRE_HEIGHT = 1  # index of the height of the centre of mass in the free walker's state
STRIKE_TOLERANCE = 1e-9  # largest relative error at a heel strike
SAMPLE_RATE = 40  # samples per pendulum time
# Quadrature errors may lower the dissipated energy, but by no more than this fraction of the allowed residual.
REGAIN_TOLERANCE = 1e-3


@dataclass(frozen=True)
class JudgedWalk:
    """Walk to be judged, in either model. Times are in pendulum times of the walker.

    touches     times of the heel strikes
    end         end time, or None in the rigid model, whose walks end at a heel strike
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
    energy: float  # J, scale of the residuals: m g L plus the kinetic and elastic energy at the start

    def tolerances(self, case: Case, tighter: float = 1.0) -> Tolerances:
        """Return the config's method and tolerances with the case's budget. `tighter` multiplies both tolerances."""
        settings = self.config.solver.rigid if case.model == "rigid" else self.config.solver.contact
        return Tolerances(settings.method, tighter * settings.rtol, tighter * settings.atol, case.budget)

    def repeated_case(self, case: Case) -> Case:
        """Return the case for a repeated walk. It keeps all its steps, because outcomes are compared, too."""
        return case


@dataclass(frozen=True)
class RigidStart(CaseStart):
    residual_name: ClassVar[str] = "energy drift within a swing"
    walker: RigidModel

    def repeated_case(self, case: Case) -> Case:
        """Return the case for a repeated walk. It keeps only the steps whose times are compared."""
        return case.model_copy(update={"steps": min(case.steps, max(case.compared_steps, 1))})

    def walk(self, case: Case, tolerances: Tolerances, sampled: bool = False) -> JudgedWalk:  # noqa: ARG002
        """Simulate a case. Only heel strikes are judged, so `sampled` has no effect."""
        walk = take_walk(self.walker, tolerances, self.start, case.steps)
        numbers = np.concatenate([walk.touch_time_s, walk.before.ravel(), walk.after.ravel()])
        touches = walk.touch_time_s / pendulum_time(self.config)
        cost = walk.work.rhs_evaluations, walk.work.accepted
        off = walk.energy_balance_residual if self.walker.sprung else walk.energy_drift
        return JudgedWalk(walk.outcome, touches, None, off, *cost, numbers, walk)

    def measures(self, walk: JudgedWalk, _case: Case) -> list[Measure]:
        """Check that at every heel strike the foot is on the slope, momentum is conserved and energy does not grow."""
        record: RigidWalkResult = walk.record
        if not record.steps:
            return []
        strikes = RigidMasses(assembly_of(self.config.walker, rigid=True), self.config.slope_rad)
        before = strikes.poses(record.before)
        after = strikes.poses(record.after, first=1)
        pushes = (float(self.walker.push_off), float(self.walker.exchanged.push_off))
        distance = feet_off_the_slope(before) / self.walker.leg_length
        # Push-offs may add energy.
        gain = 0.0 if any(pushes) else energy_gain(before, after) / self.energy
        measured = {
            "distance of the feet from the slope at heel strike, in leg lengths": finite(distance),
            "momentum changed by a heel strike": strikes.momentum_change(before, after, pushes),
            "energy gained at a heel strike": finite(gain),
        }
        return [Measure(name, value, STRIKE_TOLERANCE) for name, value in measured.items()]


@dataclass(frozen=True)
class ContactStart(CaseStart):
    residual_name: ClassVar[str] = "energy balance residual"
    scene: ContactScene

    def walk(self, case: Case, tolerances: Tolerances, sampled: bool = False) -> JudgedWalk:
        unit = pendulum_time(self.config)
        interval = self.scene.ground.frame.pendulum_time / SAMPLE_RATE if sampled else None
        walk = self.scene.walk(self.start, case.steps, tolerances, interval)
        numbers = np.concatenate([walk.end_state, walk.touch_time_s, walk.touch_along_m, walk.dissipated_J])
        touches = walk.touch_time_s / unit
        end = walk.end_time_s / unit
        cost = int(walk.work[RHS]), int(walk.work[ACCEPTED])
        return JudgedWalk(walk.outcome, touches, end, walk.energy_balance_residual_J, *cost, numbers, walk)

    def measures(self, walk: JudgedWalk, case: Case) -> list[Measure]:
        """Measure the energy that friction and damping seem to give back.

        Return an empty list if the walk was not sampled.
        """
        record: ContactWalkResult = walk.record
        if record.samples is None or record.samples.dissipated_J.shape[0] < 2:
            return []
        falls = -np.diff(record.samples.dissipated_J[:, :2], axis=0)
        back = finite(max(0.0, float(np.max(falls))) / self.energy)
        return [Measure("energy regained from friction and damping", back, REGAIN_TOLERANCE * case.balance)]

    def momentum(self, walk: JudgedWalk, case: Case) -> Measure | NotMeasured:
        """Measure the momentum balance, unless the walk has no definite outcome or ended at time 0."""
        if not walk.outcome.answered or walk.record.end_time_s <= 0.0:
            return NotMeasured(MEASURE, f"the walk ended as {walk.outcome.label}")
        return momentum_finding(self.config, self.scene, self.start, case)


Start = RigidStart | ContactStart


@cache
def gait_of(walker: RigidModel, seed: int) -> RigidGait | None:
    """Find the gait of a walker. Gaits are cached, because most cases of a catalogue differ only in the ground."""
    return find_gaits(walker, seed).gait


def prepare_start(config: WalksConfig, case: Case) -> Start | None:
    """Prepare the start of a case. Return None if the start or the pad pitch needs a gait that does not exist."""
    walker = rigid_walker(config)
    if isinstance(config.start, str):
        if (gait := gait_of(walker, config.seed)) is None:
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
    behind = abs(float(swing_foot(walker, state)[1]))
    asymmetry = 2.0 * (behind / length - 1.0) if walker.legs_differ and not isinstance(config.start, MidStep) else 0.0
    try:
        scene = scene_on_pads(config, length, state, asymmetry=asymmetry)
    except NoAnswer:
        return None
    y = start_state(scene, state)
    y = (*y[:CENTRE_HEIGHT], y[CENTRE_HEIGHT] - case.lowered_m, *y[CENTRE_HEIGHT + 1 :])
    leg = config.walker.leg_length_m
    rates = y[len(y) // 2 :]
    speed = float(np.max(np.abs([*rates[:2], *(leg * rate for rate in rates[2:])])))
    # A lowered walker presses both feet into the ground.
    stored = 2.0 * elastic_energy(scene.walker.normal, case.lowered_m)
    energy = scene.walker.mass * (config.gravity_m_s2 * leg + 0.5 * speed**2) + stored
    return ContactStart(config, y, energy, scene)
