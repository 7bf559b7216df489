"""The rigid model's functions for states in tuples, in Python, where scratch that is read unwritten is no number."""

import numpy as np

from walkerlab.mechanics import impact
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
