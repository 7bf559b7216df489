"""Basins of attraction: the starts that lead to walking, the attractors that they reach, and the steps needed."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any, ClassVar

import numpy as np

from walkerlab.config import analyses, walkers
from walkerlab.config.reads import BasinConfig, RigidConfig
from walkerlab.errors import ConfigError
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid import recorded_walk, rigid_lanes
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits import basin as grid
from walkerlab.physics.orbits import rigid_map, scaled_starts, similarity
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.run.work import WorkUnit, complete
from walkerlab.pipeline.stages.walk import OUTCOMES, count_outcomes, evenly_spread, step_asymmetry, tightened
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.pipeline.store.files import Checkpoint
from walkerlab.scene import contact
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.walk_outcomes import Pads, describe_endings

HALF_WIDTH = (0.15, 0.25, 0.25)  # half width of the default window, rad and sqrt(g/L)
REPEATED_CELLS = 100  # number of cells whose walks are repeated to measure the numerical error
SEARCHED_STARTS = 4_000  # number of starts in the search for attractors
SIGMAS = 3.0  # distance from the centre of the window to its sides, in standard deviations of the Gaussian weights
FAILED = grid.UNREACHED - 1  # stands for a failed walk in an array of attractor indices
UNITS = ("rad", "rad/s", "rad/s")
TEXTS = ("angle of the stance leg", "angular velocity of the swing leg", "angular velocity of the stance leg")


def run(
    config: BasinConfig, inputs: Mapping[str, Content], progress: Progress, *, checkpoint: Checkpoint, jobs: int = 1
) -> Content:
    """Simulate walks from every cell that the checkpoint lacks, then from the subcells of cells at the basin's edge.

    checkpoint  cells that an earlier run completed
    jobs        maximum number of processes

    Raises ConfigError for the contact model without a contact block, NoAnswer if the pads need a contact gait and
    there is none.
    """
    gait = inputs["fixedpoint"].summary
    rigid = rigid_walker(config)
    if len(rigid.section_indices) != len(analyses.COORDINATES):
        raise ConfigError(
            f"basin needs a walker with {len(analyses.COORDINATES)} coordinates just after heel strike; this one has "
            f"{len(rigid.section_indices)}.",
            "Lock the knees at heel strike: --set walker.knee.at_heel_strike=locked.",
        )
    window = window_of(config, [float(gait["state"][place]) for place in rigid.section_indices])
    progress.start("basin: attractors")
    question = question_of(config, inputs, window, rigid)
    started_at = time.perf_counter()
    units = units_of("cells", range(window.size), question.cells_at_once, 1, partial(ends_of, question, window))
    parts, walks = complete(units, checkpoint, "basin", progress, jobs, question.shared_from)
    # Work units return floats, because a checkpoint can store only floats.
    ends = grid.WalkEnds(*np.concatenate([np.reshape(part, (3, -1)) for part in parts], axis=1).astype(np.int64))
    is_walking = ends.outcome == Outcome.WALKED
    # The edge also runs between walks that fail and walks that go on without reaching an attractor.
    edges = grid.edge_cells(np.where(is_walking, ends.attractor, FAILED).reshape(window.cells))
    walking = is_walking.astype(float)
    if config.basin.refine > 1 and edges.size:
        walks_of_cell = config.basin.refine ** len(window.axes)
        shares = partial(shares_of, question, window, config.basin.refine)
        units = units_of("edge", edges.tolist(), question.edges_at_once, walks_of_cell, shares)
        edge_shares, more = complete(units, checkpoint, "basin: edges", progress, jobs, question.shared_from)
        walking[edges], walks = np.concatenate(edge_shares), walks + more
    rate = {"trajectories_per_s": walks / (time.perf_counter() - started_at)} if walks else {}
    answer = summary(config.basin, window, ends, walking.reshape(window.cells), question)
    answer |= {
        "numerical_error": sample_again(question, window, ends),
        "endings": describe_endings(answer["outcomes"], config, config.basin.model == "contact", question.pads),
        "edge_cells": int(edges.size),
        **margin_of(config, window, ends, gait),
        **rate,
    }
    return Content({"basin": group_of(config.basin, window, ends, walking)}, answer, timed=("trajectories_per_s",))


def sample_again(question: "Question", window: grid.Window, ends: grid.WalkEnds) -> dict[str, int]:
    """Repeat the walks from some evenly spaced cells at tighter tolerances, and count those that end differently."""
    cells = np.array(evenly_spread(window.size, REPEATED_CELLS))
    tighter = question.tightened().walk_to_ends(window.starts(cells))
    otherwise = (tighter.outcome != ends.outcome[cells]) | (tighter.attractor != ends.attractor[cells])
    return {"walked_again": int(cells.size), "of": window.size, "ended_otherwise": int(np.count_nonzero(otherwise))}


def window_of(config: BasinConfig, z: list[float]) -> grid.Window:
    """Build the grid of starts around the section coordinates z (3) of the gait."""
    settings = config.basin
    axes = tuple(analyses.COORDINATES.index(name) for name in settings.plane)
    rate = math.sqrt(config.gravity_m_s2 / config.walker.leg_length_m)
    half = (HALF_WIDTH[0], HALF_WIDTH[1] * rate, HALF_WIDTH[2] * rate)
    lower = settings.lower or tuple(z[axis] - half[axis] for axis in axes)
    upper = settings.upper or tuple(z[axis] + half[axis] for axis in axes)
    if any(b <= a for a, b in zip(lower, upper, strict=True)):
        raise ConfigError("basin.lower is not below basin.upper.", "Give both bounds.")
    return grid.Window(axes, lower, upper, settings.cells, (z[0], z[1], z[2]))


def question_of(
    config: BasinConfig, inputs: Mapping[str, Content], window: grid.Window, rigid: RigidModel
) -> "Question":
    """Build the model whose walks are classified, and find its attractors."""
    if config.basin.model == "contact":
        return contact_question(config, inputs, rigid)
    unit, units = similarity.unit_walker(rigid)
    legs = rigid_lanes.two_legs(unit)
    walker = unit if legs is None else legs
    scale = (1.0, units.time, units.time)
    generator = np.random.default_rng(config.seed)
    starts = np.concatenate([np.array([window.rest]), window.draw(SEARCHED_STARTS, generator)])
    attractors = grid.find_attractors(walker, starts * np.array(scale), config.seed)
    question = RigidQuestion(rigid, walker, scale, attractors, config.basin.steps)
    one_by_one = replace(question, cells_at_once=500, edges_at_once=50, shared_from=10_000)
    return question if legs is not None else one_by_one


def contact_question(config: BasinConfig, inputs: Mapping[str, Content], rigid: RigidModel) -> "ContactQuestion":
    """Build the contact model whose walks are classified, with the tolerances that `tune` uses for its map."""
    if config.contact is None:
        raise walkers.contact_required_error("basin.model: contact", config.walker, "Add one.")

    gait = inputs["fixedpoint"].summary
    steps = config.basin.contact_steps
    step_length_m = float(gait["step_length_m"])
    state = recorded_walk.as_state(gait["state"])
    answer = contact.contact_gait(config, step_length_m, state)
    asymmetry = step_asymmetry(config, inputs)
    scene = replace(contact.scene_on_pads(config, step_length_m, state, answer, asymmetry), pinned=False)
    starts = contact.build_scaled_starts(scene, rigid, state, steps, answer, contact.tolerances_of(config, steps))
    pads = Pads((scene.pitch_m, scene.pitch_m), laid=str(config.contact.pad_pitch))
    return ContactQuestion(scene, rigid, contact.scale_for_map(starts, starts.walk(1.0, 1.0).evaluations), pads)


def group_of(settings: analyses.Basin, window: grid.Window, ends: grid.WalkEnds, walking: Floats) -> Group:
    dims: tuple[str, ...] = tuple(settings.plane)
    variables: dict[str, Variable] = {
        name: Variable(window.cell_centres(index), (name,), UNITS[axis], TEXTS[axis])
        for index, (name, axis) in enumerate(zip(dims, window.axes, strict=True))
    }

    def grid_variable(values: Any, text: str) -> Variable:
        return Variable(np.ascontiguousarray(values).reshape(window.cells), dims, "1", text)

    settled = np.where(ends.attractor == grid.UNREACHED, 0, ends.steps)
    variables |= {
        "outcome": grid_variable(ends.outcome, "how the walk ended; codes in attribute outcomes"),
        "attractor": grid_variable(ends.attractor, "index of the attractor that was reached; -1: none"),
        "steps": grid_variable(ends.steps, "steps taken"),
        "steps_to_settle": grid_variable(settled, "steps until the attractor was reached; 0: never"),
        "walking": grid_variable(walking, "fraction of the cell that walks; at the basin's edge, of its subcells"),
    }
    held_values = {f"at_{name}": value for name, value in zip(analyses.COORDINATES, window.rest, strict=True)}
    return Group(variables, {"outcomes": OUTCOMES, "model": settings.model, **held_values})


def summary(
    settings: analyses.Basin, window: grid.Window, ends: grid.WalkEnds, walking: Floats, question: "Question"
) -> dict[str, Any]:
    walks = ends.outcome == Outcome.WALKED
    attractors = question.attractor_rows()
    for number, row in enumerate(attractors):
        reaches = walks & (ends.attractor == number)
        row["cells"] = int(np.count_nonzero(reaches))
        if row["cells"]:
            row["median_steps_to_settle"] = float(np.median(ends.steps[reaches]))
    sides = zip(settings.plane, window.lower, window.upper, strict=True)
    values = zip(analyses.COORDINATES, window.rest, strict=True)
    return {
        "model": settings.model,
        "plane": list(settings.plane),
        "cells": list(settings.cells),
        "window": {name: [low, high] for name, low, high in sides},
        "held": {name: value for name, value in values if name not in settings.plane},
        "share_walking": float(walking.mean()),
        "share_walking_gaussian": float(np.sum(walking * gaussian(window))),
        "outcomes": count_outcomes(ends.outcome),
        "attractors": attractors,
        "aperiodic": question.aperiodic,
        "unsettled_cells": int(np.count_nonzero(walks & (ends.attractor == grid.UNREACHED))),
        "steps_wanted": settings.steps if settings.model == "rigid" else settings.contact_steps,
    }


def gaussian(window: grid.Window) -> Floats:
    """Return the weight of each cell in a normal distribution around the window's centre. The sum is 1."""
    off = ((np.arange(cells) + 0.5 - 0.5 * cells) / (0.5 * cells / SIGMAS) for cells in window.cells)
    weights = reduce(np.multiply.outer, (np.exp(-0.5 * sigmas**2) for sigmas in off))
    return np.asarray(weights / weights.sum())


def margin_of(config: RigidConfig, window: grid.Window, ends: grid.WalkEnds, gait: Mapping[str, Any]) -> dict[str, Any]:
    """Return the distance (rad, sqrt(g/L)) from a stable gait to the nearest failing cell, or {} if the gait is
    unstable or no cell fails."""
    # The error of the distance is the size of a cell.
    failing = np.flatnonzero(ends.outcome != Outcome.WALKED)
    if not gait["stable"] or not failing.size:
        return {}
    time_unit = math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)
    away = (window.starts(failing) - np.array(window.rest)) * np.array((1.0, time_unit, time_unit))
    return {"margin": float(np.sqrt((away**2).sum(axis=1)).min())}


@dataclass(frozen=True, eq=False)
class RigidQuestion:
    """Rigid model, with the data needed to classify how its walks end."""

    rigid: RigidModel
    walker: grid.Walker  # the unit walker
    scale: tuple[float, float, float]  # factors from section coordinates in SI to those of the unit walker
    attractors: grid.Attractors
    steps: int
    cells_at_once: int = 10_000
    edges_at_once: int = 1_000
    shared_from: int = 200_000  # minimum number of walks for which starting processes saves time
    tolerances: tuple[float, float] = (grid.RTOL, grid.ATOL)
    pads: ClassVar[None] = None  # the rigid model's ground has no pads

    @property
    def aperiodic(self) -> bool:
        return self.attractors.aperiodic

    def attractor_rows(self) -> list[dict[str, Any]]:
        """Describe each attractor: its period, and a state (SI) on it."""
        rows = []
        for cycle in self.attractors.cycles:
            state = rigid_map.state_on_section(self.rigid, tuple((cycle.points[0] / np.array(self.scale)).tolist()))
            period = cycle.period * grid.stride_of(self.walker)
            rows.append({"period": period, "state": list(state), "reached_within": cycle.reach})
        return rows

    def walk_to_ends(self, z: Floats) -> grid.WalkEnds:
        """Simulate walks from section coordinates z (n, 3) in SI, until each ends or reaches an attractor."""
        scaled = z * np.array(self.scale)
        return grid.walk_to_attractor(self.walker, self.attractors, scaled, self.steps, tolerances=self.tolerances)

    def tightened(self) -> "RigidQuestion":
        """Return the same model with tolerances a hundred times tighter."""
        rtol, atol = self.tolerances
        return replace(self, tolerances=(rtol / 100.0, atol / 100.0))


@dataclass(frozen=True, eq=False)
class ContactQuestion:
    """Contact model, and how the ends of its walks are classified. At the start of a walk, the stance foot just
    touches the ground and rolls without slip.
    """

    scene: contact.ContactScene
    rigid: RigidModel
    starts: scaled_starts.ScaledStarts
    pads: Pads
    cells_at_once: int = 100
    edges_at_once: int = 10
    shared_from: int = 500
    aperiodic: ClassVar[bool] = False  # the only attractor that is considered is the gait

    def attractor_rows(self) -> list[dict[str, Any]]:
        """Describe the attractor by the period and length of its step, or return nothing if the model has no gait."""
        gait = self.starts.gait
        if gait is None:
            return []
        period_s, length_m = np.mean(gait, axis=0).tolist()
        return [{"period": len(gait), "period_s": period_s, "step_length_m": length_m}]

    def walk_to_ends(self, z: Floats) -> grid.WalkEnds:
        """Simulate walks from section coordinates z (n, 3), SI."""
        rows = [self.walk((float(a), float(b), float(c))) for a, b, c in z]
        return grid.WalkEnds(*np.array(rows, np.int64).reshape(-1, 3).T)

    def walk(self, z: tuple[float, float, float]) -> tuple[int, int, int]:
        """Simulate a walk from section coordinates z (3), SI. Return outcome, attractor and number of steps."""
        state = rigid_map.state_on_section(self.rigid, z)
        walk = self.starts.walk_from(contact.start_state(self.scene, state))
        settled = self.starts.settling_steps(walk) if walk.outcome is Outcome.WALKED else None
        return (walk.outcome, grid.UNREACHED, walk.touch_time_s.size) if settled is None else (walk.outcome, 0, settled)

    def tightened(self) -> "ContactQuestion":
        """Return the same model with the tighter tolerances of `numerical_error.tightened`."""
        return replace(self, starts=replace(self.starts, tolerances=tightened(self.starts.tolerances)[0]))


Question = RigidQuestion | ContactQuestion


def units_of(
    name: str, cells: Sequence[int], at_once: int, walks: int, run: Callable[[Sequence[int]], list[float]]
) -> list[WorkUnit]:
    """Divide cells, which need `walks` walks each, into work units of `at_once` cells. A unit is named after its first
    cell."""
    groups = (cells[first : first + at_once] for first in range(0, len(cells), at_once))
    return [WorkUnit(f"{name} {group[0]}", walks * len(group), partial(run, group)) for group in groups]


def ends_of(question: "Question", window: grid.Window, cells: Sequence[int]) -> list[float]:
    """Simulate walks from the centres of cells. Return their outcomes, attractors and step counts as one flat list."""
    ends = question.walk_to_ends(window.starts(np.array(cells)))
    return [float(number) for number in (*ends.outcome, *ends.attractor, *ends.steps)]


def shares_of(question: "Question", window: grid.Window, refine: int, cells: Sequence[int]) -> list[float]:
    """Return the fraction of each cell that leads to walking, from walks that start at the centres of its subcells."""
    inside = grid.subcell_centres(refine, len(window.axes))
    ends = question.walk_to_ends(window.starts(np.repeat(cells, len(inside)), np.tile(inside, (len(cells), 1))))
    walking = (ends.outcome == Outcome.WALKED).reshape(len(cells), -1)
    return [float(share) for share in walking.mean(axis=1)]
