"""The walker on its pads as an ordinary differential equation: where a foot is decides whether ground carries it.

What somebody writes who integrates the contact model with a general solver: one right-hand side, no events. It knows
neither that a foot must come from above nor that a walk can end. The walks of this project do not use it.
"""

from typing import Any, NamedTuple

from walkerlab.physics.ground.terrain import cell_at, has_ground_in_cell
from walkerlab.physics.ground.walker import OnGround, feet_motion
from walkerlab.physics.kernels import kernel_part
from walkerlab.physics.solvers.system import block, derivative, jacobian


class OnPads(NamedTuple):
    """A walker and the pads under it."""

    walker: OnGround
    terrain: Any


@kernel_part
def find_pads(system: OnPads, y: Any) -> None:
    """Tell the walker of ground under the feet that are over a pad, at whatever height."""
    feet = feet_motion(system.walker.form, y)
    for foot in range(2):
        system.walker.has_ground[foot] = has_ground_in_cell(cell_at(system.terrain, foot, feet[foot].along))


@block.case(OnPads)
def on_pads_block(system: OnPads) -> Any:
    """As on the ground."""
    return block(system.walker)


@derivative.case(OnPads)
def on_pads_derivative(system: OnPads, t: float, y: Any, f: Any) -> None:
    """The equations of motion on the ground that there is."""
    find_pads(system, y)
    derivative(system.walker, t, y, f)


@jacobian.case(OnPads)
def on_pads_jacobian(system: OnPads, t: float, y: Any, J: Any) -> None:
    """Their derivatives; the edges of the pads are not among them."""
    find_pads(system, y)
    jacobian(system.walker, t, y, J)
