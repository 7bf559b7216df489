"""Registration of the reproduced study's walker and of its equations besides Lagrange's.

The study is named by a string and imported late: nothing here depends on it, yet its law is part of the code that
results are made of (see code_digest.py).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from walkerlab.registration import registered

if TYPE_CHECKING:
    from walkerlab.config.schema import Equations
    from walkerlab.physics.mechanics.rigid_model import RigidModel

STUDY = "walkerlab.evidence.paper.law"
LAGRANGE_EQUATIONS: Equations = "corrected"


def is_studied(config: Any) -> bool:
    return bool(registered(STUDY, "is_own_walker")(config))


def with_equations(model: RigidModel, equations: Equations) -> RigidModel:
    moved: RigidModel = model if equations == LAGRANGE_EQUATIONS else registered(STUDY, "LAWS")[equations](model)
    return moved


def equation_sets(config: Any) -> tuple[Equations, ...]:
    """Return the sets of equations to search gaits with: the config's, and every set for the study's walker."""
    return (LAGRANGE_EQUATIONS, *registered(STUDY, "LAWS")) if is_studied(config) else (config.equations,)
