"""A plain model of a walker: a second route to its gaits, in which known mistakes can be switched on.

It shares no equations with the compiled model. It derives Lagrange's equations from point masses, whose velocities are
linear in the rates of the bodies. Heel and knee strikes are balances of angular momentum. Positions are complex numbers
in the frame of the slope: real along the slope, imaginary along its normal. Angles are measured from the normal,
counter-clockwise.

State of a walker: angles, then rates, of the swing leg (its thigh), the stance leg and, while its knee is free, the
swing shank. A torso on the legs' bisector follows them.
"""

import cmath
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import permutations, product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.linalg.lapack import dposv

from walkerlab.config.check import Instant
from walkerlab.config.drives import LINEAR
from walkerlab.config.reads import RigidConfig
from walkerlab.config.second_leg import describe_second_leg
from walkerlab.config.walkers import CompassWalker, Kneed, StraightLegs

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Event = Callable[[Floats], float]
SWING = 0
STANCE = 1
SHANK = 2
TORSO = 3
ROLLING = 4
EXACT, QUICK = 1e-12, 1e-7  # relative tolerances for gaits and for first guesses
LONGEST_SWING = 12.0  # longest swing that is simulated, in sqrt(L/g)
FALLEN = 1.5  # rad, angle of the stance leg at which the walker has fallen
MAX_EULER_STEPS = 400_000
LARGEST_STEP = 0.3  # largest integration step, in sqrt(L/g)
LOCATING_ROUNDS = 4  # Newton iterations that locate an event
SLOPE_STEP = 1e-7  # s, step of the finite difference for the slope of an event function
STRAIGHT = "straight"
BENT = "bent"
"""Phases of a swing: with a straight leg, and with a free knee."""
REDUCTIONS: Final = {
    STRAIGHT: np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]),
    BENT: np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [0.0, 1.0, 0.0]]),
}
"""Matrices (bodies, coordinates), by phase, that map the rates of the coordinates to those of all bodies: swing leg or
its thigh, stance leg, swing shank, torso, and the ground on which the stance foot rolls."""


class LegPart(NamedTuple):
    """A rigid part of a leg. Positions are relative to the part's upper hinge while the part is upright."""

    mass: float  # kg
    centre: complex  # m, centre of mass
    inertia: float  # kg m^2, about the centre of mass


NO_PART: Final = LegPart(0.0, 0j, 0.0)


@dataclass(frozen=True)
class PlainWalker:
    """A walker on its slope, with the mistakes in its equations, if there are any. SI units."""

    parts: tuple[LegPart, LegPart]  # parts of one leg: thigh and shank, or the whole leg and NO_PART
    knee: complex  # m, from hip to knee, or 0 for straight legs
    hip_mass: float
    foot: complex  # m, from hip to the centre of the foot's arc, for an upright leg
    radius: float
    gravity: float
    slope: float
    torso: LegPart = NO_PART  # positions are relative to the hip
    hip: tuple[float, float, float] = (0.0, 0.0, 0.0)  # spring, damper and torque between the legs
    push_off: float = 0.0  # N s
    free_at_strike: bool = False  # whether the trailing knee is free during the heel strike
    knee_damping: float = 0.0  # N m s/rad, while the knee is free
    # mistakes
    signs: Mapping[tuple[str, int, int], float] = field(default_factory=dict)  # factors for velocity terms, by phase
    keeps_trailing_rate: bool = False
    # weights of the trailing and leading legs' rates in a term I * rate that is added by mistake to the balance at a
    # strike
    extra_inertia: tuple[float, float] = (0.0, 0.0)
    strike_foot: complex | None = None  # m, from the hip to the point about which the leading leg turns at the strike
    # whether the trailing leg turned about the same point of its foot before the strike
    turned_about_strike_foot: bool = False
    strike_inertia: float = 1.0  # factor applied to the legs' inertia at the strike
    window: float = 0.0  # rad, how early a touch is accepted
    euler_step: float = 0.0  # s, step of Euler's method, or 0 for exact integration
    interpolates: bool = True  # whether Euler's method finds the strike between two steps
    evens_angles: bool = False  # whether a touch within the window puts both feet on the slope

    @property
    def kneed(self) -> bool:
        return self.knee != 0.0

    @property
    def leg_length(self) -> float:
        return self.radius - self.foot.imag

    @property
    def lean(self) -> float:
        """Angle (rad) from an upright leg to the line from its foot's centre to the hip."""
        return cmath.phase(-self.foot) - 0.5 * math.pi

    @property
    def pendulum_time(self) -> float:
        return math.sqrt(self.leg_length / self.gravity)

    @property
    def leg_inertia(self) -> float:
        return sum(part.inertia for part in self.parts)

    @cached_property
    def masses(self) -> Floats:
        """Point masses: two of the swing leg, two of the stance leg, the hip and the torso."""
        leg = [part.mass for part in self.parts]
        return np.array([*leg, *leg, self.hip_mass, self.torso.mass])

    @cached_property
    def inertias(self) -> Floats:
        """Inertias of all bodies."""
        upper, lower = self.parts
        return np.array([upper.inertia, self.leg_inertia, lower.inertia, self.torso.inertia, 0.0])

    def levers_about(self, foot: complex, radius: float) -> Complex:
        """Return the levers (masses, bodies) in m. The velocity of a mass is the sum of i lever exp(i psi) omega.

        A round foot that rolls acts like a lever that keeps its direction.

        foot, radius  centre and radius of the arc on which the stance leg rolls (m)
        """
        upper, lower = self.parts
        levers = np.zeros((6, 5), complex)
        levers[:, STANCE] = -foot
        levers[:, ROLLING] = 1j * radius
        levers[2:4, STANCE] += upper.centre, self.knee + lower.centre
        levers[0, SWING] = upper.centre
        levers[1, [SWING, SHANK]] = self.knee, lower.centre
        levers[5, TORSO] = self.torso.centre
        return levers

    @cached_property
    def levers(self) -> Complex:
        return self.levers_about(self.foot, self.radius)

    @cached_property
    def moments(self) -> Complex:
        """Sum over all masses of mass times the levers of two bodies (bodies, bodies), in kg m^2.

        The diagonal includes the bodies' inertias.
        """
        return np.asarray(self.levers.conj().T * self.masses @ self.levers + np.diag(self.inertias))

    @cached_property
    def weights(self) -> Complex:
        """Sum over all masses of weight times lever (bodies,) in N m, for the gravity terms of the equations."""
        return np.asarray(self.masses @ self.levers * np.conj(self.down))

    @cached_property
    def factors(self) -> dict[str, Floats]:
        """Factors (bodies, bodies) for the velocity terms, by phase: 1, or -1 for a mistake in a sign.

        The factor for rolling is 0, because the lever of a rolling foot does not turn.
        """
        factors = {phase: np.repeat([[1.0, 1.0, 1.0, 1.0, 0.0]], 5, axis=0) for phase in REDUCTIONS}
        for (phase, row, column), factor in self.signs.items():
            factors[phase][row, column] = factor
        for table in factors.values():
            table[ROLLING] = table[STANCE]  # both rows belong to the equation of the stance leg
        return factors

    def bodies(self, phase: str, state: Floats) -> Floats:
        """Return the angles and rates of all bodies (2, bodies)."""
        bodies: Floats = np.reshape(state, (2, -1)) @ REDUCTIONS[phase].T
        bodies[0, ROLLING] = 0.0
        return bodies

    def mass_matrix(self, places: Complex, inertias: Floats) -> Floats:
        """Return the mass matrix of all bodies from their levers in the current pose, `places` (masses, bodies)."""
        return np.asarray((places.conj().T * self.masses @ places).real + np.diag(inertias))

    def rates(self, phase: str, state: Floats) -> Floats:
        """Return the derivative of a state by Lagrange's equations."""
        Z = REDUCTIONS[phase]
        angles, omega = self.bodies(phase, state)
        turns = np.exp(1j * angles)
        pulls = self.moments * np.multiply.outer(turns.conj(), turns)
        # the acceleration of a mass at constant rates is the sum of -lever exp(i psi) omega^2
        forces = (self.factors[phase] * pulls.imag) @ omega**2 - (self.weights * turns).imag
        spring, damper, torque = self.hip
        twist = torque - spring * (angles[SWING] - angles[STANCE]) - damper * (omega[SWING] - omega[STANCE])
        drag = self.knee_damping * (omega[SHANK] - omega[SWING])
        forces[:3] += twist + drag, -twist, -drag
        return np.concatenate((state[Z.shape[1] :], dposv(Z.T @ pulls.real @ Z, Z.T @ forces)[1]))

    @cached_property
    def down(self) -> complex:
        """Gravity (m/s^2) in the slope's frame."""
        return -1j * self.gravity * cmath.exp(1j * self.slope)

    def swing_foot(self, state: Floats) -> complex:
        """Return the vector from the arc centre of the stance foot to that of the swing foot, for straight legs."""
        return complex(self.foot * (cmath.exp(1j * state[SWING]) - cmath.exp(1j * state[STANCE])))

    def feet_apart(self, state: Floats) -> float:
        """Return the sum of both legs' angles (rad) minus the sum at which the swing foot touches."""
        return float(state[SWING] + state[STANCE] + 2.0 * self.lean - self.window)

    def knee_bend(self, state: Floats) -> float:
        """Return the angle (rad) of the shank behind its thigh. It falls to 0 as the knee locks."""
        return float(state[SWING] - state[SHANK])


def energy(walker: PlainWalker, state: Floats) -> float:
    """Return kinetic plus potential energy (J).

    Heights are measured from the point where an upright stance leg touches the slope.
    """
    angles, omega = walker.bodies(STRAIGHT if len(state) == 4 else BENT, state)
    places = walker.levers * np.exp(1j * angles)
    heights = (places.sum(axis=1) - walker.radius * state[STANCE]) * np.conj(walker.down)
    return float(0.5 * omega @ walker.mass_matrix(places, walker.inertias) @ omega - walker.masses @ heights.real)


def full_state(walker: PlainWalker, coordinates: Floats) -> Floats:
    """Convert coordinates with a straight swing leg to the state of all bodies: first the angles, then the rates."""
    if not walker.kneed:
        return coordinates[:4]
    shank = coordinates[4] if len(coordinates) > 4 else coordinates[2]
    return np.array([*coordinates[:2], coordinates[0], *coordinates[2:4], shank])


def coordinates(walker: PlainWalker, state: Floats) -> Floats:
    """Convert the state of all bodies just after a heel strike to coordinates."""
    n = len(state) // 2
    return np.concatenate((state[:2], state[n : n + 2 + int(walker.kneed and walker.free_at_strike)]))


def scales(walker: PlainWalker, size: int) -> Floats:
    """Return the units (size,) of coordinates just after a heel strike: 1 for angles, sqrt(g/L) for rates."""
    return np.array([1.0, 1.0, *[1.0 / walker.pendulum_time] * (size - 2)])


# ---- strikes ---------------------------------------------------------------------------------------------------------


def name_balances(walker: PlainWalker) -> tuple[str, ...]:
    """Describe the bodies and points about which a heel strike conserves angular momentum."""
    names = ("the whole walker about the new foot", "the trailing leg about the hip")
    return (*names, "the trailing shank about its knee") if walker.kneed and walker.free_at_strike else names


def strike_balances(walker: PlainWalker, before: Floats) -> tuple[Floats, Floats]:
    """Return the matrix and the right-hand side of the balances that determine the rates just after a heel strike.

    before  state just before the strike, with a straight swing leg
    """
    Z = REDUCTIONS[BENT if walker.free_at_strike else STRAIGHT]
    old_angles, old = walker.bodies(STRAIGHT, before)
    foot, radius = (walker.foot, walker.radius) if walker.strike_foot is None else (walker.strike_foot, 0.0)
    pivot = (foot, radius) if walker.turned_about_strike_foot else (walker.foot, walker.radius)
    moving = walker.levers_about(*pivot) * np.exp(1j * old_angles) @ old
    # The legs exchange their roles, and the new swing leg is straight.
    angles, omega = (both[[STANCE, SWING, STANCE, TORSO, ROLLING]] for both in (old_angles, old))
    places = walker.levers_about(foot, radius) * np.exp(1j * angles)
    inertias = walker.inertias * [*[walker.strike_inertia] * 3, 1.0, 0.0]
    # The angles of the legs changed places above, so the masses must do so, too.
    momentum = (places.conj().T * walker.masses @ moving[[2, 3, 0, 1, 4, 5]]).real + inertias * omega
    if walker.push_off:
        # The impulse acts along the trailing leg, so it pushes only the hip, which moves with the stance leg.
        to_hip = -walker.foot * cmath.exp(1j * angles[SWING]) + 1j * walker.radius
        hip = 1j * -foot * cmath.exp(1j * angles[STANCE]) - radius
        momentum[STANCE] += walker.push_off * (hip.conjugate() * to_hip / abs(to_hip)).real
    n = Z.shape[1]
    # rows: whole walker, trailing leg and, if its knee is free, trailing shank
    T = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]])[:n, :n] @ Z.T
    M = T @ walker.mass_matrix(places, inertias) @ Z
    momentum = T @ momentum
    momentum[1] -= walker.leg_inertia * float(np.dot(walker.extra_inertia, omega[:2]))
    if walker.keeps_trailing_rate:
        M[1], momentum[1] = 0.0, omega[SWING]
        M[1, SWING] = 1.0
    return M, momentum


def after_strike(walker: PlainWalker, before: Floats) -> Floats:
    """Return the coordinates just after a heel strike: angles of swing and stance leg, and all rates."""
    M, momentum = strike_balances(walker, before)
    angles = before[[STANCE, SWING]]
    if walker.evens_angles:
        angles[STANCE] = -2.0 * walker.lean - angles[SWING]
    return np.concatenate((angles, np.linalg.solve(M, momentum)))


def after_knee_strike(walker: PlainWalker, state: Floats) -> Floats:
    """Return the state with a straight leg just after the knee has locked."""
    Z = REDUCTIONS[STRAIGHT]
    angles, omega = walker.bodies(BENT, state)
    M = walker.mass_matrix(walker.levers * np.exp(1j * angles), walker.inertias)
    # The impact acts within the leg, so it does not change the momenta of the coordinates that remain.
    return np.concatenate((state[:2], np.linalg.solve(Z.T @ M @ Z, Z.T @ M @ omega)))


# ---- steps -----------------------------------------------------------------------------------------------------------


class Piece(NamedTuple):
    """Part of a swing in one phase."""

    phase: str
    start: Floats
    duration: float  # s
    end: Floats


class PlainStep(NamedTuple):
    """A step of a plain walker, in SI units."""

    period: float
    length: float
    before: Floats  # state just before the heel strike
    after: Floats  # coordinates just after it
    pieces: tuple[Piece, ...]

    @property
    def knee_strike(self) -> float | None:
        """Time (s) of the knee strike from the start, or None without knees."""
        return self.pieces[0].duration if len(self.pieces) > 1 else None


def start_from(walker: PlainWalker, state: Floats, instant: Instant) -> Floats | None:
    """Return the coordinates just after the heel strike that a printed state belongs to.

    For a state in mid-stance, this is the next heel strike. Return None if the walker does not reach it.

    instant  instant at which the walker is in the state
    """
    if instant == "after-strike":
        return coordinates(walker, state)
    n = len(state) // 2
    if instant == "before-strike":
        return after_strike(walker, np.concatenate((state[:2], state[n : n + 2])))
    landed = land(walker, state)
    return None if landed is None else after_strike(walker, landed[-1].end)


def take_step(walker: PlainWalker, start: Floats, tolerance: float = EXACT) -> PlainStep | None:
    """Take a step from coordinates just after a heel strike. Return None if the walker does not complete it.

    start  (2 + rates,) rad, rad/s: angles of swing and stance leg, then all rates
    """
    pieces = land(walker, full_state(walker, start), tolerance)
    if pieces is None:
        return None
    before = pieces[-1].end
    length = walker.swing_foot(before).real - walker.radius * (before[STANCE] - start[STANCE])
    return PlainStep(sum(piece.duration for piece in pieces), length, before, after_strike(walker, before), pieces)


def land(walker: PlainWalker, state: Floats, tolerance: float = EXACT) -> tuple[Piece, ...] | None:
    """Return the pieces of the swing from a state of all bodies to the heel strike, or None if no foot lands."""
    pieces: tuple[Piece, ...] = ()
    # If the leg is straight but its foot is behind the stance foot, the knee has only just been released.
    if walker.kneed and (walker.knee_bend(state) != 0.0 or walker.swing_foot(state).real < 0.0):
        locked = swing_until(walker, BENT, state, walker.knee_bend, lambda _: True, tolerance)
        if locked is None:
            return None
        pieces = (locked,)
        state = after_knee_strike(walker, locked.end)
    elif walker.kneed:
        state = state[[SWING, STANCE, 3 + SWING, 3 + STANCE]]
    landed = swing_until(
        walker, STRAIGHT, state, walker.feet_apart, lambda end: walker.swing_foot(end).real > 0.0, tolerance
    )
    return None if landed is None else (*pieces, landed)


def swing_until(
    walker: PlainWalker, phase: str, start: Floats, event: Event, counts: Callable[[Floats], bool], tolerance: float
) -> Piece | None:
    """Integrate until `event` falls to zero in a state for which `counts` is true, or return None if it never does."""
    old_time = 0.0
    old = start
    before = event(start)
    for time, state in course(walker, phase, start, tolerance):
        after = event(state)
        # Both feet are on the slope at the start, too, and a straight leg scuffs in mid-swing. Neither is a fall
        # from above.
        if before > 0.0 >= after:
            share = before / (before - after) if walker.interpolates else 1.0
            move = float(share * (time - old_time))
            end = old + share * (state - old)
            if not walker.euler_step:
                move, end = locate(walker, phase, old, event, move, tolerance)
            if counts(end):
                return Piece(phase, start, float(old_time) + move, end)
        if abs(state[STANCE]) > FALLEN:
            return None
        old_time = time
        old = state
        before = after
    return None


def course(walker: PlainWalker, phase: str, state: Floats, tolerance: float) -> Iterator[tuple[float, Floats]]:
    """Yield the time (s) and the state after each step of an integration, starting from `state` at time 0."""
    latest = LONGEST_SWING * walker.pendulum_time
    if walker.euler_step:
        for count in range(1, min(int(latest / walker.euler_step), MAX_EULER_STEPS)):
            state = state + walker.euler_step * walker.rates(phase, state)
            yield walker.euler_step * count, state
        return
    solver = new_solver(walker, phase, state, latest, tolerance)
    while solver.status == "running":
        solver.step()
        yield solver.t, solver.y


def new_solver(walker: PlainWalker, phase: str, state: Floats, end: float, tolerance: float) -> DOP853:
    def rates(_time: float, state: Floats) -> Floats:
        return walker.rates(phase, state)

    scale = np.repeat((1.0, 1.0 / walker.pendulum_time), len(state) // 2)
    largest = LARGEST_STEP * walker.pendulum_time
    return DOP853(rates, 0.0, state, end, max_step=largest, rtol=tolerance, atol=0.1 * tolerance * scale)


def locate(
    walker: PlainWalker, phase: str, state: Floats, event: Event, move: float, tolerance: float
) -> tuple[float, Floats]:
    """Find the time and state at which an event is zero, by Newton's method.

    state  state at time 0
    move   first guess of the time (s)
    """
    time = 0.0
    for _ in range(LOCATING_ROUNDS):
        time += move
        solver = new_solver(walker, phase, state, move, tolerance)
        while solver.status == "running":
            solver.step()
        state = solver.y
        value = event(state)
        move = float(-SLOPE_STEP * value / (event(state + SLOPE_STEP * walker.rates(phase, state)) - value))
    return time, state


# ---- walkers of configs, and their mistakes --------------------------------------------------------------------------


def why_not_plain(config: RigidConfig) -> str:
    """Explain why the plain model does not describe a config's walker, or return '' if it does."""
    if describe_second_leg(config.walker):
        return "the plain model has two equal legs"
    if not isinstance(config.walker, CompassWalker | StraightLegs | Kneed):
        return "the plain model has no walkers of type parts"
    return "" if config.walker.hip.hinge_law == LINEAR else "the plain model has no hinge laws of extensions"


def plain_walker(config: RigidConfig, changed: Any = None) -> PlainWalker:
    """Build the plain model of a config's walker or, if given, of the walker `changed` on the same slope."""
    walker = changed or config.walker
    assert isinstance(walker, CompassWalker | StraightLegs | Kneed), "why_not_plain allows no other"
    # Only the contact model lets the compass roll on its ball feet.
    radius = 0.0 if isinstance(walker, CompassWalker) else walker.foot_radius_m
    torso = walker.torso
    plain = PlainWalker(
        parts=(NO_PART, NO_PART),
        knee=0j,
        hip_mass=walker.hip_mass_kg,
        foot=getattr(walker, "foot_centre_ahead_m", 0.0) - 1j * (walker.leg_length_m - radius),
        radius=radius,
        gravity=config.gravity_m_s2,
        slope=config.slope_rad,
        torso=NO_PART if torso is None else LegPart(torso.mass_kg, 1j * torso.above_hip_m, torso.inertia_kg_m2),
        hip=(walker.hip.spring_N_m_per_rad, walker.hip.damping_N_m_s_per_rad, walker.hip.torque_N_m),
        push_off=config.push_off.impulse_N_s,
        signs={(STRAIGHT, STANCE, SWING): -1.0} if config.equations == "as-printed" else {},
    )
    if not isinstance(walker, Kneed):
        below = walker.mass_to_hip_m if isinstance(walker, CompassWalker) else walker.leg_mass_below_hip_m
        centre = getattr(walker, "leg_mass_ahead_m", 0.0) - 1j * below
        return replace(plain, parts=(LegPart(walker.leg_mass_kg, centre, walker.leg_inertia_kg_m2), NO_PART))
    thigh = walker.thigh
    shank = walker.shank
    upper = LegPart(thigh.mass_kg, thigh.mass_ahead_m - 1j * thigh.mass_below_hip_m, thigh.inertia_kg_m2)
    lower = LegPart(shank.mass_kg, shank.mass_ahead_m - 1j * shank.mass_below_knee_m, shank.inertia_kg_m2)
    free = walker.knee.at_heel_strike == "free"
    damping = walker.knee.damping_N_m_s_per_rad
    return replace(plain, parts=(upper, lower), knee=-1j * thigh.length_m, free_at_strike=free, knee_damping=damping)


class Mistake(NamedTuple):
    """A mistake known from publications and programs."""

    what: str  # completes the sentence 'All printed values follow if ...', where {} stands for the size
    of_size: Callable[[float], PlainWalker]  # builds the walker with a mistake of this size
    first: float = 0.0  # first guess of the size, or 0 if the mistake has no size
    # smallest and largest size. A smaller mistake would be lost in a program's numerical error.
    limits: tuple[float, float] = (0.0, 0.0)


def list_mistakes(right: PlainWalker) -> Iterator[Mistake]:
    """Yield all known mistakes that a program for the walker may contain."""

    def mistake(what: str, **changes: Any) -> Mistake:
        return Mistake(what, lambda _: replace(right, **changes))

    def mistake_of_size(what: str, field: str, first: float, limits: tuple[float, float], **changes: Any) -> Mistake:
        return Mistake(what, lambda size: replace(right, **{field: size, **changes}), first, limits)

    for what, signs in wrong_signs(right.kneed):
        yield mistake(what, signs={**right.signs, **{term: -right.signs.get(term, 1.0) for term in signs}})
    if right.leg_inertia:
        rates = {
            "the trailing leg's rate": (1.0, 0.0),
            "the leading leg's rate": (0.0, 1.0),
            "(trailing leg's rate − leading leg's rate)": (1.0, -1.0),
        }
        momentum = "the trailing leg's angular momentum about the hip before the heel strike"
        for (rate, weights), (mark, sign) in product(rates.items(), (("−", 1.0), ("+", -1.0))):
            what = f"{momentum} has an extra term {mark}I × {rate}, where I is the leg's inertia"
            yield mistake(what, extra_inertia=tuple(sign * weight for weight in weights))
        yield mistake("the legs' inertia is left out", parts=tuple(part._replace(inertia=0.0) for part in right.parts))
        yield mistake("the legs' inertia is left out of the heel strike", strike_inertia=0.0)
    yield mistake("the trailing leg keeps its rate through the heel strike", keeps_trailing_rate=True)
    if right.radius:
        for point, name in ((right.foot, "the arc's centre"), (right.foot - 1j * right.radius, "the sole's middle")):
            what = f"the heel strike leaves out the foot's rolling: the leading leg turns about {name}"
            yield mistake(what, strike_foot=point)
            yield mistake(f"{what}, as the trailing leg does", strike_foot=point, turned_about_strike_foot=True)
    if right.hip_mass:
        yield mistake("the hip's mass counts once for each leg", hip_mass=2.0 * right.hip_mass)
    early = "the heel strike is accepted as soon as the sum of the legs' angles is within {} rad of it"
    angle = ("window", 1e-3, (1e-5, 0.3))
    yield mistake_of_size(early, *angle)
    yield mistake_of_size(f"{early}, and both feet are then put on the slope", *angle, evens_angles=True)
    step = "the equations are integrated by Euler's method with a step of {} s"
    time = ("euler_step", 4e-3 * right.pendulum_time, (2e-5, 0.2))
    yield mistake_of_size(step, *time)
    yield mistake_of_size(
        f"{step}, and the swing ends at the first time step after the heel strike", *time, interpolates=False
    )


def wrong_signs(kneed: bool) -> Iterator[tuple[str, list[tuple[str, int, int]]]]:
    """Yield groups of velocity terms in the equations of motion that may all have the wrong sign, with descriptions."""
    for phase in (STRAIGHT, BENT) if kneed else (STRAIGHT,):
        when = {BENT: " while the knee is free", STRAIGHT: " once the knee is locked" if kneed else ""}[phase]
        bodies = {"swing leg": (SWING, SHANK), "stance leg": (STANCE,)}
        if phase == BENT:
            bodies |= {"swing leg": (SWING,), "swing shank": (SHANK,)}
        for (row, rows), (column, columns) in permutations(bodies.items(), 2):
            what = f"the term of the {column}'s squared rate in the equation of the {row} has the wrong sign{when}"
            yield what, [*product((phase,), rows, columns)]
        yield f"all velocity terms have the wrong sign{when}", [*product((phase,), range(4), range(4))]
