"""Plastic impacts: velocities before, projected in the metric of the masses on what the new constraints allow.

With velocities u of all masses before and u+ = Z z+ after, Z of the new constraints, Z' M (u+ - u) = 0. Coordinates
are those of the tree about the foot that stands afterwards: velocity (v_x, v_y) of its centre, along the slope and
normal to it, and the bodies' angular velocities.

Source: (A.57) of the paper with the impulse projected away.
"""

from typing import NamedTuple

from walkerlab.kernels import inlined
from walkerlab.mechanics.links import solve_linked
from walkerlab.mechanics.standing import STANCE, Standing, projections, standing_mass
from walkerlab.mechanics.tree import sines_cosines
from walkerlab.mechanics.tuples import Vector, put
from walkerlab.solvers.system import State


class Strike(NamedTuple):
    """The instant before a heel strike, seen from the foot that stands after it, bodies in their new places."""

    theta: Vector  # (n) rad
    omega: Vector  # (n) rad/s
    along: float  # m/s, velocity of the foot's centre along the slope
    upward: float  # m/s


@inlined
def in_new_places(model: Standing, v: State, first: int) -> Vector:
    """The numbers v[first], ... of the bodies after the change of roles."""
    placed = model.tree.arm_x
    for k in range(len(placed)):
        placed = put(placed, k, v[first + model.roles[k]])
    return placed


@inlined
def before_strike(model: Standing, y: State) -> Strike:
    """The state y (2 n) at the heel strike, as the impact sees it."""
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.foot_x, model.foot_y, s, c)
    along, upward = -model.radius * y[n + STANCE], 0.0
    for l in range(n):
        along -= U[l] * y[n + l]
        upward += F[l] * y[n + l]
    return Strike(in_new_places(model, y, 0), in_new_places(model, y, n), along, upward)


@inlined
def strike_change(model: Standing, y: State, dy: State) -> Strike:
    """How `before_strike` changes along dy (2 n)."""
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.foot_x, model.foot_y, s, c)
    along, upward = -model.radius * dy[n + STANCE], 0.0
    for l in range(n):
        along -= F[l] * dy[l] * y[n + l] + U[l] * dy[n + l]
        upward += F[l] * dy[n + l] - U[l] * dy[l] * y[n + l]
    return Strike(in_new_places(model, dy, 0), in_new_places(model, dy, n), along, upward)


@inlined
def momenta(model: Standing, M: Vector, F: Vector, U: Vector, omega: Vector, along: float, upward: float) -> Vector:
    """Z' M u (n): M is M' of standing.py, whose part in the rolling of angular velocities is taken out again."""
    n, R = len(omega), model.radius
    p = omega
    for k in range(n):
        total = upward * F[k] - (along + R * omega[STANCE]) * U[k]
        for l in range(n):
            total += M[k * n + l] * omega[l]
        p = put(p, k, total)
    return put(p, STANCE, p[STANCE] - R * model.tree.mass * (along + R * omega[STANCE]))


@inlined
def mass_change(
    model: Standing, s: Vector, c: Vector, F: Vector, U: Vector, turn: Vector, jump: Vector, along: float, upward: float
) -> Vector:
    """Z' dM w (n): change of the masses' matrix as the bodies turn, times a jump w of the velocities."""
    n, tree, R = len(s), model.tree, model.radius
    out = s
    pulled = 0.0
    for k in range(n):
        total = -F[k] * turn[k] * along - U[k] * turn[k] * upward
        for l in range(n):
            cos_d, sin_d = c[l] * c[k] + s[l] * s[k], s[l] * c[k] - c[l] * s[k]
            by_angle = tree.sine[k * n + l] * cos_d - tree.cosine[k * n + l] * sin_d
            total += by_angle * (turn[l] - turn[k]) * jump[l]
        out = put(out, k, total)
        pulled += F[k] * turn[k] * jump[k]
    return put(out, STANCE, out[STANCE] + R * pulled)


@inlined
def with_rates(model: Standing, theta: Vector, omega: Vector) -> State:
    """A state (2 n) of angles and velocities."""
    n = len(theta)
    y = model.blank
    for k in range(n):
        y = put(y, k, theta[k])
        y = put(y, n + k, omega[k])
    return y


@inlined
def heel_strike(model: Standing, y: State) -> State:
    """State after the heel strike, roles changed."""
    before = before_strike(model, y)
    s, c = sines_cosines(model.tree, before.theta, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    M = standing_mass(model, s, c, U)
    p = momenta(model, M, F, U, before.omega, before.along, before.upward)
    return with_rates(model, before.theta, solve_linked(model.at_strike, M, p))


@inlined
def heel_strike_along(model: Standing, y: State, after: State, dy: State) -> State:
    """Derivative of `heel_strike` along dy; `after` is the state that y led to."""
    n = len(model.tree.arm_x)
    before, change = before_strike(model, y), strike_change(model, y, dy)
    s, c = sines_cosines(model.tree, before.theta, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    M = standing_mass(model, s, c, U)
    jump = before.omega
    for k in range(n):
        jump = put(jump, k, after[n + k] - before.omega[k])
    along, upward = -model.radius * after[n + STANCE] - before.along, -before.upward
    p = momenta(model, M, F, U, change.omega, change.along, change.upward)
    turned = mass_change(model, s, c, F, U, change.theta, jump, along, upward)
    for k in range(n):
        p = put(p, k, p[k] - turned[k])
    return with_rates(model, change.theta, solve_linked(model.at_strike, M, p))


@inlined
def knee_strike(model: Standing, y: State) -> State:
    """State after the swing leg's knee has come into line and locked."""
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    M = standing_mass(model, s, c, U)
    p = F
    for k in range(n):
        total = 0.0
        for l in range(n):
            total += M[k * n + l] * y[n + l]
        p = put(p, k, total)
    omega = solve_linked(model.straight, M, p)
    for k in range(n):
        y = put(y, n + k, omega[k])
    return y


@inlined
def knee_strike_along(model: Standing, y: State, after: State, dy: State) -> State:
    """Derivative of `knee_strike` along dy; `after` is the state that y led to."""
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    M = standing_mass(model, s, c, U)
    jump, turn, p = F, F, F
    for k in range(n):
        jump, turn = put(jump, k, after[n + k] - y[n + k]), put(turn, k, dy[k])
        total = 0.0
        for l in range(n):
            total += M[k * n + l] * dy[n + l]
        p = put(p, k, total)
    turned = mass_change(model, s, c, F, U, turn, jump, -model.radius * jump[STANCE], 0.0)
    for k in range(n):
        p = put(p, k, p[k] - turned[k])
    omega = solve_linked(model.straight, M, p)
    for k in range(n):
        dy = put(dy, n + k, omega[k])
    return dy
