"""How a walk of either model ends, as kernels return it: an outcome's number, or one of those below that are none."""

from walkerlab.outcome import Outcome

WALKED, FELL, OFF_PAD = int(Outcome.WALKED), int(Outcome.FELL), int(Outcome.OFF_PAD)
LIFTED_OFF, SLID, NO_HEEL_STRIKE = int(Outcome.LIFTED_OFF), int(Outcome.SLID), int(Outcome.NO_HEEL_STRIKE)
BUDGET_EXHAUSTED, SOLVER_FAILED = int(Outcome.BUDGET_EXHAUSTED), int(Outcome.SOLVER_FAILED)
REJECTED, BENT_KNEE, STUBBED = int(Outcome.REJECTED), int(Outcome.BENT_KNEE), int(Outcome.STUBBED)
GOES_ON = -1  # it has not ended
CHANGES_FORM = -2  # a contact walk goes on in another form: a knee locked or is free, or the legs change places
KNEE_STRUCK = -3  # a rigid swing goes on with a straight knee
FALLEN_HIP = 0.5  # leg lengths: a walker whose hip is not this high over the slope has fallen
