"""A walker standing on one foot that is pinned to the ground or rolls on it without slip.

The centre of the foot's arc is the tree's root; it moves along the slope by -R times the stance leg's angle, and R = 0
is a hinge. With the projections of the first moments c_k on the slope and its normal, F_k = (R(psi_k) c_k)_x and
U_k = (R(psi_k) c_k)_y, psi the angles from the slope's normal and s the stance leg:

    M'_kl = M_kl + R (U_k d_ls + U_l d_ks) + m R^2 d_ks d_ls
    r_k = sum over l of omega_l^2 (A_kl sin D - B_kl cos D) - g_along U_k - g_down F_k
          - d_ks R (sum over l of omega_l^2 F_l + m g_along)

Body 0 is the swing leg (its thigh), body 1 the stance leg, which stays straight; then the swing leg's shank, then what
belongs to both legs.
"""

import math
from typing import Any, NamedTuple

from walkerlab.kernels import by_type, inlined, woven
from walkerlab.mechanics.links import Independent, InLine, Links, gathered, reduced, solve_linked, spread
from walkerlab.mechanics.tree import Tree, mass_matrix, sines_cosines, with_centrifugal
from walkerlab.mechanics.trigonometry import sine_cosine
from walkerlab.mechanics.tuples import Vector, factored, put, solve_factored
from walkerlab.solvers.system import State, blank, derivative, jacobian

SWING, STANCE, SHANK = 0, 1, 2


class Standing(NamedTuple):
    """Everything that stays the same while the rigid model walks, SI."""

    tree: Tree  # about the centre of the stance foot's arc
    centrifugal: Tree  # constants of the centrifugal terms: the tree's own, unless somebody misprinted them
    radius: float  # [R] m, of either foot; 0 is a point
    foot_x: Vector  # (n) m, levers from the stance foot's centre to the swing foot's, body by body
    foot_y: Vector
    hip_x: float  # m, to the hip, which belongs to the stance leg
    hip_y: float
    knee: Any  # NoKnee or SwingKnee
    straight: Any  # links of a straight swing leg
    bent: Any  # links while its knee is free; the same for a leg without a knee
    at_strike: Any  # links in the heel strike
    roles: tuple[int, ...]  # (n) which body takes each place after the heel strike
    picked: tuple[int, ...]  # (d) places in the state of the section's coordinates, the stance leg's angle first
    lean: float  # rad, angle of the line from hip to foot centre in a straight leg
    leg_length: float  # [L] m, hip to sole
    gravity: float  # [g] m/s^2
    gravity_along: float  # m/s^2
    gravity_down: float  # m/s^2, towards the slope
    slope: float  # [phi] rad, positive downhill in walking direction
    blank: State  # (2 n) zeros: the bodies' angles from the vertical and their velocities


class NoKnee(NamedTuple):
    """Legs that are straight for good."""


class SwingKnee(NamedTuple):
    """The knee of the swing leg: it locks where the shank comes into line with its thigh from behind."""

    thigh: int  # places of both among the bodies
    shank: int


def on_slope(model: Standing, slope: float) -> Standing:
    """The same walker on another slope (rad)."""
    along, down = model.gravity * math.sin(slope), model.gravity * math.cos(slope)
    return model._replace(slope=slope, gravity_along=along, gravity_down=down)


class Mode(NamedTuple):
    """The walker between events."""

    model: Standing
    links: Any


class Variation(NamedTuple):
    """A mode with how its motion changes along directions of the start: the state, then a column (2 n) a direction."""

    mode: Mode
    blank: State


@blank.case(Mode)
def mode_blank(system: Mode) -> State:
    """Angles and velocities."""
    return system.model.blank


@blank.case(Variation)
def variation_blank(system: Variation) -> State:
    """The state and its columns."""
    return system.blank


@inlined
def projections(arm_x: Vector, arm_y: Vector, s: Vector, c: Vector) -> tuple[Vector, Vector]:
    """Levers or moments (n) seen along the slope and normal to it: F and U."""
    F, U = s, s
    for k in range(len(s)):
        F = put(F, k, c[k] * arm_x[k] - s[k] * arm_y[k])
        U = put(U, k, s[k] * arm_x[k] + c[k] * arm_y[k])
    return F, U


@inlined
def standing_mass(model: Any, s: Vector, c: Vector, U: Vector) -> Vector:
    """M' (n n), kg m^2."""
    n, R = len(s), model.radius
    M = mass_matrix(model.tree, s, c)
    if R == 0.0:
        return M
    for k in range(n):
        M = put(M, STANCE * n + k, M[STANCE * n + k] + R * U[k])
        M = put(M, k * n + STANCE, M[k * n + STANCE] + R * U[k])
    corner = STANCE * n + STANCE
    return put(M, corner, M[corner] + model.tree.mass * R * R)


@inlined
def standing_torques(model: Any, s: Vector, c: Vector, F: Vector, U: Vector, y: State) -> Vector:
    """r (n), N m."""
    n = len(s)
    r = U
    for k in range(n):
        r = put(r, k, -model.gravity_along * U[k] - model.gravity_down * F[k])
    if model.radius != 0.0:
        pulled = model.tree.mass * model.gravity_along
        for k in range(n):
            pulled += y[n + k] * y[n + k] * F[k]
        r = put(r, STANCE, r[STANCE] - model.radius * pulled)
    return with_centrifugal(model.centrifugal, s, c, y, n, r)


@woven
def rates(model: Standing, links: Any, y: State) -> Vector:
    """Angular accelerations (n) in rad/s^2."""
    return rates_of(links, model, y)


@by_type
def rates_of(links: Any, model: Any, y: State) -> Vector:
    """`rates` of the bodies that `links` leave to themselves."""


@rates_of.case(Independent, woven=True)
@rates_of.case(Links, woven=True)
def linked_rates(links: Any, model: Any, y: State) -> Vector:
    """M'^-1 r with the followers out of the way."""
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    return solve_linked(links, standing_mass(model, s, c, U), standing_torques(model, s, c, F, U, y))


class OneLess(NamedTuple):
    """What a walker's equations of motion need, with its straight swing leg as one body."""

    tree: Tree
    centrifugal: Tree
    radius: float
    gravity_along: float
    gravity_down: float
    slope: float


@rates_of.case(InLine, woven=True)
def rates_in_line(links: InLine, model: Standing, y: State) -> Vector:
    """Those of one body less."""
    one = OneLess(
        straight_tree(links, model.tree),
        straight_tree(links, model.centrifugal),
        model.radius,
        model.gravity_along,
        model.gravity_down,
        model.slope,
    )
    n, less = len(model.tree.arm_x), len(links.one_each)
    state = links.one_each + links.one_each
    for k in range(less):
        state = put(state, k, y[k if k < SHANK else k + 1])
        state = put(state, less + k, y[n + (k if k < SHANK else k + 1)])
    alpha, every = rates_of(links.others, one, state), model.tree.arm_x
    for k in range(n):
        every = put(every, k, alpha[place_in_line(k)])
    return every


@inlined
def place_in_line(k: int) -> int:
    """Where body k is among those of one body less."""
    return SWING if k == SHANK else (k if k < SHANK else k - 1)


@inlined
def straight_tree(links: InLine, tree: Tree) -> Tree:
    """The tree with the swing leg in one piece: constants of bodies that turn as one add up."""
    n, less = len(tree.arm_x), len(links.one_each)
    A, B, arm_x, arm_y = links.square, links.square, links.one_each, links.one_each
    for k in range(n):
        row = place_in_line(k)
        arm_x, arm_y = put(arm_x, row, arm_x[row] + tree.arm_x[k]), put(arm_y, row, arm_y[row] + tree.arm_y[k])
        for l in range(n):
            at = row * less + place_in_line(l)
            A, B = put(A, at, A[at] + tree.cosine[k * n + l]), put(B, at, B[at] + tree.sine[k * n + l])
    return Tree(tree.mass, A, B, arm_x, arm_y)


@inlined
def torque_gradients(
    model: Standing, s: Vector, c: Vector, F: Vector, U: Vector, alpha: Vector, y: State
) -> tuple[Vector, Vector]:
    """Derivatives (n n each) of r - M' alpha at fixed alpha with respect to the angles and to their velocities."""
    n, tree, R = len(s), model.tree, model.radius
    by_angle, by_rate = tree.cosine, tree.cosine
    for k in range(n):
        own = model.gravity_down * U[k] - model.gravity_along * F[k] - R * F[k] * alpha[STANCE]
        for l in range(n):
            omega = y[n + l]
            A, B = tree.cosine[k * n + l], tree.sine[k * n + l]
            A_c, B_c = model.centrifugal.cosine[k * n + l], model.centrifugal.sine[k * n + l]
            cos_d, sin_d = c[l] * c[k] + s[l] * s[k], s[l] * c[k] - c[l] * s[k]
            between = omega * omega * (A_c * cos_d + B_c * sin_d) + alpha[l] * (A * sin_d - B * cos_d)
            own -= between
            by_angle = put(by_angle, k * n + l, between)
            by_rate = put(by_rate, k * n + l, 2.0 * omega * (A_c * sin_d - B_c * cos_d))
        by_angle = put(by_angle, k * n + k, by_angle[k * n + k] + own)
    for l in range(n):
        omega, at = y[n + l], STANCE * n + l
        by_angle = put(by_angle, at, by_angle[at] - R * (F[l] * alpha[l] - omega * omega * U[l]))
        by_rate = put(by_rate, at, by_rate[at] - 2.0 * R * omega * F[l])
    return by_angle, by_rate


@inlined
def rates_along(model: Standing, links: Any, y: State, columns: State, first: int) -> State:
    """Derivatives of `rates` along the directions of `columns`: dz' of E' M' E dz' = E' (dr - dM' alpha).

    columns  begins with a state (see Variation) or, for first = 0, with a direction

    Returns `columns` with the rates of their own change in their places from `first` on.
    """
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    M, r = reduced(links, standing_mass(model, s, c, U), standing_torques(model, s, c, F, U, y))
    factors = factored(M, n)
    alpha = spread(links, solve_factored(factors, r))
    by_angle, by_rate = torque_gradients(model, s, c, F, U, alpha, y)
    out = columns
    for k in range(n):
        out = put(out, k, columns[n + k])
        out = put(out, n + k, alpha[k])
    for at in range(first, len(columns), 2 * n):
        change = alpha
        for k in range(n):
            total = 0.0
            for l in range(n):
                total += by_angle[k * n + l] * columns[at + l] + by_rate[k * n + l] * columns[at + n + l]
            change = put(change, k, total)
        faster = spread(links, solve_factored(factors, gathered(links, change)))
        for k in range(n):
            out = put(out, at + k, columns[at + n + k])
            out = put(out, at + n + k, faster[k])
    return out


@derivative.case(Mode, woven=True)
def mode_derivative(system: Mode, t: float, y: State) -> State:
    """The equations of motion as a first-order system."""
    n = len(system.model.tree.arm_x)
    alpha = rates(system.model, system.links, y)
    rate = system.model.blank
    for k in range(n):
        rate = put(rate, k, y[n + k])
        rate = put(rate, n + k, alpha[k])
    return rate


@derivative.case(Variation)
def variation_derivative(system: Variation, t: float, y: State) -> State:
    """Variational equations beside the equations of motion."""
    mode = system.mode
    return rates_along(mode.model, mode.links, y, y, len(mode.model.blank))


@jacobian.case(Mode)
def mode_jacobian(system: Mode, t: float, y: State, J: Any) -> None:
    """Derivatives of the equations of motion, one direction a column."""
    model = system.model
    n = len(model.tree.arm_x)
    for j in range(2 * n):
        along = rates_along(model, system.links, y, direction(model.blank, j), 0)
        for i in range(2 * n):
            J[i, j] = along[i]


@inlined
def direction(like: State, j: int) -> State:
    """The unit vector along number j."""
    return put(like, j, 1.0)


@inlined
def ground_reaction(model: Standing, links: Any, y: State) -> tuple[float, float]:
    """Force of the ground on the stance foot (N): along the slope (positive in walking direction) and normal to it."""
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    alpha = rates(model, links, y)
    along = -model.tree.mass * (model.radius * alpha[STANCE] + model.gravity_along)
    normal = model.tree.mass * model.gravity_down
    for k in range(n):
        squared = y[n + k] * y[n + k]
        along -= U[k] * alpha[k] + F[k] * squared
        normal += F[k] * alpha[k] - U[k] * squared
    return along, normal


@inlined
def kinetic_energy(model: Standing, y: State) -> float:
    """Kinetic energy (J)."""
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    _, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    M = standing_mass(model, s, c, U)
    total = 0.0
    for k in range(n):
        for l in range(n):
            total += M[k * n + l] * y[n + k] * y[n + l]
    return 0.5 * total


@inlined
def potential_energy(model: Standing, y: State) -> float:
    """Potential energy (J) from the current foothold: where the foot touches with its leg normal to the slope."""
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.tree.arm_x, model.tree.arm_y, s, c)
    rolled = -model.radius * (y[STANCE] + model.slope)
    total = model.tree.mass * (model.gravity_down * model.radius - model.gravity_along * rolled)
    for k in range(len(s)):
        total += model.gravity_down * U[k] - model.gravity_along * F[k]
    return total


@inlined
def total_energy(model: Standing, y: State) -> float:
    """Kinetic and potential energy (J) from the current foothold."""
    return kinetic_energy(model, y) + potential_energy(model, y)


@inlined
def swing_foot(model: Standing, y: State) -> tuple[float, float]:
    """How high the swing foot's lowest point is over the slope, and how far it is ahead of the stance foot's (m)."""
    return swing_foot_motion(model, y)[0]


@inlined
def swing_foot_motion(model: Standing, y: State) -> tuple[tuple[float, float], tuple[float, float]]:
    """`swing_foot` and its rates (m/s)."""
    n = len(model.tree.arm_x)
    s, c = sines_cosines(model.tree, y, 0, model.slope)
    F, U = projections(model.foot_x, model.foot_y, s, c)
    height, ahead, upward, apart = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        height += U[k]
        ahead += F[k]
        upward += F[k] * y[n + k]
        apart -= U[k] * y[n + k]
    return (height, ahead), (upward, apart)


@inlined
def hip_height(model: Standing, y: State) -> float:
    """Height of the hip over the slope (m)."""
    s, c = sine_cosine(y[STANCE] + model.slope)
    return model.radius + s * model.hip_x + c * model.hip_y


@inlined
def feet_on_slope(model: Standing, y: State) -> float:
    """Sum (rad) of the straight legs' angles from the slope's normal: zero with both feet on the slope.

    It falls through zero at heel strike. (9-2) prints theta_1 = -theta_2, which holds only for angles from the normal.
    """
    return y[SWING] + y[STANCE] + 2.0 * (model.slope + model.lean)


@inlined
def rolled_distance(model: Standing, start: State, end: State) -> float:
    """How far (m) the stance foot's point of contact has moved along the slope between two states of one step."""
    return -model.radius * (end[STANCE] - start[STANCE])
