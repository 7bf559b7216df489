"""Energy account of a walk on compliant ground: its entries, and texts and colours for the losses."""

from typing import NamedTuple

# entries of the account (J, up to the present time); TORQUE is the work of the hip torque, a part of HIP_WORK, and
# FORWARD is the positive work of that torque
DAMPING_LOSS, FRICTION_LOSS, EDGES, KNEE_STRIKES, KNEE_STOP, PUSH_OFF, HIP_WORK, TORQUE, FORWARD = range(9)
ENTRIES = FORWARD + 1
LOSS_ENTRIES, SUPPLY_ENTRIES = slice(DAMPING_LOSS, PUSH_OFF), slice(PUSH_OFF, TORQUE)


class Loss(NamedTuple):
    key: str  # name of the loss in results
    where: str  # text that completes 'energy is lost ...'
    variable: str  # name of the variable that holds the loss over time; empty if no variable does
    meaning: str  # description of the variable
    cause: str  # label in figures
    colour: str


LOSSES = (
    Loss(
        "damping",
        "in the ground's damping",
        "dissipated_damping_J",
        "cumulative loss in the ground's damping",
        "damping of the ground",
        "#0072B2",
    ),
    Loss("friction", "in friction", "dissipated_friction_J", "cumulative loss in friction", "friction", "#E69F00"),
    Loss(
        "edges",
        "at pads' edges",
        "lost_at_edges_J",
        "cumulative loss of elastic energy at pads' edges",
        "edges of pads",
        "#009E73",
    ),
    Loss("knee_strikes", "in knee strikes", "", "", "knees", "#CC79A7"),
    Loss("knee_stop", "in the knees' stops", "", "", "knees", "#CC79A7"),
)
"""Losses, in the order of the account."""
SAMPLED = {place: loss for place, loss in enumerate(LOSSES) if loss.variable}
CHANNELS = {loss.key: loss.where for loss in LOSSES}
