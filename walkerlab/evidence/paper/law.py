"""The parts of scenes that the study defines (see scene/studies.py): its walker, and the sign error of Appendix A.

Results computed with the printed equations depend on this file. The rest of the study is in other files, so that a
change there does not make these results out of date.
"""

from typing import Any

from walkerlab.config.fields import are_equal
from walkerlab.config.walkers import CompassWalker, is_passive_compass
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING, RigidModel


def is_own_walker(config: Any) -> bool:
    """Whether a config has the walker of the paper, up to rounding of values."""
    paper = CompassWalker()
    return is_passive_compass(config) and all(
        are_equal(getattr(config.walker, name), getattr(paper, name)) for name in CompassWalker.model_fields
    )


def as_printed(model: RigidModel) -> RigidModel:
    """Return a compass whose centrifugal torque on the stance leg, C_21 dtheta_1, has the sign printed in (A.5)."""
    return model.changed(unpaired=-2.0 * model.A[STANCE, SWING])
