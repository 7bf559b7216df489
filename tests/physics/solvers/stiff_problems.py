"""Stiff and smooth problems, the published ends of the stiff ones, and a kernel that solves them with Radau."""

import math
from typing import Any, NamedTuple

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers.stepping import STEP_DONE, T, advance, begin
from walkerlab.physics.solvers.system import block, derivative, jacobian

LINEAR, CURVE, VAN_DER_POL, EXPLOSION = range(4)
ROBERTSON, HIRES = range(2)


class Planar(NamedTuple):
    """Problems in the plane. They have one type, so that they compile only once."""

    kind: int
    real: float  # for LINEAR the eigenvalue, for CURVE the strength of the pull to (sin t, cos t), for VAN_DER_POL eps
    imaginary: float
    told: float  # fraction of the Jacobian that the method gets


@block.case(Planar)
def planar_block(system: Planar) -> Any:
    return (0.0, 0.0)


@derivative.case(Planar)
def planar_derivative(system: Planar, t: float, y: Any, f: Any) -> None:
    p, q = system.real, system.imaginary
    if system.kind == LINEAR:
        f[0], f[1] = p * y[0] - q * y[1], q * y[0] + p * y[1]
    elif system.kind == CURVE:
        f[0], f[1] = p * (y[0] - math.sin(t)) + math.cos(t), p * (y[1] - math.cos(t)) - math.sin(t)
    elif system.kind == VAN_DER_POL:
        f[0], f[1] = y[1], ((1.0 - y[0] * y[0]) * y[1] - y[0]) / p
    else:
        f[0], f[1] = y[0] * y[0], 0.0


@jacobian.case(Planar)
def planar_jacobian(system: Planar, t: float, y: Any, J: Any) -> None:
    p, q, told = system.real, system.imaginary, system.told
    if system.kind == LINEAR:
        J[0, 0], J[0, 1], J[1, 0], J[1, 1] = told * p, -told * q, told * q, told * p
    elif system.kind == CURVE:
        J[0, 0], J[0, 1], J[1, 0], J[1, 1] = told * p, 0.0, 0.0, told * p
    elif system.kind == VAN_DER_POL:
        J[0, 0], J[0, 1] = 0.0, told
        J[1, 0], J[1, 1] = told * (-2.0 * y[0] * y[1] - 1.0) / p, told * (1.0 - y[0] * y[0]) / p
    else:
        J[0, 0], J[0, 1], J[1, 0], J[1, 1] = told * 2.0 * y[0], 0.0, 0.0, 0.0


class Kinetics(NamedTuple):
    """Chemical problems of the test set for initial value problem solvers, at most eight species."""

    kind: int


@block.case(Kinetics)
def kinetics_block(system: Kinetics) -> Any:
    return (0.0,) * 8


@derivative.case(Kinetics)
def kinetics_derivative(system: Kinetics, t: float, y: Any, f: Any) -> None:
    if system.kind == ROBERTSON:
        slow, fast, middle = 0.04 * y[0], 3e7 * y[1] * y[1], 1e4 * y[1] * y[2]
        f[0], f[1], f[2] = middle - slow, slow - middle - fast, fast
        for i in range(3, 8):
            f[i] = 0.0
        return
    meeting = 280.0 * y[5] * y[7]
    f[0] = -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007
    f[1] = 1.71 * y[0] - 8.75 * y[1]
    f[2] = -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4]
    f[3] = 8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3]
    f[4] = -1.745 * y[4] + 0.43 * y[5] + 0.43 * y[6]
    f[5] = -meeting + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6]
    f[6] = meeting - 1.81 * y[6]
    f[7] = -meeting + 1.81 * y[6]


@jacobian.case(Kinetics)
def kinetics_jacobian(system: Kinetics, t: float, y: Any, J: Any) -> None:
    for i in range(8):
        for j in range(8):
            J[i, j] = 0.0
    if system.kind == ROBERTSON:
        J[0, 0], J[0, 1], J[0, 2] = -0.04, 1e4 * y[2], 1e4 * y[1]
        J[1, 0], J[1, 1], J[1, 2] = 0.04, -1e4 * y[2] - 6e7 * y[1], -1e4 * y[1]
        J[2, 1] = 6e7 * y[1]
        return
    J[0, 0], J[0, 1], J[0, 2] = -1.71, 0.43, 8.32
    J[1, 0], J[1, 1] = 1.71, -8.75
    J[2, 2], J[2, 3], J[2, 4] = -10.03, 0.43, 0.035
    J[3, 1], J[3, 2], J[3, 3] = 8.32, 1.71, -1.12
    J[4, 4], J[4, 5], J[4, 6] = -1.745, 0.43, 0.43
    J[5, 3], J[5, 4], J[5, 5], J[5, 6], J[5, 7] = 0.69, 1.71, -280.0 * y[7] - 0.43, 0.69, -280.0 * y[5]
    J[6, 5], J[6, 6], J[6, 7] = 280.0 * y[7], -1.81, 280.0 * y[5]
    J[7, 5], J[7, 6], J[7, 7] = -280.0 * y[7], 1.81, -280.0 * y[5]


# Mazzia, Magherini: Test set for initial value problem solvers, release 2.4, Bari 2008
VDPOL_END = (0.1706167732170483e1, -0.8928097010247975)
ROBERTSON_END = (0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050)
HIRES_END = (
    0.7371312573325668e-3, 0.1442485726316185e-3, 0.5888729740967575e-4, 0.1175651343283149e-2,
    0.2386356198831331e-2, 0.6238968252742796e-2, 0.2849998395185769e-2, 0.2850001604814231e-2,
)  # fmt: skip
ROBERTSON_START = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
HIRES_START = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057)
STIFF = Planar(VAN_DER_POL, 1e-6, 0.0, 1.0)  # mu = 1 / eps = 1e6


@kernel
def drive(method: Any, system: Any, t: float, y: Any, h: float, t_end: float) -> int:
    """Integrate from t to t_end. If h > 0, take fixed steps of that length, and start the method again for each."""
    begin(method, system, t, y, h)
    while method.clock[T] < t_end:
        status = advance(method, system, t_end if h == 0.0 else min(t_end, method.clock[T] + h))
        if status != STEP_DONE:
            return status
        if h > 0.0 and method.clock[T] < t_end:
            begin(method, system, method.clock[T], method.y, h)
    return STEP_DONE
