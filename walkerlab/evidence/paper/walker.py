"""Conversion of a config's walker to the form of Appendix A."""

from __future__ import annotations

from typing import TYPE_CHECKING

from walkerlab.config.reads import RigidConfig
from walkerlab.config.walkers import CompassWalker, is_passive_compass
from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker

if TYPE_CHECKING:
    from walkerlab.config.schema import Equations


def compass(config: RigidConfig, equations: Equations) -> RigidWalker:
    """Return a config's passive compass as a walker of Appendix A.

    Raises ValueError for another walker.
    """
    walker = config.walker
    if not isinstance(walker, CompassWalker) or walker.torso is not None:
        raise ValueError(f"Appendix A does not describe walkers of type {walker.type}")
    return RigidWalker(
        leg_length=walker.leg_length_m,
        foot_to_mass=walker.foot_to_mass_m,
        leg_mass=walker.leg_mass_kg,
        hip_mass=walker.hip_mass_kg,
        leg_inertia=walker.leg_inertia_kg_m2,
        gravity=config.gravity_m_s2,
        slope=config.slope_rad,
        c21_sign=AS_PRINTED if equations == "as-printed" else CORRECTED,
    )


def compass_or_none(config: RigidConfig, equations: Equations) -> RigidWalker | None:
    return compass(config, equations) if is_passive_compass(config) else None
