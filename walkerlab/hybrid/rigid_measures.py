"""Energies and forces along a recorded walk of the rigid model."""

from typing import Any

import numpy as np

from walkerlab.hybrid.recorded_walk import Array
from walkerlab.kernels import kernel
from walkerlab.mechanics.rigid_compass import RigidWalker, ground_reaction, kinetic_energy, potential_energy


def energies(walker: RigidWalker, states: Array) -> Array:
    """Kinetic and potential energy (samples, 2) of states (samples, 4) in J, from the current stance foot."""
    out = np.zeros((len(states), 2))
    fill_energies(walker, np.ascontiguousarray(states), out)
    return out


def reactions(walker: RigidWalker, states: Array) -> Array:
    """Force of the ground on the stance foot (samples, 2) in N: along the slope, and normal to it."""
    out = np.zeros((len(states), 2))
    fill_reactions(walker, np.ascontiguousarray(states), out)
    return out


@kernel
def fill_energies(walker: RigidWalker, states: Any, out: Any) -> None:
    """Write the energies of `states` (samples, 4) into `out` (samples, 2)."""
    for i in range(states.shape[0]):
        y = states[i]
        out[i, 0] = kinetic_energy(walker, y[0], y[1], y[2], y[3])
        out[i, 1] = potential_energy(walker, y[0], y[1])


@kernel
def fill_reactions(walker: RigidWalker, states: Any, out: Any) -> None:
    """Write the ground's forces at `states` (samples, 4) into `out` (samples, 2)."""
    for i in range(states.shape[0]):
        y = states[i]
        out[i, 0], out[i, 1] = ground_reaction(walker, y[0], y[1], y[2], y[3])
