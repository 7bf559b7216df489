"""The diagram of a family of gaits on the page: its branches, and marks whose gaits the player can show."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.report.blocks import Diagram, GaitMark, Walker
from walkerlab.report.numbers import count, quantity
from walkerlab.report.results import Results
from walkerlab.report.tracks import sampling_gap, track_in
from walkerlab.store.content import Group

MODEL = "rigid"
CLEAR = 16.0
"""Between the centres of two marks, in units of the diagram: half as much again as they are wide, for fingers."""
GAP = 3.0
"""Time between samples, in those of the walk itself: a gait is looked at, not measured."""


class DiagramAxis(NamedTuple):
    """From numbers to places on an axis."""

    least: float
    most: float
    start: float
    end: float

    def place(self, value: float) -> float:
        """Where a number is."""
        return round(self.start + (value - self.least) / (self.most - self.least) * (self.end - self.start), 1)

    def ticks(self) -> tuple[tuple[float, str], ...]:
        """Round numbers: place and text."""
        rough = (self.most - self.least) / 5.0
        ten = 10.0 ** math.floor(math.log10(rough))
        step = ten * next(digit for digit in (5, 2, 1) if digit * ten <= rough)
        numbers = range(math.ceil(self.least / step), math.floor(self.most / step) + 1)
        return tuple((self.place(number * step), f"{number * step:.6g}") for number in numbers)


def scale_of(values: NDArray[np.float64], start: float, end: float) -> DiagramAxis:
    """An axis for some numbers, with a little room at its ends."""
    least, most = float(values.min()), float(values.max())
    room = 0.04 * (most - least) or 1.0
    return DiagramAxis(least - room, most + room, start, end)


def gait_diagram(results: Results) -> Diagram | None:
    """Step periods over the parameter, with the gaits whose stored motion can be pointed at; None if there are none."""
    summary = results.summary("continuation") or {}
    branches = list(branches_of(results))
    if not any(results.group("continuation", f"{path}/motion_0") for path, _ in branches):
        return None
    value = np.concatenate([branch["value"] for _, branch in branches])
    period = np.concatenate([branch["step_period"].ravel() for _, branch in branches])
    over = parameter(summary)
    across = scale_of(value, Diagram.LEFT, Diagram.WIDTH - Diagram.RIGHT)
    up = scale_of(period, Diagram.HEIGHT - Diagram.BOTTOM, Diagram.TOP)
    return Diagram(
        title=f"Gaits over {over}",
        caption="The duration of each step of the rigid model's gaits; broken lines are unstable. A mark is a gait: "
        "chosen, it walks in the player above.",
        titles=(f"{over} ({summary['unit']})", "duration of a step (s)"),
        curves=tuple(curve for _, branch in branches for curve in curves(branch, across, up)),
        ticks=(across.ticks(), up.ticks()),
        gaits=apart(list(gaits(results, across, up))),
    )


def parameter(summary: Mapping[str, Any]) -> str:
    """What the families are over; the slope is the slope in either unit."""
    return str(summary["over"]).removesuffix("_deg").removesuffix("_rad")


def apart(marks: Sequence[GaitMark]) -> tuple[GaitMark, ...]:
    """The marks of which none covers another, so that each can be pointed at; stable gaits go before others."""
    kept: list[int] = []
    for place in sorted(range(len(marks)), key=lambda place: not marks[place].stable):
        x, y = marks[place].x, marks[place].y
        if all(math.hypot(marks[other].x - x, marks[other].y - y) >= CLEAR for other in kept):
            kept.append(place)
    return tuple(marks[place] for place in sorted(kept))


def branches_of(results: Results) -> Iterator[tuple[str, Group]]:
    """Path and group of each branch of the rigid model."""
    number = 0
    while (group := results.group("continuation", path := f"{MODEL}/branch_{number}")) is not None:
        yield path, group
        number += 1


def curves(
    branch: Group, across: DiagramAxis, up: DiagramAxis
) -> Iterator[tuple[tuple[tuple[float, float], ...], bool]]:
    """A line for each step of a branch's gaits and each stretch of one stability."""
    stable = branch["stable"].astype(bool)
    bounds = [0, *(int(place) + 1 for place in np.flatnonzero(np.diff(stable))), stable.size]
    for begin, end in pairwise(bounds):
        here = slice(max(0, begin - 1), end)
        for period in branch["step_period"][here].T:
            points = zip(branch["value"][here], period, strict=True)
            yield tuple((across.place(float(x)), up.place(float(y))) for x, y in points), bool(stable[begin])


def gaits(results: Results, across: DiagramAxis, up: DiagramAxis) -> Iterator[GaitMark]:
    """The gaits whose motion was stored, branch by branch."""
    unit = str((results.summary("continuation") or {})["unit"])
    for path, branch in branches_of(results):
        for place, value in enumerate(branch["value"].tolist()):
            moving = results.group("continuation", f"{path}/motion_{place}")
            track = None if moving is None else track_in(moving)
            if moving is None or track is None:
                continue
            steps, stable = int(moving.attrs["steps"]), bool(branch["stable"][place])
            thin = track.thinned(GAP * sampling_gap(results.config))
            said = f"{count(steps, 'step')} at {quantity(value, unit, 4)}, {'stable' if stable else 'unstable'}"
            walker = Walker(
                name=f"Gait of {said}",
                style=MODEL,
                channels=tuple(thin.channels),
                samples=int(thin["t"].size),
                floats=thin.packed(),
                strikes=tuple(moving["time"][1:][np.diff(moving["step"]) > 0].round(6).tolist()),
                stills=(),
            )
            y = up.place(float(branch["step_period"][place][0]))
            yield GaitMark(across.place(value), y, walker.name, stable, walker, float(moving.attrs["slope_rad"]))
