"""A model with its gait, ready to be disturbed or differentiated."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from walkerlab.errors import NoAnswer
from walkerlab.physics.hybrid.recorded_walk import as_state
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits.family_search import CONTACT, RIGID
from walkerlab.physics.orbits.gradients import Gradient, gradients
from walkerlab.physics.orbits.rigid_map import coordinates_of
from walkerlab.physics.orbits.robustness import GaitOnMap
from walkerlab.physics.orbits.similarity import Units, unit_walker
from walkerlab.physics.orbits.step_map import StepMap, walk_steps
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.physics.solvers.system import Floats
from walkerlab.scene.families import contact_map, rigid_map
from walkerlab.scene.parameter import SLOPE, Parameter
from walkerlab.scene.rigid import rigid_walker

if TYPE_CHECKING:
    from walkerlab.config.reads import ContactConfig

# Solver settings for walks of which only the number of steps matters; the budget is per step.
QUICK_WALKS: Final = {
    RIGID: Tolerances("dop853", 1e-7, 1e-9, ENDLESS),
    CONTACT: Tolerances("radau5", 1e-6, 1e-8, 1_000_000),
}


@dataclass(frozen=True, eq=False)
class ModelUnderTest:
    """A model and its gait, in a form that can be sent to other processes."""

    model: str
    config: ContactConfig  # config of the model's scene
    z: Floats  # (d,) coordinates of the gait on the section
    length_m: float  # step length

    def gait_on_map(self, parameter: Parameter = SLOPE) -> GaitOnMap:
        p = parameter.value_in(self.config)
        step_map: StepMap = (
            rigid_map(self.config, parameter, 1.0)
            if self.model == RIGID
            else contact_map(self.config, parameter, 1.0, self.length_m)
        )
        return GaitOnMap(step_map, p, self.z, walk_steps(step_map, self.z, p, step_map.stride).DP, self.units)

    def quick_by_leg(self) -> list[GaitOnMap]:
        """Return the gait on a map of quick walks, once for each leg that may begin to swing, or only once for equal
        legs.
        """
        quick = QUICK_WALKS[self.model]
        return [
            gait._replace(step_map=gait.step_map.replace_tolerances(quick))
            for gait in self.gait_on_map().split_by_leg()
        ]

    @property
    def first_leg(self) -> int:
        """Leg (1 or 2) that swings in the first complete step from the gait's section."""
        # On the contact model's section leg 1 has begun its swing, so the first complete step is that of leg 2.
        return 1 if self.model == RIGID else 2

    @property
    def units(self) -> Units:
        return unit_walker(rigid_walker(self.config))[1]

    def gradients(self, parameter: Parameter, selection: Collection[str]) -> dict[str, Gradient]:
        return gradients(self.gait_on_map(parameter), abs(parameter.value_in(self.config)) or 1e-2, selection)


def section_coordinates(walker: RigidModel, state: Sequence[float]) -> Floats:
    """Return the section coordinates of the unit walker for a state (SI)."""
    _, units = unit_walker(walker)
    z = coordinates_of(walker, state)
    z[1:] *= units.time
    return z


def find_model_gait(
    model: str, config: ContactConfig, gait: Mapping[str, Any], note: Callable[[str], None]
) -> ModelUnderTest:
    """Find the gait of a model, on ground without pads for the contact model.

    gait  summary of `fixedpoint`
    note  receives a message about each difference from the scene of the config

    Raises NoAnswer if it has no gait.
    """
    length = float(gait["step_length_m"])
    if model == RIGID:
        z = section_coordinates(rigid_walker(config), gait["state"])
        return ModelUnderTest(RIGID, config, z, length)
    # Imported late, because the rigid model does not need it.
    from walkerlab.scene.contact import gait_off_pads, require_contact

    # The scene's config may hold only the keys that a stage reads; the search copies a complete one.
    scene_config = SLOPE.config_at(config, config.slope_rad)
    assert scene_config is not None, "the slope of the config is always possible"
    answer = gait_off_pads(scene_config, length, as_state(gait["state"]))
    if answer.gait is None:
        raise NoAnswer(f"no gait of the contact model: {answer.reason}", answer.advice)
    if require_contact(config).terrain == "checkerboard":
        note("the contact model walks on after-mid-swing ground, because pads would end disturbed walks")
    length = float(answer.gait.lengths_m.mean())
    z = contact_map(config, SLOPE, 1.0, length).scale_section(answer.gait.z)
    return ModelUnderTest(CONTACT, config, z, length)
