"""Simulate a walker with two different legs with SciPy, independently of the rigid model.

A leg is a list of its segments from the hip down. Angles are from the slope's normal, and walks go in the direction of
x, downhill. The strikes follow from balances of angular momentum: of the whole walker about the new contact point and
of a leg about the hip.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp


@dataclass(frozen=True)
class Segment:
    length: float
    mass: float
    below: float
    ahead: float
    inertia: float


@dataclass(frozen=True)
class Leg:
    segments: tuple[Segment, ...]
    radius: float
    centre_ahead: float = 0.0

    @property
    def length(self):
        return sum(segment.length for segment in self.segments)

    @property
    def centre(self):
        """Return the centre of the foot's arc of a straight leg, measured from the hip."""
        return np.array([self.centre_ahead, self.radius - self.length])

    def masses(self, angles):
        """Yield mass, inertia, angle index and levers {angle index: vector} from the hip of each segment."""
        levers = {}
        for segment, angle in zip(self.segments, angles, strict=True):
            at = dict(levers)
            at[angle] = at.get(angle, np.zeros(2)) + np.array([segment.ahead, -segment.below])
            yield segment.mass, segment.inertia, angle, at
            levers[angle] = levers.get(angle, np.zeros(2)) + np.array([0.0, -segment.length])

    def foot(self, angles):
        """Return the levers from the hip to the centre of the foot's arc."""
        levers = {}
        for segment, angle in zip(self.segments[:-1], angles[:-1], strict=True):
            levers[angle] = levers.get(angle, np.zeros(2)) + np.array([0.0, -segment.length])
        last = np.array([self.centre_ahead, self.radius - self.segments[-1].length])
        levers[angles[-1]] = levers.get(angles[-1], np.zeros(2)) + last
        return levers


def turned(angle, vector):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def quarter(vector):
    return np.array([-vector[1], vector[0]])


@dataclass(frozen=True)
class Swing:
    """Swing of one leg on the other. Angle 0 is that of the swing thigh, 1 of the stance leg, and 2 of a free shank."""

    swinging: Leg
    standing: Leg
    hip_mass: float
    slope: float
    gravity: float
    free_shank: bool
    knee_damping: float = 0.0

    @property
    def n(self):
        return 3 if self.free_shank else 2

    def bodies(self):
        """Yield mass, inertia, angle index and levers from the stance foot's centre for each body."""
        swing_angles = [0, 2 if self.free_shank else 0][: len(self.swinging.segments)]
        to_hip = -self.standing.centre
        yield self.hip_mass, 0.0, 1, {1: to_hip}
        for leg, angles in ((self.standing, [1] * len(self.standing.segments)), (self.swinging, swing_angles)):
            for mass, inertia, angle, levers in leg.masses(angles):
                at = dict(levers)
                at[1] = at.get(1, np.zeros(2)) + to_hip
                yield mass, inertia, angle, at

    def foot(self):
        swing_angles = [0, 2 if self.free_shank else 0][: len(self.swinging.segments)]
        levers = dict(self.swinging.foot(swing_angles))
        levers[1] = levers.get(1, np.zeros(2)) - self.standing.centre
        return levers

    def place(self, q, levers):
        """Return a position, measured from where an upright stance leg touches, and its derivative (2, n) by the
        angles.
        """
        R = self.standing.radius
        at, J = np.array([-R * q[1], R]), np.zeros((2, self.n))
        J[0, 1] = -R
        for k, lever in levers.items():
            arm = turned(q[k], lever)
            at = at + arm
            J[:, k] += quarter(arm)
        return at, J

    def accelerations(self, q, w):
        M, r = np.zeros((self.n, self.n)), np.zeros(self.n)
        g = self.gravity * np.array([np.sin(self.slope), -np.cos(self.slope)])
        for mass, inertia, angle, levers in self.bodies():
            _, J = self.place(q, levers)
            inward = -sum(w[k] ** 2 * turned(q[k], lever) for k, lever in levers.items())
            M += mass * J.T @ J
            M[angle, angle] += inertia
            r += mass * J.T @ (g - inward)
        if self.free_shank:
            torque = self.knee_damping * (w[2] - w[0])
            r += np.array([torque, 0.0, -torque])
        return np.linalg.solve(M, r)

    def rates(self, t, y):
        return np.append(y[self.n :], self.accelerations(y[: self.n], y[self.n :]))

    def foot_height(self, t, y):
        return self.place(y[: self.n], self.foot())[0][1] - self.swinging.radius

    def foot_ahead(self, y):
        q = y[: self.n]
        return self.place(q, self.foot())[0][0] + self.standing.radius * q[1]

    def momentum(self, q, w, about, of=None):
        """Return the angular momentum about a point. `of` selects bodies by their angles."""
        # about the hip, the hip mass has no angular momentum
        total = 0.0
        for mass, inertia, angle, levers in self.bodies():
            if of is not None and angle not in of:
                continue
            at, J = self.place(q, levers)
            arm, v = at - about, J @ w
            total += mass * (arm[0] * v[1] - arm[1] * v[0]) + inertia * w[angle]
        return total

    def hip(self, q):
        return self.place(q, {1: -self.standing.centre})[0]


def linear_solve(balance, n):
    """Solve balance(w) = 0, which is linear in w (n,)."""
    offset = balance(np.zeros(n))
    A = np.column_stack([balance(e) - offset for e in np.eye(n)])
    return np.linalg.solve(A, -offset)


@dataclass(frozen=True)
class Walker:
    """Two legs on a hip mass, of which leg 0 swings first. Dampers act at the knees, and push-offs (N s) along trailing
    legs.
    """

    legs: tuple[Leg, Leg]
    hip_mass: float
    slope: float
    gravity: float = 9.81
    knee_damping: tuple[float, float] = (0.0, 0.0)
    push_offs: tuple[float, float] = (0.0, 0.0)

    def swing(self, k, free_shank=False):
        damping = self.knee_damping[k]
        return Swing(self.legs[k], self.legs[1 - k], self.hip_mass, self.slope, self.gravity, free_shank, damping)

    def step(self, k, q, w, rise=0.0, swings=None):
        """Take a step of leg k from the angles and rates of swing and stance leg. Return duration, length, and the new
        angles and rates.

        The foot lands on a foothold `rise` (m) above the stance foot's. The solution of the straight swing is appended
        to `swings`, if given.
        """
        bent_s, start = 0.0, q[1]
        if len(self.legs[k].segments) == 2:
            bent_s, q, w = self.straighten(k, np.array([*q, q[0]]), np.array([*w, w[0]]))
        system = self.swing(k)
        run = integrate(system, np.append(q, w), lambda t, y: system.foot_height(t, y) - rise, -1.0)
        landing = next(place for place, y in enumerate(run.y_events[0]) if system.foot_ahead(y) > 0.0)
        y = run.y_events[0][landing]
        if swings is not None:
            swings.append(run.sol)
        length = system.foot_ahead(y) + system.standing.radius * (start - y[1])
        return bent_s + run.t_events[0][landing], length, y[1::-1], self.strike(k, y[:2], y[2:])

    def straighten(self, k, q, w):
        """Return the time at which the knee of leg k locks, and angles and rates of the straight legs just after it."""
        bent, straight = self.swing(k, free_shank=True), self.swing(k)
        run = integrate(bent, np.append(q, w), lambda t, y: y[2] - y[0], 1.0)
        place = next(place for place, t in enumerate(run.t_events[0]) if t > 1e-6)
        q, w = np.split(run.y_events[0][place], 2)
        contact, hip = np.array([-bent.standing.radius * q[1], 0.0]), bent.hip(q)
        momenta = np.array([bent.momentum(q, w, contact), bent.momentum(q, w, hip, (0, 2))])

        def balance(rates):
            kept = straight.momentum(q[:2], rates, contact), straight.momentum(q[:2], rates, hip, (0,))
            return np.array(kept) - momenta

        return run.t_events[0][place], q[:2], linear_solve(balance, 2)

    def strike(self, k, q, w):
        """Return the rates after the heel strike of leg k, swing leg first."""
        before, after, exchanged = self.swing(k), self.swing(1 - k), q[::-1]
        foot = before.place(q, before.foot())[0]
        contact = foot - np.array([0.0, before.swinging.radius])
        momenta = np.array([before.momentum(q, w, contact), before.momentum(q, w, before.hip(q), (1,))])
        to_hip = before.hip(q) - [-before.standing.radius * q[1], 0.0]
        impulse = self.push_offs[1 - k] * to_hip / np.hypot(*to_hip)
        arm = before.hip(q) - contact
        momenta[0] += arm[0] * impulse[1] - arm[1] * impulse[0]
        new_contact, new_hip = np.array([-after.standing.radius * exchanged[1], 0.0]), after.hip(exchanged)

        def balance(rates):
            trailing = after.momentum(exchanged, rates, new_hip, (0,))
            return np.array([after.momentum(exchanged, rates, new_contact), trailing]) - momenta

        return linear_solve(balance, 2)

    def stride(self, state, rises=(0.0, 0.0), first=0, swings=None):
        """Return both steps' (duration, length) and the state after them, from a state just after a heel strike.

        Leg `first` swings first, and the footholds rise by `rises` (m). `swings` is as in `step`.
        """
        n, steps = len(state) // 2, []
        q, w = np.array(state[:2]) + self.slope, np.array(state[n : n + 2])
        for k, rise in enumerate(rises, first):
            duration, length, q, w = self.step(k % 2, q, w, rise, swings)
            steps.append((duration, length))
        return np.array(steps), np.append(q - self.slope, w)


def integrate(system, y, event, direction):
    """Integrate for up to three seconds, and return the solution with all zeros of an event function."""
    event_of = lambda t, y: event(t, y)  # noqa: E731 (functions of classes take no attributes)
    event_of.direction = direction
    settings = {"rtol": 1e-12, "atol": 1e-12, "max_step": 0.05, "dense_output": True}
    return solve_ivp(system.rates, (0.0, 1.5), y, "DOP853", events=event_of, **settings)
