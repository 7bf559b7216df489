"""Find the study that a config's walker belongs to, and the equations of motion that it adds to Lagrange's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from walkerlab.extensions import code_by_word, extensions, load

if TYPE_CHECKING:
    from walkerlab.config.schema import Equations
    from walkerlab.extensions import Study
    from walkerlab.physics.mechanics.rigid_model import RigidModel

LAGRANGE_EQUATIONS: Equations = "corrected"


def study_of(config: Any) -> Study | None:
    """Return the study that has a config's walker, or None if no study has."""
    studies = (study for extension in extensions().values() for study in extension.studies)
    return next((study for study in studies if load(study.own_walker)(config)), None)


def is_studied(config: Any) -> bool:
    return study_of(config) is not None


def replace_equations(model: RigidModel, equations: Equations) -> RigidModel:
    moved: RigidModel = model if equations == LAGRANGE_EQUATIONS else load(code_by_word("equations")[equations])(model)
    return moved


def equation_sets(config: Any) -> tuple[Equations, ...]:
    """Return the sets of equations for the gait search: all sets for a study's walker, otherwise the config's."""
    study = study_of(config)
    return (config.equations,) if study is None else (LAGRANGE_EQUATIONS, *study.equations)
