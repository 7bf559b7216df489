"""What the stage `continuation` stores and prints of the families that it followed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from walkerlab.config.continuation import Continuation, Span
from walkerlab.orbits.attractors import Attractors, feigenbaum_ratios
from walkerlab.orbits.bifurcation_curves import BifurcationCurve
from walkerlab.orbits.families import Branch, strike_to_strike
from walkerlab.orbits.regions import Regions
from walkerlab.orbits.step_maps import Cycle, Monitor
from walkerlab.scene.parameter import Parameter
from walkerlab.store.content import Attribute, Group, Variable

if TYPE_CHECKING:
    from walkerlab.stages.continuation import Followed

POINT, STEP = ("point",), ("point", "step")


def summary(found: Sequence[Followed], parameter: Parameter, asked: Continuation) -> dict[str, Any]:
    """What the command prints; values are in the unit of the key that was asked for."""
    return {
        "over": parameter.key,
        "unit": parameter.unit,
        "from": asked.least,
        "to": asked.most,
        "branches": [branch_summary(one.model, branch) for one in found for branch in one.branches],
        "bifurcations": [row for one in found for row in bifurcation_rows(one)],
        "lyapunov": [
            {"model": one.model, "value": e.value, "exponent": e.exponent, "uncertainty": e.uncertainty}
            for one in found
            for e in one.exponents
        ],
        "cascades": [row for one in found for row in cascade_rows(one)],
        "limits": [row for one in found for row in limit_rows(one)],
        "attractors": [attractor_summary(one.model, one.attractors) for one in found if one.attractors.found],
        "curves": [row for one in found for row in curve_rows(one)],
        "regions": [row for one in found for row in region_rows(one)],
    }


def branch_summary(model: str, branch: Branch) -> dict[str, Any]:
    """One branch: between which values, how far it is stable, and why it ends."""
    ranges = branch.stable_ranges
    widest = max(ranges, key=lambda pair: pair[1] - pair[0], default=None)
    return {
        "model": model,
        "period": branch.period,
        "from": branch.ends[0].value,
        "to": branch.ends[1].value,
        "points": len(branch.points),
        "stable_range": None if widest is None else list(widest),
        "stable_ranges": [list(pair) for pair in ranges],
        "ends": [{"value": end.value, "reason": end.reason} for end in branch.ends],
    }


def bifurcation_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """The bifurcations of a model, branch by branch."""
    for number, branch in enumerate(followed.branches):
        for one in branch.bifurcations:
            yield {
                "kind": one.kind,
                "period": branch.period,
                "value": one.value,
                "multiplier": [one.multiplier.real, one.multiplier.imag],
                "model": followed.model,
                "branch": number,
            }


def limit_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Where assumptions of a model cease to hold."""
    for branch in followed.branches:
        for crossing in branch.crossings:
            yield {
                "model": followed.model,
                "period": branch.period,
                "value": crossing.value,
                "what": crossing.monitor.meaning,
                "limit": crossing.monitor.limit,
            }


def cascade_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Chains of branches, each born in a flip of the one before, with the ratios of their flips' distances."""
    for first in followed.branches:
        if first.ends[0].reason.startswith("flip"):
            continue
        flips = chain(first, followed.branches)
        if len(flips) > 1:
            ratios = feigenbaum_ratios(flips)
            ends = {"accumulates_at": flips[-1] + (flips[-1] - flips[-2]) / (ratios[-1] - 1.0)} if ratios else {}
            yield {"model": followed.model, "period": first.period, "flips": flips, "ratios": ratios, **ends}


def chain(branch: Branch, branches: Sequence[Branch]) -> list[float]:
    """Flips of a branch, of the branch born there, and so on, wherever a branch is stable before it."""
    flips = [one.value for one in branch.bifurcations if one.kind == "flip"]
    for flip in flips:
        for child in branches:
            if child.period == 2 * branch.period and child.ends[0].value == flip:
                return [flip, *chain(child, branches)]
    return flips[:1]


def attractor_summary(model: str, attractors: Attractors) -> dict[str, Any]:
    """Over which values the attractor was followed, and what became of it."""
    aperiodic = [one.value for one in attractors.found if one.period == 0]
    return {
        "model": model,
        "from": attractors.found[0].value,
        "to": attractors.found[-1].value,
        "aperiodic_from": min(aperiodic, default=None),
        "lost_at": attractors.lost_at,
        "ended": attractors.reason,
        "periods": sorted({one.period for one in attractors.found}),
    }


def curve_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Curves of bifurcations over the plane: where they begin and end, and why."""
    for curve in followed.curves:
        yield {
            "model": followed.model,
            "kind": curve.kind,
            "period": curve.period,
            "points": int(curve.first.size),
            "begins": [float(curve.first[0]), float(curve.second[0])],
            "ends": [float(curve.first[-1]), float(curve.second[-1])],
            "reasons": [end.reason for end in curve.ends],
        }


def curve_group(curve: BifurcationCurve, parameter: Parameter, second: Span) -> Group:
    """A curve over the plane of both parameters."""
    along = ("point",)
    return Group(
        {
            "value": Variable(curve.first, along, parameter.unit, parameter.key),
            "second": Variable(curve.second, along, "1", second.over),
        },
        {"kind": curve.kind, "period": curve.period},
    )


def curve_overview(rows: Sequence[dict[str, Any]]) -> Group:
    """Every curve of every model in a row."""
    along = ("curve",)
    return Group(
        {
            "model": Variable(np.array([row["model"] for row in rows]), along, "", "model"),
            "kind": Variable(np.array([row["kind"] for row in rows]), along, "", "fold or flip"),
            "period": Variable(np.array([row["period"] for row in rows]), along, "1", "steps of the gait"),
        }
    )


def regions_group(regions: Regions, parameter: Parameter, second: Span) -> Group:
    """What walks settle on over the plane of both parameters."""
    periods = "steps after which walks repeat themselves; 0: never, -1: none goes on"
    return Group(
        {
            "value": Variable(regions.first, ("first",), parameter.unit, parameter.key),
            "second": Variable(regions.second, ("second",), "1", second.over),
            "period": Variable(regions.period, ("first", "second"), "1", periods),
        }
    )


def region_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Which share of the plane each kind of attractor has."""
    if followed.regions is not None:
        periods, counts = np.unique(followed.regions.period, return_counts=True)
        for period, cells in zip(periods, counts, strict=True):
            yield {"model": followed.model, "period": int(period), "share": float(cells / followed.regions.period.size)}


def groups(found: Sequence[Followed], parameter: Parameter, block: Continuation) -> dict[str, Group]:
    """One group a branch and a curve, and one for bifurcations, exponents and attractor of each model."""
    branches = [branch_summary(one.model, branch) for one in found for branch in one.branches]
    stored: dict[str, Group] = {"branches": overview(branches, parameter)} if branches else {}
    curves = [row for one in found for row in curve_rows(one)]
    if curves:
        stored["curves"] = curve_overview(curves)
    for one in found:
        if one.step_map is None:
            continue
        if block.second is not None:
            for number, curve in enumerate(one.curves):
                stored[f"{one.model}/curve_{number}"] = curve_group(curve, parameter, block.second)
            if one.regions is not None:
                stored[f"{one.model}/regions"] = regions_group(one.regions, parameter, block.second)
        for number, branch in enumerate(one.branches):
            marks = [*birth_of(branch, one.branches), *marks_on(branch)]
            stored[f"{one.model}/branch_{number}"] = branch_group(branch, marks, one.step_map.monitors, parameter)
        rows = list(bifurcation_rows(one))
        if rows:
            stored[f"{one.model}/bifurcations"] = bifurcation_group(rows, parameter)
        if one.exponents:
            stored[f"{one.model}/lyapunov"] = lyapunov_group(one, parameter)
        if one.attractors.found:
            stored[f"{one.model}/attractor"] = attractor_group(one.attractors, parameter)
    return stored


def overview(rows: Sequence[dict[str, Any]], parameter: Parameter) -> Group:
    """Every branch of every model in a row."""
    along = ("branch",)
    return Group(
        {
            "model": Variable(np.array([row["model"] for row in rows]), along, "", "model"),
            "period": Variable(np.array([row["period"] for row in rows]), along, "1", "steps of the gait"),
            "from": Variable(np.array([row["from"] for row in rows]), along, parameter.unit, "where it begins"),
            "to": Variable(np.array([row["to"] for row in rows]), along, parameter.unit, "where it ends"),
        },
        {"over": parameter.key},
    )


class Mark(NamedTuple):
    """A bifurcation among the points of a branch: after which point, and the steps of the gait there."""

    after: int
    kind: str
    value: float
    cycle: Cycle


def marks_on(branch: Branch) -> list[Mark]:
    """The bifurcations of a branch in their order along it."""
    found = []
    for one, segment in branch.segments:
        ends = (segment.first.x, segment.second.x)
        for index, pair in enumerate(pairwise(branch.points)):
            if all(any(np.array_equal(point.solved.x, end) for end in ends) for point in pair):
                found.append(Mark(index, one.kind, one.value, one.point.evaluated.data))
    return sorted(found, key=lambda mark: mark.after)


def birth_of(branch: Branch, branches: Sequence[Branch]) -> list[Mark]:
    """The flip that a branch begins at: its parent's gait, twice."""
    for parent in branches:
        for one in parent.bifurcations:
            if one.kind == "flip" and 2 * parent.period == branch.period and one.value == branch.ends[0].value:
                cycle = one.point.evaluated.data
                return [Mark(-1, one.kind, one.value, replace(cycle, steps=(*cycle.steps, *cycle.steps)))]
    return []


def mark_variables(marks: Sequence[Mark], parameter: Parameter) -> dict[str, Variable]:
    """Where on a branch its bifurcations are."""
    along, steps = ("mark",), ("mark", "step")
    periods = np.array([strike_to_strike(mark.cycle) for mark in marks])
    angles = np.array([[step.angle for step in mark.cycle.steps] for mark in marks])
    return {
        "mark_after": Variable(np.array([m.after for m in marks]), along, "1", "point before a bifurcation; -1: none"),
        "mark_kind": Variable(np.array([m.kind for m in marks]), along, "", "fold, flip or torus"),
        "mark_value": Variable(np.array([m.value for m in marks]), along, parameter.unit, "where it is"),
        "mark_step_period": Variable(periods, steps, "s", "durations of the steps there"),
        "mark_stance_angle": Variable(angles, steps, "rad", "stance leg just after each heel strike there"),
    }


def branch_group(branch: Branch, marks: Sequence[Mark], monitors: Sequence[Monitor], parameter: Parameter) -> Group:
    """The gaits of a branch in their order along it."""
    points = branch.points
    multipliers = np.array([point.multipliers for point in points])
    variables = {
        "value": Variable(branch.values, POINT, parameter.unit, parameter.key),
        "stable": Variable(np.array([point.stable for point in points]), POINT, "1", "whether disturbances die out"),
        "step_period": Variable(np.array([p.periods_s for p in points]), STEP, "s", "durations of the steps"),
        "step_length": Variable(np.array([p.lengths_m for p in points]), STEP, "m", "lengths of the steps"),
        "stance_angle": Variable(
            np.array([p.angles for p in points]), STEP, "rad", "stance leg just after each heel strike"
        ),
        "section": Variable(np.array([p.z for p in points]), ("point", "coordinate"), "1", "section coordinates"),
        "multiplier_real": Variable(multipliers.real, ("point", "multiplier"), "1", "multiplier, real part"),
        "multiplier_imag": Variable(multipliers.imag, ("point", "multiplier"), "1", "multiplier, imaginary part"),
    }
    for column, monitor in enumerate(monitors):
        values = np.array([point.monitors[column] for point in points])
        variables[monitor.name] = Variable(values, POINT, monitor.unit, monitor.meaning)
    if marks:
        variables |= mark_variables(marks, parameter)
    attrs: dict[str, Attribute] = {
        "period": branch.period,
        "begins": branch.ends[0].reason,
        "ends": branch.ends[1].reason,
    }
    return Group(variables, attrs)


def bifurcation_group(rows: Sequence[dict[str, Any]], parameter: Parameter) -> Group:
    """The bifurcations of a model."""
    along = ("bifurcation",)
    multipliers = np.array([row["multiplier"] for row in rows])
    return Group(
        {
            "kind": Variable(np.array([row["kind"] for row in rows]), along, "", "fold, flip or torus"),
            "period": Variable(np.array([row["period"] for row in rows]), along, "1", "steps of the gait"),
            "branch": Variable(np.array([row["branch"] for row in rows]), along, "1", "number of the branch"),
            "value": Variable(np.array([row["value"] for row in rows]), along, parameter.unit, parameter.key),
            "multiplier_real": Variable(multipliers[:, 0], along, "1", "critical multiplier, real part"),
            "multiplier_imag": Variable(multipliers[:, 1], along, "1", "critical multiplier, imaginary part"),
        }
    )


def lyapunov_group(followed: Followed, parameter: Parameter) -> Group:
    """The largest Lyapunov exponent over the parameter."""
    rows, along = followed.exponents, ("sample",)
    return Group(
        {
            "value": Variable(np.array([one.value for one in rows]), along, parameter.unit, parameter.key),
            "exponent": Variable(np.array([one.exponent for one in rows]), along, "1", "largest exponent per step"),
            "uncertainty": Variable(np.array([one.uncertainty for one in rows]), along, "1", "its standard error"),
        }
    )


def attractor_group(attractors: Attractors, parameter: Parameter) -> Group:
    """Steps on the attractor over the parameter."""
    rows, along = attractors.found, ("sample", "visit")
    return Group(
        {
            "value": Variable(np.array([one.value for one in rows]), ("sample",), parameter.unit, parameter.key),
            "period": Variable(
                np.array([one.period for one in rows]), ("sample",), "1", "steps after which it repeats; 0: never"
            ),
            "step_period": Variable(np.array([one.periods_s for one in rows]), along, "s", "durations of steps on it"),
            "stance_angle": Variable(
                np.array([one.angles for one in rows]), along, "rad", "stance leg just after each heel strike"
            ),
        }
    )
