"""The two gaits of a compass walker in the limit of a vanishing slope, used as seeds of the search for gaits.

At small angles the swing phase is linear, D(0) ddq = diag(-m b g, K g) q, with one oscillating and one growing mode,
and the heel strike is a constant linear map. Two kinds of period-1 motion remain as the slope phi goes to zero.

Long period: the step is symmetric about mid-swing, and both legs turn at the same rate at heel strike, so that to
leading order the impact changes nothing. Its energy loss, M (L omega alpha)^2 / 2 at an angle alpha between the legs,
equals the energy from a step's descent, M g L alpha phi. As omega is proportional to alpha, phi = kappa alpha^3.

Short period: the swing foot comes down while still moving forward, and the whole motion is proportional to phi. The
ratio grows without bound as the feet's mass vanishes. In that limit this gait, too, grows as the cube root of phi.

Source: Garcia, Chatterjee, Ruina, Coleman, The simplest walking model: stability, complexity, and scaling, J. Biomech.
Eng. 120 (1998), section 4 and appendix. Unlike theirs, the legs in this module have mass.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from walkerlab.physics.mechanics import rigid_model as rigid
from walkerlab.physics.mechanics.impact import strike
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.solvers.system import Floats, State

LONG_PERIOD = "long-period seed"
SHORT_PERIOD = "short-period seed"
SCAN = 400  # number of samples that bracket a root
LOSS_ANGLE = 1e-3  # rad, small compared to one and large compared to rounding errors
# rad, angle between the legs at which the long-period seed is accurate to a percent
LONG_AMPLITUDE = 0.05
SHORT_AMPLITUDE = 0.002
# largest growth exponent of the falling mode over half a step. Above it, the start is lost in rounding errors.
MAX_GROWTH = 30.0
# matrices for a slope of 1 rad: STATE_OF maps (z, 1) to the state, SECTION_ROWS maps (z, 1) to z, and FEET_DOWN maps
# the state to theta_1 + theta_2
STATE_OF = np.array([[-1.0, 0.0, 0.0, -2.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
SECTION_ROWS = np.eye(3, 4)
FEET_DOWN = np.array([1.0, 1.0, 0.0, 0.0])
THETA_2 = np.array([1.0, 0.0, 0.0])


class SmallSlopeSeed(NamedTuple):
    name: str
    slope: float  # rad
    z: Floats  # (3,) theta_2, dtheta_1, dtheta_2 after the heel strike
    period: float  # s, period in the limit
    limit: Floats  # (3,) z / slope^(1/3) in the limit


class Modes(NamedTuple):
    """Modes of the linear swing phase: ddq = V diag(-swing^2, fall^2) V^-1 q."""

    swing: float  # rad/s, frequency of the oscillating mode
    fall: float  # 1/s, rate of the growing mode
    V: Floats  # (2, 2), one mode per column, oscillating first


def linear_modes(walker: RigidModel) -> Modes | None:
    """Return the modes of the swing phase about upright legs, or None if the legs have too little inertia."""
    legs = leg_columns(walker)
    level = rigid.change_slope(walker, 0.0)
    inertias = rigid.mass_matrix(level, level.zero_state)
    M, K = legs.T @ inertias @ legs, walker.gravity * legs.T @ np.diag(walker.arm_y) @ legs
    # det(K - x M) = first x^2 - 2 half x + last
    first, last = np.linalg.det(M), np.linalg.det(K)
    half = 0.5 * (K[0, 0] * M[1, 1] + K[1, 1] * M[0, 0]) - K[0, 1] * M[0, 1]
    # One positive and one negative root: the stance leg falls over, the swing leg swings.
    if not last < 0.0 < first:
        return None
    # root of the polynomial times `first`, without cancellation
    root = half + math.copysign(math.sqrt(half * half - first * last), half)
    oscillating, growing = sorted((root / first, last / root))
    swinging = K - oscillating * M
    falling = K - growing * M
    # The kernel of a singular symmetric matrix ((a, b), (b, c)) is spanned by (c, -b) and by (-b, a).
    V = np.array([[swinging[1, 1], -falling[0, 1]], [-swinging[0, 1], falling[0, 0]]])
    return Modes(math.sqrt(-oscillating), math.sqrt(growing), V)


def leg_columns(walker: RigidModel) -> Floats:
    """Return the angles (n, 2) of all bodies for unit angles of the swing leg and the stance leg, one column each."""
    return np.array([rigid.apply_couplings(walker, rigid.STRAIGHT, unit) for unit in np.eye(len(walker.arm_x))[:2]]).T


def seeds(walker: RigidModel) -> tuple[SmallSlopeSeed, ...]:
    """Return the small-slope gaits of `walker`, whatever its slope. Only walkers that balance upright have them."""
    modes = None if walker.kneed or walker.lean != 0.0 or walker.arm_x.any() else linear_modes(walker)
    try:
        long = None if modes is None else long_period_seed(walker, modes)
        if modes is None or long is None:
            return ()
        short = short_period_seed(walker, modes, long.period)
    except FloatingPointError:  # with all masses in one place a heel strike is undetermined
        return ()
    return (long,) if short is None else (long, short)


def long_period_seed(walker: RigidModel, modes: Modes) -> SmallSlopeSeed | None:
    """Return the symmetric gait at LONG_AMPLITUDE, or None if the walker falls before its legs meet again."""
    half = symmetric_half_period(modes)
    if half is None or modes.fall * half > MAX_GROWTH:
        return None
    at_end = np.array([math.sin(modes.swing * half) / modes.swing, math.sinh(modes.fall * half) / modes.fall])
    rates_at_end = np.array([math.cos(modes.swing * half), math.cosh(modes.fall * half)])
    total = modes.V[0] + modes.V[1]
    # weights of the modes: at the end both feet are on the slope, with a unit angle between the legs
    weights = np.array([total[1] * at_end[1], -total[0] * at_end[0]])
    weights /= (modes.V[0] - modes.V[1]) @ (weights * at_end)
    omega = float((modes.V @ (weights * rates_at_end)).mean())
    return cube_root_seed(LONG_PERIOD, walker, np.array([0.5, omega, omega]), 2.0 * half)


def cube_root_seed(name: str, walker: RigidModel, per_angle: Floats, period: float) -> SmallSlopeSeed:
    """Return the gait at LONG_AMPLITUDE.

    per_angle  (3,) theta_2 + phi, dtheta_1 and dtheta_2, each divided by the angle between the legs
    """
    kappa = slope_for_loss(walker, per_angle)
    slope = kappa * LONG_AMPLITUDE**3
    z = LONG_AMPLITUDE * per_angle - np.array([slope, 0.0, 0.0])
    return SmallSlopeSeed(name, slope, z, period, per_angle / np.cbrt(kappa))


@np.errstate(divide="raise", invalid="raise")
def slope_for_loss(walker: RigidModel, per_angle: Floats) -> float:
    """Return slope / angle^3, where the slope balances the heel strike's loss at this angle between the legs."""
    # In the limit the gait ends a step as it began it, with both legs at the same rates.
    flat = rigid.change_slope(walker, 0.0)
    angle = LOSS_ANGLE
    omega = angle * float(per_angle[2])
    before = leg_state(flat, (0.5 * angle, -0.5 * angle), (omega, omega))
    after = apply_strike(flat, before)
    lost = rigid.kinetic_energy(flat, before) - rigid.kinetic_energy(flat, after)
    length = rigid.swing_foot(flat, before)[1] + flat.radius * angle
    return float(lost / (flat.mass * flat.gravity * length * angle**3))


@np.errstate(divide="raise", invalid="raise")
def apply_strike(walker: RigidModel, state: State) -> Floats:
    after = np.zeros(len(state))
    strike(walker, walker, rigid.AT_STRIKE, np.array(state), after)
    return after


def leg_state(walker: RigidModel, theta: tuple[float, float], omega: tuple[float, float]) -> State:
    legs = leg_columns(walker)
    return tuple(float(x) for x in (*(legs @ theta), *(legs @ omega)))


def symmetric_half_period(modes: Modes) -> float | None:
    """Return the first time h > 0 (s) after mid-swing with theta_1 + theta_2 = 0 and dtheta_1 = dtheta_2."""
    total = modes.V[0] + modes.V[1]
    apart = modes.V[0] - modes.V[1]

    def mismatch(h: Floats) -> Floats:
        swinging = total[0] * np.sin(modes.swing * h) / modes.swing * apart[1]
        falling = total[1] * np.tanh(modes.fall * h) / modes.fall * apart[0] * np.cos(modes.swing * h)
        # Both terms have been divided by cosh, which would overflow. Division by h removes the root at mid-swing.
        return np.asarray((swinging - falling) / h)

    return first_root(mismatch, 2.0 * math.pi / modes.swing)


def short_period_seed(walker: RigidModel, modes: Modes, longest: float) -> SmallSlopeSeed | None:
    """Return the gait whose angles are proportional to the slope and whose period is below `longest` (s), or None if it
    does not exist."""
    try:
        conditions = step_conditions(walker, modes)
        period = first_root(lambda t: np.asarray(np.linalg.det(conditions(t)) / t), longest)
        if period is None:
            return None
        rows = conditions(np.array(period))[:3]
        z = np.asarray(np.linalg.solve(rows[:, :3], -rows[:, 3]), np.float64)
    except np.linalg.LinAlgError:  # with all masses in one place a heel strike is undetermined
        return None
    # The angle between the legs is 2 (z[0] + 1) times the slope.
    if z[0] <= -1.0:
        return None
    slope = 0.5 * SHORT_AMPLITUDE / float(z[0] + 1.0)
    per_angle = 0.5 * (z + THETA_2) / (z[0] + 1.0)
    # With hardly any mass at the feet, the cube-root law already holds at this amplitude.
    if slope_for_loss(walker, per_angle) * SHORT_AMPLITUDE**3 > slope:
        return cube_root_seed(SHORT_PERIOD, walker, per_angle, period)
    return SmallSlopeSeed(SHORT_PERIOD, slope, slope * z, period, np.zeros(3))


def step_conditions(walker: RigidModel, modes: Modes) -> Callable[[Floats], Floats]:
    """Return a function that maps durations t (s) to matrices (..., 4, 4) of the linearised conditions for a step, at a
    slope of one radian."""
    # The matrices act on (z, 1). Three rows require that z repeats after t, one that both feet are down. A solution
    # exists if the determinant vanishes.
    flat = rigid.change_slope(walker, 0.0)
    n = len(walker.arm_x)
    swing = modes.swing
    fall = modes.fall
    inverse = np.linalg.inv(modes.V)
    strike = np.zeros((3, 4))  # the heel strike at vanishing angles, including the exchange of roles
    strike[0, 0] = 1.0
    for leg, omega in enumerate(((1.0, 0.0), (0.0, 1.0))):
        strike[1:, 2 + leg] = apply_strike(flat, leg_state(flat, (0.0, 0.0), omega))[n : n + 2]
    # The equilibrium is not zero, because a leg with a rolling foot balances off the vertical on a slope.
    legs = leg_columns(flat)
    pull = np.array([0.0, flat.mass * flat.gravity * flat.radius])
    equilibrium = np.zeros((4, 4))
    equilibrium[:2, 3] = np.linalg.solve(flat.gravity * legs.T @ np.diag(flat.arm_y) @ legs, pull)

    def combine_modes(oscillating: Floats, growing: Floats) -> Floats:
        weights = np.stack((oscillating, growing), axis=-1)[..., None, :]
        return np.asarray(modes.V * weights @ inverse, np.float64)

    def conditions(t: Floats) -> Floats:
        sine = np.sin(swing * t)
        cosine = np.cos(swing * t)
        growing = np.sinh(fall * t)
        grown = np.cosh(fall * t)
        flow = np.empty((*t.shape, 4, 4))  # maps a state to the state t later
        flow[..., :2, :2] = flow[..., 2:, 2:] = combine_modes(cosine, grown)
        flow[..., :2, 2:] = combine_modes(sine / swing, growing / fall)
        flow[..., 2:, :2] = combine_modes(-swing * sine, fall * growing)
        end = flow @ (STATE_OF - equilibrium) + equilibrium
        bordered = np.empty_like(flow)
        bordered[..., :3, :] = SECTION_ROWS - strike @ end
        bordered[..., 3, :] = FEET_DOWN @ end
        # Both feet are down if theta_1 + theta_2 = -2 phi, with phi = 1.
        bordered[..., 3, 3] += 2.0
        return bordered

    return conditions


def first_root(f: Callable[[Floats], Floats], longest: float) -> float | None:
    """Return the smallest root of f in (0, longest) by successively finer samples, or None if f keeps its sign."""
    # Exclude the end, at which the conditions of the short gait degenerate into those of the long gait.
    samples = longest * np.arange(1, SCAN) / SCAN
    while True:
        values = f(samples)
        turns = np.flatnonzero(values[:-1] * values[1:] <= 0.0)
        if turns.size == 0:
            return None
        low, high = float(samples[turns[0]]), float(samples[turns[0] + 1])
        if high - low <= 1e-14 * high:
            return 0.5 * (low + high)
        samples = np.linspace(low, high, SCAN)
