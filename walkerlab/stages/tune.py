"""The paper's parameter adjustment as a method for any walker: is it needed, how large is it, what lies behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from walkerlab.config.reads import ContactConfig, TuneConfig
from walkerlab.config.walkers import is_plain_compass, is_the_papers
from walkerlab.errors import NoAnswer
from walkerlab.hybrid.contact_run import ContactWalkResult
from walkerlab.hybrid.recorded_walk import RigidWalkResult, take_walk, with_scaled_rates
from walkerlab.mechanics.standing import STANCE, SWING, Standing
from walkerlab.orbits.contact_gait import GaitAnswer
from walkerlab.orbits.rigid_limit import motion_of_legs
from walkerlab.orbits.scaled_starts import (
    TOLERANCES,
    Adjustment,
    MarginSearch,
    ScaledStarts,
    StartMap,
    StartTrial,
    as_map,
    contact_row,
    margins,
    rigid_map,
    scaled_starts,
    smallest_change,
)
from walkerlab.paper.adams_start import adams_walk, forces_of
from walkerlab.scene.contact import ContactScene, contact_gait, contact_scene, start_state
from walkerlab.scene.left_out import of_adjustment
from walkerlab.scene.rigid import coordinates, rigid_walker
from walkerlab.solvers.registry import ENDLESS, Tolerances
from walkerlab.solvers.system import State
from walkerlab.stages.contact_sim import BUDGET_PER_STEP, SAMPLES_PER_PENDULUM_TIME, rigid_start
from walkerlab.stages.numerical_error import numerical_error
from walkerlab.stages.progress import Progress
from walkerlab.stages.tune_limit import LimitFindings, limit_findings, limit_groups, limit_summary
from walkerlab.stages.tune_results import Procedure, TuneFindings, groups, summary, walk_summary
from walkerlab.store.content import Content
from walkerlab.workers import in_order

# tolerances of the map: away from edges its outcomes are those of the config's (docs/adjustment.md)
MAP_RTOL, MAP_ATOL = 1e-4, 1e-6
LEAST_BUDGET, BUDGET_FACTOR = 60_000, 4  # right-hand sides of a cell: at least, and of the rigid start's walk
RIGID = Tolerances("dop853", 1e-10, 1e-12, ENDLESS)
AS_IT_STANDS = (1.0, 1.0)
# walks with knees or rolling feet take several times as long as the compass's: their map and margins are coarser
COMPASS_CELLS, CELLS, COARSE = 61, 21, MarginSearch(step=0.05, largest=2.0)


def run(config: TuneConfig, inputs: Mapping[str, Content], progress: Progress, jobs: int = 1) -> Content:
    """Adjust the start; that none walks is an answer. Raises NoAnswer if the pads are to fit a gait there is not."""
    rigid_step, rigid_state = rigid_start(config, inputs)
    near = tuple(float(x) for x in inputs["fixedpoint"].summary["state"])  # the start itself may be far from any gait
    gait = contact_gait(config, rigid_step, near)
    scene = free_scene(config, rigid_step, gait)
    found = TuneRun(config, scene, rigid_state, gait).findings(progress, jobs)
    stored, said = groups(found), summary(found, config) | {"left_out": list(of_adjustment(config))}
    limit = rigid_limit(config, found, inputs, progress)
    if limit is not None:
        stored |= limit_groups(limit)
        said |= limit_summary(limit)
    return Content(stored, said)


def free_scene(config: ContactConfig, rigid_step: float, gait: GaitAnswer) -> ContactScene:
    """The config's scene without a hinge; raises NoAnswer if its pads are to fit a gait that there is not."""
    contact = config.contact
    wants_own = contact is not None and contact.pad_pitch == "own" and contact.terrain == "checkerboard"
    if wants_own and gait.gait is None:
        raise NoAnswer(f"tune: no contact gait to lay the pads for: {gait.reason}", gait.advice)
    own = None if gait.gait is None else gait.gait.step.length_m
    return replace(contact_scene(config, rigid_step, own if own is not None else rigid_step), pinned=False)


def rigid_limit(
    config: TuneConfig, found: TuneFindings, inputs: Mapping[str, Content], progress: Progress
) -> LimitFindings | None:
    """What the rigid limit takes; None if it is not asked for or there is no gait to follow."""
    if found.gait.gait is None or not config.tune.rigid_limit:
        return None
    rigid = inputs["fixedpoint"].summary
    return limit_findings(config, found.scene, found.gait.gait, rigid, found.procedure.rigid, progress)


class TuneRun:
    """What the parts of the stage share."""

    def __init__(self, config: TuneConfig, scene: ContactScene, rigid_state: State, gait: GaitAnswer) -> None:
        """Nothing is walked yet."""
        self.config, self.scene, self.rigid_state, self.gait = config, scene, rigid_state, gait
        self.steps = 2 * config.strides
        self.rigid: Standing = rigid_walker(config, config.equations)
        self.compass, self.of_the_paper = is_plain_compass(config.walker), is_the_papers(config.walker)
        self.starts = self.scaled()

    def findings(self, progress: Progress, jobs: int) -> TuneFindings:
        """Procedure, margins, map, adjustment and the paper's own start."""
        settings = self.config.tune
        cells = settings.cells or (COMPASS_CELLS if self.compass else CELLS)
        swing, stance = (np.linspace(*ends, cells) for ends in (settings.swing_factors, settings.stance_factors))
        progress.start("tune: procedure")
        hinged = self.walk(self.rigid_state, pinned=True) if self.compass else None
        released = self.walk(self.rigid_state)
        as_it_stands = self.starts.walk(*AS_IT_STANDS)
        progress.start("tune: map", swing.size * stance.size)
        quick = self.starts.coarser(MAP_RTOL, MAP_ATOL, max(LEAST_BUDGET, BUDGET_FACTOR * as_it_stands.evaluations))
        rows = []
        for row in in_order([partial(contact_row, quick, swing, float(factor)) for factor in stance], jobs):
            rows.append(row)
            progress.advance(swing.size)
        walked = as_map(swing, stance, rows)
        progress.start("tune: rigid map and margins")
        rigid_cells = rigid_map(self.rigid, self.rigid_state, swing, stance, self.steps)
        adjustment, around = self.adjusted(as_it_stands, quick, walked)
        search = MarginSearch() if self.compass else COARSE
        found = margins(self.starts, around, search) if adjustment is not None else []
        state = None if adjustment is None else self.scaled_state(adjustment.swing, adjustment.stance)
        adjusted = None if state is None else self.walk(state)
        errors = {"released": self.error(released, self.rigid_state)}
        if hinged is not None:
            errors["hinged"] = self.error(hinged, self.rigid_state, pinned=True)
        if state is not None and adjusted is not None:
            errors["adjusted"] = self.error(adjusted, state)
        return TuneFindings(
            self.scene,
            self.gait,
            Procedure(self.rigid_state, self.rigid_walk(), hinged, released, adjusted),
            as_it_stands,
            adjustment,
            found,
            walked,
            rigid_cells,
            adams_walk(self.rigid, self.walk, self.scene.walker) if self.of_the_paper else None,
            self.steps,
            coordinates(self.config),
            errors,
            state,
            None if adjusted is None else self.factors_at_the_end(adjusted),
        )

    def adjusted(
        self, as_it_stands: StartTrial, quick: ScaledStarts, cells: StartMap
    ) -> tuple[Adjustment | None, tuple[float, float]]:
        """The smallest change of the velocities, and the factors around which margins are asked."""
        if as_it_stands.walks:
            return Adjustment(*AS_IT_STANDS, as_it_stands), AS_IT_STANDS
        if not cells.walking.size:
            return None, AS_IT_STANDS
        cell = (
            float(np.ptp(cells.swing)) / (cells.swing.size - 1),
            float(np.ptp(cells.stance)) / (cells.stance.size - 1),
        )
        change = smallest_change(self.starts, quick, cells.walking, cell)
        return change, AS_IT_STANDS if change is None else (change.swing, change.stance)

    def scaled(self) -> ScaledStarts:
        """The scaled starts, walked at the config's tolerances."""
        found = self.gait.gait
        own = None if found is None else (found.step.period_s, found.step.length_m)
        starts = scaled_starts(
            self.scene.walker,
            self.scene.ground,
            lambda swing, stance: start_state(self.scene, self.scaled_state(swing, stance)),
            self.steps,
            own,
        )
        return replace(starts, tolerances=replace(self.tolerances, method=TOLERANCES.method))

    def scaled_state(self, swing: float, stance: float) -> State:
        """The rigid start with its velocities scaled."""
        return with_scaled_rates(self.rigid, self.rigid_state, swing, stance)

    def factors_at_the_end(self, walk: ContactWalkResult) -> tuple[float, float] | None:
        """Velocities of the last step of a walk, once the foot behind has lifted, over those of the rigid start."""
        if walk.touch_time_s.size < 2:
            return None
        time, normal, _ = forces_of(walk, self.scene.walker)
        landed = int(walk.touch_time_s.size) % 2  # leg 0 lands first
        swing = 1 - landed
        lifted = np.flatnonzero((time > walk.touch_time_s[-2]) & (normal[:, swing] <= 0.0) & (normal[:, landed] > 0.0))
        if not lifted.size or walk.samples is None:
            return None
        n = len(self.rigid_state) // 2
        first = self.rigid_state[n + SWING], self.rigid_state[n + STANCE]
        if 0.0 in first:
            return None
        rates = motion_of_legs(walk.samples.states[lifted[:1]], self.scene.walker)[1][0]
        return float(rates[swing] / first[0]), float(rates[landed] / first[1])

    @property
    def tolerances(self) -> Tolerances:
        """The config's."""
        settings = self.config.solver.contact
        return Tolerances(settings.method, settings.rtol, settings.atol, self.steps * BUDGET_PER_STEP)

    def walk(self, state: State, pinned: bool = False, tolerances: Tolerances | None = None) -> ContactWalkResult:
        """Walk the contact model from a rigid state, as contact-sim does, with samples; at the config's tolerances."""
        scene = replace(self.scene, pinned=pinned)
        interval = scene.frame.pendulum_time / SAMPLES_PER_PENDULUM_TIME
        return scene.walk(start_state(scene, state), self.steps, tolerances or self.tolerances, interval)

    def error(self, walk: ContactWalkResult, state: State, pinned: bool = False) -> dict[str, Any]:
        """The numerical error of such a walk, under its key; nothing for one without an answer."""
        if not walk.outcome.answered:
            return {}
        error = numerical_error(
            walk_summary(walk), self.tolerances, lambda tighter: walk_summary(self.walk(state, pinned, tighter))
        )
        return {"numerical_error": error}

    def rigid_walk(self) -> RigidWalkResult:
        """The rigid model from its start, with samples."""
        return take_walk(self.rigid, RIGID, self.rigid_state, self.steps, sampled=True)
