"""Search the last step of any method for its first event."""

from typing import Any, NamedTuple

from walkerlab.ground.terrain import Terrain
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import Frame, earliest_crossing, sample_event_functions
from walkerlab.kernels import by_type_or_default, inlined, kernel
from walkerlab.solvers.events import CrossingFinder
from walkerlab.solvers.in_tuples import blank, interpolate
from walkerlab.solvers.scipy_methods import ScipyMethod
from walkerlab.solvers.system import State
from walkerlab.solvers.vectors import load


class Scene(NamedTuple):
    """What does not change while a walk goes on."""

    walker: ContactWalker
    terrain: Terrain
    frame: Frame
    watch_order: bool  # whether it matters that the feet pass each other


class Feet(NamedTuple):
    """What the search must know of the feet."""

    has_ground: Any  # (2,) whether there is ground under each
    cells: Any  # (2,) which cell of its lane each is over
    sides: Any  # (event functions,) on which side of zero each event function is known to be
    at_zero: Any  # (event functions,) which event functions the last event left at zero
    touched: Any  # (2,) m, where the material of each was when it touched
    order: Any  # (2,) the stance foot, and how many steps it is
    knee: Any  # (2,) what each knee is doing
    releasing: Any  # (1,) whether the trailing knee is still to be released


@inlined
def sample(system: Any, scene: Scene, feet: Feet, state: State, node: int, finder: CrossingFinder) -> None:
    """All event functions at one node of the step."""
    stance = feet.order[0]
    touched = feet.touched[stance]
    sample_event_functions(
        system, scene.walker, scene.terrain, scene.frame, feet.cells, stance, touched, state, node, finder
    )


@inlined
def search(system: Any, scene: Scene, feet: Feet, finder: CrossingFinder) -> tuple[float, int]:
    """The first event of the sampled step."""
    return earliest_crossing(
        system,
        scene.walker,
        scene.frame,
        scene.watch_order,
        feet.has_ground,
        feet.order[0],
        feet.sides,
        feet.at_zero,
        scene.terrain.has_pads,
        feet.knee,
        feet.releasing[0] != 0,
        finder,
    )


@by_type_or_default
def scan(method: Any, system: Any, scene: Scene, feet: Feet, finder: CrossingFinder) -> tuple[float, int]:
    """Fraction of a method's last step at which the first event lies, and which it is; its dense output is ready.

    The event functions stay in `finder.values`. The fraction is NO_CROSSING if there is no event.
    """
    for node in range(finder.nodes.size):
        sample(system, scene, feet, interpolate(method, system, finder.nodes[node]), node, finder)
    return search(system, scene, feet, finder)


@kernel
def scan_states(system: Any, scene: Scene, feet: Feet, states: Any, finder: CrossingFinder) -> tuple[float, int]:
    """The same for a step whose states at the nodes are the rows of `states`."""
    for node in range(finder.nodes.size):
        sample(system, scene, feet, load(states, node, blank(system)), node, finder)
    return search(system, scene, feet, finder)


@scan.case(ScipyMethod)
def scan_scipy(method: ScipyMethod, system: Any, scene: Scene, feet: Feet, finder: CrossingFinder) -> tuple[float, int]:
    """A walk in Python hands the step's states to compiled code at once."""
    fraction, event = scan_states(system, scene, feet, method.states_at(finder.nodes), finder)
    return fraction, event
