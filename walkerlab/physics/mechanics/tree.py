"""Equations of motion of a tree of bodies about its root, for both models: matrices, torques, energies, gradients.

Let F_k = (R(psi_k) c_k)_x and U_k = (R(psi_k) c_k)_y be the first moments c_k projected on the slope and its normal,
with psi the angles from the normal, and let Delta = theta_l - theta_k. Then

    M_kl = A_kl cos Delta + B_kl sin Delta
    r_k = sum over l of omega_l^2 (A_kl sin Delta - B_kl cos Delta) - g_along U_k - g_down F_k

where the two terms of gravity hold for a root at rest. Each model adds the terms due to its root's motion: those of a
rolling foot in rigid_model.py, Newton's law for the centre of mass in ground/motion.py.

In the functions, `tree` is a Mechanism with n bodies: a `RigidModel`, or a `GroundModel` on compliant ground. If the
type of the tree fixes n, the compiler unrolls the loops below, which then take little more than half the time.

Some bodies follow others: a locked shank follows its thigh, a torso follows the bisector of the legs. So the angles are
theta = E z with a constant E, and M alpha = r becomes E^T M E dz = E^T r, where dz holds the accelerations of z. The
system keeps its size: the row and column of a follower are added to those of the bodies that it follows, and the
follower's own equation becomes trivial. The row of a follower in E (n, n) holds its weights, with zero on the diagonal.
All other rows are those of the unit matrix. A model has an E for each phase.
"""

from collections.abc import Mapping
from inspect import get_annotations
from operator import itemgetter
from typing import Any, TypeVar

import numpy as np

from walkerlab.physics.kernels import forced_inline
from walkerlab.physics.mechanics.hinges import HINGE_ROWS, LAW_NUMBERS, TORQUE, SpringDamper
from walkerlab.physics.mechanics.trigonometry import sine_cosine
from walkerlab.physics.solvers.system import Floats, Integers

R = TypeVar("R", bound=type)


def fast_fields(kind: R) -> R:
    """Give a class of records fast access to its annotated fields."""
    # NumPy's own field access is several times slower, and the Python code around a walk reads many fields.
    fields: dict[str, Any] = {name: property(itemgetter(name)) for name in kind.__annotations__}
    fields |= {"__getattribute__": object.__getattribute__, "__getitem__": np.void.__getitem__}
    for name, read in fields.items():
        setattr(kind, name, read)
    return kind


def record_type(kind: type, shapes: Mapping[str, tuple[int, ...]], law: type[SpringDamper] = SpringDamper) -> Any:
    """Create the NumPy type of a structured scalar with the fields of a class and its bases, eight bytes per number.

    law  hinge law of a Mechanism. For any law but SpringDamper, the type has an additional, unused field whose name
         identifies the law
    """
    marks = [] if law is SpringDamper else [(f"{law.__module__}/{law.__qualname__}", np.int64)]
    fields = [
        (name, np.int64 if of in (Integers, int, bool) else np.float64, shapes.get(name, ()))
        for each in (*kind.__bases__, kind)
        for name, of in get_annotations(each).items()
    ]
    return np.dtype((kind, fields + marks))


def new_record(kind: Any, **fields: Any) -> Any:
    """Create a structured scalar that kernels can write, with a type from `record_type`. Fields not named are zero."""
    record = np.zeros((), kind)[()]
    for name, value in fields.items():
        record[name] = value
    return record


@fast_fields
class Mechanism(np.record):  # type: ignore[misc]  # NumPy's stubs call one of its bases final
    """Constants (SI) for both models: a tree of n bodies relative to its root, its hinges and the forces on it."""

    A: Floats  # (n, n) kg m^2, as defined in mechanics/parts.py
    B: Floats  # (n, n) kg m^2
    arm_x: Floats  # (n,) c, kg m: first moments about the root; zero if the root is the centre of mass
    arm_y: Floats
    E: Floats  # (phases, n, n) reductions; the diagonal entry of a body that follows others is zero
    hinges: Integers  # (rows, 2) bodies at each hinge; its resistance turns the first back and the second forward
    laws: Floats  # (rows, LAW_NUMBERS) parameters of the hinge law at each hinge
    push_off: float  # N s, impulse along the trailing leg: instantaneous, or a pulse that starts at the touch
    mass: float  # kg
    gravity_along: float  # m/s^2, downhill
    gravity_down: float  # m/s^2, towards the slope
    slope: float  # [phi] rad, positive if the walker walks downhill

    @property
    def sprung(self) -> bool:
        return bool(self.laws.any())

    @property
    def driven(self) -> bool:
        return bool(self.push_off != 0.0 or self.laws[:, TORQUE].any())


def mechanism_shapes(n: int, phases: int, rows: int) -> dict[str, tuple[int, ...]]:
    """Return the shapes of a Mechanism's arrays for given numbers of bodies, phases and hinges (`rows`)."""
    pairs = dict.fromkeys(("A", "B"), (n, n))
    arms = dict.fromkeys(("arm_x", "arm_y"), (n,))
    return {**pairs, **arms, "E": (phases, n, n), "hinges": (rows, 2), "laws": (rows, LAW_NUMBERS)}


def write_fields(mechanisms: Any, fields: Mapping[str, Any]) -> None:
    """Set fields of one or more mechanisms. A name in HINGE_ROWS, such as "hip", sets the laws of those hinges."""
    for name, value in fields.items():
        if name in HINGE_ROWS:
            mechanisms["laws"][..., HINGE_ROWS[name], :] = value
        else:
            mechanisms[name] = value


@forced_inline
def sines_cosines(tree: Any, n: int, theta: Any, s: Any, c: Any) -> None:
    """Write sines and cosines (n,) of the angles from the slope's normal into s and c.

    theta  (n,) the same angles, measured from the vertical
    """
    for k in range(n):
        s[k], c[k] = sine_cosine(theta[k] + tree.slope)


@forced_inline
def projections(lever_x: Any, lever_y: Any, n: int, s: Any, c: Any, F: Any, U: Any) -> None:
    """Write the components of levers or moments (n,) along the slope and normal to it into F and U."""
    for k in range(n):
        F[k] = c[k] * lever_x[k] - s[k] * lever_y[k]
        U[k] = s[k] * lever_x[k] + c[k] * lever_y[k]


@forced_inline
def lever_motion(lever_x: Any, lever_y: Any, n: int, s: Any, c: Any, omega: Any) -> tuple[float, float, float, float]:
    """Compute position (m) and velocity (m/s) of a point relative to the root, along and normal to the slope."""
    along = 0.0
    height = 0.0
    along_rate = 0.0
    height_rate = 0.0
    for k in range(n):
        forward = c[k] * lever_x[k] - s[k] * lever_y[k]
        upward = s[k] * lever_x[k] + c[k] * lever_y[k]
        along += forward
        height += upward
        along_rate -= upward * omega[k]
        height_rate += forward * omega[k]
    return along, height, along_rate, height_rate


@forced_inline
def add_gravity(tree: Any, n: int, F: Any, U: Any, r: Any) -> None:
    """Add the torques of gravity (N m) about a root at rest to r (n,). F and U (n,) are the projected first moments."""
    for k in range(n):
        r[k] -= tree.gravity_along * U[k] + tree.gravity_down * F[k]


@forced_inline
def add_inertia(tree: Any, n: int, s: Any, c: Any, omega: Any, M: Any, r: Any) -> None:
    """Write the mass matrix (kg m^2) into M (n, n), and add the centrifugal torques (N m) to r (n,)."""
    for k in range(n):
        M[k, k] = tree.A[k, k]
        # B is antisymmetric and Delta changes sign with the order of the pair, so M is symmetric, `turning`
        # antisymmetric, and zero on the diagonal.
        for l in range(k):
            A, B = tree.A[k, l], tree.B[k, l]
            cos_d = c[l] * c[k] + s[l] * s[k]
            sin_d = s[l] * c[k] - c[l] * s[k]
            M[k, l] = A * cos_d + B * sin_d
            M[l, k] = M[k, l]
            turning = A * sin_d - B * cos_d
            r[k] += omega[l] * omega[l] * turning
            r[l] -= omega[k] * omega[k] * turning


@forced_inline
def add_gravity_gradient(tree: Any, n: int, F: Any, U: Any, by_angle: Any) -> None:
    """Add the derivatives of the gravity torques with respect to the angles to by_angle (n, n)."""
    for k in range(n):
        by_angle[k, k] += tree.gravity_down * U[k] - tree.gravity_along * F[k]


@forced_inline
def add_inertia_gradients(
    tree: Any, n: int, s: Any, c: Any, omega: Any, alpha: Any, by_angle: Any, by_rate: Any
) -> None:
    """Add the derivatives of (centrifugal torques - M alpha) at fixed alpha to by_angle and by_rate (n, n)."""
    for k in range(n):
        diagonal = 0.0
        for l in range(n):
            A, B = tree.A[k, l], tree.B[k, l]
            cos_d = c[l] * c[k] + s[l] * s[k]
            sin_d = s[l] * c[k] - c[l] * s[k]
            turning = A * sin_d - B * cos_d
            change = omega[l] * omega[l] * (A * cos_d + B * sin_d) + alpha[l] * turning
            # All terms depend on theta_l - theta_k, so the derivative with respect to theta_k is minus that
            # with respect to theta_l.
            diagonal -= change
            by_angle[k, l] += change
            by_rate[k, l] += 2.0 * omega[l] * turning
        by_angle[k, k] += diagonal


@forced_inline
def kinetic_energy(n: int, M: Any, omega: Any) -> float:
    total = 0.0
    for k in range(n):
        for l in range(n):
            total += M[k, l] * omega[k] * omega[l]
    return 0.5 * total


@forced_inline
def potential_energy(tree: Any, n: int, along: float, height: float, F: Any, U: Any) -> float:
    """Compute the potential energy of gravity (J) with the root at (along, height) in the slope's frame (m)."""
    total = tree.mass * (tree.gravity_down * height - tree.gravity_along * along)
    for k in range(n):
        total += tree.gravity_down * U[k] - tree.gravity_along * F[k]
    return total


@forced_inline
def expand(E: Any, n: int, z: Any) -> None:
    """Replace z (n,) by E z: compute each follower's value from those of the bodies it follows."""
    for c in range(n):
        if E[c, c] == 0.0:
            total = 0.0
            for p in range(n):
                total += E[c, p] * z[p]
            z[c] = total


@forced_inline
def factor_linked(E: Any, n: int, M: Any) -> None:
    """Replace M (n, n) by the factors of E^T M E = L D L^T: 1/D on the diagonal, L^T above it."""
    for c in range(n):
        if E[c, c] == 0.0:
            for p in range(n):
                for l in range(n):
                    M[p, l] += E[c, p] * M[c, l]
            for p in range(n):
                for l in range(n):
                    M[l, p] += E[c, p] * M[l, c]
            for l in range(n):
                M[c, l], M[l, c] = 0.0, 0.0
            M[c, c] = 1.0
    # M is positive definite, so no row exchanges are needed.
    for k in range(n):
        M[k, k] = 1.0 / M[k, k]
        for i in range(k + 1, n):
            M[k, i] = M[i, k] * M[k, k]
            for j in range(k + 1, i + 1):
                M[i, j] -= M[k, i] * M[j, k]


@forced_inline
def solve_linked(E: Any, n: int, factors: Any, b: Any) -> None:
    """Replace the right-hand side r in b (n,) by the solution E dz, using the factors from `factor_linked`."""
    # A torque on a follower acts on the bodies it follows.
    for c in range(n):
        if E[c, c] == 0.0:
            for p in range(n):
                b[p] += E[c, p] * b[c]
            b[c] = 0.0
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= factors[k, i] * b[k]
    for k in range(n - 1, -1, -1):
        b[k] *= factors[k, k]
        for j in range(k + 1, n):
            b[k] -= factors[k, j] * b[j]
    expand(E, n, b)
