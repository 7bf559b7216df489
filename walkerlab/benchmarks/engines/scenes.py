"""The walks that engines are given: the walker's parts, its ground, its start, and our own walk beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walkerlab.benchmarks.engines.planar import (
    FLOATING,
    PlanarModel,
    chain_of,
    levers_from,
    planar_model,
)
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_run import Ground
from walkerlab.mechanics.assembly import masses, total_mass
from walkerlab.mechanics.parts import Assembly, Position
from walkerlab.mechanics.standing import swing_foot
from walkerlab.scene.contact import contact_scene, hinge_of, start_state
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import rigid_walker
from walkerlab.solvers.system import State

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class EngineScene:
    """A walker on its ground, as an engine and as the rules of a walk see it.

    assembly  the parts
    base      the body that the engine's tree hangs from
    hip       its point that does
    ours      the walker as this project walks it
    walker    the same with its feet's levers from the base's point
    chain     (n, n) which relative angles add up to each absolute one
    ground    terrain, and the measures that a walk is judged by
    stance    the first stance foot
    start     state of the free walker on the gait
    """

    name: str
    assembly: Assembly
    base: str
    hip: Position
    gravity: float
    ours: ContactWalker
    walker: ContactWalker
    chain: Floats
    ground: Ground
    stance: int
    start: State

    @cached_property
    def model(self) -> PlanarModel:
        """What an engine builds."""
        return planar_model(self.assembly, self.base, self.hip, FLOATING, self.gravity, self.ours.slope)

    @cached_property
    def centre_levers(self) -> Floats:
        """Levers (n, 2) in m from the base's point to the centre of mass."""
        every = [
            mass * levers_from(self.assembly, self.base, self.hip, at.body, at.at_m)
            for mass, at in masses(self.assembly)
        ]
        return np.asarray(sum(every) / total_mass(self.assembly))

    def from_base(self, y: State) -> tuple[Floats, Floats]:
        """Coordinates and velocities of the engine from the state of the free walker."""
        n = len(self.chain)
        angles, rates = np.array(y[2 : 2 + n]) + self.ours.slope, np.array(y[4 + n :])
        shift, drift = self._centre(angles, rates)
        at, moving = np.array(y[:2]) - shift, np.array(y[2 + n : 4 + n]) - drift
        relative, turning = np.linalg.solve(self.chain, angles), np.linalg.solve(self.chain, rates)
        return np.concatenate((at, relative)), np.concatenate((moving, turning))

    def about_centre(self, q: Floats, v: Floats) -> Floats:
        """State of the free walker from an engine's coordinates and velocities."""
        angles, rates = self.chain @ q[2:], self.chain @ v[2:]
        shift, drift = self._centre(angles, rates)
        return np.concatenate((q[:2] + shift, angles - self.ours.slope, v[:2] + drift, rates))

    def _centre(self, angles: Floats, rates: Floats) -> tuple[Floats, Floats]:
        """Where the centre of mass is from the base's point (m), and how it moves against it (m/s)."""
        s, c = np.sin(angles), np.cos(angles)
        d = self.centre_levers
        forward, upward = c * d[:, 0] - s * d[:, 1], s * d[:, 0] + c * d[:, 1]
        return np.array((forward.sum(), upward.sum())), np.array((-rates @ upward, rates @ forward))

    def started(self, factor: float) -> EngineScene:
        """The scene with the start's velocities times a factor; the stance foot stays at rest in the ground's eyes."""
        n = len(self.chain)
        return replace(self, start=(*self.start[: 2 + n], *(factor * x for x in self.start[2 + n :])))


def compass_scene(config: Config, rigid_step_length_m: float, rigid_state: State) -> EngineScene:
    """The config's compass on its own ground, free from its start."""
    scene = replace(contact_scene(config, rigid_step_length_m, rigid_step_length_m), pinned=None)
    assembly = scene.assembly
    start = start_state(scene, rigid_state)
    base = assembly.legs[STANCE_FOOT][0]
    hip = hinge_of(assembly, base, assembly.legs[1 - STANCE_FOOT][0])
    return engine_scene("compass", assembly, base, hip, config.gravity_m_s2, scene.walker, scene.ground, start)


def engine_scene(
    name: str,
    assembly: Assembly,
    base: str,
    hip: Position,
    gravity: float,
    ours: ContactWalker,
    ground: Ground,
    start: State,
) -> EngineScene:
    """The scene of an assembly that hangs from the hip."""
    feet = tuple(
        foot._replace(
            lever_x=tuple(float(x) for x in d[:, 0]),
            lever_y=tuple(float(x) for x in d[:, 1]),
        )
        for foot, part in zip(ours.feet, assembly.feet, strict=True)
        for d in (levers_from(assembly, base, hip, part.body, part.centre_m),)
    )
    walker = ours._replace(feet=(feet[0], feet[1]))
    return EngineScene(
        name, assembly, base, hip, gravity, ours, walker, chain_of(assembly, base), ground, STANCE_FOOT, start
    )


def scenes(config: Config, rigid_step_length_m: float | None, rigid_state: State) -> tuple[EngineScene, ...]:
    """The walks of a config."""
    assembly = assembly_of(config.walker)
    if assembly.knees or assembly.couplings:
        raise ConfigError(
            "engines: only walkers whose bodies turn independently are taken to other engines so far.",
            "Choose a compass or straight legs without a torso.",
        )
    length = rigid_step_length_m or abs(swing_foot(rigid_walker(config, config.equations), rigid_state)[1])
    return (compass_scene(config, length, rigid_state),)
