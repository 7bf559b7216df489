"""Walker on pads as an ordinary differential equation: the ground carries a foot wherever it is over a pad.

This is the contact model as one would write it for a general solver, with one right-hand side and without events. A
pad then also carries a foot that comes from its side, and a walk never ends. Only the comparison with general solvers
uses this system.
"""

from typing import Any, NamedTuple

from walkerlab.physics.ground.terrain import cell_at, has_ground_in_cell
from walkerlab.physics.ground.walker import OnGround, feet_motion
from walkerlab.physics.kernels import kernel_part
from walkerlab.physics.solvers.system import block, derivative, jacobian


class OnPads(NamedTuple):
    walker: OnGround
    terrain: Any


@kernel_part
def find_pads(system: OnPads, y: Any) -> None:
    """Record in `has_ground` whether each foot is over a pad, at any height."""
    feet = feet_motion(system.walker.form, y)
    for foot in range(2):
        system.walker.has_ground[foot] = has_ground_in_cell(cell_at(system.terrain, foot, feet[foot].along))


@block.case(OnPads)
def pads_block(system: OnPads) -> Any:
    return block(system.walker)


@derivative.case(OnPads)
def pads_derivative(system: OnPads, t: float, y: Any, f: Any) -> None:
    find_pads(system, y)
    derivative(system.walker, t, y, f)


@jacobian.case(OnPads)
def pads_jacobian(system: OnPads, t: float, y: Any, J: Any) -> None:
    """Compute the Jacobian of the equations of motion, ignoring the jumps at the pads' edges."""
    find_pads(system, y)
    jacobian(system.walker, t, y, J)
