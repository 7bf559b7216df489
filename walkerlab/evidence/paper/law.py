"""The parts of scenes that the study defines (see scene/studies.py): its walker, and Appendix A's sign error.

Results with the equations as printed depend on this file, so the rest of the study is in other files.
"""

from typing import Any

from walkerlab.config.fields import are_equal
from walkerlab.config.walkers import CompassWalker, is_passive_compass
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING, RigidModel


def is_own_walker(config: Any) -> bool:
    """Whether a config has the paper's walker, up to rounding of its values."""
    walker = config.walker
    paper = CompassWalker()
    return is_passive_compass(config) and all(
        are_equal(getattr(walker, name), getattr(paper, name)) for name in CompassWalker.model_fields
    )


def as_printed(model: RigidModel) -> RigidModel:
    """Return a compass whose centrifugal torque on the stance leg, C_21 dtheta_1, has the sign printed in (A.5)."""
    return model.changed(unpaired=-2.0 * model.A[STANCE, SWING])
