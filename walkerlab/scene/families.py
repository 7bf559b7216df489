"""Build step maps of a config as functions of a parameter, for following families of gaits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from walkerlab.errors import ConfigError
from walkerlab.physics.orbits.rigid_map import RigidMap
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.parameter import Parameter, parameter_of
from walkerlab.scene.rigid import have_different_legs, rigid_walker

if TYPE_CHECKING:
    from walkerlab.config.reads import ContactConfig, RigidConfig
    from walkerlab.physics.orbits.contact_map import ContactMap
    from walkerlab.scene.contact import ContactScene

# Solver settings of one step of the contact model.
CONTACT_STEP = Tolerances("radau5", 1e-10, 1e-12, 60_000)
RELATIVE_CHANGE = 1e-3  # relative change of a parameter, to test whether a model depends on it


def rigid_map(config: ContactConfig, parameter: Parameter, scale: float) -> RigidMap:
    step_map = RigidMap(parameter.vary(config, rigid_walker), scale, rigid_walker(config))
    step_map.stride = steps_of_stride(config, parameter)
    return step_map


def steps_of_stride(config: RigidConfig, parameter: Parameter) -> int:
    """Return the number of steps after which a family's step map repeats: 2 if the legs differ, or may differ."""
    return 2 if parameter.varies_second_leg or have_different_legs(config) else 1


def scene_for(step_length_m: float) -> Callable[[ContactConfig], ContactScene]:
    """Return a function from configs to their contact scenes, with pads and terrain for steps of this length."""
    from walkerlab.scene.contact import contact_scene

    return lambda config: contact_scene(config, step_length_m, step_length_m)


def contact_map(config: ContactConfig, parameter: Parameter, scale: float, step_length_m: float) -> ContactMap:
    from walkerlab.physics.orbits.contact_map import ContactMap

    scene = scene_for(step_length_m)
    step_map = ContactMap(parameter.vary(config, scene), scale, CONTACT_STEP, step_length_m, scene(config))
    step_map.stride = steps_of_stride(config, parameter)
    return step_map


def model_differs(model: str, config: ContactConfig, parameter: Parameter, values: tuple[float, float]) -> bool:
    # Any step length will do to see whether two scenes differ.
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
    """Whether a parameter affects a model. This is assumed if the config allows no neighbouring value for a test."""
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
    """Build the error for a config key `where` that names a parameter `key` which none of the models uses."""
    return ConfigError(
        f"{where}: {key} does not affect the {' or the '.join(models)} model",
        "Choose a key that the model uses, or another model (--model).",
        tuple(where.split(".")),
    )
