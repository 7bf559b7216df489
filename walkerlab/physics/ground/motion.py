"""Equations of motion of the walker on compliant ground, and their exact derivatives."""

from typing import Any

from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.hinges import add_gradients, add_torques
from walkerlab.physics.ground.pulse import push_gradient, push_on
from walkerlab.physics.ground.walker import BODY_VECTOR, GroundModel, OnGround
from walkerlab.physics.kernels import forced_inline, kernel_part, matrix, vector
from walkerlab.physics.mechanics import tree
from walkerlab.physics.solvers.system import block, derivative, jacobian


@block.case(OnGround)
def coordinate_and_rate(system: OnGround) -> tuple[float, float]:
    # Forms differ in size, but each has as many rates as coordinates, so blocks of two always fit.
    return (0.0, 0.0)


@forced_inline
def foot_wrench(system: OnGround, t: float, foot: int, s: Any, c: Any, y: Any, r: Any) -> tuple[float, float]:
    """Compute the force (N) of the ground and the push-off on a foot, along and normal to the slope.

    Adds the torques of this force to r (n,).
    """
    form = system.form
    push = push_on(system, t, foot, s, c)
    along = push.along
    normal = push.upward
    if system.has_ground[foot] != 0:
        motion = forms.relative_to_ground(system, foot, forms.foot_motion(form, foot, s, c, y))
        if motion.height < 0.0:
            force = forms.foot_force(system, motion)
            along += force.along
            normal += force.normal.force
    if along == 0.0 and normal == 0.0:
        return 0.0, 0.0
    F, U = vector(BODY_VECTOR), vector(BODY_VECTOR)
    tree.projections(form.foot_x[foot], form.foot_y[foot], form.bodies, s, c, F, U)
    for k in range(form.bodies):
        # Virtual work: per unit rate of body k, the foot's lowest material point moves by rolling - U along the slope
        # and by F normal to it.
        r[k] += along * (form.rolling[foot, k] - U[k]) + normal * F[k]
    return along, normal


@forced_inline
def solve_motion(system: OnGround, t: float, y: Any, s: Any, c: Any, M: Any, r: Any) -> tuple[float, float]:
    """Compute the ground and push-off forces (N, along and normal to the slope), and the angular accelerations.

    Writes the accelerations into r, sines and cosines of the angles into s and c, and the factors of the mass matrix
    into M.
    """
    # First, r collects the torques of feet, hinges, stops, centrifugal forces and, in a pinned form, gravity.
    form = system.form
    forms.sines_cosines(form, y, s, c)
    n = form.bodies
    half = forms.half_size(form)
    for k in range(n):
        r[k] = 0.0
    # In a free form, gravity has no torque about the root, which is the centre of mass. `ground_derivative` adds the
    # acceleration.
    if form.places == 0:
        F, U = vector(BODY_VECTOR), vector(BODY_VECTOR)
        tree.projections(form.arm_x, form.arm_y, n, s, c, F, U)
        tree.add_gravity(form, n, F, U, r)
    along = 0.0
    normal = 0.0
    for foot in range(2):
        force = foot_wrench(system, t, foot, s, c, y, r)
        along += force[0]
        normal += force[1]
    add_torques(system, y, r)
    tree.add_inertia(form, n, s, c, y[half + form.places : 2 * half], M, r)
    tree.factor_linked(form.E[0], n, M)
    tree.solve_linked(form.E[0], n, M, r)
    return along, normal


@derivative.case(OnGround)
def ground_derivative(system: OnGround, t: float, y: Any, f: Any) -> None:
    """Evaluate Newton's law for the centre of mass (unless a foot is pinned) and the tree's equations of motion."""
    form = system.form
    n = form.bodies
    half = forms.half_size(form)
    first = form.places
    s, c, r, M = vector(BODY_VECTOR), vector(BODY_VECTOR), vector(BODY_VECTOR), matrix(BODY_VECTOR)
    along, normal = solve_motion(system, t, y, s, c, M, r)
    for i in range(half):
        f[i] = y[half + i]
    if first > 0:
        f[half] = form.gravity_along + along / form.mass
        f[half + 1] = normal / form.mass - form.gravity_down
    for k in range(n):
        f[half + first + k] = r[k]


@kernel_part
def motion_gradient(form: GroundModel, foot: int, F: Any, U: Any, y: Any, j: int) -> tuple[float, float, float]:
    """Return the derivatives of a foot's penetration, penetration rate and slip with respect to y[j].

    F, U  (n,) levers from the root to the foot, projected on the slope and on its normal
    """
    p = form.places
    half = forms.half_size(form)
    moves = j >= half
    k = (j - half if moves else j) - p
    if k < 0:
        # j is a coordinate or velocity of the root, normal to the slope (k = -1) or along it (k = -2).
        if k == -1:
            return (0.0, -1.0, 0.0) if moves else (-1.0, 0.0, 0.0)
        return 0.0, 0.0, 1.0 if moves else 0.0
    if moves:
        return 0.0, -F[k], form.rolling[foot, k] - U[k]
    # The derivatives below follow from dF/dtheta = -U and dU/dtheta = F.
    omega = y[half + p + k]
    return -F[k], omega * U[k], -omega * F[k]


@kernel_part
def add_foot_gradients(system: OnGround, t: float, foot: int, s: Any, c: Any, y: Any, J: Any) -> None:
    """Add the derivatives of a foot's force and torques to J, whose rows the caller divides by mass and inertia."""
    form = system.form
    push = push_on(system, t, foot, s, c)
    motion = forms.relative_to_ground(system, foot, forms.foot_motion(form, foot, s, c, y))
    inside = system.has_ground[foot] != 0 and motion.height < 0.0
    pushed = push.above != 0.0
    if not inside and not pushed:
        return
    F, U = vector(BODY_VECTOR), vector(BODY_VECTOR)
    p = form.places
    half = forms.half_size(form)
    tree.projections(form.foot_x[foot], form.foot_y[foot], form.bodies, s, c, F, U)
    along = push.along
    normal = push.upward
    if inside:
        force = forms.foot_force(system, motion)
        along += force.along
        normal += force.normal.force
        for j in range(2 * half):
            # derivatives of penetration, its rate and the slip with respect to coordinate or velocity j
            deeper, deeper_rate, faster = motion_gradient(form, foot, F, U, y, j)
            by_j = force.normal.by_penetration * deeper + force.normal.by_rate * deeper_rate
            add_column(form, foot, j, force.coefficient * by_j + force.by_slip * faster, by_j, F, U, J)
    for k in range(form.bodies):
        # The arm of the force turns with the body: d(rolling - U)/dtheta = -F and dF/dtheta = -U.
        J[half + p + k, p + k] -= along * F[k] + normal * U[k]
        if pushed:
            by_angle = push_gradient(form, push, foot, s, c, k)
            add_column(form, foot, p + k, by_angle[0], by_angle[1], F, U, J)


@kernel_part
def add_column(form: GroundModel, foot: int, j: int, along: float, normal: float, F: Any, U: Any, J: Any) -> None:
    """Add derivatives of a foot's force (`along` and `normal` to the slope) and of its torques to column j of J."""
    p = form.places
    half = forms.half_size(form)
    if p > 0:
        J[half, j] += along
        J[half + 1, j] += normal
    for k in range(form.bodies):
        J[half + p + k, j] += along * (form.rolling[foot, k] - U[k]) + normal * F[k]


@kernel_part
def add_torque_gradients(system: OnGround, s: Any, c: Any, y: Any, alpha: Any, by_angle: Any, by_rate: Any) -> None:
    form = system.form
    n = form.bodies
    p = form.places
    half = forms.half_size(form)
    if p == 0:
        F, U = vector(BODY_VECTOR), vector(BODY_VECTOR)
        tree.projections(form.arm_x, form.arm_y, n, s, c, F, U)
        tree.add_gravity_gradient(form, n, F, U, by_angle)
    add_gradients(system, y, by_angle, by_rate)
    tree.add_inertia_gradients(form, n, s, c, y[half + p : 2 * half], alpha, by_angle, by_rate)


@jacobian.case(OnGround)
def ground_jacobian(system: OnGround, t: float, y: Any, J: Any) -> None:
    """Compute the Jacobian of the equations of motion, exact except at switching points of the force law."""
    form = system.form
    n = form.bodies
    p = form.places
    half = forms.half_size(form)
    s, c, alpha, M = vector(BODY_VECTOR), vector(BODY_VECTOR), vector(BODY_VECTOR), matrix(BODY_VECTOR)
    by_torque = matrix(BODY_VECTOR)
    for i in range(half):
        for j in range(2 * half):
            J[i, j], J[half + i, j] = 1.0 if j == i + half else 0.0, 0.0
    solve_motion(system, t, y, s, c, M, alpha)
    # row k: angular accelerations due to a unit torque on body k
    for k in range(n):
        for l in range(n):
            by_torque[k, l] = 1.0 if k == l else 0.0
        tree.solve_linked(form.E[0], n, M, by_torque[k])
    for foot in range(2):
        add_foot_gradients(system, t, foot, s, c, y, J)
    add_torque_gradients(system, s, c, y, alpha, J[half + p :, p:half], J[half + p :, half + p :])
    for j in range(2 * half):
        for k in range(n):
            # M d alpha = d r - dM alpha. The rows of J hold the right-hand side so far, and `by_torque` is the inverse
            # of M.
            alpha[k] = J[half + p + k, j]
        for k in range(n):
            total = 0.0
            for l in range(n):
                total += by_torque[l, k] * alpha[l]
            J[half + p + k, j] = total
        for i in range(p):
            J[half + i, j] /= form.mass
