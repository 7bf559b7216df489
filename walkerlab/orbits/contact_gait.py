"""Search for the contact model's own gait: walk from a rigid start to the section, then Newton's method.

If that fails, the gait is followed from nearly rigid ground, where the rigid gait is a good guess, to the actual force
laws, in steps as large as Newton's method allows.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from walkerlab.ground.terrain import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_events import PASSING, JudgedGround
from walkerlab.hybrid.contact_result import new_observer, walk_on
from walkerlab.hybrid.contact_state import new_walk_state
from walkerlab.orbits.contact_map import OwnPads, coordinates_of
from walkerlab.orbits.continuation import Follower, Strides, Way
from walkerlab.orbits.newton import Effort, NotConverged
from walkerlab.orbits.step_map import Cycle, gait_near
from walkerlab.outcome import Outcome
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import Floats, State

WARM_UP = (4, 2, 0)  # steps walked from the start before Newton's method takes over
BUDGET_OF_A_STEP = 40_000  # right-hand sides
EFFORT = Effort(1e-10, most=10, shortest=1e-3, growth=2.0, rounding=1.0)
# nearly rigid ground, by which factor its laws differ from the wanted ones
STIFFER, STICKIER = 100.0, 30.0
FIRST_STRIDE, STRIDES = 0.25, Strides(1.0, 0.02, 2)  # of the way from nearly rigid to the wanted ground


@dataclass(frozen=True)
class GaitAnswer:
    """The contact model's gait, or why there is none."""

    gait: Cycle | None
    reason: str  # how it was found, or why not
    advice: str = ""


def find_gait_from(walker: ContactWalker, ground: JudgedGround, tolerances: Tolerances, start: State) -> GaitAnswer:
    """Find the contact gait near a state of the free walker with both feet on the ground.

    Never raises if there is no gait: the answer states the reason and advice.
    """
    hopeless = why_there_is_none(walker)
    if hopeless:
        return GaitAnswer(None, *hopeless)
    tolerances = replace(tolerances, budget=BUDGET_OF_A_STEP)
    said = "the start does not even let the feet pass each other"
    for steps, z in section_points(walker, ground, tolerances, start):
        gait = gait_on(OwnPads(lambda _: walker, ground, tolerances, ground.terrain.stride_measure), z)
        if isinstance(gait, Cycle):
            return GaitAnswer(gait, f"Newton's method after {steps} steps from the start")
        said = f"Newton's method found none after {steps} steps from the start: {gait}"
    followed = follow_from_rigid(walker, ground, tolerances, start)
    if followed.gait is not None:
        return followed
    return GaitAnswer(None, f"{said}; {followed.reason}", followed.advice)


def why_there_is_none(walker: ContactWalker) -> tuple[str, str] | None:
    """Return why conservation of momentum and energy exclude a gait on this ground, and advice; None if they do not."""
    if walker.slope <= 0.0 and not walker.driven:
        return "a walker that does not descend loses energy with every step", "Let the slope descend: slope_deg > 0."
    friction, wanted = walker.friction.largest, abs(math.tan(walker.slope))
    if friction == 0.0 and not walker.driven:
        return (
            "without friction nothing holds the walker back: it gathers speed along the slope",
            f"Give the feet friction: contact.friction: coulomb, contact.static_friction above {wanted:.3g}.",
        )
    if friction < wanted:
        return (
            f"static friction {friction:.3g} is below the slope's {wanted:.3g}: "
            "on average the ground cannot hold the walker's weight along the slope",
            "Raise contact.static_friction, or choose a gentler slope.",
        )
    return None


def section_points(
    walker: ContactWalker, ground: JudgedGround, tolerances: Tolerances, start: State
) -> Iterator[tuple[int, Floats]]:
    """Yield points of the section on a walk from the start, each with its number of steps."""
    for steps in WARM_UP:
        walk_state = new_walk_state(walker, ground.terrain, STANCE_FOOT, steps + 1, start)
        observer = new_observer(walker, walk_state, start)
        enough = replace(tolerances, budget=(steps + 1) * tolerances.budget)
        stopped = walk_on(walker, ground, enough, walk_state, observer, start, steps)
        if stopped.outcome is Outcome.WALKED and walk_state.at_zero[PASSING]:
            yield steps, coordinates_of(walker, np.array(stopped.state), int(walk_state.progress.stance))
        elif walk_state.progress.steps > steps:
            return


def gait_on(pads: OwnPads, z: Floats, rigidity: float = 0.0) -> Cycle | str:
    """Run Newton's method from section coordinates z; return the gait, or why it failed."""
    found = gait_near(pads, z, rigidity, EFFORT)
    if isinstance(found, NotConverged):
        if found.singular:
            return "its matrix is singular, since a multiplier is 1"
        if found.outcome is None or found.outcome is Outcome.WALKED:
            return "it did not converge"
        if found.outcome is Outcome.REJECTED:
            return "its push-off lasts until the feet pass each other, or longer"
        return f"a step ended as {found.outcome.label}"
    if found.step.length_m <= 0.0:
        return f"it led to a walk that does not advance, with steps of {found.step.length_m:.3g} m"
    return found


def with_scaled_laws(walker: ContactWalker, stiffness: float, damping: float, creep: float) -> ContactWalker:
    """Return the walker with stiffness, damping and friction velocities of the ground scaled by these factors.

    The penetration of full damping shrinks with the static penetration, so that the damping ratio is unchanged.
    """
    normal = walker.normal
    changed = normal._replace(
        stiffness=normal.stiffness * stiffness,
        damping=normal.damping * damping,
        full_damping_penetration=normal.full_damping_penetration * stiffness ** (-1.0 / normal.exponent),
    )
    return walker._replace(normal=changed, friction=walker.friction.with_creep(creep))


def with_rigidity(walker: ContactWalker, rigidity: float) -> ContactWalker:
    """Return the walker on ground of a rigidity from 0, its own, to 1, nearly rigid."""
    stiffer = STIFFER**rigidity
    return with_scaled_laws(walker, stiffer, math.sqrt(stiffer), STICKIER**-rigidity)


def follow_from_rigid(walker: ContactWalker, ground: JudgedGround, tolerances: Tolerances, start: State) -> GaitAnswer:
    """Follow the gait from nearly rigid force laws to the actual ones."""

    def gait_at(rigidity: float, z: Floats, pitch_m: float) -> Cycle | str:
        return gait_on(OwnPads(partial(with_rigidity, walker), ground, tolerances, pitch_m), z, rigidity)

    points = section_points(with_rigidity(walker, 1.0), ground, tolerances, start)
    hint = "" if walker.whole.push_off == 0.0 else "Shorten the push-off (push_off.duration_s). "
    tried = (gait_at(1.0, z, ground.terrain.stride_measure) for _, z in points)
    last = next((found for found in tried if isinstance(found, Cycle)), None)
    if last is None:
        return GaitAnswer(
            None,
            "nearly rigid ground has no gait either",
            f"{hint}Damp or stiffen the contact, try a gentler slope, or, on pads, contact.terrain: after-mid-swing.",
        )
    gaits = {0.0: last}

    def softer(way: float, expected: Floats) -> Floats | None:
        """Solve for the gait a given part of the way to the actual ground: section coordinates, then step length."""
        near = gait_at(1.0 - way, expected[:-1], expected[-1])
        if not isinstance(near, Cycle):
            return None
        gaits[way] = near
        return with_length(near)

    way = Follower(softer, Way(0.0, FIRST_STRIDE, ((0.0, with_length(last)),)), STRIDES).to(1.0)
    if way.at == 1.0:
        return GaitAnswer(gaits[1.0], "followed from nearly rigid ground")
    rigidity = 1.0 - way.at
    return GaitAnswer(
        None,
        f"followed from nearly rigid ground the gait is lost where that is {STIFFER**rigidity:.3g} times as stiff "
        f"and creep {STICKIER**rigidity:.3g} times as slow as wanted",
        f"{hint}Stiffen or damp the contact, lower its stiction velocity, or choose a gentler slope.",
    )


def with_length(gait: Cycle) -> Floats:
    return np.append(gait.z, gait.lengths_m)
