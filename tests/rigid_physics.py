"""Functions of the rigid model in Python for states in tuples, with scratch memory that begins as NaN."""

import numpy as np
from scipy.integrate import solve_ivp

from walkerlab.physics.mechanics import impact
from walkerlab.physics.mechanics.hinges import HIP_ROW, TORQUE
from walkerlab.physics.mechanics.parts import Anchor, levers, masses
from walkerlab.physics.mechanics.rigid import group_bodies
from walkerlab.physics.mechanics.rigid_model import (
    AT_STRIKE,
    BENT,
    STANCE,
    STRAIGHT,
    SWING,
    Mode,
    apply_couplings,
    energies,
)
from walkerlab.physics.solvers.system import derivative


def rates(model, phase, y):
    """Return the angular accelerations."""
    f = np.zeros(len(y))
    derivative(Mode(model, phase), 0.0, np.array(y, float), f)
    return tuple(f[len(y) // 2 :])


def total_energy(model, y):
    return sum(energies(model, y))


def potential_energy(model, y):
    return energies(model, y)[1]


def heel_strike(model, y, columns=()):
    return struck(AT_STRIKE, model, y, columns)


def knee_strike(model, y, columns=()):
    return struck(STRAIGHT, model, y, columns)


def struck(phase, model, y, columns):
    """Return the state after a strike, and the columns of directions after it."""
    before = np.concatenate((y, *columns))
    after = np.full(before.size, np.nan)
    impact.strike(model, model, phase, before, after)
    return tuple(after)


def torque_work_of_a_step(model, start, step):
    """Return the net and the positive work (J) of the constant hip torque in a step, as SciPy's integral of its power
    in each phase.

    step  a walk of one step from `start`, which has the times of its strikes
    """
    n, torque = len(model.arm_x), model.laws[HIP_ROW, TORQUE]
    knee_strikes = () if step.knee_strike_time_s is None else step.knee_strike_time_s[:1].tolist()
    y, t, work = np.array(start), 0.0, np.zeros(2)
    for phase, end in ((BENT, knee_strikes), (STRAIGHT, step.touch_time_s[:1].tolist())):
        if not end:
            continue

        def rate(_, x, phase=phase):
            power = torque * (x[n + SWING] - x[n + STANCE])
            return (*x[n : 2 * n], *rates(model, phase, tuple(x[: 2 * n])), power, max(0.0, power))

        # No solver step is so long that it could skip two turns of the legs.
        swing = solve_ivp(rate, (t, *end), (*y, 0.0, 0.0), "DOP853", rtol=1e-11, atol=1e-13, max_step=2e-2)
        y, t, work = swing.y[: 2 * n, -1], end[0], work + swing.y[2 * n :, -1]
        y = np.array(knee_strike(model, y)) if phase == BENT else y
    return work


def state_linked(model, phase, y):
    """Return a state with each follower at the angle that its coupling gives."""
    n = len(y) // 2
    return (*apply_couplings(model, phase, y[:n]), *apply_couplings(model, phase, y[n:]))


def momentum_of_masses(assembly, slope, y):
    """Return the momentum of all masses along and normal to the slope (kg m/s). The assembly stands on its
    second foot.
    """
    members = group_bodies(assembly).members
    theta, omega = members @ np.array(y).reshape(2, -1)[0], members @ np.array(y).reshape(2, -1)[1]
    foot = assembly.feet[1]
    along = np.array([np.cos(slope), -np.sin(slope)])
    rolling = -foot.radius_m * omega[assembly.index(foot.body)] * along
    total = np.zeros(2)
    for mass, at in masses(assembly):
        d = levers(assembly, Anchor(foot.body, foot.centre_m), at)
        turning = np.column_stack(
            (-np.sin(theta) * d[:, 0] - np.cos(theta) * d[:, 1], np.cos(theta) * d[:, 0] - np.sin(theta) * d[:, 1])
        )
        total += mass * (rolling + omega @ turning)
    return total @ along, total @ [np.sin(slope), np.cos(slope)]
