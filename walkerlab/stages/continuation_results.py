"""What the stage `continuation` follows, what of it is stored and printed, and how some of its gaits move."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np

from walkerlab.config.continuation import Continuation, Span
from walkerlab.config.reads import ContactConfig
from walkerlab.config.schema import Output
from walkerlab.hybrid.recorded_walk import Samples
from walkerlab.labels import Label
from walkerlab.mechanics.rigid import knee_of
from walkerlab.orbits.attractors import AttractorBranch, Lyapunov, feigenbaum_ratios, may_part
from walkerlab.orbits.bifurcations import Bifurcation
from walkerlab.orbits.families import Crossing, GaitBranch, GaitPoint, ends_at, steps_word, strike_to_strike
from walkerlab.orbits.plane import BifurcationCurve, Regions
from walkerlab.orbits.shooting import on_section
from walkerlab.orbits.similarity import unit_walker
from walkerlab.orbits.step_map import IteratedMap, Monitor, StepMap
from walkerlab.scene.endings import WHAT, causes, without_pads
from walkerlab.scene.parameter import Parameter
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import RigidScene, coordinates, rigid_walker
from walkerlab.solvers.registry import ENDLESS, Tolerances
from walkerlab.stages.numerical_error import OF_EACH_STEP, SAMPLE, USUAL, evenly_spread, tightened
from walkerlab.stages.simulate import trajectory_group
from walkerlab.store.columns import columns, labelled, real_and_imaginary
from walkerlab.store.content import Attribute, Group, Variable

MOTIONS_OF_BRANCH, LONGEST = 12, 4  # gaits of one branch, and steps of a gait, that are walked
STRIDE = 2  # steps, after which each leg is where it was
TOLERANCES = Tolerances("dop853", 1e-9, 1e-11, ENDLESS)
ALL_OUTPUTS: Final[tuple[Output, ...]] = ("states", "energies", "forces")
EVERY = 3  # which samples are kept beside those at heel strikes

MODEL, KIND = Label("", "model"), Label("", "fold, flip or torus")
PERIOD = Label("1", "steps of the gait")
STANCE = Label("rad", "stance leg just after each heel strike", name="stance_angle")
CURVES = {"model": MODEL, "kind": Label("", "fold or flip"), "period": PERIOD}
BIFURCATIONS = {"kind": KIND, "period": PERIOD, "branch": Label("1", "number of the branch")}
EXPONENTS = {"exponent": Label("1", "largest exponent per step"), "uncertainty": Label("1", "its standard error")}
POINTS = {
    "stable": Label("1", "whether disturbances die out"),
    "periods_s": Label("s", "durations of the steps", ("step",), name="step_period"),
    "lengths_m": Label("m", "lengths of the steps", ("step",), name="step_length"),
    "angles": replace(STANCE, dims=("step",)),
    "z": Label("1", "section coordinates", ("coordinate",), name="section"),
}
ATTRACTORS = {
    "period": Label("1", "steps after which it repeats; 0: never"),
    "periods_s": Label("s", "durations of steps on it", ("visit",), name="step_period"),
    "angles": replace(STANCE, dims=("visit",)),
}


NO_ATTRACTORS = AttractorBranch()


@dataclass(frozen=True, eq=False)
class Followed:
    """What was found of one model; no map if there was no gait to begin from.

    map_of   the step map over the parameter of another config
    curves   of bifurcations, over the plane of two parameters
    regions  of that plane, by what walks settle on
    """

    model: str
    step_map: StepMap | None
    branches: tuple[GaitBranch, ...]
    map_of: Callable[[ContactConfig], StepMap] | None = None
    attractors: AttractorBranch = NO_ATTRACTORS
    exponents: tuple[Lyapunov, ...] = ()
    curves: tuple[BifurcationCurve, ...] = ()
    regions: Regions | None = None


def summary(
    found: Sequence[Followed], parameter: Parameter, asked: Continuation, config: ContactConfig
) -> dict[str, Any]:
    """What the command prints; values are in the unit of the key that was asked for."""
    return {
        "over": parameter.key,
        "unit": parameter.unit,
        "from": asked.least,
        "to": asked.most,
        "branches": [branch_summary(one.model, branch) for one in found for branch in one.branches],
        "bifurcations": [row for one in found for row in bifurcation_rows(one)],
        "first_doubling": {one.model: flip for one in found if (flip := first_doubling(one.branches)) is not None},
        "lyapunov": [{"model": one.model, **asdict(exponent)} for one in found for exponent in one.exponents],
        "cascades": [row for one in found for row in cascade_rows(one)],
        "limits": [row for one in found for row in limit_rows(one)],
        "numerical_error": {one.model: error for one in found if (error := sample_again(one)) is not None},
        "endings": [row for one in found for row in ending_rows(one, parameter, config)],
        "attractors": [attractor_summary(one) for one in found if one.attractors.found],
        "curves": [row for one in found for row in curve_rows(one)],
        "regions": [row for one in found for row in region_rows(one)],
    }


def branch_summary(model: str, branch: GaitBranch) -> dict[str, Any]:
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


def first_doubling(branches: Sequence[GaitBranch]) -> float | None:
    """The least flip at which a gait of one step ceases to be stable; None if there is none.

    branches  of one model; one that is unstable on both sides of a flip does not count
    """
    flips = [
        one.value
        for branch in branches
        if branch.period == 1
        for one in branch.bifurcations
        if one.kind == "flip" and any(math.isclose(one.value, end) for pair in branch.stable_ranges for end in pair)
    ]
    return min(flips, default=None)


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


def sample_again(followed: Followed) -> dict[str, Any] | None:
    """What tighter tolerances change in the steps of some gaits, spread evenly over all branches; None without any."""
    step_map, every = followed.step_map, [(branch, point) for branch in followed.branches for point in branch.points]
    if step_map is None or not every:
        return None
    tighter, by = tightened(step_map.tolerances)
    again = [
        (point, step_map.timed(point.z, point.value, branch.period, tighter))
        for branch, point in (every[place] for place in evenly_spread(len(every), SAMPLE))
    ]
    changes = [
        (np.max(np.abs(found[0] - point.periods_s)), np.max(np.abs(found[1] - point.lengths_m)))
        for point, found in again
        if found is not None
    ]
    counts = {"walked_again": len(again), "of": len(every), "ended_otherwise": len(again) - len(changes)}
    largest = dict(zip(OF_EACH_STEP, np.max(changes, axis=0).tolist(), strict=True)) if changes else {}
    return {**counts, **largest, **({} if by == USUAL else {"by": by})}


def ending_rows(followed: Followed, parameter: Parameter, config: ContactConfig) -> Iterator[dict[str, Any]]:
    """What ends walks along the branches, and what the ground has to do with it, in words: `said`."""
    for branch in followed.branches:
        gait = f"the {followed.model} model's gait of {branch.period} {steps_word(branch.period)}"
        for end in branch.ends:
            outcome = end.reason.partition(":")[0]
            if outcome in WHAT:
                why = causes(outcome, config, followed.model == "contact")
                said = f"At {end.value:.5g} {parameter.unit} {gait} ends ({end.reason})."
                yield ending_row(followed.model, branch.period, end.value, outcome, " ".join([said, *why]))
        for crossing in branch.crossings:
            if crossing.monitor.name == "tripped":
                side = side_beyond(branch, crossing, followed.step_map)
                said = (
                    f"{side} about {crossing.value:.2g} {parameter.unit} {gait} trips over pads of its own step "
                    f"length: the pads end walks there, not the gait. Try {without_pads(config)}."
                )
                yield ending_row(followed.model, branch.period, crossing.value, "off-pad", said)


def side_beyond(branch: GaitBranch, crossing: Crossing, step_map: StepMap | None) -> str:
    """On which side of a crossing what is watched is beyond its limit, as its neighbour there has it."""
    assert step_map is not None, "a branch is followed with one"
    place, limit = list(step_map.monitors).index(crossing.monitor), crossing.monitor.limit
    nearest = min(branch.points, key=lambda point: abs(point.value - crossing.value))
    beyond = limit is not None and nearest.monitors[place] > limit
    return "Above" if beyond == (nearest.value > crossing.value) else "Below"


def ending_row(model: str, period: int, value: float, outcome: str, said: str) -> dict[str, Any]:
    """What ends walks at one value."""
    return {"model": model, "period": period, "value": value, "outcome": outcome, "said": said}


def cascade_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Chains of branches, each born in a flip of the one before, with the ratios of their flips' distances."""
    for first in followed.branches:
        if any(is_born_in(first, flip, other) for other in followed.branches for flip in other.bifurcations):
            continue
        flips = chain(first, followed.branches)
        if len(flips) > 1:
            ratios = feigenbaum_ratios(flips)
            ends = {"accumulates_at": flips[-1] + (flips[-1] - flips[-2]) / (ratios[-1] - 1.0)} if ratios else {}
            yield {"model": followed.model, "period": first.period, "flips": flips, "ratios": ratios, **ends}


def chain(branch: GaitBranch, branches: Sequence[GaitBranch]) -> list[float]:
    """Flips of a branch, of the branch born there, and so on, wherever a branch is stable before it."""
    flips = [one for one in branch.bifurcations if one.kind == "flip"]
    for flip in flips:
        for child in branches:
            if is_born_in(child, flip, branch):
                return [flip.value, *chain(child, branches)]
    return [flip.value for flip in flips[:1]]


def is_born_in(child: GaitBranch, flip: Bifurcation, parent: GaitBranch) -> bool:
    """Whether a branch begins at a flip of another one, at either of its ends."""
    if flip.kind != "flip" or child.period != 2 * parent.period:
        return False
    return child.ends[0].value == flip.value or ends_at(child, flip, child.period)


def attractor_summary(followed: Followed) -> dict[str, Any]:
    """Over which values the attractor was followed, and what became of it.

    Just beyond a flip walks leave the gait slowly: what has not repeated itself by then counts as aperiodic only where
    neighbours may part, and neither a gait that was followed is stable nor a cascade still doubles.
    """
    attractors, exponents = followed.attractors, followed.exponents
    periodic = [pair for branch in followed.branches for pair in branch.stable_ranges]
    periodic += [(row["flips"][0], row["accumulates_at"]) for row in cascade_rows(followed) if "accumulates_at" in row]
    aperiodic = [
        one.value
        for one in attractors.found
        if one.period == 0
        and may_part(exponents, one.value)
        and not any(min(pair) <= one.value <= max(pair) for pair in periodic)
    ]
    return {
        "model": followed.model,
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
        stored["curves"] = Group(columns(curves, CURVES, "curve"))
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
            stored[f"{one.model}/lyapunov"] = Group(columns(one.exponents, value_of(parameter) | EXPONENTS, "sample"))
        if one.attractors.found:
            found_on = columns(one.attractors.found, value_of(parameter) | ATTRACTORS, "sample")
            stored[f"{one.model}/attractor"] = Group(found_on)
    return stored


def overview(rows: Sequence[dict[str, Any]], parameter: Parameter) -> Group:
    """Every branch of every model in a row."""
    ends = {"from": Label(parameter.unit, "where it begins"), "to": Label(parameter.unit, "where it ends")}
    return Group(columns(rows, {"model": MODEL, "period": PERIOD, **ends}, "branch"), {"over": parameter.key})


def value_of(parameter: Parameter) -> dict[str, Label]:
    """The column of the parameter's values."""
    return {"value": Label(parameter.unit, parameter.key)}


class Mark(NamedTuple):
    """A bifurcation among the points of a branch: after which point, and the steps of the gait there."""

    after: int
    kind: str
    value: float
    cycle: IteratedMap


def marks_on(branch: GaitBranch) -> list[Mark]:
    """The bifurcations of a branch in their order along it."""
    found = []
    for one, segment in branch.segments:
        ends = (segment.first.x, segment.second.x)
        for index, pair in enumerate(pairwise(branch.points)):
            if all(any(np.array_equal(point.solved.x, end) for end in ends) for point in pair):
                found.append(Mark(index, one.kind, one.value, one.point.evaluated.data))
    return sorted(found, key=lambda mark: mark.after)


def birth_of(branch: GaitBranch, branches: Sequence[GaitBranch]) -> list[Mark]:
    """The flip that a branch begins at: its parent's gait, twice."""
    for parent in branches:
        for one in parent.bifurcations:
            if one.kind == "flip" and 2 * parent.period == branch.period and one.value == branch.ends[0].value:
                cycle = one.point.evaluated.data
                return [Mark(-1, one.kind, one.value, replace(cycle, steps=(*cycle.steps, *cycle.steps)))]
    return []


def mark_variables(marks: Sequence[Mark], parameter: Parameter) -> dict[str, Variable]:
    """Where on a branch its bifurcations are."""
    steps = ("mark", "step")
    periods = np.array([strike_to_strike(mark.cycle) for mark in marks])
    angles = np.array([[step.angle for step in mark.cycle.steps] for mark in marks])
    labels = {
        "after": Label("1", "point before a bifurcation; -1: none", name="mark_after"),
        "kind": replace(KIND, name="mark_kind"),
        "value": Label(parameter.unit, "where it is", name="mark_value"),
    }
    return {
        **columns(marks, labels, "mark"),
        "mark_step_period": Variable(periods, steps, "s", "durations of the steps there"),
        "mark_stance_angle": Variable(angles, steps, "rad", "stance leg just after each heel strike there"),
    }


def branch_group(branch: GaitBranch, marks: Sequence[Mark], monitors: Sequence[Monitor], parameter: Parameter) -> Group:
    """The gaits of a branch in their order along it."""
    points = branch.points
    multipliers = [point.multipliers for point in points]
    variables = {
        **columns(points, value_of(parameter) | POINTS, "point"),
        **real_and_imaginary("multiplier", multipliers, ("point", "multiplier"), "multiplier"),
    }
    for place, monitor in enumerate(monitors):
        label = Label(monitor.unit, monitor.meaning)
        variables[monitor.name] = labelled([point.monitors[place] for point in points], label, "point")
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
    multipliers = [complex(*row["multiplier"]) for row in rows]
    along = "bifurcation"
    return Group(
        {
            **columns(rows, value_of(parameter) | BIFURCATIONS, along),
            **real_and_imaginary("multiplier", multipliers, (along,), "critical multiplier"),
        }
    )


def motions(branches: Sequence[GaitBranch], config: ContactConfig, parameter: Parameter) -> dict[str, Group]:
    """Some gaits of each branch of the rigid model, walking, by branch and point: branch_0/motion_7."""
    return {
        f"branch_{number}/motion_{place}": group
        for number, branch in enumerate(branches)
        if branch.period <= LONGEST
        for place in evenly_spread(len(branch.points), MOTIONS_OF_BRANCH)
        for group in motion(branch.points[place], branch.period, config, parameter)
    }


def motion(point: GaitPoint, period: int, config: ContactConfig, parameter: Parameter) -> Iterator[Group]:
    """A gait walking, as `simulate` stores a walk; nothing where the config refuses the value."""
    changed = parameter.config_at(config, point.value)
    if changed is None:
        return
    walker = rigid_walker(changed, changed.equations)
    unit, units = unit_walker(walker)
    section, n = on_section(unit, point.z), len(walker.arm_x)
    start = (*section[:n], *(rate / units.time for rate in section[n:]))
    steps = max(period, STRIDE)
    knee = knee_of(assembly_of(changed.walker, rigid=True))
    scene = RigidScene(walker, TOLERANCES, coordinates(changed), knee, ALL_OUTPUTS)
    walk = scene.walk(start, steps, TOLERANCES, sampled=True)
    if walk.steps < steps or walk.samples is None:
        return
    seen = trajectory_group(scene, walk, thinned(walk.samples))
    yield replace(seen, attrs={"value": point.value, "slope_rad": changed.slope_rad, "steps": period})


def thinned(samples: Samples) -> Samples:
    """Every third sample, and both sides of every heel strike."""
    changes = np.flatnonzero(np.diff(samples.step))
    kept = np.unique(np.concatenate((np.arange(0, samples.time_s.size, EVERY), changes, changes + 1)))
    return Samples(samples.time_s[kept], samples.state[kept], samples.step[kept], samples.bent[kept])
