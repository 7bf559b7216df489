"""Functions of the state that return what a system's equations write."""

import numpy as np

from walkerlab.physics.solvers.system import derivative, jacobian


def rate_of(system, state):
    """dy/dt of a system."""
    f = np.full(len(state), np.nan)
    derivative(system, 0.0, np.array(state), f)
    return tuple(f.tolist())


def gradient_of(system, state):
    """Derivatives of dy/dt by the state."""
    J = np.full((len(state), len(state)), np.nan)
    jacobian(system, 0.0, np.array(state), J)
    return J
