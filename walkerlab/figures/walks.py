"""The walks of both models as figures show them, out of the stored results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import CONTACT, RIGID, Look
from walkerlab.store.content import Content, Group

Array = NDArray[np.float64]

RIGID_STAGE, CONTACT_STAGE, COMPARE_STAGE = "simulate", "contact-sim", "compare"
TRAJECTORY, STEPS = "trajectory", "steps"
STATES = ("time", "angle", "velocity", "stance_leg")
JOINTS = ("hip_along_m", "hip_height_m", "foot_along_m", "foot_height_m")
ENERGIES = ("time", "kinetic_J", "potential_J", "mechanical_J")

NO_STATES = "'states' is not among the config's outputs"
NO_ENERGIES = "'energies' is not among the config's outputs"
NO_STEP = "no step was completed"
TOUCHES = "touch_time_s"

RIGID_STATES = Need(RIGID_STAGE, TRAJECTORY, STATES, NO_STATES)
RIGID_ENERGIES = Need(RIGID_STAGE, TRAJECTORY, ENERGIES, NO_ENERGIES)
STEPS_TAKEN_RIGID = Need(RIGID_STAGE, STEPS, (TOUCHES, "touch_along_m"), NO_STEP)
CONTACT_STATES = Need(CONTACT_STAGE, TRAJECTORY, STATES, NO_STATES)
CONTACT_ENERGIES = Need(CONTACT_STAGE, TRAJECTORY, ENERGIES, NO_ENERGIES)
STEPS_TAKEN_CONTACT = Need(CONTACT_STAGE, STEPS, (TOUCHES, "touch_along_m"), NO_STEP)

PAPER_STRIDES = 5
"""Strides that the paper's figures in time show; a longer walk's figures show its first ones."""


def redoes_the_paper(results: Results) -> bool:
    """Whether the scene is the paper's own; of any other, figures say nothing of the paper."""
    return COMPARE_STAGE in results and not results[COMPARE_STAGE].summary.get("departures")


@dataclass(frozen=True, eq=False)
class Walk:
    """A walk in time.

    look      of its model
    outcome   how it ended
    steps     how many steps it has in all
    strikes   (shown steps,) s, times of the heel strikes
    time      (samples,) s
    samples   variables of the trajectory by name, their first axis time
    """

    look: Look
    outcome: str
    steps: int
    strikes: Array
    time: Array
    samples: dict[str, NDArray[Any]]

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A variable of the trajectory, such as 'angle' (samples, 2)."""
        return self.samples[name]

    def first(self, strides: int) -> Walk:
        """Its first strides; the walk itself if it has no more."""
        steps = 2 * strides
        if self.strikes.size <= steps:
            return self
        end = self.strikes[steps - 1]
        shown = self.time <= end
        samples = {name: values[shown] for name, values in self.samples.items()}
        return Walk(self.look, self.outcome, self.steps, self.strikes[:steps], self.time[shown], samples)

    @property
    def described(self) -> str:
        """How it went, in words: 'the rigid model walked 10 steps'."""
        count = f"{self.steps} step" + ("" if self.steps == 1 else "s")
        if self.outcome == "walked":
            return f"the {self.look.label} walked {count}"
        return f"the {self.look.label} took {count} ({self.outcome})"


def walks_with(results: Results, rigid: Need, contact: Need) -> list[Walk]:
    """The walks of the models whose results have what is needed, the rigid model's first."""
    return [
        walk_of(results[need.stage], look, need.variables)
        for need, look in ((rigid, RIGID), (contact, CONTACT))
        if need.missing_in(results, {}) is None
    ]


def walk_of(result: Content, look: Look, variables: tuple[str, ...]) -> Walk:
    """The walk that a stage has stored, with the variables that are wanted."""
    trajectory = result[TRAJECTORY]
    times = touch_times(result.groups.get(STEPS, Group({})))
    samples = {name: trajectory[name] for name in variables}
    return Walk(look, str(result.summary["outcome"]), times.size, times, trajectory["time"], samples)


def touch_times(steps: Group) -> Array:
    """Times of the heel strikes (s); none if no step was completed."""
    return steps[TOUCHES] if TOUCHES in steps.variables else np.zeros(0)


def sentence(walks: list[Walk]) -> str:
    """How the walks went, as a sentence."""
    text = ", ".join(walk.described for walk in walks)
    return text[:1].upper() + text[1:] + "."


def shown(walks: list[Walk], strides: int = PAPER_STRIDES) -> tuple[list[Walk], str]:
    """The walks' first strides, and a phrase on how much that is: '' if it is all, ' (the first 5 strides)' if not."""
    cut = [walk.first(strides) for walk in walks]
    whole = all(short is walk for short, walk in zip(cut, walks, strict=True))
    return cut, "" if whole else f" (the first {strides} strides)"
