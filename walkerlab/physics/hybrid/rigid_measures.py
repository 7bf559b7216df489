"""Energies and forces along a recorded walk of the rigid model."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult
from walkerlab.physics.hybrid.walk_record import Array
from walkerlab.physics.kernels import kernel
from walkerlab.physics.mechanics import rigid_model
from walkerlab.physics.mechanics.rigid_model import BENT, STANCE, STRAIGHT, SWING, Mode, RigidModel, ground_reaction


def energies(walker: RigidModel, states: Array) -> Array:
    """Compute kinetic and potential energy (samples, 2) in J of states (samples, 2 n), heights from the stance foot."""
    out = np.zeros((len(states), 2))
    fill_energies(walker, np.ascontiguousarray(states), out)
    return out


def reactions(walker: RigidModel, states: Array, bent: NDArray[np.bool_] | None = None) -> Array:
    """Compute the force (N) on the stance foot along and normal to the slope (samples, 2); `bent` marks a free knee."""
    out = np.zeros((len(states), 2))
    free = np.zeros(len(states), np.bool_) if bent is None else bent
    fill_reactions(walker, np.ascontiguousarray(states), free, out)
    return out


@kernel
def fill_energies(walker: RigidModel, states: Any, out: Any) -> None:
    for i in range(states.shape[0]):
        out[i, 0], out[i, 1] = rigid_model.energies(walker, states[i])


@kernel
def fill_reactions(walker: RigidModel, states: Any, bent: Any, out: Any) -> None:
    for i in range(states.shape[0]):
        out[i, 0], out[i, 1] = ground_reaction(Mode(walker, BENT if bent[i] else STRAIGHT), states[i])


@dataclass(frozen=True)
class Places:
    """Points of the walker at each sample (m): along the slope from the first foothold, and height above the slope."""

    contact: Array  # (samples, 2) contact point of the stance foot
    hip: Array  # (samples, 2)
    swing_foot: Array  # (samples, 2) lowest point of the swing foot
    knees: Array | None  # (samples, 2, 2) knees of swing and stance leg; None for legs without knees


class FootholdsOfWalk(NamedTuple):
    """Footholds of a walk, beginning with the one at the start."""

    along_m: Array  # (steps + 1,) along the slope
    height_m: Array  # (steps + 1,) above the slope
    set_down_rad: Array  # (steps + 1,) angle of the leg from the vertical as its foot is set down


def footholds_of(walk: RigidWalkResult) -> FootholdsOfWalk:
    set_down = np.append(walk.start[STANCE], walk.after[:, STANCE])
    return FootholdsOfWalk(np.append(0.0, walk.touch_along_m), walk.ground_m, set_down)


def places(
    walker: RigidModel,
    knee_m: tuple[float, float] | None,
    footholds: FootholdsOfWalk,
    angle: Array,
    step: NDArray[np.int64],
) -> Places:
    """Compute the walker's points at angles (samples, n) in rad, swing leg first; `knee_m` is in the thigh's frame."""
    psi = angle + walker.slope
    rolled = -walker.radius * (angle[:, STANCE] - footholds.set_down_rad[step])
    contact = np.column_stack((footholds.along_m[step] + rolled, footholds.height_m[step]))
    centre = contact + np.array([0.0, walker.radius])
    hip = centre + rotate_levers(psi[:, [STANCE]], [walker.hip_x], [walker.hip_y])
    foot = centre + rotate_levers(psi, walker.foot_x, walker.foot_y) - [0.0, walker.radius]
    knees = None
    if knee_m is not None:
        knees = np.stack(
            [hip + rotate_levers(psi[:, [leg]], knee_m[:1], knee_m[1:]) for leg in (SWING, STANCE)], axis=1
        )
    return Places(contact, hip, foot, knees)


def rotate_levers(psi: Array, lever_x: Any, lever_y: Any) -> Array:
    """Sum the bodies' levers (samples, 2), rotated by the angles psi (samples, n) from the slope's normal."""
    s, c = np.sin(psi), np.cos(psi)
    x, y = np.array(lever_x), np.array(lever_y)
    return np.column_stack((c @ x - s @ y, s @ x + c @ y))
