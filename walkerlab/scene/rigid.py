"""Build the rigid model of a config, leaving out everything that the config does not need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from walkerlab.config.ground import Footholds
from walkerlab.config.walkers import Walker
from walkerlab.errors import ConfigError
from walkerlab.hybrid.recorded_walk import RigidWalkResult, take_walk
from walkerlab.mechanics.rigid import knee_of, on_level_ground, places_of
from walkerlab.mechanics.standing import Standing, on_slope
from walkerlab.scene.footholds import foothold_heights
from walkerlab.scene.parts import SHOWN_IN, assembly_of, drive_numbers, knee_locked_at_strike
from walkerlab.scene.studies import moved_by
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import State

if TYPE_CHECKING:
    from walkerlab.config.reads import RigidConfig
    from walkerlab.config.schema import Equations, Output

REMEMBERED = 16  # walkers: over a slope the same one is asked for again and again


@dataclass(frozen=True)
class RigidScene:
    """A walker on its slope, ready to walk."""

    walker: Standing
    names: tuple[str, ...]  # of the state's numbers
    knee_m: tuple[float, float] | None  # the knee in its thigh's frame
    outputs: tuple[Output, ...]  # what in time is wanted
    ground: Footholds

    def walk(
        self,
        start: State,
        steps: int,
        tolerances: Tolerances,
        sampled: bool = False,
        advance: Callable[[int], None] | None = None,
        step_length: float | None = None,
    ) -> RigidWalkResult:
        """Walk up to `steps` steps from a state (2 n); `sampled` to record the requested outputs. See `take_walk`."""
        heights, sampled = foothold_heights(self.ground, steps), sampled and bool(self.outputs)
        return take_walk(self.walker, tolerances, start, steps, sampled, advance, heights, step_length)


def rigid_scene(config: RigidConfig, ground: Footholds, outputs: tuple[Output, ...]) -> RigidScene:
    """Build the scene of a config on a ground, with the outputs to record."""
    return RigidScene(
        walker=rigid_walker(config),
        names=coordinates(config),
        knee_m=knee_of(assembly_of(config.walker, rigid=True)),
        outputs=outputs,
        ground=ground,
    )


def rigid_walker(config: RigidConfig, equations: Equations | None = None) -> Standing:
    """Return the walker of a config, with its own set of equations or another one."""
    passive = on_slope(level_walker(config.walker, config.gravity_m_s2), config.slope_rad)
    return moved_by(passive.changed(**drive_numbers(config)), equations or config.equations)


def walker_or_none(config: RigidConfig | None) -> Standing | None:
    return None if config is None else rigid_walker(config)


@lru_cache(REMEMBERED)
def level_walker(walker: Walker, gravity: float) -> Standing:
    """Return a walker on level ground (gravity in m/s^2); raises ConfigError for parts that make no walker."""
    try:
        return on_level_ground(assembly_of(walker, rigid=True), gravity, knee_locked_at_strike(walker))
    except ValueError as error:
        raise ConfigError(f"walker: {error}", SHOWN_IN) from None


def coordinates(config: RigidConfig) -> tuple[str, ...]:
    """Return the names of the rigid model's state variables."""
    angles = tuple(f"theta_{name}" for name in places_of(assembly_of(config.walker, rigid=True)).names)
    return (*angles, *(f"d{name}" for name in angles))
