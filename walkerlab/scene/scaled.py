"""Starts of the contact model with scaled velocities, for maps and basins."""

from dataclasses import replace

from walkerlab.physics.hybrid.recorded_walk import scale_rates
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits import scaled_starts
from walkerlab.physics.orbits.contact_gait import GaitAnswer
from walkerlab.physics.orbits.contact_map import lengths_between_touches
from walkerlab.physics.orbits.step_map import Cycle
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import State
from walkerlab.scene.contact import ContactScene, start_state

# Except at boundaries between outcomes, these tolerances give the same map as the config's.
MAP_RTOL = 1e-4
MAP_ATOL = 1e-6
MIN_BUDGET, BUDGET_FACTOR = 60_000, 4  # evaluations per cell: minimum, and multiple of those for the unchanged start


def build_scaled_starts(
    scene: ContactScene, rigid: RigidModel, state: State, steps: int, answer: GaitAnswer, tolerances: Tolerances
) -> scaled_starts.ScaledStarts:
    """Build starts with scaled velocities from a rigid start. If the contact gait is known, walks must settle on it."""
    gait = None if answer.gait is None else steps_to_settle_on(answer.gait)

    def start(swing: float, stance: float) -> State:
        return start_state(scene, scale_rates(rigid, state, swing, stance))

    starts = scaled_starts.scaled_starts(scene.walker, scene.ground, start, steps, gait)
    return replace(starts, tolerances=replace(tolerances, method=scaled_starts.START_TOLERANCES.method))


def steps_to_settle_on(gait: Cycle) -> tuple[tuple[float, float], ...]:
    """Return period (s) and length (m) of each step of a gait, which is a single step for equal legs."""
    if len(gait.steps) == 1:
        return ((gait.period_s, gait.step.length_m),)
    return tuple(zip(gait.periods_s.tolist(), lengths_between_touches(gait).tolist(), strict=True))


def scale_for_map(starts: scaled_starts.ScaledStarts, evaluations: int) -> scaled_starts.ScaledStarts:
    """Return the starts with the solver settings of a map.

    evaluations  right-hand-side evaluations for the unchanged start; a cell's budget is a multiple of them
    """
    return starts.coarser(MAP_RTOL, MAP_ATOL, max(MIN_BUDGET, BUDGET_FACTOR * evaluations))
