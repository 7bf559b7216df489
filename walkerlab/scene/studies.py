"""Registration of the reproduced study: its walker, and its own equations in addition to Lagrange's.

The study is named by a string and imported late, so this module does not depend on it, but code digests include its
law (see code_digest.py).
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
    """Return the sets of equations for the gait search: all sets for the study's walker, otherwise the config's."""
    return (LAGRANGE_EQUATIONS, *registered(STUDY, "LAWS")) if is_studied(config) else (config.equations,)
