"""From a config and a parameter to the step maps that its families of gaits are followed on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.shooting import RigidMap
from walkerlab.scene.parameter import Parameter
from walkerlab.scene.rigid import rigid_walker
from walkerlab.solvers.registry import Tolerances

if TYPE_CHECKING:
    from walkerlab.config.reads import ContactConfig
    from walkerlab.orbits.contact_map import ContactMap, WalkerOnGround

CONTACT = Tolerances("radau5", 1e-10, 1e-12, 60_000)
"""Of one step of the contact model."""


def rigid_walkers(config: ContactConfig, parameter: Parameter) -> Callable[[float], Standing | None]:
    """The rigid walker at a value of the parameter; None where the config refuses the value."""
    return parameter.over(config, rigid_walker)


def rigid_map(config: ContactConfig, parameter: Parameter, scale: float) -> RigidMap:
    """The rigid model's step map over the parameter."""
    return RigidMap(rigid_walkers(config, parameter), scale, rigid_walker(config))


def walkers_on_ground(
    config: ContactConfig, parameter: Parameter, step_length_m: float
) -> Callable[[float], WalkerOnGround | None]:
    """The contact model at a value of the parameter, steps judged by a length; None where the config refuses it."""
    from walkerlab.scene.contact import contact_scene

    return parameter.over(config, lambda changed: contact_scene(changed, step_length_m, step_length_m))


def contact_map(config: ContactConfig, parameter: Parameter, scale: float, step_length_m: float) -> ContactMap:
    """The contact model's step map over the parameter; steps are judged by a length (m)."""
    from walkerlab.orbits.contact_map import ContactMap
    from walkerlab.scene.contact import contact_scene

    walkers = walkers_on_ground(config, parameter, step_length_m)
    like = contact_scene(config, step_length_m, step_length_m)
    return ContactMap(walkers, scale, CONTACT, step_length_m, like)
