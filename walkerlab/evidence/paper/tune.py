"""Stage `tune`: repeat the paper's adjustment for any walker.

It reports whether the adjustment is needed, why, and how large it is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from walkerlab.config.reads import TuneConfig
from walkerlab.config.walkers import CompassWalker, is_passive_compass
from walkerlab.evidence.paper.law import is_own_walker
from walkerlab.evidence.paper.measured import AdamsWalk, adams_walk
from walkerlab.evidence.paper.omissions import adjustment_omissions
from walkerlab.evidence.paper.printed import LARGEST_ERROR, TABLE_2
from walkerlab.labels import Label
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.compliant import contact_walker
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import ContactWalker
from walkerlab.physics.hybrid.comparison import Motion, add_strike_samples
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, losses_by_channel, sample_feet
from walkerlab.physics.hybrid.recorded_walk import as_state, scale_rates, take_walk
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING, RigidModel
from walkerlab.physics.orbits import scaled_starts
from walkerlab.physics.orbits.contact_gait import GaitAnswer
from walkerlab.physics.orbits.contact_map import angled_bodies, contact_step, turning_bodies
from walkerlab.physics.orbits.rigid_limit import (
    ALL_POINT_SERIES,
    ALL_SERIES,
    DAMPING_SERIES,
    NORMAL_SERIES,
    STICTION_SERIES,
    STIFFNESS_SERIES,
    Distance,
    Extrapolation,
    Limit,
    extrapolate,
    leg_motion,
    observed_orders,
)
from walkerlab.physics.orbits.step_map import Cycle
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.physics.solvers.system import State
from walkerlab.pipeline.progress import Progress, track
from walkerlab.pipeline.run.workers import map_in_order
from walkerlab.pipeline.stages.rigid_groups import leg_variables
from walkerlab.pipeline.stages.walk import (
    OUTCOMES,
    TIME,
    count_outcomes,
    leg_labels,
    numerical_error,
    rigid_start,
    step_columns,
    summarise_walk,
    variables_over_time,
)
from walkerlab.pipeline.store.content import (
    Content,
    Group,
    Variable,
    columns,
    numbered,
    real_and_imaginary,
    rows_group,
    values_by_column,
)
from walkerlab.scene import contact
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import rigid_walker, state_names
from walkerlab.scene.walk_outcomes import Pads, describe_endings

# We sample this many times as often as contact-sim, so that interpolation errors stay far below the model error.
SAMPLING_FACTOR = 4
COMPASS_SERIES = STICTION_SERIES, STIFFNESS_SERIES, DAMPING_SERIES, NORMAL_SERIES
GAIT_SERIES = STICTION_SERIES, NORMAL_SERIES
COARSE_STRIDE = 3  # use every third setting for walkers that are slower to simulate than the compass
SETTING = "setting"
FACTOR_LABELS = {
    "stiffness_factor": Label("1", "factor applied to the stiffness"),
    "damping_factor": Label("1", "factor applied to the damping"),
    "stiction_velocity_factor": Label("1", "factor applied to the stiction and friction velocity"),
}
DISTANCE_LABELS = {
    "period_s": Label("s", "period of the contact gait"),
    "step_length_m": Label("m", "step length of the contact gait"),
    "slip_m": Label("m", "slip per step of the contact gait"),
    "period_error_s": Label("s", "period of the contact gait minus the rigid gait's"),
    "length_error_m": Label("m", "step length of the contact gait minus the rigid gait's"),
    "numerical_period_s": Label("s", "change of the period at a ten times tighter tolerance"),
    "angle_error_rad": Label("rad", "largest difference in angle from the rigid walk at equal phase, between impacts"),
    "velocity_error_rad_s": Label("rad/s", "largest difference in angular velocity at equal phase, between impacts"),
    "raw_angle_error_rad": Label("rad", "largest difference in angle from the rigid walk at equal times"),
    "raw_velocity_error_rad_s": Label("rad/s", "largest difference in angular velocity at equal times"),
    "numerical_time_s": Label("s", "change of the last touch's time if the tolerance is a hundred times tighter"),
    "rhs_evaluations": Label("1", "number of right-hand-side evaluations in the walk"),
    "wall_s": Label("s", "processor time of the walk", timing=True),
}


@dataclass(frozen=True)
class LimitFindings:
    """Distances of the gaits and walks of each series from those of the rigid model, and the limit without creep."""

    walk_series: tuple[str, ...]  # series that compare whole walks, not only gaits
    rigid_period: float  # s, period of the rigid gait
    contact_period: float  # s, period of the contact gait
    series: dict[str, list[Distance]]
    without_creep: Extrapolation | None


def limit_findings(tune: "TuneRun", rigid_gait: Mapping[str, Any], progress: Progress) -> LimitFindings | None:
    """Follow each series of contact settings towards the rigid limit.

    Return None if there is no contact gait, or if the rigid walk has no samples or no step.

    rigid_gait  summary of `fixedpoint`
    """
    config = tune.config
    scene = tune.scene
    gait = tune.gait.gait
    walk = tune.rigid_walk
    if gait is None or walk.samples is None or walk.steps == 0:
        return None
    compass = isinstance(config.walker, CompassWalker) and config.walker.torso is None
    legs = leg_variables(walk.samples)
    angle, velocity = (legs[name].values for name in ("angle", "velocity"))
    motion = add_strike_samples(Motion(walk.samples.time_s, angle, velocity, walk.touch_time_s, walk.knee_strikes_s))
    period, length = (float(rigid_gait[key]) for key in ("period_s", "step_length_m"))
    interval = scene.ground.frame.pendulum_time / (SAMPLING_FACTOR * contact.SAMPLES_PER_PENDULUM_TIME)
    limit = Limit(scene.ground, period, length, motion, walk.steps, interval, 1 if compass else COARSE_STRIDE)
    # Only the compass has point feet in the rigid model and round feet in the contact model.
    compared = (ALL_SERIES, ALL_POINT_SERIES) if isinstance(config.walker, CompassWalker) else (ALL_SERIES,)
    gaits = COMPASS_SERIES if compass else GAIT_SERIES
    progress.start("tune: rigid limit", len(compared) + len(gaits))

    def start(walker: ContactWalker) -> State:
        return contact.start_state(replace(scene, walker=walker), walk.start)

    series: dict[str, list[Distance]] = {}
    for name in (*compared, *gaits):
        walker = scene.walker
        if name == ALL_POINT_SERIES:  # point feet, as in the rigid model
            points = config.walker.model_copy(update={"foot_radius_m": 0.0})
            rules = contact.knee_rules(config.walker)
            laws = walker.normal, walker.friction
            ground = config.gravity_m_s2, config.slope_rad
            walker = contact_walker(assembly_of(points), *laws, *ground, rules, drives=contact.contact_drives(config))
        series[name] = limit.series(name, walker, gait, start if name in compared else None)
        progress.advance()
    return LimitFindings(compared, limit.period_s, gait.period_s, series, extrapolate(series[STICTION_SERIES]))


def limit_summary(findings: LimitFindings) -> dict[str, Any]:
    """Summarise the orders of convergence, the settings that reach the paper's 1e-4 rad, and why the periods differ."""
    reaches = {}
    for name in findings.walk_series:
        distances = [distance for distance in findings.series[name] if distance.angle_error_rad is not None]
        within = (setting(each) for each in distances if (each.angle_error_rad or 0.0) <= LARGEST_ERROR.value)
        reaches[name] = {
            "claim_rad": LARGEST_ERROR.value,
            "settings": [setting(distance) for distance in distances],
            "first_within_claim": next(within, None),
        }
    orders = {name: observed_orders(rows) for name, rows in findings.series.items()}
    return {"orders": orders, "reaches": reaches, "causes": causes(findings)}


def setting(distance: Distance) -> dict[str, Any]:
    names = ("period_error_s", "angle_error_rad", "velocity_error_rad_s", "raw_angle_error_rad", "numerical_time_s")
    return {
        **values_by_column(distance.setting, FACTOR_LABELS),
        **{name: getattr(distance, name) for name in names},
        "run_wall_s": distance.wall_s,
    }


def causes(findings: LimitFindings) -> dict[str, Any]:
    """Split the difference of the periods (s) by cause, by switching off one property at a time.

    The rest is the joint effect of these properties. It includes creep if the limit without creep was not reached.
    """
    total = findings.contact_period - findings.rigid_period
    farthest = findings.series[findings.walk_series[-1]]
    parts: dict[str, float] = {}
    if findings.without_creep is not None:
        parts["creep_s"] = findings.contact_period - findings.without_creep.period
    if findings.series[NORMAL_SERIES]:
        parts["penetration_and_finite_impact_s"] = findings.contact_period - findings.series[NORMAL_SERIES][-1].period_s
    if findings.series.get(ALL_POINT_SERIES):
        parts["foot_radius_s"] = findings.contact_period - findings.series[ALL_POINT_SERIES][0].period_s
    parts["rest_s" if findings.without_creep is None else "together_s"] = total - sum(parts.values())
    return {
        "total_s": total,
        **parts,
        "creep_uncertainty_s": None if findings.without_creep is None else findings.without_creep.uncertainty,
        "left_with_all_off_s": farthest[-1].period_error_s if farthest else None,
    }


def limit_groups(findings: LimitFindings) -> dict[str, Group]:
    """Build a group for each series: its settings, and how far the gait is from the rigid gait.

    If walks were compared, the group also says how far the walk is from the rigid walk.
    """
    groups = {}
    text = "number of the setting, beginning with the config's contact"
    for series, rows in findings.series.items():
        if shown := [distance for distance in rows if distance.angle_error_rad is not None] or rows:
            settings = rows_group([row.setting for row in shown], FACTOR_LABELS, SETTING, text)
            # If no walk was compared, the columns of the comparison are missing.
            labels = {name: DISTANCE_LABELS[name] for name in DISTANCE_LABELS if getattr(shown[0], name) is not None}
            path = f"limit/{series.replace(', ', '-').replace(' ', '-')}"
            groups[path] = Group({**settings.variables, **columns(shown, labels, SETTING)})
    return groups


RIGID_SETTINGS = Tolerances("dop853", 1e-10, 1e-12, ENDLESS)
UNCHANGED_START = (1.0, 1.0)  # factors that leave the velocities of the rigid start unchanged
# Walks with knees or rolling feet take several times longer to compute, so their map and margins are coarser.
COMPASS_CELLS = 61
OTHER_CELLS = 21
COARSE_MARGINS = {"step": 0.05, "largest": 2.0}
SEARCH_ADVICE = "Widen the search (tune.swing_factors, tune.stance_factors, tune.cells) or choose another contact."
WALK_SUMMARY_KEYS = ("outcome", "advice", "steps", "step_periods_s", "step_lengths_m", "end_time_s")
"""Quantities reported for each walk of the procedure."""


def run(config: TuneConfig, inputs: Mapping[str, Content], progress: Progress, jobs: int = 1) -> Content:
    """Adjust the start until the contact model walks. If no start leads to walking, the summary gives the reason.

    Raises NoAnswer if the pads need a gait that does not exist.
    """
    rigid_step, rigid_state = rigid_start(config, inputs)
    rigid_gait = inputs["fixedpoint"].summary  # the start may be far from this gait
    gait = contact.contact_gait(config, rigid_step, as_state(rigid_gait["state"]))
    scene = replace(contact.scene_on_pads(config, rigid_step, rigid_state, gait), pinned=False)
    tune = TuneRun(config, scene, rigid_state, gait)
    tune.find(progress, jobs)
    stored = groups(tune)
    report = summary(tune) | {"left_out": list(adjustment_omissions(config))}
    if config.tune.rigid_limit and (limit := limit_findings(tune, rigid_gait, progress)):
        stored |= limit_groups(limit)
        report |= limit_summary(limit)
    return Content(stored, report)


class TuneRun:
    """Inputs and results of the stage.

    names       names of the rigid start's coordinates
    steps       number of steps per walk
    pins_foot   whether one walk has its first stance foot pinned, as in the paper's procedure for its compass
    walks       walks of the procedure: `hinged`, with the first stance foot pinned; `released`, with both feet free;
                and `adjusted`, from the adjusted start, if there is one
    printed     summaries of these walks
    adjustment  smallest change of the velocities with which the contact model walks, or None if it never walks
    """

    def __init__(self, config: TuneConfig, scene: contact.ContactScene, rigid_state: State, gait: GaitAnswer) -> None:
        self.config = config
        self.scene = scene
        self.rigid_state = rigid_state
        self.gait = gait
        self.names = state_names(config)
        self.steps = 2 * config.strides
        self.tolerances = contact.tolerances_of(config, self.steps)
        self.rigid: RigidModel = rigid_walker(config)
        self.pins_foot = is_passive_compass(config)
        self.starts = contact.build_scaled_starts(scene, self.rigid, rigid_state, self.steps, gait, self.tolerances)
        self.walks: dict[str, ContactWalkResult] = {}
        self.printed: dict[str, dict[str, Any]] = {}
        self.margins: list[scaled_starts.Margin] = []
        self.adjusted_state: State | None = None
        self.paper: AdamsWalk | None = None  # walk from the paper's ADAMS start, only for the paper's compass

    def find(self, progress: Progress, jobs: int) -> None:
        """Run the procedure: walks, map, adjusted start and margins.

        For the paper's compass, also try its ADAMS start.
        """
        settings = self.config.tune
        cells = settings.cells or (COMPASS_CELLS if self.pins_foot else OTHER_CELLS)
        swing, stance = (np.linspace(*ends, cells) for ends in (settings.swing_factors, settings.stance_factors))
        progress.start("tune: procedure")
        self.rigid_walk = take_walk(self.rigid, RIGID_SETTINGS, self.rigid_state, self.steps, sampled=True)
        if self.pins_foot:
            self.take("hinged", self.rigid_state)
        self.take("released", self.rigid_state)
        self.as_it_stands = self.starts.walk(*UNCHANGED_START)
        quick = contact.scale_for_map(self.starts, self.as_it_stands.evaluations)
        rows = [partial(scaled_starts.contact_row, quick, swing, float(factor)) for factor in stance]
        cells_by_row = [*track(progress, "tune: map", swing.size * stance.size, map_in_order(rows, jobs), swing.size)]
        self.contact_map = scaled_starts.as_map(swing, stance, cells_by_row)
        progress.start("tune: rigid map and margins")
        self.rigid_map = scaled_starts.rigid_map(self.rigid, self.rigid_state, swing, stance, self.steps)
        self.adjustment = self.adjusted(quick)
        if self.adjustment is not None:
            factors = self.adjustment.swing, self.adjustment.stance
            self.margins = scaled_starts.margins(self.starts, factors, **({} if self.pins_foot else COARSE_MARGINS))
            self.adjusted_state = scale_rates(self.rigid, self.rigid_state, *factors)
            self.take("adjusted", self.adjusted_state)
        if is_own_walker(self.config):
            terrain = contact.require_contact(self.config).terrain
            self.paper = adams_walk(self.rigid, self.walk, self.scene.walker, terrain)

    def adjusted(self, quick: scaled_starts.ScaledStarts) -> scaled_starts.Adjustment | None:
        """Return the smallest change of the velocities that makes the contact model walk, or None if it never walks.

        quick  the starts with the coarser solver settings of the map
        """
        cells = self.contact_map
        if self.as_it_stands.walks:
            return scaled_starts.Adjustment(*UNCHANGED_START, self.as_it_stands)
        if not cells.walking.size:
            return None
        swing, stance = (float(np.ptp(factors)) / (factors.size - 1) for factors in (cells.swing, cells.stance))
        return scaled_starts.smallest_change(self.starts, quick, cells.walking, (swing, stance))

    @property
    def gait_factors(self) -> tuple[float, float] | None:
        """Position of the gait on the map, or None if it cannot be determined.

        The factors are the velocities just after the rear foot lifts in the last step of the adjusted walk, divided by
        those of the rigid start.
        """
        walk = self.walks.get("adjusted")
        n = len(self.rigid_state) // 2
        first = self.rigid_state[n + SWING], self.rigid_state[n + STANCE]
        if walk is None or walk.steps < 2 or walk.samples is None or 0.0 in first:
            return None
        time = walk.samples.time_s
        normal = sample_feet(self.scene.walker, walk.samples)[:, :, 2]
        landed = walk.steps % 2  # leg 0 lands first
        swing = 1 - landed
        lifted = np.flatnonzero((time > walk.touch_time_s[-2]) & (normal[:, swing] <= 0.0) & (normal[:, landed] > 0.0))
        if not lifted.size:
            return None
        rates = leg_motion(walk.samples.states[lifted[:1]], self.scene.walker)[1][0]
        return float(rates[swing] / first[0]), float(rates[landed] / first[1])

    def walk(self, state: State, pinned: bool = False, tolerances: Tolerances | None = None) -> ContactWalkResult:
        """Simulate the contact model from a state of the rigid model, by default at the tolerances of the config."""
        scene = replace(self.scene, pinned=pinned)
        interval = scene.ground.frame.pendulum_time / contact.SAMPLES_PER_PENDULUM_TIME
        return scene.walk(contact.start_state(scene, state), self.steps, tolerances or self.tolerances, interval)

    def take(self, name: str, state: State) -> None:
        """Simulate and record a walk of the procedure, with its numerical error unless the solver failed.

        name  key of the walk in `walks`
        """
        walk = self.walks[name] = self.walk(state, name == "hinged")
        report = self.printed[name] = walk_summary(walk)
        if walk.outcome.answered:
            report["numerical_error"] = numerical_error(
                report, self.tolerances, lambda tighter: walk_summary(self.walk(state, name == "hinged", tighter))
            )


def walk_summary(walk: ContactWalkResult) -> dict[str, Any]:
    quantities = summarise_walk(walk)
    return {key: quantities[key] for key in WALK_SUMMARY_KEYS}


def summary(tune: TuneRun) -> dict[str, Any]:
    pitch = tune.scene.pitch_m
    ends = count_outcomes(tune.contact_map.outcome)
    pads = Pads((pitch, pitch), laid=str(contact.require_contact(tune.config).pad_pitch))
    return {
        "table2": table_2(tune),
        "gait": gait_summary(tune),
        "adjustment": adjustment_summary(tune),
        **({} if tune.paper is None else {"paper_start": summarise_adams_start(tune.paper)}),
        "procedure": {**tune.printed, "adjusted": tune.printed.get("adjusted")},
        "map": {
            "cells": int(tune.contact_map.outcome.size),
            "walks_share": tune.contact_map.share(),
            "contact": ends,
            "rigid": count_outcomes(tune.rigid_map.outcome),
            "endings": describe_endings(ends, tune.config, True, pads),
        },
        "slope_rad": tune.scene.walker.slope,
        "pitch_m": pitch,
    }


def summarise_adams_start(paper: AdamsWalk) -> dict[str, Any]:
    """Summarise the walks of both models from the paper's start."""
    return {
        "outcome": paper.walk.outcome.label,
        "reason": paper.reason,
        "steps": paper.walk.steps,
        "state": list(paper.rigid.state),
        "energy_J": paper.rigid.energy,
        "weight_N": paper.rigid.weight,
        "normal_force_N": paper.rigid.normal_force,
        "pull_from_s": paper.rigid.pull_from,
        "airborne_from_s": paper.airborne_from,
        "end_time_s": paper.walk.end_time_s,
    }


def table_2(tune: TuneRun) -> dict[str, dict[str, Any]]:
    """Tabulate the start before and after the adjustment and, for the paper's compass, the printed values."""
    rows = {}
    adjusted = tune.adjusted_state
    for k, (name, value) in enumerate(zip(tune.names, tune.rigid_state, strict=True)):
        row: dict[str, Any] = {"unit": "rad" if k < len(tune.names) // 2 else "rad/s"}
        if tune.paper is not None:
            row |= {
                "paper_matlab": TABLE_2[k].matlab.value,
                "paper_adams": TABLE_2[k].adams.value,
                "paper_percent": TABLE_2[k].percent.value,
                "paper_percent_of_matlab": TABLE_2[k].percent_of_matlab,
                "paper_percent_of_adams": TABLE_2[k].percent_of_adams,
            }
        ours = None if adjusted is None else adjusted[k]
        rows[name] = {
            **row,
            "ours_rigid": value,
            "ours_adjusted": ours,
            "ours_percent_of_rigid": None if ours is None else percent(ours, value, value),
            "ours_percent_of_adjusted": None if ours is None else percent(ours, value, ours),
        }
    return rows


def percent(value: float, reference: float, base: float) -> float | None:
    """Return how much `value` exceeds `reference` in magnitude, in percent of `base`, or None for a base of zero."""
    return 100.0 * (abs(value) - abs(reference)) / abs(base) if base else None


def gait_summary(tune: TuneRun) -> dict[str, Any]:
    """Summarise the contact model's gait, or give the reason why the search found none."""
    gait = tune.gait.gait
    report = {"found": gait is not None, "reason": tune.gait.reason, "advice": tune.gait.advice}
    if gait is None:
        return report
    step = contact_step(gait)
    return {
        **report,
        "state": gait.z.tolist(),
        "state_is": [f"{text} ({unit})" for text, unit in section_coordinates(tune.scene)],
        "section": "the swing foot passes the stance foot, where no foot touches or lifts",
        "period_s": step.period_s,
        "step_length_m": step.length_m,
        "multipliers": [[float(value.real), float(value.imag)] for value in gait.multipliers],
        "spectral_radius": float(abs(gait.multipliers[0])),
        "stable": gait.stable,
        "slip_m": step.slip_m,
        "residual": gait.residual,
        "lost_J": losses_by_channel(tune.scene.walker, step.dissipated_J),
        "height_lost_J": step.driven.gravity,
        "work_per_step_J": step.driven.work_per_step(1),
        "cost_of_transport": step.driven.cost_of_transport(step.length_m),
        "balance_J": float(step.dissipated_J.sum() - step.driven.net_work),
    }


def section_coordinates(scene: contact.ContactScene) -> list[tuple[str, str]]:
    """Return a description and the unit of each coordinate of a gait on its section."""
    walker = scene.walker
    names = [body.name for body in scene.assembly.bodies]

    def coordinates_of(quantity: str, unit: str, bodies: tuple[int, ...]) -> list[tuple[str, str]]:
        roles = ["stance" if body in walker.legs[STANCE_FOOT] else "swing" for body in bodies]
        bare = [names[body].rstrip(" 0123456789") for body in bodies]
        return [(f"{quantity} of the {role} {name}", unit) for role, name in zip(roles, bare, strict=True)]

    return [
        ("height of the centre of mass over the slope", "m"),
        *coordinates_of("angle", "rad", angled_bodies(walker, STANCE_FOOT)),
        ("velocity of the centre of mass along the slope", "m/s"),
        ("velocity of the centre of mass normal to the slope", "m/s"),
        *coordinates_of("angular velocity", "rad/s", turning_bodies(walker, STANCE_FOOT)),
    ]


def adjustment_summary(tune: TuneRun) -> dict[str, Any]:
    """Summarise the adjustment: whether it is needed, the smallest change that suffices, and its margins."""
    change = tune.adjustment
    report: dict[str, Any] = {"needed": not tune.as_it_stands.walks, "found": change is not None}
    if change is None:
        on_gait = " and settled on the gait" if tune.gait.gait is not None else ""
        reason = f"none of {tune.contact_map.outcome.size} starts walked {tune.steps} steps{on_gait}"
        return {**report, "reason": reason, "advice": tune.gait.advice or SEARCH_ADVICE}
    margins = {}
    for margin in tune.margins:
        fails = margin.fails
        beyond = None if fails is None else Outcome(fails.outcome)
        margins[margin.name] = {
            "factor": margin.factor,
            "percent": 100.0 * (margin.factor - 1.0),
            "beyond": None if beyond is None else "not settled" if beyond is Outcome.WALKED else beyond.label,
            "steps_beyond": None if fails is None else fails.steps,
        }
    return {
        **report,
        "scale_dtheta1": change.swing,
        "scale_dtheta2": change.stance,
        "distance": change.distance,
        "walked_steps": change.trial.steps,
        "margins": margins,
    }


def groups(tune: TuneRun) -> dict[str, Group]:
    stored = {"map": map_group(tune)}
    if tune.margins:
        labels = {
            "name": Label("", "what is scaled"),
            "factor": Label("1", "largest change that still leads to walking (factor)"),
        }
        stored["margins"] = rows_group(tune.margins, labels, "margin", "number")
    if tune.gait.gait is not None:
        stored["gait"] = gait_group(tune.gait.gait, tune.scene)
    rigid = tune.rigid_walk.samples
    if rigid is not None and rigid.time_s.size:
        in_time = {**leg_labels(), **variables_over_time(time=rigid.time_s), **leg_variables(rigid)}
        stored["rigid_start"] = Group({**in_time, **step_columns(tune.rigid_walk.touch_time_s)})
    for name, walk in tune.walks.items():
        if walk.samples is not None and walk.samples.time_s.size:
            stored[name] = Group({**legs_in_time(walk, tune.scene.walker), **step_columns(walk.touch_time_s)})
    if tune.paper is not None:
        energy = {"mechanical_J": Variable(tune.paper.mechanical, (TIME,), "J", "kinetic and potential energy")}
        forces = variables_over_time(normal_force_N=tune.paper.normal)
        stored["paper_start"] = Group({**legs_in_time(tune.paper.walk, tune.scene.walker), **forces, **energy})
    return stored


def legs_in_time(walk: ContactWalkResult, walker: ContactWalker) -> dict[str, Variable]:
    """Return angles and velocities of the legs, or none if the walk has no samples."""
    if walk.samples is None:
        return {}
    angle, velocity = leg_motion(walk.samples.states, walker)
    return {**leg_labels(), **variables_over_time(time=walk.samples.time_s, angle=angle, velocity=velocity)}


def map_group(tune: TuneRun) -> Group:
    """Build the group with the outcome and steps of both models over the two velocity factors."""
    cells = tune.contact_map
    swing = "swing_factor"
    stance = "stance_factor"
    over = {
        "outcome": (cells.outcome, "outcome of the contact model's walk, see attribute outcomes"),
        "steps": (cells.steps, "steps of the contact model"),
        "settled": (cells.settled, "1 if the last step equals the contact gait's within two percent"),
        "rigid_outcome": (tune.rigid_map.outcome, "outcome of the rigid model's walk"),
        "rigid_steps": (tune.rigid_map.steps, "steps of the rigid model"),
    }
    factor = "factor on the {} leg's initial angular velocity"
    attrs: dict[str, Any] = {"outcomes": OUTCOMES, "steps_wanted": tune.steps}
    if change := tune.adjustment:
        attrs |= {"adjusted_swing_factor": change.swing, "adjusted_stance_factor": change.stance}
    if factors := tune.gait_factors:
        attrs |= {"gait_swing_factor": factors[0], "gait_stance_factor": factors[1]}
    variables = {
        swing: Variable(cells.swing, (swing,), "1", factor.format("swing")),
        stance: Variable(cells.stance, (stance,), "1", factor.format("stance")),
        **{name: Variable(values, (stance, swing), "1", text) for name, (values, text) in over.items()},
    }
    return Group(variables, attrs)


def gait_group(gait: Cycle, scene: contact.ContactScene) -> Group:
    coordinates = section_coordinates(scene)
    names = np.array([f"{text} ({unit})" for text, unit in coordinates], dtype=object)
    units = ", ".join(unit for _, unit in coordinates)
    pairs = ("coordinate", "along")
    variables = {
        "coordinate": Variable(names, ("coordinate",), "", "coordinate"),
        "state": Variable(gait.z, ("coordinate",), units, "gait on the section"),
        "derivative": Variable(gait.DP, pairs, "per unit of the coordinate", "derivative of the step map"),
        **numbered(gait.z.size, "multiplier", "number"),
        **real_and_imaginary("multiplier", gait.multipliers, ("multiplier",), "multiplier"),
    }
    return Group(variables)
