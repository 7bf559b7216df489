"""Prepare models and their gaits for disturbances and derivatives, and build step maps over a parameter for
families."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from walkerlab.config.reads import ContactConfig, RigidConfig
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.physics.hybrid.recorded_walk import as_state
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits import family_search, similarity
from walkerlab.physics.orbits.gradients import Gradient, gradients
from walkerlab.physics.orbits.rigid_map import RigidMap, coordinates_of
from walkerlab.physics.orbits.robustness import GaitOnMap
from walkerlab.physics.orbits.step_map import StepMap, walk_steps
from walkerlab.physics.solvers import registry, system
from walkerlab.scene.parameter import SECOND_LEG, SLOPE, Parameter, parameter_of
from walkerlab.scene.rigid import have_different_legs, rigid_walker

if TYPE_CHECKING:
    from walkerlab.physics.orbits.contact_map import ContactMap
    from walkerlab.scene.contact import ContactScene

# Solver settings of one step of the contact model.
CONTACT_STEP = registry.Tolerances("radau5", 1e-10, 1e-12, 60_000)
RELATIVE_CHANGE = 1e-3  # relative change of a parameter with which to test whether a model depends on it


def rigid_map(config: ContactConfig, parameter: Parameter, scale: float) -> RigidMap:
    step_map = RigidMap(parameter.vary(config, rigid_walker), scale, rigid_walker(config))
    step_map.stride = steps_of_stride(config, parameter)
    return step_map


def steps_of_stride(config: RigidConfig, parameter: Parameter) -> int:
    """Return the number of steps that a family's step map takes: 2 if the legs differ, or may differ, otherwise 1."""
    return 2 if SECOND_LEG in parameter.path or have_different_legs(config) else 1


def scene_for(step_length_m: float) -> "Callable[[ContactConfig], ContactScene]":
    """Return a function that builds the contact scene of a config, with pads and terrain for steps of this length."""
    from walkerlab.scene.contact import contact_scene

    return lambda config: contact_scene(config, step_length_m, step_length_m)


def contact_map(config: ContactConfig, parameter: Parameter, scale: float, step_length_m: float) -> "ContactMap":
    from walkerlab.physics.orbits.contact_map import ContactMap

    scene = scene_for(step_length_m)
    step_map = ContactMap(parameter.vary(config, scene), scale, CONTACT_STEP, step_length_m, scene(config))
    step_map.stride = steps_of_stride(config, parameter)
    return step_map


def model_differs(model: str, config: ContactConfig, parameter: Parameter, values: tuple[float, float]) -> bool:
    # The step length does not matter, because the scenes are only compared.
    make: Callable[[ContactConfig], Any] = rigid_walker if model == "rigid" else scene_for(1.0)
    first, last = ([*iterate_values(parameter.vary(config, make)(value))] for value in values)
    return len(first) != len(last) or not all(map(np.array_equal, first, last))


def iterate_values(value: Any) -> Iterator[Any]:
    if isinstance(value, tuple) or is_dataclass(value):
        for field in value if isinstance(value, tuple) else vars(value).values():
            yield from iterate_values(field)
    else:
        yield value


def model_reads(model: str, config: ContactConfig, key: str) -> bool:
    """Whether a parameter affects a model. This is assumed if no neighbouring value is valid, so that it cannot be
    tested."""
    parameter = parameter_of(key, config)
    value = parameter.value_in(config)
    neighbours = (value + sign * RELATIVE_CHANGE * (abs(value) or 1.0) for sign in (1.0, -1.0))
    allowed = [changed for changed in neighbours if parameter.config_at(config, changed) is not None]
    return not allowed or any(model_differs(model, config, parameter, (value, changed)) for changed in allowed)


def refuse_unread(where: str, key: str, config: ContactConfig, models: Sequence[str]) -> None:
    """Raise ConfigError about the config key `where` if no model reads the parameter `key` that it names."""
    if not any(model_reads(model, config, key) for model in models):
        raise unused_key_error(where, key, models)


def unused_key_error(where: str, key: str, models: Sequence[str]) -> ConfigError:
    """Build the error for the config key `where`, whose parameter `key` none of the models uses."""
    text = f"{where}: {key} does not affect the {' or the '.join(models)} model"
    advice = "Choose a key that the model uses, or another model (--model)."
    return ConfigError(text, advice, tuple(where.split(".")))


# Solver settings, with a budget per step, for walks whose steps are only counted.
QUICK_WALKS: Final = {
    family_search.RIGID: registry.Tolerances("dop853", 1e-7, 1e-9, registry.ENDLESS),
    family_search.CONTACT: registry.Tolerances("radau5", 1e-6, 1e-8, 1_000_000),
}


@dataclass(frozen=True, eq=False)
class ModelUnderTest:
    """A model and its gait, in a form that can be sent to other processes."""

    model: str
    config: ContactConfig  # config of the model's scene
    z: system.Floats  # (d,) coordinates of the gait on the section
    length_m: float  # step length

    def gait_on_map(self, parameter: Parameter = SLOPE) -> GaitOnMap:
        p = parameter.value_in(self.config)
        step_map: StepMap = (
            rigid_map(self.config, parameter, 1.0)
            if self.model == family_search.RIGID
            else contact_map(self.config, parameter, 1.0, self.length_m)
        )
        return GaitOnMap(step_map, p, self.z, walk_steps(step_map, self.z, p, step_map.stride).DP, self.units)

    def quick_by_leg(self) -> list[GaitOnMap]:
        """Return the gait on a map of quick walks, for each leg that may swing first or, if the legs are equal, only
        once.
        """
        quick = QUICK_WALKS[self.model]
        gaits = self.gait_on_map().split_by_leg()
        return [gait._replace(step_map=gait.step_map.replace_tolerances(quick)) for gait in gaits]

    @property
    def first_leg(self) -> int:
        """Leg (1 or 2) that swings in the first complete step from the gait's section."""
        # The contact model's section lies within the swing of leg 1, so in the first complete step leg 2 swings.
        return 1 if self.model == family_search.RIGID else 2

    @property
    def units(self) -> similarity.Units:
        return similarity.unit_walker(rigid_walker(self.config))[1]

    def gradients(self, parameter: Parameter, selection: Collection[str]) -> dict[str, Gradient]:
        return gradients(self.gait_on_map(parameter), abs(parameter.value_in(self.config)) or 1e-2, selection)


def section_coordinates(walker: RigidModel, state: Sequence[float]) -> system.Floats:
    """Return the section coordinates of the unit walker for a state (SI)."""
    _, units = similarity.unit_walker(walker)
    z = coordinates_of(walker, state)
    z[1:] *= units.time
    return z


def find_model_gait(
    model: str, config: ContactConfig, gait: Mapping[str, Any], note: Callable[[str], None]
) -> ModelUnderTest:
    """Find the gait of a model, on ground without pads for the contact model.

    gait  summary of `fixedpoint`
    note  called with a message about each difference from the scene of the config

    Raises NoAnswer if the model has no gait.
    """
    length = float(gait["step_length_m"])
    if model == family_search.RIGID:
        z = section_coordinates(rigid_walker(config), gait["state"])
        return ModelUnderTest(family_search.RIGID, config, z, length)
    # Imported here, because the rigid model does not need it.
    from walkerlab.scene.contact import gait_off_pads, require_contact

    # `config` may have only the keys that a stage reads, but the search changes copies of a complete config.
    scene_config = SLOPE.config_at(config, config.slope_rad)
    assert scene_config is not None, "the slope of the config is always possible"
    answer = gait_off_pads(scene_config, length, as_state(gait["state"]))
    if answer.gait is None:
        raise NoAnswer(f"no gait of the contact model: {answer.reason}", answer.advice)
    if require_contact(config).terrain == "checkerboard":
        note("the contact model walks on after-mid-swing ground, because pads would end disturbed walks")
    length = float(answer.gait.lengths_m.mean())
    z = contact_map(config, SLOPE, 1.0, length).scale_section(answer.gait.z)
    return ModelUnderTest(family_search.CONTACT, config, z, length)
