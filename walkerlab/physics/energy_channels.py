"""Energy account of a walk on compliant ground: its entries, and texts and colours for the losses."""

from typing import NamedTuple

# entries of the account (J, up to the present time). TORQUE, the work of the hip torque, is part of HIP_WORK. FORWARD
# is the positive work of that torque.
DAMPING_LOSS, FRICTION_LOSS, EDGES, KNEE_STRIKES, KNEE_STOP, PUSH_OFF, HIP_WORK, TORQUE, FORWARD = range(9)
ENTRIES = FORWARD + 1
LOSS_ENTRIES = slice(DAMPING_LOSS, PUSH_OFF)
SUPPLY_ENTRIES = slice(PUSH_OFF, TORQUE)


class Loss(NamedTuple):
    key: str  # name of the loss in results
    where: str  # text that completes 'energy is lost ...'
    variable: str  # variable with the loss over time; empty if there is none
    meaning: str  # description of the variable
    cause: str  # label in figures
    colour: str


LOSSES = (
    Loss(
        key="damping",
        where="in the ground's damping",
        variable="dissipated_damping_J",
        meaning="cumulative loss in the ground's damping",
        cause="damping of the ground",
        colour="#0072B2",
    ),
    Loss(
        key="friction",
        where="in friction",
        variable="dissipated_friction_J",
        meaning="cumulative loss in friction",
        cause="friction",
        colour="#E69F00",
    ),
    Loss(
        key="edges",
        where="at pads' edges",
        variable="lost_at_edges_J",
        meaning="cumulative loss of elastic energy at pads' edges",
        cause="edges of pads",
        colour="#009E73",
    ),
    Loss(key="knee_strikes", where="in knee strikes", variable="", meaning="", cause="knees", colour="#CC79A7"),
    Loss(key="knee_stop", where="in the knees' stops", variable="", meaning="", cause="knees", colour="#CC79A7"),
)
"""Losses, in the order of the entries above."""
SAMPLED = {index: loss for index, loss in enumerate(LOSSES) if loss.variable}
CHANNELS = {loss.key: loss.where for loss in LOSSES}
