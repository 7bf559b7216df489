"""Plastic impacts: project the velocities before impact onto those that the new constraints allow, in the mass metric.

All masses have velocities u before and u+ = Z z+ after the impact, where Z follows from the new constraints and
Z^T M (u+ - u) = 0. The coordinates are those of the tree about the new stance foot: the velocity (v_x, v_y) of its
centre, along the slope and normal to it, and the bodies' angular velocities.

Source: (A.57) of the paper, with the impulse eliminated by the projection.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.kernels import forced_inline, kernel_part, matrix, vector
from walkerlab.physics.mechanics import rigid_model as rigid
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.mechanics.tree import add_inertia, factor_linked, projections, sines_cosines, solve_linked
from walkerlab.physics.mechanics.trigonometry import sine_cosine
from walkerlab.physics.solvers.system import Floats


@kernel_part
def strike(before: RigidModel, model: RigidModel, phase: int, y: Any, new: Any) -> None:
    """Write the state after a plastic impact under constraints E[phase] into `new`, where y is the state before it.

    At a heel strike, AT_STRIKE, the swing foot becomes the stance foot and the legs exchange their roles: `before` is
    the model of the swing that ends, `model` that of the next one. Any number of variational columns may follow the
    state. They are also mapped and written into `new`.
    """
    # E[phase] makes bodies follow others: a locked shank, for example, follows its thigh (see tree.py).
    like = model.arm_x
    other_foot = phase == rigid.AT_STRIKE
    n = len(like)
    R = model.radius
    R_before = before.radius
    E = model.E[phase]
    s, c, F, U = vector(like), vector(like), vector(like), vector(like)
    foot_F, foot_U = vector(like), vector(like)
    p, jump, turned = vector(like), vector(like), vector(like)
    M, factors = matrix(like), matrix(like)
    sines_cosines(before, n, y, s, c)
    projections(before.foot_x, before.foot_y, n, s, c, foot_F, foot_U)
    # Velocity of the new stance foot's centre, along the slope and normal to it. The old foot's centre moves at -R
    # omega. At a heel strike the levers to the other foot are added.
    along = -R_before * y[n + rigid.STANCE]
    upward = 0.0
    if other_foot:
        for l in range(n):
            along -= foot_U[l] * y[n + l]
            upward += foot_F[l] * y[n + l]
    for k in range(n):
        body = model.roles[k] if other_foot else k
        new[k], new[n + k] = y[body], y[n + body]
    # p is scratch here: finite torques have no part in an impact.
    rigid.equations(model, new, s, c, F, U, M, p)
    for k in range(n):
        for l in range(n):
            factors[k, l] = M[k, l]
        turned[k] = 0.0
    factor_linked(E, n, factors)
    pushed = other_foot and model.push_off != 0.0
    twist = push_off(model, new).angular if pushed else 0.0
    constraints = Constraints(E, M, factors, F, U)
    project(model, constraints, new[n : 2 * n], along, upward, twist, turned, p)
    for k in range(n):
        jump[k] = p[k] - new[n + k]
        new[n + k] = p[k]
    jump_along = -R * p[rigid.STANCE] - along
    jump_upward = -upward
    for at in range(2 * n, len(y), 2 * n):
        along = -R_before * y[at + n + rigid.STANCE]
        upward = 0.0
        if other_foot:
            # The root's velocity above is differentiated with dF/dtheta = -U and dU/dtheta = F.
            for l in range(n):
                along -= foot_F[l] * y[at + l] * y[n + l] + foot_U[l] * y[at + n + l]
                upward += foot_F[l] * y[at + n + l] - foot_U[l] * y[at + l] * y[n + l]
        for k in range(n):
            body = model.roles[k] if other_foot else k
            new[at + k], new[at + n + k] = y[at + body], y[at + n + body]
        twist = 0.0
        if pushed:
            push = push_off(model, new)
            twist = push.by_trailing * new[at + rigid.SWING] + push.by_leading * new[at + rigid.STANCE]
        turn = new[at : at + n]
        rate = new[at + n : at + 2 * n]
        # Z^T M (u+ - u) = 0 also holds for neighbouring angles. Its change contains Z^T dM (u+ - u), while Z is
        # constant.
        mass_change(model, s, c, turn, jump, jump_along, jump_upward, turned)
        project(model, constraints, rate, along, upward, twist, turned, p)
        for k in range(n):
            new[at + n + k] = p[k]


class RootedTree(NamedTuple):
    """Tree of n bodies, described relative to its root: the fields of a model's Mechanism that `project` needs."""

    A: Floats  # (n, n) kg m^2
    B: Floats
    arm_x: Floats  # (n,) kg m
    arm_y: Floats
    mass: float  # kg
    radius: float  # m, radius of the rolling foot; 0 if the root is at rest or is the centre of mass
    slope: float  # rad


def lock(
    tree: RootedTree, E: Floats, angles: Floats, omega: Floats, turns: Floats, rates: Floats
) -> tuple[Floats, float, Floats]:
    """Project the angular velocities omega (n,) onto those that E (n, n) allows. The root's motion does not change.

    turns, rates  (n, columns) changes of the angles (rad) and of omega (rad/s) just before the lock

    Returns the velocities after the lock, the kinetic energy lost (J), and the changes (n, columns) of the velocities.
    """
    n = len(omega)
    s, c, F, U, p = np.zeros((5, n))
    M = np.zeros((n, n))
    changes, turned = np.zeros((2, *rates.shape))
    sines_cosines(tree, n, angles, s, c)
    add_inertia(tree, n, s, c, omega, M, p)
    factors = M.copy()
    factor_linked(E, n, factors)
    constraints = Constraints(E, M, factors, F, U)
    project(tree, constraints, omega, along=0.0, upward=0.0, twist=0.0, turned=np.zeros(n), p=p)
    if rates.shape[1] > 0:
        mass_change(tree, s, c, turns, p - omega, 0.0, 0.0, turned)
        project(tree, constraints, rates, along=0.0, upward=0.0, twist=0.0, turned=turned, p=changes)
    # Because p is a projection in the metric M, p^T M (omega - p) = 0, which simplifies the loss to this form.
    return p, float(0.5 * (M @ omega) @ (omega - p)), changes


class PushOffImpulse(NamedTuple):
    """Push-off impulse at the trailing foot, along the line from its contact point to the hip."""

    along: float  # N s, along the slope
    upward: float  # N s, normal to the slope
    # N m s, angular impulse on the leading leg about its contact point. An impulse through the hip turns no other body.
    angular: float
    by_trailing: float  # N m s, derivative of `angular` with respect to the trailing leg's angle
    by_leading: float  # N m s, derivative with respect to the leading leg's angle


@kernel_part
def push_off(model: RigidModel, new: Any) -> PushOffImpulse:
    """Compute the push-off at a heel strike from the state `new` just after it."""
    s_t, c_t = sine_cosine(new[rigid.SWING] + model.slope)
    s_l, c_l = sine_cosine(new[rigid.STANCE] + model.slope)
    R_t = model.swing_radius
    R_l = model.radius
    hip_x = model.swing_hip_x
    hip_y = model.swing_hip_y
    # vector from each foot's contact point to the hip, along the slope and normal to it
    x_t = c_t * hip_x - s_t * hip_y
    y_t = s_t * hip_x + c_t * hip_y + R_t
    x_l = c_l * model.hip_x - s_l * model.hip_y
    y_l = s_l * model.hip_x + c_l * model.hip_y + R_l
    length = math.hypot(x_t, y_t)
    share = model.push_off / length
    # The impulse passes through the hip. This is the moment about the contact point of the leading leg.
    angular = share * (x_l * y_t - y_l * x_t)
    # Turning a leg moves the hip about the arc's centre, which is R above the contact point: dx = -(y - R), dy = x.
    # With R > 0 the distance from the trailing contact point to the hip also changes.
    by_trailing = share * (x_l * x_t + y_l * (y_t - R_t)) - angular * x_t * R_t / (length * length)
    by_leading = -share * ((y_l - R_l) * y_t + x_l * x_t)
    return PushOffImpulse(share * x_t, share * y_t, angular, by_trailing, by_leading)


def push_off_work(model: RigidModel, before: Floats) -> Floats:
    """Compute the work (strikes,) in J of the push-offs from states (strikes, 2 n) just before their heel strikes.

    At push-off the walker is free of the ground, its knees locked and its torso coupled. An impulse P along e does the
    work (P^2 / 2) J M^-1 J^T, where J gives the velocity along e of the trailing contact point or, equally, of the hip.
    Eliminating the angular velocities from M leaves the apparent mass at the hip, m - C^T I^-1 C, with first moments C
    and inertia I about the hip. With massless legs the work is P^2 / (2 m). Source: Kuo (2002).
    """
    n, E = len(model.arm_x), model.E[rigid.STRAIGHT]
    Z = E[:, np.diag(E) != 0.0]
    A, B, arm_x, arm_y = (each.copy() for each in (model.A, model.B, model.arm_x, model.arm_y))
    # The trailing leg carries no other body. Its constants about the hip are the same as in its next swing.
    following = model.exchanged
    leg = [rigid.SWING] if following.shank == rigid.NO_SHANK else [rigid.SWING, int(following.shank)]
    for pairs in (A, B):
        pairs[rigid.STANCE, :], pairs[:, rigid.STANCE] = 0.0, 0.0
    A[rigid.STANCE, rigid.STANCE] = following.A[np.ix_(leg, leg)].sum()
    arm_x[rigid.STANCE], arm_y[rigid.STANCE] = following.arm_x[leg].sum(), following.arm_y[leg].sum()
    psi = before[:, :n] + model.slope
    s = np.sin(psi)
    c = np.cos(psi)
    turned = psi[:, None, :] - psi[:, :, None]
    inertia = Z.T @ (A * np.cos(turned) + B * np.sin(turned)) @ Z
    moments = Z.T @ np.stack((-s * arm_x - c * arm_y, c * arm_x - s * arm_y), axis=2)
    apparent = model.mass * np.eye(2) - moments.transpose(0, 2, 1) @ np.linalg.solve(inertia, moments)
    s_t = s[:, rigid.STANCE]
    c_t = c[:, rigid.STANCE]
    to_hip = np.stack((c_t * model.hip_x - s_t * model.hip_y, s_t * model.hip_x + c_t * model.hip_y + model.radius), 1)
    impulse = following.push_off * to_hip / np.linalg.norm(to_hip, axis=1, keepdims=True)
    return np.asarray(0.5 * (impulse[:, None, :] @ np.linalg.solve(apparent, impulse[:, :, None]))[:, 0, 0])


def push_at_hip(model: RigidModel, y: Any, impulse: float) -> NDArray[np.float64]:
    """Return the state y (2 n,) after an impulse (N s) at the hip along the slope, applied just after a heel strike."""
    # The new stance foot stays at rest. The trailing knee is already released and moves freely.
    n = len(model.arm_x)
    new = np.array(y, float)
    E = model.E[rigid.BENT if model.kneed else rigid.STRAIGHT]
    M = rigid.mass_matrix(model, new)
    p = np.zeros(n)
    # A forward impulse above the foothold turns the stance leg clockwise.
    p[rigid.STANCE] = -impulse * rigid.hip_height(model, new)
    factor_linked(E, n, M)
    solve_linked(E, n, M, p)
    new[n:] += p
    return new


class Constraints(NamedTuple):
    """Constraints of an impact, with the mass matrix and moments of the tree about its new root."""

    E: Any  # (n, n) reduction of tree.py
    M: Any  # (n, n) kg m^2
    factors: Any  # (n, n) factors from `factor_linked`
    F: Any  # (n,) kg m, first moments projected onto the slope
    U: Any  # (n,) kg m, first moments projected onto the slope's normal


@forced_inline
def project(
    model: Any, constraints: Constraints, omega: Any, along: float, upward: float, twist: float, turned: Any, p: Any
) -> None:
    """Write the angular velocities (rad/s) after an impact, or a change of them, into p (n,).

    omega, along, upward  velocities u before the impact, or their change, of bodies (n,) in rad/s and root in m/s
    twist                 N m s, impulse on the stance leg, or its change
    turned                (n,) change of momentum due to a change of the angles; zero for velocities
    """
    # M is M' of rigid_model.py and includes the root's rolling velocity -R omega. `sliding` is `along` minus that.
    M, F, U = constraints.M, constraints.F, constraints.U
    n, R = len(model.arm_x), model.radius
    sliding = along + R * omega[rigid.STANCE]
    for k in range(n):
        total = upward * F[k] - sliding * U[k]
        for l in range(n):
            total += M[k, l] * omega[l]
        p[k] = total
    p[rigid.STANCE] -= R * model.mass * sliding
    for k in range(n):
        p[k] -= turned[k]
    p[rigid.STANCE] += twist
    solve_linked(constraints.E, n, constraints.factors, p)


@forced_inline
def mass_change(model: Any, s: Any, c: Any, turn: Any, jump: Any, along: float, upward: float, p: Any) -> None:
    """Write Z^T dM w into p (n,). `dM` is the change of M due to `turn` (n,), and w the jump of all velocities."""
    n = len(model.arm_x)
    F, U = vector(model.arm_x), vector(model.arm_x)
    projections(model.arm_x, model.arm_y, n, s, c, F, U)
    pulled = 0.0
    for k in range(n):
        turn_k = turn[k]
        total = -F[k] * turn_k * along - U[k] * turn_k * upward
        for l in range(n):
            cos_d = c[l] * c[k] + s[l] * s[k]
            sin_d = s[l] * c[k] - c[l] * s[k]
            total += (model.B[k, l] * cos_d - model.A[k, l] * sin_d) * (turn[l] - turn_k) * jump[l]
        p[k] = total
        pulled += F[k] * turn_k * jump[k]
    p[rigid.STANCE] += model.radius * pulled
