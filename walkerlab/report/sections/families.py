"""Families of gaits over a parameter, their bifurcations, a diagram whose gaits walk, and basins of attraction."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.labels import with_unit
from walkerlab.report.blocks import Diagram, GaitMark, PageBlock, Paragraph, Section, Walker
from walkerlab.report.numbers import count, number, quantity, whole
from walkerlab.report.results import Results
from walkerlab.report.sections.gaits import complex_number
from walkerlab.report.sections.walks import error_of_sample
from walkerlab.report.tables import Column, Table, table
from walkerlab.report.tracks import sampling_gap, track_in
from walkerlab.report.words import words
from walkerlab.store.content import Group

MODELS = ("rigid", "contact")


def section(results: Results) -> Section | None:
    """Branches, their bifurcations and the chaos beyond; None if none were followed."""
    summary = results.summary("continuation")
    if summary is None or not summary.get("branches"):
        return None
    first, *others = findings(summary) or [f"{count(len(summary['branches']), 'branch', 'branches')} followed."]
    blocks: list[PageBlock] = [Paragraph(" ".join(others))] if others else []
    diagram = gait_diagram(results)
    if diagram is not None:
        blocks.append(diagram)
    if summary["bifurcations"]:
        blocks.append(bifurcations(summary))
    return Section("families", f"Families of gaits over {parameter(summary)}", tuple(blocks), first)


def findings(summary: Mapping[str, Any]) -> list[str]:
    """What there is to say, sentence by sentence."""
    unit = str(summary["unit"])
    said = []
    for model in MODELS:
        stable = [one for one in summary["branches"] if one["model"] == model and one["period"] == 1]
        ranges = [pair for one in stable for pair in one["stable_ranges"]]
        if ranges:
            said.append(words("families.stable", model, *max(ranges, key=lambda pair: pair[1] - pair[0]), unit))
    doubling = summary["first_doubling"]
    if doubling.keys() >= set(MODELS):
        said.append(words("families.shift", doubling["contact"] - doubling["rigid"], unit))
    cascades = [one for one in summary["cascades"] if "accumulates_at" in one]
    said += [words("families.cascade", one, len(one["flips"]), unit) for one in cascades]
    for one in summary["attractors"]:
        if one["aperiodic_from"] is not None:
            said.append(words("families.aperiodic", one["aperiodic_from"], unit))
        if one["lost_at"] is not None:
            said.append(words("families.lost", one, unit))
    said += [one["said"] for one in summary.get("endings", ()) if one["period"] == 1]
    for model, error in summary.get("numerical_error", {}).items():
        said.append(error_of_sample(error, f"gaits of the {model} model"))
    wild = max(summary["lyapunov"], key=lambda one: one["exponent"], default=None)
    if wild is not None and wild["exponent"] > 3.0 * wild["uncertainty"]:
        said.append(words("families.chaos", wild, unit))
    return said


def bifurcations(summary: Mapping[str, Any]) -> Table:
    """Every bifurcation that was located."""
    columns = (
        Column("kind", "kind"),
        Column("model", "model"),
        Column("steps of the gait", "period", numeric=True),
        Column(with_unit(parameter(summary), summary["unit"]), "value", lambda value: number(value, 9), numeric=True),
        Column("critical multiplier", "multiplier", lambda parts: complex_number(*parts), numeric=True),
    )
    return table("Bifurcations, as zeros of their test functions", columns, summary["bifurcations"])


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
            said = f"{count(steps, 'step')} at {quantity(value, unit, 4)}, {'stable' if stable else 'unstable'}"
            walker = Walker(
                name=f"Gait of {said}",
                style=MODEL,
                track=track.thinned(GAP * sampling_gap(results.config)),
                strikes=tuple(moving["time"][1:][np.diff(moving["step"]) > 0].round(6).tolist()),
                stills=(),
            )
            y = up.place(float(branch["step_period"][place][0]))
            yield GaitMark(across.place(value), y, walker.name, stable, walker, float(moving.attrs["slope_rad"]))


ATTRACTOR_COLUMNS = (
    Column("period (steps)", "period", whole, numeric=True),
    Column("cells", "cells", whole, numeric=True),
    Column("steps to reach it, median", "median_steps_to_settle", lambda steps: number(steps, 3), numeric=True),
)


def basin(results: Results) -> Section | None:
    """What the basin came to; None if it was not asked for."""
    summary = results.summary("basin")
    if summary is None:
        return None
    blocks: list[PageBlock] = [shares(summary), *(Paragraph(said) for said in grounds(summary))]
    if summary["attractors"]:
        blocks.append(attractors(summary))
    return Section("basin", "Basins of attraction", tuple(blocks))


def shares(summary: Mapping[str, Any]) -> Paragraph:
    """The share of starts that walk, which depends on the window, and what does not depend on it."""
    window = [f"{name} from {number(low, 4)} to {number(high, 4)}" for name, (low, high) in summary["window"].items()]
    ends = [f"{many:,} {name}" for name, many in summary["outcomes"].items()]
    return Paragraph(words("basin.shares", summary, window, ends))


def grounds(summary: Mapping[str, Any]) -> list[str]:
    """What of the ground ended walks, and whether walks end alike at tighter tolerances."""
    told = [str(one["said"]) for one in summary.get("endings", ()) if one["ground"]]
    error = summary.get("numerical_error")
    return told if error is None else [*told, error_of_sample(error, "starts")]


def attractors(summary: Mapping[str, Any]) -> Table:
    """What walks settle on."""
    return table("Attractors", ATTRACTOR_COLUMNS, summary["attractors"], note=words("basin.unsettled", summary))
