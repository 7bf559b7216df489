"""Build the groups in which families of gaits are stored: branches, bifurcations, attractors, curves and sampled
walks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np

from walkerlab.config import contact, reads, schema
from walkerlab.labels import Label
from walkerlab.physics.orbits import family_search, rigid_map, similarity, step_map, two_parameters
from walkerlab.physics.orbits.families import GaitBranch
from walkerlab.physics.solvers import registry, system
from walkerlab.pipeline.stages.rigid_groups import trajectory_group
from walkerlab.pipeline.stages.walk import STRIDE, evenly_spread, select_samples
from walkerlab.pipeline.store.content import Group, Variable, columns, labelled, real_and_imaginary
from walkerlab.scene.parameter import Parameter
from walkerlab.scene.rigid import rigid_scene

MOTIONS_OF_BRANCH = 12  # maximum number of gaits per branch whose walks are stored
MAX_MOTION_PERIOD = 4  # the walks of gaits with longer periods (steps) are not stored
TOLERANCES = registry.Tolerances("dop853", 1e-9, 1e-11, registry.ENDLESS)
ALL_OUTPUTS: Final[tuple[schema.Output, ...]] = ("states", "energies", "forces")
SAMPLE_STRIDE = 3  # of the samples between heel strikes, every third is stored

MODEL = Label("", "model")
KIND = Label("", "fold, flip or torus")
PERIOD = Label("1", "steps of the gait")
STANCE = Label("rad", "angle of the stance leg just after each heel strike", name="stance_angle")
CURVES = {"model": MODEL, "kind": Label("", "fold or flip"), "period": PERIOD}
BIFURCATIONS = {"kind": KIND, "period": PERIOD, "branch": Label("1", "number of the branch")}
EXPONENTS = {"exponent": Label("1", "largest Lyapunov exponent per step"), "uncertainty": Label("1", "standard error")}
POINTS = {
    "stable": Label("1", "whether disturbances die out"),
    "periods_s": Label("s", "durations of the steps", ("step",), name="step_period"),
    "lengths_m": Label("m", "lengths of the steps", ("step",), name="step_length"),
    "angles": replace(STANCE, dims=("step",)),
    "z": Label("1", "section coordinates", ("coordinate",), name="section"),
}
ATTRACTORS = {
    "period": Label("1", "steps after which the attractor repeats; 0: never"),
    "periods_s": Label("s", "durations of steps on the attractor", ("visit",), name="step_period"),
    "angles": replace(STANCE, dims=("visit",)),
}
PERIOD_TEXT: Final = "steps after which walks repeat themselves; 0: never, -1: no walk continues"
MARKS = {
    "after": Label("1", "index of the point before the bifurcation; -1: none", name="mark_after"),
    "kind": replace(KIND, name="mark_kind"),
    "periods": Label("s", "step durations of the gait at the bifurcation", ("step",), name="mark_step_period"),
    "angles": Label("rad", "stance leg angles of the gait at the bifurcation", ("step",), name="mark_stance_angle"),
}


def groups(
    families: Sequence[family_search.Family], answer: Mapping[str, Any], config: reads.ContactConfig,
    parameter: Parameter, second: Parameter | None,
) -> dict[str, Group]:  # fmt: skip
    """Build a group for each branch and curve, and for the bifurcations, exponents and attractor of each model.

    answer  summary of the stage, whose branches, bifurcations and curves are also stored as tables
    second  second parameter, if gaits are followed over a plane
    """
    value = {"value": Label(parameter.unit, parameter.key)}
    stored: dict[str, Group] = {}

    def coordinates(plane: two_parameters.BifurcationCurve | two_parameters.Regions, *dims: str) -> dict[str, Variable]:
        """Return the coordinates of both parameters."""
        axes = zip(("value", "second"), (plane.first, plane.second), (parameter, second), dims, strict=True)
        return {
            name: labelled(values, Label(family.unit, family.key), dim) for name, values, family, dim in axes if family
        }

    if answer["branches"]:
        ends = {"from": Label(parameter.unit, "start of the branch"), "to": Label(parameter.unit, "end of the branch")}
        overview = columns(answer["branches"], {"model": MODEL, "period": PERIOD, **ends}, "branch")
        stored["branches"] = Group(overview, {"over": parameter.key})
    if answer["curves"]:
        stored["curves"] = Group(columns(answer["curves"], CURVES, "curve"))
    for family in families:
        if family.step_map is None:
            continue
        own: dict[str, Group] = {}
        for number, curve in enumerate(family.curves):
            about = {"kind": curve.kind, "period": curve.period}
            own[f"curve_{number}"] = Group(coordinates(curve, "point", "point"), about)
        if family.regions is not None:
            periods = Variable(family.regions.period, ("first", "second"), "1", PERIOD_TEXT)
            own["regions"] = Group({**coordinates(family.regions, "first", "second"), "period": periods})
        for number, branch in enumerate(family.branches):
            marks = [*birth_of(branch, family.branches), *marks_on(branch)]
            own[f"branch_{number}"] = branch_group(branch, marks, family.step_map.monitors, value)
        rows = [row for row in answer["bifurcations"] if row["model"] == family.model]
        if rows:
            multipliers = [complex(*row["multiplier"]) for row in rows]
            both = real_and_imaginary("multiplier", multipliers, ("bifurcation",), "critical multiplier")
            own["bifurcations"] = Group({**columns(rows, value | BIFURCATIONS, "bifurcation"), **both})
        if family.exponents:
            own["lyapunov"] = Group(columns(family.exponents, value | EXPONENTS, "sample"))
        if family.attractors.found:
            own["attractor"] = Group(columns(family.attractors.found, value | ATTRACTORS, "sample"))
        if family.model == family_search.RIGID:
            own |= motions(family.branches, config, parameter)
        stored |= {f"{family.model}/{name}": group for name, group in own.items()}
    return stored


class Mark(NamedTuple):
    """Bifurcation on a branch: the index of the last point before it, its kind and value, and the steps of its gait."""

    after: int
    kind: str
    value: float
    periods: system.Floats  # durations of the gait's steps (s)
    angles: system.Floats  # angle of the stance leg just after each heel strike of the gait (rad)


def marks_on(branch: GaitBranch) -> list[Mark]:
    """Return the bifurcations of a branch in order along the branch."""
    return [
        Mark(index, bifurcation.kind, bifurcation.value, bifurcation.gait.periods_s, bifurcation.gait.angles)
        for index, (before, after) in enumerate(pairwise(branch.points))
        for bifurcation in branch.bifurcations if bifurcation.lies_between(before, after)
    ]  # fmt: skip


def birth_of(branch: GaitBranch, branches: Sequence[GaitBranch]) -> list[Mark]:
    """Return the flip where a branch begins, in a list that is empty if it does not begin at a flip.

    The steps of the flip's gait are repeated, because gaits of the branch have twice as many.
    """
    for parent in branches:
        for flip in parent.bifurcations:
            if flip.kind == "flip" and 2 * parent.period == branch.period and flip.value == branch.ends[0].value:
                # A branch that was found from a seed may begin with another step of the gait than the branch from which
                # it splits.
                steps = [np.tile(values, 2) for values in (flip.gait.periods_s, flip.gait.angles)]
                first = branch.points[0].periods_s
                shift = min(range(parent.period), key=lambda k: float(np.abs(np.roll(steps[0], k) - first).max()))
                return [Mark(-1, flip.kind, flip.value, *(np.roll(values, shift) for values in steps))]
    return []


def branch_group(
    branch: GaitBranch, marks: Sequence[Mark], monitors: Sequence[step_map.Monitor], value: Mapping[str, Label]
) -> Group:
    """Build the group of a branch, with gaits and bifurcations in order.

    value  label of the parameter's values
    """
    points = branch.points
    multipliers = [point.multipliers for point in points]
    variables = {
        **columns(points, {**value, **POINTS}, "point"),
        **real_and_imaginary("multiplier", multipliers, ("point", "multiplier"), "multiplier"),
    }
    for index, monitor in enumerate(monitors):
        label = Label(monitor.unit, monitor.meaning)
        variables[monitor.name] = labelled([point.monitors[index] for point in points], label, "point")
    if marks:
        labels = MARKS | {"value": Label(value["value"].unit, "value at the bifurcation", name="mark_value")}
        variables |= columns(marks, labels, "mark")
    begin, end = branch.ends
    return Group(variables, {"period": branch.period, "begins": begin.reason, "ends": end.reason})


def motions(branches: Sequence[GaitBranch], config: reads.ContactConfig, parameter: Parameter) -> dict[str, Group]:
    """Build groups such as branch_0/motion_7, the sampled walks of a few gaits, evenly spread along each rigid
    branch."""
    return {
        f"branch_{number}/motion_{place}": group
        for number, branch in enumerate(branches)
        if branch.period <= MAX_MOTION_PERIOD
        for place in evenly_spread(len(branch.points), MOTIONS_OF_BRANCH)
        for group in motion(branch.points[place], branch.period, config, parameter)
    }


def motion(point: step_map.Cycle, period: int, config: reads.ContactConfig, parameter: Parameter) -> Iterator[Group]:
    """Simulate a gait and yield its samples in the layout of `simulate`, or nothing if the config rejects the value."""
    changed = parameter.config_at(config, point.value)
    if changed is None:
        return
    scene = rigid_scene(changed, contact.Footholds(), ALL_OUTPUTS)
    unit, units = similarity.unit_walker(scene.walker)
    # Points of a branch are states of a walker of unit size, so they are scaled to this walker.
    section = rigid_map.state_on_section(unit, point.z)
    n = len(scene.walker.arm_x)
    start = (*section[:n], *(rate / units.time for rate in section[n:]))
    steps = max(period, STRIDE)
    walk = scene.walk(start, steps, TOLERANCES, sampled=True)
    if walk.steps < steps or walk.samples is None:
        return
    changes = np.flatnonzero(np.diff(walk.samples.step))
    # Both sides of heel strikes are kept. Without them, the jumps of the velocities would be lost.
    selected = np.unique(np.concatenate((np.arange(0, walk.samples.time_s.size, SAMPLE_STRIDE), changes, changes + 1)))
    samples_group = trajectory_group(scene, walk, select_samples(walk.samples, selected))
    yield replace(samples_group, attrs={"value": point.value, "slope_rad": changed.slope_rad, "steps": period})
