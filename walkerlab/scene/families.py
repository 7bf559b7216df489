"""From a config and a parameter to the step maps that its families of gaits are followed on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.family_search import RIGID
from walkerlab.orbits.shooting import RigidMap
from walkerlab.scene.parameter import Parameter
from walkerlab.scene.rigid import rigid_walker, walker_or_none
from walkerlab.solvers.registry import Tolerances

if TYPE_CHECKING:
    from walkerlab.config.reads import ContactConfig
    from walkerlab.orbits.contact_map import ContactMap, WalkerOnGround

CONTACT = Tolerances("radau5", 1e-10, 1e-12, 60_000)
"""Of one step of the contact model."""


def rigid_walkers(config: ContactConfig, parameter: Parameter) -> Callable[[float], Standing | None]:
    """The rigid walker at a value of the parameter; None where the config refuses the value."""
    return lambda value: walker_or_none(parameter.config_at(config, value))


def rigid_map(config: ContactConfig, parameter: Parameter, scale: float) -> RigidMap:
    """The rigid model's step map over the parameter."""
    return RigidMap(rigid_walkers(config, parameter), scale, rigid_walker(config, config.equations))


def walker_on_ground(config: ContactConfig, step_length_m: float) -> WalkerOnGround:
    """The contact model of a config; steps are judged by a length (m)."""
    from walkerlab.orbits.contact_map import WalkerOnGround
    from walkerlab.scene.contact import contact_scene

    scene = contact_scene(config, step_length_m, step_length_m)
    return WalkerOnGround(scene.walker, scene.ground)


def walkers_on_ground(
    config: ContactConfig, parameter: Parameter, step_length_m: float
) -> Callable[[float], WalkerOnGround | None]:
    """The contact model at a value of the parameter; None where the config refuses the value."""

    def walker_at(value: float) -> WalkerOnGround | None:
        changed = parameter.config_at(config, value)
        return None if changed is None else walker_on_ground(changed, step_length_m)

    return walker_at


def contact_map(config: ContactConfig, parameter: Parameter, scale: float, step_length_m: float) -> ContactMap:
    """The contact model's step map over the parameter; steps are judged by a length (m)."""
    from walkerlab.orbits.contact_map import ContactMap

    walkers = walkers_on_ground(config, parameter, step_length_m)
    return ContactMap(walkers, scale, CONTACT, step_length_m, walker_on_ground(config, step_length_m))


def touches(model: str, config: ContactConfig, parameter: Parameter, least: float, most: float) -> bool:
    """Whether a model changes between two values of the parameter."""
    walkers: Callable[..., Callable[[float], Any]] = (
        rigid_walkers if model == RIGID else partial(walkers_on_ground, step_length_m=1.0)
    )
    walker_at = walkers(config, parameter)
    first, last = ([*numbers_in(walker_at(value))] for value in (least, most))
    return len(first) != len(last) or not all(map(np.array_equal, first, last))


def numbers_in(value: Any) -> Iterator[Any]:
    """All that a record and the records in it are made of."""
    if isinstance(value, tuple) or is_dataclass(value):
        for one in value if isinstance(value, tuple) else vars(value).values():
            yield from numbers_in(one)
    else:
        yield value
