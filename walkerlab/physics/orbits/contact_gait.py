"""Search for a gait of the contact model: walk from a rigid start to the section, then apply Newton's method.

If that fails, the gait is followed from nearly rigid ground, where the rigid gait is a good guess, to the actual
ground.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import ContactWalker
from walkerlab.physics.hybrid.contact_result import new_observer, walk_on
from walkerlab.physics.hybrid.contact_state import PASSING, JudgedGround, new_walk_state
from walkerlab.physics.orbits.contact_map import AdaptivePads, coordinates_of
from walkerlab.physics.orbits.continuation import Follower, FollowerState, Strides
from walkerlab.physics.orbits.newton import Effort, NotConverged
from walkerlab.physics.orbits.step_map import Cycle, gait_near
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, State

WARM_UP_STEPS = (4, 2, 0)  # numbers of steps to walk before Newton's method, tried in turn
SEARCH_STEP_BUDGET = 40_000  # right-hand-side evaluations per step
CONTACT_EFFORT = Effort(1e-10, max_evaluations=10, shortest=1e-3, growth=2.0, rounding=1.0)
# largest factors by which the stiffness rises and the friction velocities fall from actual to nearly rigid ground
MAX_STIFFENING = 100.0
MAX_CREEP_FACTOR = 30.0
# increments of the parameter that runs from nearly rigid ground (0) to the actual ground (1)
FIRST_STRIDE = 0.25
RIGIDITY_STRIDES = Strides(1.0, 0.02, 2)


@dataclass(frozen=True)
class GaitAnswer:
    gait: Cycle | None
    reason: str  # how the gait was found, or why the search failed
    advice: str = ""


def find_gait_from(
    walker: ContactWalker, ground: JudgedGround, tolerances: Tolerances, start: State, legs_differ: bool = False
) -> GaitAnswer:
    """Search for the contact gait near `start`, a state of the free walker with both feet on the ground."""
    pitches_m = [ground.terrain.pitch] * (2 if legs_differ else 1)
    excluded = why_no_gait(walker)
    if excluded:
        return GaitAnswer(None, *excluded)
    tolerances = replace(tolerances, budget=SEARCH_STEP_BUDGET)
    failure = "from the start, the feet do not even pass each other"
    for steps, z in section_points(walker, ground, tolerances, start):
        gait = solve_gait_on(AdaptivePads(lambda _: walker, ground, tolerances, *pitches_m), z, len(pitches_m))
        if isinstance(gait, Cycle):
            return GaitAnswer(gait, f"Newton's method after {steps} steps from the start")
        failure = f"Newton's method found no gait after {steps} steps from the start: {gait}"
    followed = follow_from_rigid(walker, ground, tolerances, start, pitches_m)
    if followed.gait is not None:
        return followed
    return GaitAnswer(None, f"{failure}; {followed.reason}", followed.advice)


def why_no_gait(walker: ContactWalker) -> tuple[str, str] | None:
    """Return reason and advice if conservation of momentum or energy excludes a gait on this ground, otherwise None."""
    if walker.slope <= 0.0 and not walker.driven:
        return "a walker that does not descend loses energy with every step", "Let the slope descend: slope_deg > 0."
    friction = walker.friction.largest
    required = abs(math.tan(walker.slope))
    if friction == 0.0 and not walker.driven:
        return (
            "without friction nothing holds the walker back: it gathers speed along the slope",
            f"Give the feet friction: contact.friction: coulomb, contact.static_friction above {required:.3g}.",
        )
    if friction < required:
        return (
            f"static friction {friction:.3g} is below the slope's {required:.3g}: "
            "on average the ground cannot hold the walker's weight along the slope",
            "Raise contact.static_friction, or choose a gentler slope.",
        )
    return None


def section_points(
    walker: ContactWalker, ground: JudgedGround, tolerances: Tolerances, start: State
) -> Iterator[tuple[int, Floats]]:
    """Walk from the start and yield points of the section, each with the number of steps walked."""
    for steps in WARM_UP_STEPS:
        walk_state = new_walk_state(walker, ground, STANCE_FOOT, steps + 1, start)
        observer = new_observer(walker, walk_state, start)
        enough = replace(tolerances, budget=(steps + 1) * tolerances.budget)
        stopped = walk_on(walker, enough, walk_state, observer, start, steps)
        if stopped.outcome is Outcome.WALKED and walk_state.at_zero[PASSING]:
            yield steps, coordinates_of(walker, np.array(stopped.state), int(walk_state.progress.stance))
        elif walk_state.progress.steps > steps:
            return


def solve_gait_on(pads: AdaptivePads, z: Floats, steps: int, rigidity: float = 0.0) -> Cycle | str:
    """Solve for a gait of `steps` steps near z (d,), or return why there is none."""
    gait = gait_near(pads, z, rigidity, CONTACT_EFFORT, steps)
    if isinstance(gait, NotConverged):
        if gait.singular:
            return "its matrix is singular, since a multiplier is 1"
        if gait.outcome is None or gait.outcome is Outcome.WALKED:
            return "it did not converge"
        if gait.outcome is Outcome.REJECTED:
            return "its push-off lasts until the feet pass each other, or longer"
        return f"a step ended as {gait.outcome.label}"
    if gait.lengths_m.min() <= 0.0:
        return f"it led to a walk that does not advance, with steps of {gait.lengths_m.min():.3g} m"
    return gait


def scale_laws(walker: ContactWalker, stiffness: float, damping: float, creep: float) -> ContactWalker:
    """Return the walker with the ground's stiffness, damping and friction velocities multiplied by these factors."""
    # The full-damping penetration shrinks like the static penetration, so that a foot at rest keeps its fraction of the
    # full damping.
    normal = walker.normal.stiffen(stiffness, damping, stiffness ** (-1.0 / walker.normal.exponent))
    return walker._replace(normal=normal, friction=walker.friction.scale_creep(creep))


def set_rigidity(walker: ContactWalker, rigidity: float) -> ContactWalker:
    """Return the walker on ground of a rigidity between 0 (actual ground) and 1 (nearly rigid ground)."""
    stiffer = MAX_STIFFENING**rigidity
    return scale_laws(walker, stiffer, math.sqrt(stiffer), MAX_CREEP_FACTOR**-rigidity)


def follow_from_rigid(
    walker: ContactWalker, ground: JudgedGround, tolerances: Tolerances, start: State, pitches_m: Sequence[float]
) -> GaitAnswer:
    count = len(pitches_m)

    def gait_at(rigidity: float, z: Floats, pitches_m: Sequence[float]) -> Cycle | str:
        pads = AdaptivePads(partial(set_rigidity, walker), ground, tolerances, *pitches_m)
        return solve_gait_on(pads, z, count, rigidity)

    points = section_points(set_rigidity(walker, 1.0), ground, tolerances, start)
    hint = "" if walker.whole.push_off == 0.0 else "Shorten the push-off (push_off.duration_s). "
    tried = (gait_at(1.0, z, pitches_m) for _, z in points)
    last = next((gait for gait in tried if isinstance(gait, Cycle)), None)
    if last is None:
        return GaitAnswer(
            None,
            "nearly rigid ground has no gait either",
            f"{hint}Damp or stiffen the contact, try a gentler slope, or, on pads, contact.terrain: after-mid-swing.",
        )
    gaits = {0.0: last}

    def evaluate_softer(state: float, expected: Floats) -> Floats | None:
        near = gait_at(1.0 - state, expected[:-count], expected[-count:].tolist())
        if not isinstance(near, Cycle):
            return None
        gaits[state] = near
        return append_length(near)

    first = FollowerState(0.0, FIRST_STRIDE, ((0.0, append_length(last)),))
    state = Follower(evaluate_softer, first, RIGIDITY_STRIDES).follow_to(1.0)
    if state.value == 1.0:
        return GaitAnswer(gaits[1.0], "followed from nearly rigid ground")
    rigidity = 1.0 - state.value
    return GaitAnswer(
        None,
        f"followed from nearly rigid ground, the gait is lost at {MAX_STIFFENING**rigidity:.3g} times the stiffness "
        f"and creep {MAX_CREEP_FACTOR**rigidity:.3g} times slower than requested",
        f"{hint}Stiffen or damp the contact, lower its stiction velocity, or choose a gentler slope.",
    )


def append_length(gait: Cycle) -> Floats:
    # The pitch of the pads must be followed together with the gait, because steps get shorter on softer ground.
    return np.append(gait.z, gait.lengths_m)
