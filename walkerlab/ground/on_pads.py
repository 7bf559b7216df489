"""The walker on its pads as an ordinary differential equation: where a foot is decides whether ground carries it.

What somebody writes who integrates the contact model with a general solver: one right-hand side, no events. It knows
neither that a foot must come from above nor that a walk can end. The walks of this project do not use it.
"""

from typing import Any, NamedTuple

from walkerlab.ground.held import always_held, no_stops
from walkerlab.ground.motion import OnGround
from walkerlab.ground.terrain import cell_at, has_ground_in_cell
from walkerlab.ground.walker import ContactWalker, foot_motion
from walkerlab.kernels import inlined
from walkerlab.mechanics.tree import sines_cosines
from walkerlab.solvers.in_tuples import blank, derivative, jacobian
from walkerlab.solvers.system import State


class OnPads(NamedTuple):
    """A walker and the pads under it."""

    walker: ContactWalker
    terrain: Any


@inlined
def over_pads(system: OnPads, y: State) -> OnGround:
    """The walker with ground under the feet that are over a pad, at whatever height."""
    walker, terrain = system.walker, system.terrain
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    first = foot_motion(walker, walker.feet[0], s, c, y).along
    second = foot_motion(walker, walker.feet[1], s, c, y).along
    over_first = has_ground_in_cell(cell_at(terrain, 0, first))
    over_second = has_ground_in_cell(cell_at(terrain, 1, second))
    return OnGround(walker, (over_first, over_second), always_held(walker.held), no_stops(walker.knees))


@blank.case(OnPads)
def on_pads_blank(system: OnPads) -> State:
    """As on the ground."""
    return system.walker.blank


@derivative.case(OnPads)
def on_pads_derivative(system: OnPads, t: float, y: State) -> State:
    """The equations of motion on the ground that there is."""
    return derivative(over_pads(system, y), t, y)


@jacobian.case(OnPads)
def on_pads_jacobian(system: OnPads, t: float, y: State, J: Any) -> None:
    """Their derivatives; the edges of the pads are not among them."""
    jacobian(over_pads(system, y), t, y, J)
