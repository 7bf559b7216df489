"""Energies and forces along a recorded walk of the rigid model."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult
from walkerlab.physics.hybrid.walk_record import Array
from walkerlab.physics.kernels import kernel
from walkerlab.physics.mechanics import rigid_model
from walkerlab.physics.mechanics.rigid_model import Mode, RigidModel


def energies(walker: RigidModel, states: Array) -> Array:
    """Compute kinetic and potential energy (samples, 2) in J of states (samples, 2 n).

    Heights are measured from the stance foot.
    """
    out = np.zeros((len(states), 2))
    fill_energies(walker, np.ascontiguousarray(states), out)
    return out


def reactions(walker: RigidModel, states: Array, bent: NDArray[np.bool_] | None = None) -> Array:
    """Compute the force (N) on the stance foot along and normal to the slope (samples, 2). `bent` marks a free knee."""
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
        mode = Mode(walker, rigid_model.BENT if bent[i] else rigid_model.STRAIGHT)
        out[i, 0], out[i, 1] = rigid_model.ground_reaction(mode, states[i])


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
    set_down = np.append(walk.start[rigid_model.STANCE], walk.after[:, rigid_model.STANCE])
    return FootholdsOfWalk(np.append(0.0, walk.touch_along_m), walk.ground_m, set_down)


def places(
    walker: RigidModel,
    knees_m: tuple[tuple[float, float], ...],
    footholds: FootholdsOfWalk,
    angle: Array,
    step: NDArray[np.int64],
) -> Places:
    """Compute the positions of the walker's points, from angles (samples, n) in rad and step numbers (samples,).

    knees_m  position of each leg's knee in its thigh's frame; empty for legs without knees
    """

    def points(model: RigidModel, angle: Array, step: NDArray[np.int64]) -> Array:
        psi = angle + model.slope
        rolled = -model.radius * (angle[:, rigid_model.STANCE] - footholds.set_down_rad[step])
        contact = np.column_stack((footholds.along_m[step] + rolled, footholds.height_m[step]))
        centre = contact + np.array([0.0, model.radius])
        hip = centre + rotate_levers(psi[:, [rigid_model.STANCE]], [model.hip_x], [model.hip_y])
        foot = centre + rotate_levers(psi, model.foot_x, model.foot_y) - [0.0, model.swing_radius]
        # `compute_in_turns` passes either even or odd steps. In odd steps leg 2 swings.
        by_role = knees_m[::-1] if step.size and step[0] % 2 else knees_m
        legs = zip((rigid_model.SWING, rigid_model.STANCE), by_role, strict=False)
        knees = [hip + rotate_levers(psi[:, [leg]], [x], [y]) for leg, (x, y) in legs]
        return np.stack((contact, hip, foot, *knees), axis=1)

    at = rigid_model.compute_in_turns(walker, step, points, angle, step)
    return Places(at[:, 0], at[:, 1], at[:, 2], at[:, 3:] if knees_m else None)


def rotate_levers(psi: Array, lever_x: Any, lever_y: Any) -> Array:
    """Sum the bodies' levers (samples, 2), rotated by the angles psi (samples, n) from the slope's normal."""
    s, c = np.sin(psi), np.cos(psi)
    x, y = np.array(lever_x), np.array(lever_y)
    return np.column_stack((c @ x - s @ y, s @ x + c @ y))
