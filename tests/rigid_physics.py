"""The rigid model's functions for states in tuples, in Python, where scratch that is read unwritten is no number."""

import numpy as np

from walkerlab.mechanics import impact
from walkerlab.mechanics.assembly import Anchor, levers, masses
from walkerlab.mechanics.rigid import places_of
from walkerlab.mechanics.standing import Mode, energies, linked
from walkerlab.solvers.system import derivative


def rates(model, phase, y):
    """Angular accelerations."""
    f = np.zeros(len(y))
    derivative(Mode(model, phase), 0.0, np.array(y, float), f)
    return tuple(f[len(y) // 2 :])


def total_energy(model, y):
    return sum(energies(model, y))


def potential_energy(model, y):
    return energies(model, y)[1]


def heel_strike(model, y, columns=()):
    return struck(impact.heel_strike, model, y, columns)


def knee_strike(model, y, columns=()):
    return struck(impact.knee_strike, model, y, columns)


def struck(strike, model, y, columns):
    """The state after a strike, with the images of directions behind it."""
    before = np.concatenate((y, *columns))
    after = np.full(before.size, np.nan)
    strike(model, before, after)
    return tuple(after)


def state_linked(model, phase, y):
    """A state with the followers where those are that they follow."""
    n = len(y) // 2
    return (*linked(model, phase, y[:n]), *linked(model, phase, y[n:]))


def momentum_of_masses(assembly, slope, y):
    """Along the slope and normal to it (kg m/s), mass by mass, standing on the assembly's second foot."""
    members = places_of(assembly).members
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
