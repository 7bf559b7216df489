"""What both models store of a walk, under the same names with the same units and meanings."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from walkerlab.labels import Label
from walkerlab.store.columns import labelled, numbered
from walkerlab.store.content import Variable

STEP, TIME, LEG = "step", "time", "leg"
OVER_TIME: Final = {
    "time": Label("s", "time"),
    "angle": Label("rad", "angle of the leg from the vertical"),
    "velocity": Label("rad/s", "angular velocity of the leg"),
    "hip_along_m": Label("m", "position of the hip along the slope"),
    "hip_height_m": Label("m", "height of the hip over the slope"),
    "knee_along_m": Label("m", "position of the knee along the slope"),
    "knee_height_m": Label("m", "height of the knee over the slope"),
    "foot_along_m": Label("m", "position of the foot along the slope"),
    "foot_height_m": Label("m", "height of the foot's lowest point over the slope"),
    "kinetic_J": Label("J", "kinetic energy"),
    "potential_J": Label("J", "potential energy from the current stance foot"),
    "mechanical_J": Label("J", "kinetic and potential energy from the current stance foot"),
}
NORMAL_FORCE: Final = Label("N", "normal force of the ground on the foot")  # of the contact model, under either foot


def at_samples(values: ArrayLike, label: Label) -> Variable:
    """Numbers (samples,), or (samples, 2) of what each leg has."""
    return labelled(values, label, *(TIME, LEG)[: np.ndim(values)])


def over_time(**values: ArrayLike) -> dict[str, Variable]:
    """What the samples of a walk have, by names in `OVER_TIME`."""
    return {name: at_samples(found, OVER_TIME[name]) for name, found in values.items()}


def of_body(name: str, angle: ArrayLike, velocity: ArrayLike) -> dict[str, Variable]:
    """How a body beside the legs' own turns: a shank, a torso."""
    return {
        f"{name}_angle": at_samples(angle, Label("rad", f"angle of the {name} from the vertical")),
        f"{name}_velocity": at_samples(velocity, Label("rad/s", f"angular velocity of the {name}")),
    }


def legs() -> dict[str, Variable]:
    """The legs, which keep their numbers when they change roles."""
    return numbered(2, LEG, "leg: 0 swings first, 1 stands first")


def touches(times_s: ArrayLike) -> dict[str, Variable]:
    """When steps ended, a row each."""
    label = Label("s", "time of the touch that ends the step")
    return {**numbered(np.size(times_s), STEP, "step number"), "touch_time_s": labelled(times_s, label, STEP)}
