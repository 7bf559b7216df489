"""Records of a walk on compliant ground in addition to its steps: samples, energy balance, tangent.

The tangent follows the variational equations along the solver's steps. On each step the derivative Phi of the state
obeys dPhi/dt = J(t) Phi. This equation is solved by three-stage Radau collocation on the same step, with J at the
stages: for radau5 this is the exact derivative of the step itself. The force law is continuous at its switching points
and at touch and lift, so Phi jumps only at the events of `contact_jumps`. A foot that leaves its pad under load would
also need a jump, but that happens in no gait.
"""

from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics import energy_channels as channels
from walkerlab.physics import kernels
from walkerlab.physics.ground.energy import dissipated_power, foot_elastic_energy, push_power, total_energy
from walkerlab.physics.ground.hinges import hinge_energies, hinge_powers
from walkerlab.physics.ground.walker import STATE_VECTOR, OnGround, one_foot_motion, relative_to_ground, store_whole
from walkerlab.physics.hybrid.contact_state import HEIGHT, LEGS_TURN, PER_FOOT, VERTICAL_VELOCITY, WalkState
from walkerlab.physics.hybrid.walk_record import torque_work
from walkerlab.physics.kernels import kernel, kernel_part, matrix, pass_by_reference, vector
from walkerlab.physics.mechanics.hinges import HIP_ROW, hinge_law
from walkerlab.physics.mechanics.tree import fast_fields, record_type
from walkerlab.physics.solvers.events import RISING, CrossingFinder, first_crossing
from walkerlab.physics.solvers.linear import factor, solve
from walkerlab.physics.solvers.radau5 import RADAU_NODES, ROOT6, Radau5
from walkerlab.physics.solvers.stepping import T_OLD, T, interpolate, sample
from walkerlab.physics.solvers.system import jacobian

SIDE_OFFSET = 4e-12  # s, a few times the uncertainty of event times
# coefficients of Radau IIA: Hairer and Wanner II, (5.6)
RADAU_WEIGHTS = np.array(
    [
        [(88.0 - 7.0 * ROOT6) / 360.0, (296.0 - 169.0 * ROOT6) / 1800.0, (-2.0 + 3.0 * ROOT6) / 225.0],
        [(296.0 + 169.0 * ROOT6) / 1800.0, (88.0 + 7.0 * ROOT6) / 360.0, (-2.0 - 3.0 * ROOT6) / 225.0],
        [(16.0 - ROOT6) / 36.0, (16.0 + ROOT6) / 36.0, 1.0 / 9.0],
    ]
)


@pass_by_reference
class Tangent(NamedTuple):
    """Derivative Phi of the state with respect to the start, and workspace. The free walker's state has n values."""

    # If locked knees or a pinned foot reduce the state, only the first rows are used.

    Phi: Any  # (n, directions); no directions unless the tangent is requested
    stages: Any  # (4, n, n) Jacobians at the three stages, and one more for extrapolation
    system: Any  # (3 n, 3 n) matrix of the collocation equations, or its factors
    pivots: Any  # (3 n,)
    rates: Any  # (3 n,) stage derivatives of one direction


def new_tangent(n: int, directions: int) -> Tangent:
    m = n if directions else 0
    Phi, stages, system = map(np.zeros, ((n, directions), (4, m, m), (3 * m, 3 * m)))
    return Tangent(Phi, stages, system, pivots=np.zeros(3 * m, np.int64), rates=np.zeros(3 * m))


@kernel_part
def jacobian_at(method: Any, system: Any, fraction: float, J: Any) -> None:
    y = vector(STATE_VECTOR)[: method.y.size]
    interpolate(method, system, fraction, y)
    jacobian(system, method.clock[T_OLD] + fraction * (method.clock[T] - method.clock[T_OLD]), y, J)


@kernel_part
def carry_tangent(tangent: Tangent, method: Any, system: Any) -> None:
    """Advance Phi over the last solver step."""
    n, h = method.y.size, method.clock[T] - method.clock[T_OLD]
    for i in range(2):
        jacobian_at(method, system, RADAU_NODES[i], tangent.stages[i])
    jacobian_at_end(tangent, method, system)
    for i in range(3):
        for j in range(3):
            for row in range(n):
                for column in range(n):
                    same = 1.0 if i == j and row == column else 0.0
                    slope = h * RADAU_WEIGHTS[i, j] * tangent.stages[i, row, column]
                    tangent.system[i * n + row, j * n + column] = same - slope
    factor(tangent.system, tangent.pivots, 3 * n)
    for direction in range(tangent.Phi.shape[1]):
        carry_direction(tangent, n, direction, h)


@kernel_part
def jacobian_at_end(tangent: Tangent, method: Any, system: Any) -> None:
    """Compute the Jacobian at the solver step's end, extrapolated from two states shortly before the end."""
    # The Jacobian jumps at a switching point of the force law, and a solver step to that point may end on either side.
    near = min(0.25, SIDE_OFFSET / (method.clock[T] - method.clock[T_OLD]))
    for i in range(2):
        jacobian_at(method, system, 1.0 - (1 + i) * near, tangent.stages[2 + i])
    n = method.y.size
    for row in range(n):
        for column in range(n):
            tangent.stages[2, row, column] += tangent.stages[2, row, column] - tangent.stages[3, row, column]


@kernel_part
def carry_direction(tangent: Tangent, n: int, direction: int, h: float) -> None:
    """Advance one column of Phi (n,): solve K = J (Phi + h A K) for the stage derivatives, then add h b K."""
    for i in range(3):
        for row in range(n):
            total = 0.0
            for k in range(n):
                total += tangent.stages[i, row, k] * tangent.Phi[k, direction]
            tangent.rates[i * n + row] = total
    solve(tangent.system, tangent.pivots, tangent.rates, 0, 3 * n)
    for row in range(n):
        change = (
            RADAU_WEIGHTS[2, 0] * tangent.rates[row]
            + RADAU_WEIGHTS[2, 1] * tangent.rates[n + row]
            + RADAU_WEIGHTS[2, 2] * tangent.rates[2 * n + row]
        )
        tangent.Phi[row, direction] += h * change


# nodes of a Radau quadrature rule over a solver step, preceded by the start of the step, and their weights
Quadrature = tuple[tuple[float, ...], tuple[float, ...]]
RADAU_ORDER_5: Quadrature = (
    (0.0, 0.15505102572168219, 0.6449489742783178, 1.0),
    (0.0, 0.37640306270046725, 0.5124858261884216, 0.1111111111111111),
)
RADAU_ORDER_9: Quadrature = (
    (0.0, 0.05710419611451768, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195, 1.0),
    (0.0, 0.14371356079122594, 0.28135601514946207, 0.31182652297574126, 0.22310390108357075, 0.04),
)


@pass_by_reference
class ContactSamples(NamedTuple):
    time_s: Any  # (samples,)
    states: Any  # (samples, 4 + 2 n) states of the free walker with all bodies
    has_ground: Any  # (samples, 2) whether there is ground below each foot
    stance: Any  # (samples,) stance foot
    knees: Any  # (samples, 2) state of each knee
    level: Any  # (samples, 2) m, height of the ground above the slope, for each foot
    account: Any  # (samples, entries) J, energy account up to each sample

    @property
    def dissipated_J(self) -> Any:
        """Energy dissipated up to each sample (samples, 5), in the order of `energy_channels.LOSSES`."""
        return self.account[:, channels.LOSS_ENTRIES]

    @property
    def driven_J(self) -> Any:
        """Energy supplied by push-off and hip up to each sample (samples, 2)."""
        return self.account[:, channels.SUPPLY_ENTRIES]


@fast_fields
class ContactTally(np.record):  # type: ignore[misc]  # NumPy's stubs call one of its bases final
    """Counts, extremes and initial energy of a walk: a structured scalar that kernels write to."""

    recorded: int  # number of samples recorded
    max_penetration: float  # m
    residual: float  # J, largest residual of the energy balance
    start_energy: float  # J, initial energy, with potential energy measured from a fixed origin
    energy_below: float  # J, initial energy, with potential energy measured from the slope below the walker
    start_spring: float  # J, initial elastic energy of the springs at the hinges
    spring_work: float  # J, work of these springs up to the last touch that ended a step


CONTACT_TALLY = record_type(ContactTally, {})


@pass_by_reference
class ContactObserver(NamedTuple):
    """Samples, energy balance and tangent of a walk. Those that are not requested are skipped."""

    track_energy: bool  # whether to keep the energy balance
    samples: ContactSamples
    account: Any  # (entries,) J, up to the present time
    account_at_touch: Any  # (entries,) J, up to the last touch that ended a step
    tally: ContactTally
    tangent: Tangent  # derivative of the state with respect to the start; empty unless requested


@kernel_part
def observe(
    observer: ContactObserver, method: Any, system: OnGround, finder: CrossingFinder, walk_state: WalkState
) -> None:
    """Record the last solver step. It must be valid, and its event functions must be sampled."""
    record_samples(observer, method, system, walk_state)
    if observer.track_energy:
        balance(observer, method, system)
        note_torque(observer, method, system, finder)
        for foot in range(2):
            if system.has_ground[foot] != 0:
                note_depth(observer, method, system, finder, foot)
    if observer.tangent.Phi.shape[1] > 0:
        carry_tangent(observer.tangent, method, system)


@kernel_part
def record_samples(observer: ContactObserver, method: Any, system: OnGround, walk_state: WalkState) -> None:
    t, h = method.clock[T_OLD], method.clock[T] - method.clock[T_OLD]
    samples = observer.samples
    index = observer.tally.recorded
    y = vector(STATE_VECTOR)[: method.y.size]
    while index < samples.time_s.size and samples.time_s[index] <= method.clock[T]:
        fraction = (samples.time_s[index] - t) / h
        interpolate(method, system, fraction, y)
        store_whole(system.form, y, samples.states[index])
        for entry in range(channels.ENTRIES):
            samples.account[index, entry] = observer.account[entry]
        add_work_until(method, system, fraction, samples.account[index])
        for k in range(2):
            samples.knees[index, k] = walk_state.knee[k]
            samples.has_ground[index, k] = walk_state.has_ground[k]
            samples.level[index, k] = walk_state.level[k]
        samples.stance[index] = walk_state.progress.stance
        index += 1
    observer.tally.recorded = index


@kernel_part
def balance(observer: ContactObserver, method: Any, system: OnGround) -> None:
    """Record work and losses of the last solver step, and the energy residual at its end."""
    account = observer.account
    add_work_until(method, system, 1.0, account)
    # TORQUE and FORWARD are parts of HIP_WORK and do not count again.
    lost = -account[channels.PUSH_OFF] - account[channels.HIP_WORK]
    for entry in range(channels.PUSH_OFF):
        lost += account[entry]
    residual = end_energy(system, method.y) + lost - observer.tally.start_energy
    observer.tally.residual = max(observer.tally.residual, abs(residual))


@kernel_part
def note_torque(observer: ContactObserver, method: Any, system: OnGround, finder: CrossingFinder) -> None:
    torque = hinge_law(system.form, HIP_ROW).torque
    if torque != 0.0:
        given = torque_work(torque, method, system, finder, LEGS_TURN, 1.0)
        observer.account[channels.TORQUE] += given.net
        observer.account[channels.FORWARD] += given.positive


@kernel_part
def note_work(observer: ContactObserver, system: OnGround, y: Any) -> None:
    """Record the energy account and the work of the springs at the end of a step.

    The values at the last heel strike give the work in completed steps.
    """
    for entry in range(channels.ENTRIES):
        observer.account_at_touch[entry] = observer.account[entry]
    observer.tally.spring_work = observer.tally.start_spring - hinge_energies(system, y)[0]


@kernel_part
def note_depth(observer: ContactObserver, method: Any, system: OnGround, finder: CrossingFinder, foot: int) -> None:
    """Record a foot's largest penetration in the last solver step: at its end, or where the foot stopped sinking in."""
    end = finder.nodes.size - 1
    first = foot * PER_FOOT
    deepest = -finder.values[first + HEIGHT, end]
    if finder.values[first + VERTICAL_VELOCITY, 0] < 0.0 < finder.values[first + VERTICAL_VELOCITY, end]:
        at = first_crossing(finder, first + VERTICAL_VELOCITY, RISING, 0.0, False)
        y = vector(STATE_VECTOR)[: method.y.size]
        # If rounding hides the crossing, it is at the end of the solver step.
        interpolate(method, system, min(at, 1.0), y)
        deepest = max(deepest, -relative_to_ground(system, foot, one_foot_motion(system.form, foot, y)).height)
    observer.tally.max_penetration = max(observer.tally.max_penetration, deepest)


@kernel_part
def observe_edge(observer: ContactObserver, system: OnGround, foot: int, y: Any) -> None:
    if system.has_ground[foot] != 0 and observer.track_energy:
        observer.account[channels.EDGES] += foot_elastic_energy(system, foot, y)


@kernel
def end_energy(system: OnGround, y: Any) -> float:
    return total_energy(system, y)


@kernels.dispatch_by_type_or_default
def quadrature(method: Any) -> Quadrature:
    """Return the quadrature rule for powers over a method's step, as accurate as the best dense output."""
    return RADAU_ORDER_9


@quadrature.case(Radau5)
def collocation_rule(method: Radau5) -> Quadrature:
    return RADAU_ORDER_5


@kernel_part
def add_work_until(method: Any, system: OnGround, fraction: float, account: Any) -> None:
    """Add the work and losses (J) in the first `fraction` of the last solver step to an account (entries,)."""
    rule = quadrature(method)
    nodes, _ = rule
    fractions = vector(nodes)
    states = matrix(STATE_VECTOR)
    for i in range(len(nodes)):
        fractions[i] = fraction * nodes[i]
    sample(method, system, fractions, states)
    span = fraction * (method.clock[T] - method.clock[T_OLD])
    add_work(system, states, rule, method.clock[T_OLD], span, account)


@kernel
def add_work(system: OnGround, states: Any, rule: Quadrature, begin: float, span: float, account: Any) -> None:
    """Add the work and losses (J) from `begin` to `begin + span` (s) to an account, given the states at the nodes."""
    nodes, weights = rule
    for foot in range(2):
        if system.has_ground[foot] != 0:
            damping, friction = foot_work(system, states, weights, foot, span)
            account[channels.DAMPING_LOSS] += damping
            account[channels.FRICTION_LOSS] += friction
    for i in range(1, len(nodes)):
        weight = span * weights[i]
        supplied, lost = hinge_powers(system, states[i])
        account[channels.HIP_WORK] += weight * supplied
        account[channels.KNEE_STOP] += weight * lost
        account[channels.PUSH_OFF] += weight * push_power(system, begin + nodes[i] * span, states[i])


@kernel_part
def foot_work(system: OnGround, states: Any, weights: tuple[float, ...], foot: int, span: float) -> tuple[float, float]:
    """Compute the energies (J) lost to damping and friction under a foot that has ground below it."""
    # If the force law has released the foot, the damping loss is the energy that the ground's spring loses: quadrature
    # would be inaccurate for powers of the penetration. Solver steps end at a release, so the foot stays released
    # within one.
    damping = 0.0
    friction = 0.0
    let_go = True
    last = len(weights) - 1
    # The first node, at the start of the solver step, has weight zero. Only the elastic energies below need it.
    for i in range(1, len(weights)):
        power = dissipated_power(system, foot, states[i])
        damping += span * weights[i] * power[0]
        friction += span * weights[i] * power[1]
        # The end of the solver step may lie on either side of a release.
        let_go = let_go and (i == last or power[2] == 0.0)
    if let_go:
        damping = foot_elastic_energy(system, foot, states[0]) - foot_elastic_energy(system, foot, states[last])
    return damping, friction
