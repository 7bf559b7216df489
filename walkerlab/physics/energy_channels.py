"""Energy account of a walk on compliant ground: losses and inputs with their texts and colours."""

from typing import NamedTuple

# places in the account, J so far; the last two are the hip torque's part of the hip's work, and what of it is positive
DAMPING, FRICTION, EDGES, KNEE_STRIKES, KNEE_STOP, PUSH_OFF, HIP, TORQUE, FORWARD = range(9)
ENTRIES = FORWARD + 1
LOST, GIVEN = slice(DAMPING, PUSH_OFF), slice(PUSH_OFF, TORQUE)


class Loss(NamedTuple):
    """A way of losing energy."""

    key: str  # under which a walk's loss is stored
    where: str  # energy is lost
    variable: str  # over time; none of its own where it is empty
    meaning: str  # of the variable
    cause: str  # in figures
    colour: str


LOSSES = (
    Loss(
        "damping",
        "in the ground's damping",
        "dissipated_damping_J",
        "dissipated in normal direction so far",
        "damping of the ground",
        "#0072B2",
    ),
    Loss("friction", "in friction", "dissipated_friction_J", "dissipated in friction so far", "friction", "#E69F00"),
    Loss(
        "edges",
        "at pads' edges",
        "lost_at_edges_J",
        "elastic energy lost at pads' edges so far",
        "edges of pads",
        "#009E73",
    ),
    Loss("knee_strikes", "in knee strikes", "", "", "knees", "#CC79A7"),
    Loss("knee_stop", "in the knees' stops", "", "", "knees", "#CC79A7"),
)
"""In the order of the account."""
SAMPLED = {place: loss for place, loss in enumerate(LOSSES) if loss.variable}
CHANNELS = {loss.key: loss.where for loss in LOSSES}
