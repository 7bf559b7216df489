"""Arithmetic on the paper's printed numbers alone: no walk, no config of a run."""

from walkerlab.config.contact import Contact
from walkerlab.ground.resting import RestingFoot, resting_foot
from walkerlab.paper.printed import DAMPING, STEP_LENGTH, STIFFNESS, TABLE_1


def printed_speed(cycle: float) -> float:
    """The printed step length over a cycle's time (s), as section 5 has it (m/s)."""
    return STEP_LENGTH.value / cycle


def speed_difference(matlab_cycle: float, adams_cycle: float) -> float:
    """Difference of the two speeds (%) that follow from cycles of these times (s)."""
    matlab, adams = printed_speed(matlab_cycle), printed_speed(adams_cycle)
    return 100.0 * abs(adams - matlab) / matlab


def readings_of_fig_4b() -> tuple[RestingFoot, RestingFoot]:
    """How the paper's walker stands on its contact by its numbers without units: read in N, mm and s, and in SI."""
    _, leg, hip, gravity = (entry.value for entry in TABLE_1)
    mass, adams = hip + 2.0 * leg, Contact(stiffness=STIFFNESS.value, damping=DAMPING.value).in_si()
    in_adams = resting_foot(mass * gravity, mass, adams.stiffness, adams.exponent, adams.damping)
    return in_adams, resting_foot(mass * gravity, mass, STIFFNESS.value, 1.0, DAMPING.value)
