"""Sections on families of gaits, with bifurcations and an interactive diagram, and on basins of attraction."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.drives import push_offs
from walkerlab.labels import add_unit, axis_label
from walkerlab.pipeline.store.content import Group
from walkerlab.views.report.blocks import Diagram, GaitMark, Paragraph, Results, Section, Walker, stage_section
from walkerlab.views.report.gaits import complex_number
from walkerlab.views.report.numbers import format_integer, number
from walkerlab.views.report.tables import Column, Table, table
from walkerlab.views.report.tracks import sampling_gap, track_in
from walkerlab.views.report.words import words


@stage_section("continuation", "branches")
def section(results: Results, summary: Mapping[str, Any]) -> Section | None:
    first, *rest = findings(summary) or [words("families.followed", summary["branches"])]
    blocks = (Paragraph(" ".join(rest)), gait_diagram(results), bifurcations(summary))
    return Section.create("families", f"Families of gaits over {parameter(summary)}", blocks, first)


def findings(summary: Mapping[str, Any]) -> list[str]:
    stable = {}
    for model in ("rigid", "contact"):
        alone = [branch for branch in summary["branches"] if (branch["model"], branch["period"]) == (model, 1)]
        if ranges := [pair for branch in alone for pair in branch["stable_ranges"]]:
            stable[model] = max(ranges, key=lambda pair: pair[1] - pair[0])
    return words.parts("families.findings", summary, stable)


def bifurcations(summary: Mapping[str, Any]) -> Table:
    columns = (
        Column("kind", "kind"),
        Column("model", "model"),
        Column("period (steps)", "period", numeric=True),
        Column(add_unit(parameter(summary), summary["unit"]), "value", lambda value: number(value, 9), numeric=True),
        Column("critical multiplier", "multiplier", lambda parts: complex_number(*parts), numeric=True),
    )
    return table("Bifurcations, as zeros of their test functions", columns, summary["bifurcations"])


def parameter(summary: Mapping[str, Any]) -> str:
    return axis_label(str(summary["over"]))


DIAGRAM_MODEL = "rigid"
MIN_MARK_DISTANCE = 16.0
"""Minimum distance between two marks (diagram units), which is 1.5 times their width, so that a finger can select
one."""
SAMPLING_MARGIN = 3.0
"""Sampling interval, relative to that of the walks. It is larger, because these gaits are only viewed."""


class DiagramAxis:
    """Maps values to positions along an axis, with a margin."""

    def __init__(self, values: NDArray[np.float64], start: float, end: float) -> None:
        least = float(values.min())
        most = float(values.max())
        # If all values are equal, the axis still needs some span.
        room = 0.04 * (most - least) or 1.0
        self.least = least - room
        self.most = most + room
        self.start = start
        self.end = end

    def place(self, value: float) -> float:
        return round(self.start + (value - self.least) / (self.most - self.least) * (self.end - self.start), 1)

    def ticks(self) -> tuple[tuple[float, str], ...]:
        """Return the positions and texts of ticks at round values."""
        rough = (self.most - self.least) / 5.0
        ten = 10.0 ** math.floor(math.log10(rough))
        step = ten * next(digit for digit in (5, 2, 1) if digit * ten <= rough)
        numbers = range(math.ceil(self.least / step), math.floor(self.most / step) + 1)
        return tuple((self.place(number * step), f"{number * step:.6g}") for number in numbers)


def gait_diagram(results: Results) -> Diagram | None:
    """Plot step periods over the parameter, with marks for gaits whose motion is stored.

    Returns None if no motion is stored.
    """
    summary = results.summary("continuation")
    branches: list[Group] = []
    while (branch := results.group("continuation", f"{DIAGRAM_MODEL}/branch_{len(branches)}")) is not None:
        branches.append(branch)
    moving = [
        (branch, place, motion)
        for number, branch in enumerate(branches)
        for place in range(branch["value"].size)
        if (motion := results.group("continuation", f"{DIAGRAM_MODEL}/branch_{number}/motion_{place}")) is not None
    ]
    if not moving:
        return None
    value = np.concatenate([branch["value"] for branch in branches])
    period = np.concatenate([branch["step_period"].ravel() for branch in branches])
    across = DiagramAxis(value, Diagram.LEFT, Diagram.WIDTH - Diagram.RIGHT)
    up = DiagramAxis(period, Diagram.HEIGHT - Diagram.BOTTOM, Diagram.TOP)
    pushes = any(push_offs(results.config.push_off))
    gap = SAMPLING_MARGIN * sampling_gap(results.config)
    unit = summary["unit"]
    marks = []
    for branch, place, motion in moving:
        x, y = float(branch["value"][place]), float(branch["step_period"][place][0])
        stable = bool(branch["stable"][place])
        if (track := track_in(motion)) is not None:
            name = words("families.mark", int(motion.attrs["steps"]), x, unit, stable)
            strikes = motion["time"][1:][np.diff(motion["step"]) > 0].round(6)
            walker = Walker(name, DIAGRAM_MODEL, track.thin(gap), tuple(strikes.tolist()), (), pushes=pushes)
            marks.append(GaitMark(across.place(x), up.place(y), stable, walker, float(motion.attrs["slope_rad"])))
    over = parameter(summary)
    return Diagram(
        title=f"Gaits over {over}",
        caption=words("families.diagram"),
        titles=(add_unit(over, unit), "duration of a step (s)"),
        curves=tuple(curve for branch in branches for curve in curves(branch, across, up)),
        ticks=(across.ticks(), up.ticks()),
        gaits=separate_marks(marks),
    )


def separate_marks(marks: Sequence[GaitMark]) -> tuple[GaitMark, ...]:
    """Select marks that do not overlap, preferring stable gaits."""
    chosen: list[int] = []
    for place in sorted(range(len(marks)), key=lambda place: not marks[place].stable):
        x, y = marks[place].x, marks[place].y
        if all(math.hypot(marks[index].x - x, marks[index].y - y) >= MIN_MARK_DISTANCE for index in chosen):
            chosen.append(place)
    return tuple(marks[place] for place in sorted(chosen))


def curves(
    branch: Group, across: DiagramAxis, up: DiagramAxis
) -> Iterator[tuple[tuple[tuple[float, float], ...], bool]]:
    """Yield lines (points, stable) of step period over parameter.

    Each stretch of stable or of unstable gaits has one line for every step of a gait.
    """
    stable = branch["stable"].astype(bool)
    bounds = [0, *(int(place) + 1 for place in np.flatnonzero(np.diff(stable))), stable.size]
    for begin, end in pairwise(bounds):
        # A stretch begins with the last point of the one before, so that the line has no gap.
        stretch = slice(max(0, begin - 1), end)
        for period in branch["step_period"][stretch].T:
            points = zip(branch["value"][stretch], period, strict=True)
            yield tuple((across.place(float(x)), up.place(float(y))) for x, y in points), bool(stable[begin])


ATTRACTOR_COLUMNS = (
    Column("period (steps)", "period", format_integer, numeric=True),
    Column("cells", "cells", format_integer, numeric=True),
    Column("steps to reach it, median", "median_steps_to_settle", lambda steps: number(steps, 3), numeric=True),
)


@stage_section("basin")
def basin(_results: Results, summary: Mapping[str, Any]) -> Section | None:
    sentences = (words("basin.shares", summary), *words.parts("basin.grounds", summary))
    return Section.create("basin", "Basins of attraction", (*map(Paragraph, sentences), attractors(summary)))


def attractors(summary: Mapping[str, Any]) -> Table:
    return table("Attractors", ATTRACTOR_COLUMNS, summary["attractors"], note=words("basin.unsettled", summary))
