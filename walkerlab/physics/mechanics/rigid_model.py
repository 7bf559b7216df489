"""Rigid model: a walker on one foot, which is pinned to the ground or rolls on it without slip.

The root of the tree is the centre of the foot's arc. It moves along the slope by -R times the stance leg's angle. For
R = 0 it is a hinge. With M, r, F and U of tree.py, Kronecker's delta d and the index s of the stance leg:

    M'_kl = M_kl + R (U_k d_ls + U_l d_ks) + m R^2 d_ks d_ls
    r'_k = r_k - d_ks R (sum over l of omega_l^2 F_l + m g_along)

Body 0 is the swing leg (or its thigh), body 1 the straight stance leg. Then come the swing leg's shank and the bodies
that both legs share. Bodies that follow others are eliminated as in tree.py.
"""

import math
from typing import Any, NamedTuple, cast

import numpy as np

from walkerlab.physics.kernels import forced_inline, kernel_part, matrix, vector, zeros
from walkerlab.physics.mechanics import hinges, tree
from walkerlab.physics.mechanics.trigonometry import sine_cosine
from walkerlab.physics.solvers.system import Floats, Integers, block, derivative, jacobian

SWING, STANCE = range(2)
# indices into E: swing knee bent, swing leg straight, heel strike
BENT, STRAIGHT, AT_STRIKE = range(3)
NO_SHANK = -1


@tree.fast_fields
class RigidModel(tree.Mechanism):  # type: ignore[misc]  # as for Mechanism
    """Structured scalar with the constants (SI) of the rigid model. Its type fixes the number n of bodies."""

    # E holds three reductions: BENT, STRAIGHT and AT_STRIKE. If the legs differ, `paired_with` is the model in which
    # the other leg swings. It is not a field, because kernels take both models as an array (see `models_in_turn`).
    paired_with = cast("RigidModel | None", None)

    foot_x: Floats  # (n,) m, levers of the bodies from the stance foot's centre to the swing foot's
    foot_y: Floats
    roles: Integers  # (n,) body k after a heel strike is body roles[k] before it
    section: Integers  # (n + 1,) state indices of the d section coordinates, the stance leg's angle first, then zeros
    coordinates: int  # [d] number of coordinates on the section
    thigh: int  # index of the swing leg's thigh; NO_SHANK without knees
    shank: int  # index of the swing leg's shank; NO_SHANK without knees
    unpaired: float  # kg m^2, coefficient of the torque on the stance leg in `add_unpaired_torque`
    radius: float  # [R] m, radius of the stance foot; 0 for a point foot
    swing_radius: float  # m, radius of the swing foot
    hip_x: float  # m, lever from the stance foot's centre to the hip, in the stance leg's frame
    hip_y: float
    swing_hip_x: float  # m, lever from the swing foot's centre to the hip, in the straight swing leg's frame
    swing_hip_y: float
    alike: bool  # whether both legs have the same length and sole
    lean: float  # rad, angle from a straight leg's axis to the line from hip to foot centre
    leg_length: float  # [L] m, from hip to sole
    gravity: float  # [g] m/s^2
    zero_state: Floats  # (2 n,) zeros for the state: the bodies' angles from the vertical and their velocities

    @property
    def section_indices(self) -> tuple[int, ...]:
        """Indices (d,) of the section's coordinates in the state."""
        return tuple(self.section[: self.coordinates].tolist())

    @property
    def kneed(self) -> bool:
        return bool(self.shank != NO_SHANK)

    @property
    def passive(self) -> bool:
        """Whether the walker has no drive, spring or damper."""
        return not self.sprung and not self.driven

    @property
    def damped_knees(self) -> bool:
        """Whether a knee has a damper."""
        laws = [model.laws[hinges.HIP_ROW + 1 :, hinges.DAMPING] for model in (self, self.exchanged)]
        return bool(np.any(laws))

    @property
    def legs_differ(self) -> bool:
        return self.paired_with is not None

    @property
    def exchanged(self) -> "RigidModel":
        """Model of the next step, in which the legs have exchanged roles. If the legs are equal, it is this model."""
        return self if self.paired_with is None else pair(self.paired_with, self)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RigidModel) or self.dtype != other.dtype or self.tobytes() != other.tobytes():
            return False
        return bool(self.paired_with == other.paired_with)

    def __hash__(self) -> int:
        return hash((self.tobytes(), self.paired_with))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as read-only: kernels would be compiled again for a writable record."""
        return restore_model, (np.asarray(self), self.paired_with)

    def changed(self, **fields: Any) -> "RigidModel":
        """Return a read-only copy with some fields changed. If the legs differ, both models are changed."""
        model = replace_fields(self, fields)
        return model if self.paired_with is None else pair(model, replace_fields(self.paired_with, fields))


def replace_fields(model: Any, fields: Any) -> RigidModel:
    """Return a read-only copy of a model with some fields changed. The copy is not paired with another model."""
    memory: Any = np.empty((), model.dtype)
    memory[()] = model
    tree.write_fields(memory, fields)
    memory.flags.writeable = False
    return cast(RigidModel, memory[()])


def pair(first: RigidModel, second: RigidModel) -> RigidModel:
    """Return a copy of `first`, in which leg 1 swings, paired with `second`, in which leg 2 swings."""
    model = replace_fields(first, {})
    other = replace_fields(second, {})
    # An ordinary assignment would make NumPy look for a field of this name in the record.
    object.__setattr__(model, "paired_with", other)
    return model


def restore_model(record: Any, paired_with: RigidModel | None) -> RigidModel:
    """Return the model of a pickled record."""
    model = replace_fields(record, {})
    return model if paired_with is None else pair(model, paired_with)


def models_in_turn(model: RigidModel) -> Any:
    """Return the models of successive steps as an array for kernels: one model for equal legs, otherwise two."""
    models = np.array([model] if model.paired_with is None else [model, model.paired_with], model.dtype)
    models.flags.writeable = False
    return models


def compute_in_turns(model: RigidModel, step: Any, compute: Any, *rows: Any) -> Floats:
    """Return compute(model, *rows), with the model of the other leg for rows that belong to odd steps.

    step  (n,) number of the step of each row
    rows  (n, ...) arrays of arguments
    """
    if model.paired_with is None:
        return np.asarray(compute(model, *rows))
    parts = [(step % 2 == k, each) for k, each in enumerate((model, model.exchanged))]
    values = [compute(each, *(row[chosen] for row in rows)) for chosen, each in parts]
    merged = np.empty((len(step), *values[0].shape[1:]))
    for (chosen, _), value in zip(parts, values, strict=True):
        merged[chosen] = value
    return merged


def new_rigid_model(n: int, law: type[hinges.SpringDamper], **fields: Any) -> RigidModel:
    """Create a rigid model of n bodies with a hinge law and the given fields. All others are zero."""
    shapes = {
        **tree.mechanism_shapes(n, 3, len(fields["hinges"])),
        **dict.fromkeys(("foot_x", "foot_y", "roles"), (n,)),
        "section": (n + 1,),
        "zero_state": (2 * n,),
    }
    model: RigidModel = tree.new_record(tree.record_type(RigidModel, shapes, law))
    return model.changed(**fields)


def change_slope(model: RigidModel, slope: float) -> RigidModel:
    along = model.gravity * math.sin(slope)
    down = model.gravity * math.cos(slope)
    return model.changed(slope=slope, gravity_along=along, gravity_down=down)


class Mode(NamedTuple):
    """System to integrate between events, for a state (2 n,) followed by any number of variational columns (2 n,)."""

    model: RigidModel
    phase: int  # BENT or STRAIGHT
    # m, heights of the foothold that the swing foot leaves and of its next one, relative to the stance foothold
    behind: float = 0.0
    rise: float = 0.0


@block.case(Mode)
def state_or_column(system: Mode) -> Any:
    """Return zeros (2 n,) in the shape of the state and of each variational column."""
    return zeros(system.model.zero_state)


@forced_inline
def equations(model: RigidModel, y: Any, s: Any, c: Any, F: Any, U: Any, M: Any, r: Any) -> None:
    """Write M' (n, n) in kg m^2 into M and r' (n,) in N m into r.

    Sines and cosines of the angles go to s and c, and the projected first moments to F and U, (n,) each.
    """
    n, R = len(model.arm_x), model.radius
    omega = y[n : 2 * n]
    tree.sines_cosines(model, n, y, s, c)
    tree.projections(model.arm_x, model.arm_y, n, s, c, F, U)
    for k in range(n):
        r[k] = 0.0
    tree.add_gravity(model, n, F, U, r)
    tree.add_inertia(model, n, s, c, omega, M, r)
    for row in range(len(model.hinges)):
        if hinges.is_sprung(model, row):
            hinges.add_hinge_torque(torque_at(model, row, y), model.hinges[row, 0], model.hinges[row, 1], r)
    add_unpaired_torque(model, s, c, omega, r)
    if R != 0.0:
        pulled = model.mass * model.gravity_along
        for k in range(n):
            pulled += omega[k] * omega[k] * F[k]
            M[STANCE, k] += R * U[k]
            M[k, STANCE] += R * U[k]
        r[STANCE] -= R * pulled
        M[STANCE, STANCE] += model.mass * R * R


@forced_inline
def torque_at(model: RigidModel, row: int, y: Any) -> hinges.HingeTorque:
    """Compute the torque of the spring, damper and drive at a hinge."""
    n = len(model.arm_x)
    body = model.hinges[row, 0]
    other = model.hinges[row, 1]
    return hinges.hinge_torque(hinges.hinge_law(model, row), y[body] - y[other], y[n + body] - y[n + other])


@hinges.legs_apart.case(Mode)
def rigid_legs_apart(system: Mode, y: Any) -> tuple[float, float]:
    """Return the angle between the legs' uppermost bodies (rad), and its rate (rad/s)."""
    n = len(system.model.arm_x)
    return y[SWING] - y[STANCE], y[n + SWING] - y[n + STANCE]


@forced_inline
def add_unpaired_torque(model: RigidModel, s: Any, c: Any, omega: Any, r: Any) -> None:
    """Add the torque `unpaired` sin(theta_1 - theta_2) omega_1^2 (N m) on the stance leg to r (n,)."""
    # This torque has no reaction on the swing leg and does not conserve energy. In Lagrange's equations it is zero.
    if model.unpaired != 0.0:
        r[STANCE] += model.unpaired * omega[SWING] * omega[SWING] * (s[SWING] * c[STANCE] - c[SWING] * s[STANCE])


@forced_inline
def add_unpaired_gradients(model: RigidModel, s: Any, c: Any, omega: Any, by_angle: Any, by_rate: Any) -> None:
    """Add the derivatives of the unpaired torque with respect to angles and rates to by_angle and by_rate (n, n)."""
    if model.unpaired != 0.0:
        cos_d = c[SWING] * c[STANCE] + s[SWING] * s[STANCE]
        sin_d = s[SWING] * c[STANCE] - c[SWING] * s[STANCE]
        turning = model.unpaired * omega[SWING] * omega[SWING] * cos_d
        by_angle[STANCE, SWING] += turning
        by_angle[STANCE, STANCE] -= turning
        by_rate[STANCE, SWING] += 2.0 * model.unpaired * omega[SWING] * sin_d


@derivative.case(Mode)
def mode_derivative(system: Mode, t: float, y: Any, f: Any) -> None:
    """Evaluate the equations of motion as a first-order system, and the variational equations for the columns."""
    model = system.model
    like = model.arm_x
    E = model.E[system.phase]
    n = len(like)
    s, c, F, U = vector(like), vector(like), vector(like), vector(like)
    alpha, M = vector(like), matrix(like)
    equations(model, y, s, c, F, U, M, alpha)
    tree.factor_linked(E, n, M)
    tree.solve_linked(E, n, M, alpha)
    for k in range(n):
        f[k], f[n + k] = y[n + k], alpha[k]
    if len(y) > 2 * n:
        by_angle, by_rate = matrix(like), matrix(like)
        torque_gradients(model, y, s, c, alpha, by_angle, by_rate)
        for at in range(2 * n, len(y), 2 * n):
            # The state's alpha is no longer needed. From here on, alpha holds d alpha, the solution of
            # E^T M' E d alpha = E^T (dr' - dM' alpha).
            for k in range(n):
                total = 0.0
                for l in range(n):
                    total += by_angle[k, l] * y[at + l] + by_rate[k, l] * y[at + n + l]
                alpha[k] = total
            tree.solve_linked(E, n, M, alpha)
            for k in range(n):
                f[at + k], f[at + n + k] = y[at + n + k], alpha[k]


@forced_inline
def torque_gradients(model: RigidModel, y: Any, s: Any, c: Any, alpha: Any, by_angle: Any, by_rate: Any) -> None:
    """Write the derivatives of r' - M' alpha at fixed alpha into by_angle and by_rate (n, n)."""
    n, R = len(model.arm_x), model.radius
    omega = y[n : 2 * n]
    F, U = vector(model.arm_x), vector(model.arm_x)
    tree.projections(model.arm_x, model.arm_y, n, s, c, F, U)
    for k in range(n):
        for l in range(n):
            by_angle[k, l], by_rate[k, l] = 0.0, 0.0
        # From M'_ks = M_ks + R U_k, with dU/dtheta = F.
        by_angle[k, k] = -R * F[k] * alpha[STANCE]
    tree.add_gravity_gradient(model, n, F, U, by_angle)
    tree.add_inertia_gradients(model, n, s, c, omega, alpha, by_angle, by_rate)
    for row in range(len(model.hinges)):
        if hinges.is_sprung(model, row):
            now = torque_at(model, row, y)
            hinges.add_hinge_gradients(now, model.hinges[row, 0], model.hinges[row, 1], by_angle, by_rate)
    add_unpaired_gradients(model, s, c, omega, by_angle, by_rate)
    if R != 0.0:
        for l in range(n):
            by_angle[STANCE, l] -= R * (F[l] * alpha[l] - omega[l] * omega[l] * U[l])
            by_rate[STANCE, l] -= 2.0 * R * omega[l] * F[l]


@jacobian.case(Mode)
def mode_jacobian(system: Mode, t: float, y: Any, J: Any) -> None:
    """Compute the Jacobian (2 n, 2 n) of the equations of motion, column by column."""
    model = system.model
    like = model.arm_x
    E = model.E[system.phase]
    n = len(like)
    s, c, F, U = vector(like), vector(like), vector(like), vector(like)
    alpha, M = vector(like), matrix(like)
    by_angle, by_rate = matrix(like), matrix(like)
    equations(model, y, s, c, F, U, M, alpha)
    tree.factor_linked(E, n, M)
    tree.solve_linked(E, n, M, alpha)
    torque_gradients(model, y, s, c, alpha, by_angle, by_rate)
    for j in range(2 * n):
        for k in range(n):
            J[k, j] = 1.0 if j == n + k else 0.0
            alpha[k] = by_angle[k, j] if j < n else by_rate[k, j - n]
        tree.solve_linked(E, n, M, alpha)
        for k in range(n):
            J[n + k, j] = alpha[k]


@kernel_part
def ground_reaction(system: Mode, y: Any) -> tuple[float, float]:
    """Compute the ground force (N) on the stance foot, along the slope (in the walking direction) and normal to it."""
    model = system.model
    n = len(model.arm_x)
    s, c, F, U = vector(model.arm_x), vector(model.arm_x), vector(model.arm_x), vector(model.arm_x)
    f = vector(model.zero_state)
    tree.sines_cosines(model, n, y, s, c)
    tree.projections(model.arm_x, model.arm_y, n, s, c, F, U)
    derivative(system, 0.0, y, f)
    # Newton's law for the centre of mass, which moves with the rolling foot's centre and with the first moments.
    along = -model.mass * (model.radius * f[n + STANCE] + model.gravity_along)
    normal = model.mass * model.gravity_down
    for k in range(n):
        squared = y[n + k] * y[n + k]
        along -= U[k] * f[n + k] + F[k] * squared
        normal += F[k] * f[n + k] - U[k] * squared
    return along, normal


@kernel_part
def momentum(model: RigidModel, y: Any) -> tuple[float, float]:
    """Compute the walker's linear momentum (kg m/s), along the slope and normal to it."""
    n = len(model.arm_x)
    s, c = vector(model.arm_x), vector(model.arm_x)
    tree.sines_cosines(model, n, y, s, c)
    _, _, along, normal = tree.lever_motion(model.arm_x, model.arm_y, n, s, c, y[n : 2 * n])
    return along - model.mass * model.radius * y[n + STANCE], normal


@kernel_part
def energies(model: RigidModel, y: Any) -> tuple[float, float]:
    """Compute the kinetic energy, and the potential energy of gravity and of the springs at the hinges (J)."""
    # Heights are measured from the contact point of a stance leg that is normal to the slope.
    n = len(model.arm_x)
    s, c, F, U = vector(model.arm_x), vector(model.arm_x), vector(model.arm_x), vector(model.arm_x)
    r, M = vector(model.arm_x), matrix(model.arm_x)
    equations(model, y, s, c, F, U, M, r)
    # The foot's centre has rolled this far since the leg was normal to the slope.
    rolled = -model.radius * (y[STANCE] + model.slope)
    potential = tree.potential_energy(model, n, rolled, model.radius, F, U)
    for row in range(len(model.hinges)):
        apart = y[model.hinges[row, 0]] - y[model.hinges[row, 1]]
        potential += hinges.hinge_energy(hinges.hinge_law(model, row), apart)
    return tree.kinetic_energy(n, M, y[n : 2 * n]), potential


def energy_at_touch(model: RigidModel, touched: Any) -> Any:
    """Compute the potential energy (J) of the walker if all its mass were at the point where a foot touches down.

    touched  rad, angle of the leg at its touch
    """
    # This uses the same zero level as `energies`, so that the two can be subtracted.
    return model.mass * model.gravity_along * model.radius * (touched + model.slope)


@kernel_part
def swing_foot(model: RigidModel, y: Any) -> tuple[float, float]:
    """Compute the swing foot's height above the stance foot and its distance ahead of it (m)."""
    # The changes are not used, so any array serves as `turn`.
    height, ahead, _, _ = swing_foot_motion(model, y, y)
    return height, ahead


@kernel_part
def swing_foot_motion(model: RigidModel, y: Any, turn: Any) -> tuple[float, float, float, float]:
    """Compute height and distance of the swing foot (m), and how they change if the bodies turn by `turn` (n,).

    If `turn` is in rad/s, the changes are velocities (m/s).
    """
    n = len(model.arm_x)
    s, c = vector(model.arm_x), vector(model.arm_x)
    tree.sines_cosines(model, n, y, s, c)
    ahead, height, apart, upward = tree.lever_motion(model.foot_x, model.foot_y, n, s, c, turn)
    return height + (model.radius - model.swing_radius), ahead, upward, apart


@kernel_part
def hip_height(model: RigidModel, y: Any) -> float:
    """Compute the height (m) of the hip above the slope."""
    s, c = sine_cosine(y[STANCE] + model.slope)
    return model.radius + s * model.hip_x + c * model.hip_y


@kernel_part
def feet_on_slope(model: Any, swing: Any, stance: Any) -> Any:
    """Compute the sum (rad) of the straight legs' angles from the slope's normal: 0 if both feet are on even ground.

    For legs that are alike, the sum falls through zero at heel strike. `swing` and `stance` (rad) are scalars, arrays
    or lanes, measured from the vertical. Equation (9-2) of the paper reads theta_1 = -theta_2, which holds only for
    angles from the normal.
    """
    return swing + stance + 2.0 * (model.slope + model.lean)


def step_lengths(model: RigidModel, starts: Any, ends: Any) -> Floats:
    """Compute step lengths (steps,) in m along the slope from each step's first and last state (steps, 2 n)."""
    psi = ends[:, : len(model.arm_x)] + model.slope
    ahead = np.cos(psi) @ model.foot_x - np.sin(psi) @ model.foot_y
    return np.asarray(ahead - model.radius * (ends[:, STANCE] - starts[:, STANCE]))


def step_length_changes(model: RigidModel, ends: Any, starts_turn: Any, ends_turn: Any) -> Floats:
    """Compute changes of `step_lengths` (steps, columns) in m due to changes of the states (steps, columns, 2 n)."""
    n = len(model.arm_x)
    psi = ends[:, :n] + model.slope
    by_angle = -np.sin(psi) * model.foot_x - np.cos(psi) * model.foot_y
    ahead = (ends_turn[:, :, :n] * by_angle[:, None]).sum(axis=2)
    return np.asarray(ahead - model.radius * (ends_turn[:, :, STANCE] - starts_turn[:, :, STANCE]))


def mass_matrix(model: RigidModel, y: Any) -> Floats:
    """Compute the mass matrix (n, n) in kg m^2 for the bodies' angular velocities, before couplings are applied."""
    n = len(model.arm_x)
    s, c, F, U, r = np.zeros((5, n))
    M = np.zeros((n, n))
    equations(model, y, s, c, F, U, M, r)
    return M


def kinetic_energy(model: RigidModel, y: Any) -> float:
    """Compute the kinetic energy (J)."""
    return energies(model, y)[0]


def apply_couplings(model: RigidModel, phase: int, values: Any) -> Floats:
    """Return a copy of `values` (n,) in which each follower's value is computed from those of the bodies it follows."""
    every = np.array(values, float)
    tree.expand(model.E[phase], every.size, every)
    return every
