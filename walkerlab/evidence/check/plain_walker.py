"""A plain model of a walker, the second route to its gaits, in which known mistakes can be switched on.

It shares no equations with the compiled model. Lagrange's equations follow from the point masses of the walker's parts,
whose velocities are linear in the rates of its bodies; heel and knee strikes are balances of angular momentum. All
positions are complex numbers in the slope's frame, real along the slope and imaginary along its normal, and angles are
measured from the normal, counter-clockwise.

State of a walker: angles, then rates, of the swing leg (its thigh), the stance leg and, while its knee is free, the
swing shank. A torso on the legs' bisector follows them.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Event = Callable[[Floats], float]
SWING = 0
STANCE = 1
SHANK = 2
EXACT, QUICK = 1e-12, 1e-7  # relative tolerances of gaits and of first guesses
LONGEST_SWING = 12.0  # sqrt(L/g)
FALLEN = 1.5  # rad, angle of the stance leg
MAX_EULER_STEPS = 400_000
LARGEST_STEP = 0.3  # sqrt(L/g)
LOCATING_ROUNDS, TINY = 2, 1e-7  # s
STRAIGHT = "straight"
BENT = "bent"
"""Phases of a swing: with a straight leg, and with a free knee."""


class LegPart(NamedTuple):
    """A rigid part of a leg. Positions are relative to its upper hinge, with the part upright."""

    mass: float  # kg
    centre: complex  # m, centre of mass
    inertia: float  # kg m^2, about the centre of mass


@dataclass(frozen=True)
class PlainWalker:
    """A walker on its slope, and the mistakes in its equations. SI units."""

    parts: tuple[LegPart, ...]  # of one leg: the whole leg, or thigh and shank
    knee: complex  # m, from hip to knee; 0 for straight legs
    hip_mass: float
    foot: complex  # m, from hip to the centre of the foot's arc, leg upright
    radius: float
    gravity: float
    slope: float
    torso: LegPart | None = None  # with positions relative to the hip
    hip: tuple[float, float, float] = (0.0, 0.0, 0.0)  # spring, damper and torque between the legs
    push_off: float = 0.0  # N s
    free_at_strike: bool = False  # whether the trailing knee is free during the heel strike
    knee_damping: float = 0.0  # N m s/rad, while the knee is free
    # mistakes
    signs: Mapping[tuple[str, int, int], float] = field(default_factory=dict)  # factors on velocity terms, by phase
    keeps_trailing_rate: bool = False
    extra_inertia: tuple[float, float] = (0.0, 0.0)  # weights of trailing and leading rate in an extra term I * rate
    strike_foot: complex | None = None  # m, from hip to the point on which the leading leg turns in the strike
    turned_on_it: bool = False  # whether the trailing leg turns about the same point of its own foot before the strike
    strike_inertia: float = 1.0  # factor on the inertia of legs in the strike
    window: float = 0.0  # rad, by which a touch is accepted early
    euler_step: float = 0.0  # s, step of Euler's method; 0 for exact integration
    interpolates: bool = True  # whether Euler's method finds the strike between two steps
    evens_angles: bool = False  # whether a touch within the window puts both feet on the slope

    @property
    def kneed(self) -> bool:
        return len(self.parts) > 1

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

    def reduction(self, phase: str) -> Floats:
        """Return the matrix (bodies, coordinates) from the rates of the coordinates to those of all bodies."""
        coordinates = np.eye(3 if self.kneed and phase == BENT else 2)
        return (
            coordinates
            if self.torso is None
            else np.vstack((coordinates, np.resize([0.5, 0.5, 0.0], len(coordinates))))
        )

    @cached_property
    def masses(self) -> Floats:
        """Point masses: those of the swing leg, of the stance leg, of the hip and of the torso."""
        leg = [part.mass for part in self.parts]
        return np.array([*leg, *leg, self.hip_mass, *([] if self.torso is None else [self.torso.mass])])

    def inertias(self, phase: str) -> Floats:
        """Return the inertias of all bodies."""
        leg = [part.inertia for part in self.parts]
        swing = leg if phase == BENT else [sum(leg)]
        return np.array([swing[0], sum(leg), *swing[1:], *([] if self.torso is None else [self.torso.inertia])])

    def levers(self, phase: str, foot: complex) -> Complex:
        """Return the levers (masses, bodies). A mass is at the sum over bodies of lever times exp(i psi)."""
        n = len(self.parts)
        levers = np.zeros((len(self.masses), len(self.reduction(phase))), complex)
        levers[:, STANCE] = -foot
        for place, (hinge, part) in enumerate(zip((0j, self.knee), self.parts, strict=False)):
            levers[n + place, STANCE] += hinge + part.centre
            levers[place, SWING] = hinge
            levers[place, SHANK if place and phase == BENT else SWING] += part.centre
        if self.torso is not None:
            levers[-1, -1] = self.torso.centre
        return levers

    @cached_property
    def phases(self) -> dict[str, Phase]:
        """Sums over the point masses, by phase, from which the equations of motion are formed."""
        return {phase: self.sums(phase) for phase in (STRAIGHT, BENT)}

    def sums(self, phase: str) -> Phase:
        levers = self.levers(phase, self.foot)
        moments = (levers.conj().T * self.masses) @ levers
        bodies = range(len(moments))
        constant = np.diag(moments.real.diagonal() + self.inertias(phase))
        constant[STANCE, STANCE] += self.radius**2 * self.mass
        signs = [[self.signs.get((phase, k, l), 1.0) for l in bodies] for k in bodies]
        first = self.masses @ levers
        return Phase(self.reduction(phase), levers, constant.tolist(), moments.tolist(), first.tolist(), signs)

    def motions(self, angles: Floats, levers: Complex, radius: float) -> Complex:
        """Return the velocities (masses, bodies) of all masses per unit rate of each body, with the foot rolling."""
        D: Complex = 1j * levers * np.exp(1j * angles)
        D[:, STANCE] -= radius
        return D

    def rates(self, phase: str, state: Floats) -> Floats:
        """Return the derivative of a state by Lagrange's equations."""
        sums = self.phases[phase]
        Z = sums.reduction
        n = Z.shape[1]
        follows = n < len(Z)
        rates = state[n:].tolist()
        angles = (Z @ state[:n]).tolist() if follows else state[:n].tolist()
        omega = (Z @ state[n:]).tolist() if follows else rates
        turns = [cmath.exp(1j * angle) for angle in angles]
        # velocity of all masses per unit rate: i lever turn, and -R for the stance leg, on which the foot rolls
        M = [row.copy() for row in sums.constant]
        forces = [0.0] * len(omega)
        for k, turn in enumerate(turns):
            lever = sums.first[k] * turn
            signs = sums.signs[k]
            M[k][STANCE] += self.radius * lever.imag
            M[STANCE][k] += self.radius * lever.imag
            forces[STANCE] -= sums.signs[STANCE][k] * self.radius * lever.real * omega[k] ** 2
            forces[k] += (-1j * lever.conjugate() * self.down).real
            for l in range(k):
                pull = sums.moments[k][l] * turn.conjugate() * turns[l]
                M[k][l] += pull.real
                M[l][k] += pull.real
                # the centripetal acceleration is -lever turn omega^2
                forces[k] += signs[l] * pull.imag * omega[l] ** 2
                forces[l] -= sums.signs[l][k] * pull.imag * omega[k] ** 2
        forces[STANCE] -= self.radius * self.mass * self.down.real
        spring, damper, torque = self.hip
        twist = torque - spring * (angles[SWING] - angles[STANCE]) - damper * (omega[SWING] - omega[STANCE])
        forces[SWING] += twist
        forces[STANCE] -= twist
        if self.kneed and phase == BENT:
            drag = self.knee_damping * (omega[SHANK] - omega[SWING])
            forces[SHANK] -= drag
            forces[SWING] += drag
        if follows:
            M = (Z.T @ M @ Z).tolist()
            forces = (Z.T @ forces).tolist()
        return np.array(rates + eliminate(M, forces))

    @cached_property
    def mass(self) -> float:
        return float(self.masses.sum())

    @cached_property
    def down(self) -> complex:
        """Gravity (m/s^2) in the slope's frame."""
        return -1j * self.gravity * cmath.exp(1j * self.slope)

    def swing_foot(self, state: Floats) -> complex:
        """Return the position of the swing foot's centre relative to that of the stance foot, swing leg straight."""
        return complex(self.foot * (cmath.exp(1j * state[SWING]) - cmath.exp(1j * state[STANCE])))

    def feet_apart(self, state: Floats) -> float:
        """Return the sum (rad) of both legs' angles, hip to foot. It falls to the window, usually 0, at a touch."""
        return float(state[SWING] + state[STANCE] + 2.0 * self.lean - self.window)

    def knee_bend(self, state: Floats) -> float:
        """Return the angle (rad) of the shank behind its thigh. It falls to 0 as the knee locks."""
        return float(state[SWING] - state[SHANK])

    def energy(self, phase: str, state: Floats) -> float:
        """Return kinetic plus potential energy (J).

        Heights are measured from the point where an upright stance leg touches the slope.
        """
        Z = self.reduction(phase)
        angles, omega = np.reshape(state, (2, -1)) @ Z.T
        levers = self.phases[phase].levers
        velocities = self.motions(angles, levers, self.radius) @ omega
        rolled = 1j * self.radius - self.radius * angles[STANCE]
        places = levers @ np.exp(1j * angles) + rolled
        kinetic = 0.5 * (self.masses @ np.abs(velocities) ** 2 + self.inertias(phase) @ omega**2)
        return float(kinetic - self.masses @ (places * np.conj(self.down)).real)

    def balances(self) -> tuple[str, ...]:
        """Describe the bodies and points about which a heel strike conserves angular momentum."""
        names = ("the whole walker about the new foot", "the trailing leg about the hip")
        return (*names, "the trailing shank about its knee") if self.kneed and self.free_at_strike else names

    def strike_balances(self, before: Floats) -> tuple[Floats, Floats]:
        """Return matrix and right-hand side of the balances that determine the rates just after a heel strike.

        before  state just before it, swing leg straight
        """
        phase = BENT if self.free_at_strike else STRAIGHT
        Z = self.reduction(phase)
        old_angles, old = np.reshape(before[:4], (2, 2)) @ self.reduction(STRAIGHT).T
        foot, radius = (self.foot, self.radius) if self.strike_foot is None else (self.strike_foot, 0.0)
        pivot = (foot, radius) if self.turned_on_it else (self.foot, self.radius)
        velocities = self.motions(old_angles, self.levers(STRAIGHT, pivot[0]), pivot[1]) @ old
        legs = len(self.parts)
        order = [*range(legs, 2 * legs), *range(legs), *range(2 * legs, len(velocities))]
        bodies = [STANCE, SWING, *([STANCE] if phase == BENT else []), *([-1] if self.torso else [])]
        angles = old_angles[bodies]
        omega = old[bodies]
        J = self.motions(angles, self.levers(phase, foot), radius) @ Z
        weighted = J.conj().T * self.masses
        inertias = self.inertias(phase)
        inertias[: len(bodies) - int(self.torso is not None)] *= self.strike_inertia
        momentum = (weighted @ velocities[order]).real + Z.T @ (inertias * omega)
        if self.push_off:
            # the impulse acts along the trailing leg through the hip, so it turns only what moves with the hip
            to_hip = -self.foot * cmath.exp(1j * angles[SWING]) + 1j * self.radius
            hip = 1j * -foot * cmath.exp(1j * angles[STANCE]) - radius
            momentum[STANCE] += self.push_off * (hip.conjugate() * to_hip / abs(to_hip)).real
        M = (weighted @ J).real + Z.T @ (inertias[:, None] * Z)
        # whole walker, trailing leg and, if it is free, trailing shank
        T = np.ones((Z.shape[1], Z.shape[1]))
        T[1:] = 0.0
        T[1, [SWING, *range(2, Z.shape[1])]] = 1.0
        if Z.shape[1] > 2:
            T[2, SHANK] = 1.0
        M = T @ M
        momentum = T @ momentum
        momentum[1] -= self.leg_inertia * float(np.dot(self.extra_inertia, omega[:2]))
        if self.keeps_trailing_rate:
            M[1], momentum[1] = 0.0, omega[SWING]
            M[1, SWING] = 1.0
        return M, momentum

    def after_strike(self, before: Floats) -> Floats:
        """Return the coordinates just after a heel strike: angles of swing and stance leg, and all rates."""
        M, momentum = self.strike_balances(before)
        angles = before[[STANCE, SWING]]
        if self.evens_angles:
            angles[STANCE] = -2.0 * self.lean - angles[SWING]
        return np.concatenate((angles, np.linalg.solve(M, momentum)))

    def step(self, start: Floats, tolerance: float = EXACT) -> PlainStep | None:
        """Take a step from coordinates just after a heel strike, or None if the walker does not complete it.

        start  (2 + rates,) rad, rad/s: angles of swing and stance leg, then all rates
        """
        state = np.asarray(start, float)
        if self.kneed:
            rates = state[2:] if len(state) > 4 else np.append(state[2:], state[2])
            state = np.array([*state[:2], state[0], *rates])
        pieces = self.land(state, tolerance)
        if pieces is None:
            return None
        before = pieces[-1].end
        length = self.swing_foot(before).real - self.radius * (before[STANCE] - start[STANCE])
        period = sum(piece.duration for piece in pieces)
        return PlainStep(period, length, before, self.after_strike(before), pieces)

    def land(self, state: Floats, tolerance: float = EXACT) -> tuple[Piece, ...] | None:
        """Return the parts of the swing from a state of all bodies to the heel strike, or None if no foot lands."""
        pieces: tuple[Piece, ...] = ()
        # A straight leg whose foot is behind the stance foot has just been released.
        if self.kneed and (self.knee_bend(state) != 0.0 or self.swing_foot(state).real < 0.0):
            locked = self.swing(BENT, state, self.knee_bend, lambda _: True, tolerance)
            if locked is None:
                return None
            pieces = (locked,)
            state = self.after_knee_strike(locked.end)
        elif self.kneed:
            state = state[[SWING, STANCE, 3 + SWING, 3 + STANCE]]
        landed = self.swing(STRAIGHT, state, self.feet_apart, lambda end: self.swing_foot(end).real > 0.0, tolerance)
        return None if landed is None else (*pieces, landed)

    def swing(
        self, phase: str, start: Floats, event: Event, counts: Callable[[Floats], bool], tolerance: float
    ) -> Piece | None:
        """Integrate until `event` falls to zero in a state for which `counts` is true. None if that never happens."""
        latest = LONGEST_SWING * self.pendulum_time
        if self.euler_step:
            return self.euler(phase, start, event, counts, latest)
        scale = np.repeat((1.0, 1.0 / self.pendulum_time), len(start) // 2)

        def rates(_time: float, state: Floats) -> Floats:
            return self.rates(phase, state)

        def solver(begin: float, state: Floats, end: float) -> DOP853:
            largest = LARGEST_STEP * self.pendulum_time
            return DOP853(rates, begin, state, end, max_step=largest, rtol=tolerance, atol=0.1 * tolerance * scale)

        walk = solver(0.0, start, latest)
        before = event(start)
        while walk.status == "running" and abs(walk.y[STANCE]) < FALLEN:
            old_time = walk.t
            old = walk.y
            walk.step()
            after = event(walk.y)
            if before > 0.0 >= after:
                course = walk.dense_output()
                time = brentq(lambda time, course=course: event(course(time)), old_time, walk.t, xtol=1e-15)
                for _ in range(LOCATING_ROUNDS):
                    landing = solver(old_time, old, time)
                    while landing.status == "running":
                        landing.step()
                    # The interpolant is less accurate than the integration.
                    state = landing.y
                    slope = event(landing.y + TINY * self.rates(phase, landing.y))
                    time -= event(state) * TINY / (slope - event(state))
                if counts(state):
                    return Piece(phase, start, time, state)
            before = after
        return None

    def euler(
        self, phase: str, start: Floats, event: Event, counts: Callable[[Floats], bool], latest: float
    ) -> Piece | None:
        """Integrate like `swing`, but by Euler's method with a fixed step."""
        step = self.euler_step
        state = start
        before = event(start)
        for count in range(1, min(int(latest / step), MAX_EULER_STEPS)):
            old = state
            state = state + step * self.rates(phase, state)
            after = event(state)
            if abs(state[STANCE]) > FALLEN:
                return None
            if before > 0.0 >= after and counts(state):
                share = before / (before - after) if self.interpolates else 1.0
                return Piece(phase, start, step * (count - 1 + share), old + share * (state - old))
            before = after
        return None

    def after_knee_strike(self, state: Floats) -> Floats:
        """Return the state with a straight leg just after the knee has locked."""
        D = self.motions(self.reduction(BENT) @ state[:3], self.phases[BENT].levers, self.radius) @ self.reduction(BENT)
        M = (D.conj().T * self.masses @ D).real
        M += self.reduction(BENT).T * self.inertias(BENT) @ self.reduction(BENT)
        locked = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
        rates = np.linalg.solve(locked.T @ M @ locked, locked.T @ M @ state[3:])
        return np.concatenate((state[:2], rates))


class Phase(NamedTuple):
    """Sums over the point masses of a walker in one phase."""

    reduction: Floats  # (bodies, coordinates)
    levers: Complex  # m, (masses, bodies)
    constant: list[list[float]]  # kg m^2, part of the mass matrix that no angle changes
    moments: list[list[complex]]  # kg m^2, of two levers
    first: list[complex]  # kg m, of one lever
    signs: list[list[float]]  # factors on velocity terms


def eliminate(M: list[list[float]], forces: list[float]) -> list[float]:
    """Solve M x = forces for a small symmetric positive M, which needs no pivots. Both are overwritten."""
    n = len(forces)
    for pivot in range(n):
        for row in range(pivot + 1, n):
            factor = M[row][pivot] / M[pivot][pivot]
            for column in range(pivot + 1, n):
                M[row][column] -= factor * M[pivot][column]
            forces[row] -= factor * forces[pivot]
    for row in range(n - 1, -1, -1):
        for column in range(row + 1, n):
            forces[row] -= M[row][column] * forces[column]
        forces[row] /= M[row][row]
    return forces


class Piece(NamedTuple):
    """Part of a swing in one phase."""

    phase: str
    start: Floats
    duration: float  # s
    end: Floats


class PlainStep(NamedTuple):
    """A step of a plain walker, SI units."""

    period: float
    length: float
    before: Floats  # state just before the heel strike
    after: Floats  # coordinates just after it
    pieces: tuple[Piece, ...]

    @property
    def knee_strike(self) -> float | None:
        """Time (s) of the knee strike from the start, or None without knees."""
        return self.pieces[0].duration if len(self.pieces) > 1 else None
