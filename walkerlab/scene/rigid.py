"""Build the rigid model of a config, with only the parts that the config needs, and the heights of its footholds."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from walkerlab.config import contact, reads, walkers
from walkerlab.errors import ConfigError
from walkerlab.physics.hybrid import recorded_walk, walk_record
from walkerlab.physics.mechanics.parts import Position
from walkerlab.physics.mechanics.rigid import group_bodies, knee_positions, rigid_on_level_ground
from walkerlab.physics.mechanics.rigid_model import RigidModel, change_slope, pair, replace_fields
from walkerlab.physics.solvers import registry, system
from walkerlab.scene import parts, studies

if TYPE_CHECKING:
    from walkerlab.config.schema import Equations, Output


def foothold_heights(ground: contact.Footholds, steps: int) -> system.Floats | None:
    """Return the heights (steps + 1,) in m above the slope of the footholds at the start and after each step, or None
    on even ground."""
    if ground.even:
        return None
    if ground.heights_m:
        listed = np.array(ground.heights_m)[:steps]
        return np.concatenate(([0.0], listed, np.full(steps - listed.size, ground.heights_m[-1])))
    return walk_record.rough_heights(ground.roughness_m, ground.seed, steps)


FIRST_STEP = registry.Tolerances("dop853", 1e-10, 1e-12, registry.ENDLESS)
CACHED_LEVEL_WALKERS = 16  # number of walkers that are cached, since all members of a family over slopes share one


@dataclass(frozen=True)
class RigidScene:
    walker: RigidModel
    names: tuple[str, ...]  # names of the state variables
    knees_m: tuple[Position, ...]  # position of each leg's knee in its thigh's frame; empty without knees
    outputs: "tuple[Output, ...]"  # groups of quantities to record over time
    ground: contact.Footholds

    def walk(
        self,
        start: system.State,
        steps: int,
        tolerances: registry.Tolerances,
        sampled: bool = False,
        advance: Callable[[int], None] | None = None,
        step_length: float | None = None,
    ) -> recorded_walk.RigidWalkResult:
        """Simulate up to `steps` steps from a state (2 n). `sampled` records the requested outputs, see `take_walk`."""
        heights = foothold_heights(self.ground, steps)
        sampled = sampled and bool(self.outputs)
        return recorded_walk.take_walk(self.walker, tolerances, start, steps, sampled, advance, heights, step_length)


def rigid_scene(config: reads.RigidConfig, ground: contact.Footholds, outputs: "tuple[Output, ...]") -> RigidScene:
    return RigidScene(
        walker=rigid_walker(config),
        names=state_names(config),
        knees_m=knee_positions(parts.assembly_of(config.walker, rigid=True)),
        outputs=outputs,
        ground=ground,
    )


def rigid_walker(config: reads.RigidConfig, equations: "Equations | None" = None) -> RigidModel:
    """Return the rigid walker of a config. `equations` overrides the config's set of equations."""
    level = level_walker(config.walker, config.gravity_m_s2)
    driven = add_drives(change_slope(level, config.slope_rad), config)
    return studies.replace_equations(driven, equations or config.equations)


def add_drives(passive: RigidModel, config: reads.RigidConfig) -> RigidModel:
    """Return the model with the push-off, the hip's spring, damper and torque, and the knee dampers of the config."""
    drives = parts.drive_parameters(config)
    driven = passive.changed(**drives.shared)
    legs = [
        {"push_off": push} | ({"knees": drives.knees[leg]} if drives.knees else {})
        for leg, push in enumerate(drives.push_offs)
    ]
    # Legs with equal drives share one model.
    if legs[0] == legs[1]:
        return driven.changed(**legs[0])
    return pair(*(replace_fields(model, leg) for model, leg in zip((driven, driven.exchanged), legs, strict=True)))


@lru_cache(CACHED_LEVEL_WALKERS)
def level_walker(walker: walkers.Walker, gravity: float) -> RigidModel:
    """Return a walker on level ground (gravity in m/s^2).

    Raises ConfigError if the parts are not a valid walker.
    """
    law = parts.hinge_law_of(walker)
    assembly = parts.assembly_of(walker, rigid=True)
    try:
        return rigid_on_level_ground(assembly, gravity, parts.knee_locked_at_strike(walker), law)
    except ValueError as error:
        raise ConfigError(f"walker: {error}", parts.PARTS_DOCS) from None


def have_different_legs(config: reads.RigidConfig) -> bool:
    return rigid_walker(config).legs_differ


def state_names(config: reads.RigidConfig) -> tuple[str, ...]:
    angles = tuple(f"theta_{name}" for name in group_bodies(parts.assembly_of(config.walker, rigid=True)).names)
    return (*angles, *(f"d{name}" for name in angles))


def first_step_length(config: reads.RigidConfig, start: system.State) -> float:
    """Return the length (m) of the rigid model's first step from a state, or half the leg length if the step is not
    completed.

    It is the reference length of a walk that starts in mid-step, because the feet are not a step apart then.
    """
    first = recorded_walk.take_walk(rigid_walker(config), FIRST_STEP, start, 1)
    return float(first.lengths_m[0]) if first.steps else 0.5 * config.walker.leg_length_m
