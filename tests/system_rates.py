"""Functions that return what the equations of a system write into arrays."""

import numpy as np

from walkerlab.physics.solvers.system import derivative, jacobian


def rate_of(system, state):
    """Return dy/dt of a system."""
    f = np.full(len(state), np.nan)
    derivative(system, 0.0, np.array(state), f)
    return tuple(f.tolist())


def gradient_of(system, state):
    """Return the derivatives of dy/dt by the state."""
    J = np.full((len(state), len(state)), np.nan)
    jacobian(system, 0.0, np.array(state), J)
    return J
