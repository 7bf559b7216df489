"""From a config to the least that can walk the rigid model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from walkerlab.mechanics.rigid_compass import AS_PRINTED, CORRECTED, RigidWalker
from walkerlab.solvers.registry import method_named

if TYPE_CHECKING:
    from walkerlab.config.schema import Config, Equations

COORDINATES = ("theta_1", "theta_2", "dtheta_1", "dtheta_2")
SWING_EQUATIONS = len(COORDINATES)
C21_SIGNS: dict[Equations, float] = {"corrected": CORRECTED, "as-printed": AS_PRINTED}
ENDLESS = 2**62  # right-hand sides; a walk is given its budget step by step


@dataclass(frozen=True)
class RigidScene:
    """A walker on its slope, ready to walk."""

    walker: RigidWalker
    method: Any  # integrator for the swing phase
    states: bool  # whether angles and velocities in time are wanted
    energies: bool
    forces: bool

    @property
    def sampled(self) -> bool:
        """Whether anything in time is wanted."""
        return self.states or self.energies or self.forces


def rigid_scene(config: Config) -> RigidScene:
    """The scene of a config: its equations, its method, and of the outputs those that it asks for."""
    settings = config.solver.rigid
    method = method_named(settings.method).new(SWING_EQUATIONS, settings.rtol, settings.atol, ENDLESS)
    wanted = config.outputs
    return RigidScene(
        walker=rigid_walker(config, config.equations),
        method=method,
        states="states" in wanted,
        energies="energies" in wanted,
        forces="forces" in wanted,
    )


def rigid_walker(config: Config, equations: Equations) -> RigidWalker:
    """The walker of a config with one of the two sets of equations; the rigid model has point feet."""
    walker = config.walker
    return RigidWalker(
        leg_length=walker.leg_length_m,
        foot_to_mass=walker.foot_to_mass_m,
        leg_mass=walker.leg_mass_kg,
        hip_mass=walker.hip_mass_kg,
        leg_inertia=walker.leg_inertia_kg_m2,
        gravity=config.gravity_m_s2,
        slope=config.slope_rad,
        c21_sign=C21_SIGNS[equations],
    )
