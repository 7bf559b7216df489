"""Codes for how a walk ended (negative codes: how it continues), and limits on poses.

Kernels of both models use them.
"""

from walkerlab.outcome import Outcome

WALKED = int(Outcome.WALKED)
FELL = int(Outcome.FELL)
OFF_PAD = int(Outcome.OFF_PAD)
LIFTED_OFF = int(Outcome.LIFTED_OFF)
SLID = int(Outcome.SLID)
NO_HEEL_STRIKE = int(Outcome.NO_HEEL_STRIKE)
BUDGET_EXHAUSTED = int(Outcome.BUDGET_EXHAUSTED)
SOLVER_FAILED = int(Outcome.SOLVER_FAILED)
REJECTED = int(Outcome.REJECTED)
BENT_KNEE = int(Outcome.BENT_KNEE)
STUBBED = int(Outcome.STUBBED)
GOES_ON = -1  # the walk has not ended
CHANGES_FORM = -2  # a contact walk continues in another form: a knee locks or is freed, or the legs change roles
KNEE_STRUCK = -3  # a rigid swing continues with a straight knee
FALLEN_HIP = 0.5  # leg lengths; a walker whose hip is lower than this above the slope has fallen
STRAIGHT_KNEE = 1e-9  # rad and rad/s; thigh and shank of a straight leg differ by less than this in angle and rate
ON_GROUND = 1e-9  # leg lengths; feet that are both on the ground differ in height by no more than this
