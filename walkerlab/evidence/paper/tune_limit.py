"""Part of `tune`: the approach to the rigid limit, and the contribution of each contact property to the difference."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from walkerlab.config.reads import ContactConfig
from walkerlab.config.walkers import CompassWalker
from walkerlab.evidence.paper.printed import LARGEST_ERROR
from walkerlab.labels import Label
from walkerlab.physics.ground.compliant import contact_walker
from walkerlab.physics.ground.walker import ContactWalker
from walkerlab.physics.hybrid.comparison import Motion, add_strike_samples
from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult
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
    observed_orders,
)
from walkerlab.physics.orbits.step_map import Cycle
from walkerlab.physics.solvers.system import State
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.simulate import leg_variables
from walkerlab.pipeline.store.content import Group, columns, rows_group, values_by_column
from walkerlab.scene.contact import SAMPLES_PER_PENDULUM_TIME, ContactScene, contact_drives, knee_rules, start_state
from walkerlab.scene.parts import assembly_of

SAMPLING_FACTOR = 4  # factor on contact-sim's sampling rate; keeps interpolation errors far below the model error
COMPASS_SERIES = STICTION_SERIES, STIFFNESS_SERIES, DAMPING_SERIES, NORMAL_SERIES
GAIT_SERIES = STICTION_SERIES, NORMAL_SERIES
COARSE_STRIDE = 3  # use every third setting for walkers that are slower to simulate than the compass
SETTING = "setting"
FACTOR_LABELS = {
    "stiffness": Label("1", "factor on the stiffness", name="stiffness_factor"),
    "damping": Label("1", "factor on the damping", name="damping_factor"),
    "stiction": Label("1", "factor on the stiction and friction velocity", name="stiction_velocity_factor"),
}
DISTANCE_LABELS = {
    "period": Label("s", "period of the contact gait", name="period_s"),
    "length": Label("m", "step length of the contact gait", name="step_length_m"),
    "slip": Label("m", "slip per step of the contact gait", name="slip_m"),
    "period_error": Label("s", "period of the contact gait minus the rigid gait's", name="period_error_s"),
    "length_error": Label("m", "step length of the contact gait minus the rigid gait's", name="length_error_m"),
    "numerical_period": Label("s", "change of the period at a ten times tighter tolerance", name="numerical_period_s"),
}
PHASE_TEXT = "in phase, between impacts"
WALK_LABELS = {
    "angle": Label("rad", f"largest difference of an angle from the rigid walk {PHASE_TEXT}", name="angle_error_rad"),
    "velocity": Label("rad/s", f"largest difference of an angular velocity {PHASE_TEXT}", name="velocity_error_rad_s"),
    "raw_angle": Label("rad", "largest difference of an angle at the same time", name="raw_angle_error_rad"),
    "raw_velocity": Label(
        "rad/s", "largest difference of an angular velocity at the same time", name="raw_velocity_error_rad_s"
    ),
    "numerical_time": Label(
        "s", "change of the last touch at a hundred times tighter tolerance", name="numerical_time_s"
    ),
    "evaluations": Label("1", "number of right-hand-side evaluations in the walk", name="rhs_evaluations"),
    "wall_s": Label("s", "processor time of the walk", timing=True),
}


@dataclass(frozen=True)
class LimitFindings:
    """Gaits (and walks) of each series, compared with those of the rigid model, and the limit without creep."""

    walk_series: tuple[str, ...]  # series in which whole walks are compared as well as gaits
    rigid_period: float  # s, period of the rigid gait
    contact_period: float  # s, period of the contact gait
    series: dict[str, list[Distance]]
    without_creep: Extrapolation | None


def limit_findings(
    config: ContactConfig,
    scene: ContactScene,
    gait: Cycle,
    rigid_gait: Mapping[str, Any],
    walk: RigidWalkResult,
    progress: Progress,
) -> LimitFindings | None:
    """Take the contact to the rigid limit, or return None if the rigid walk has no samples or no step.

    rigid_gait  summary of `fixedpoint`
    walk        walk of the rigid model from the start
    """
    if walk.samples is None or walk.steps == 0:
        return None
    compass = isinstance(config.walker, CompassWalker) and config.walker.torso is None
    legs = leg_variables(walk.samples)
    angle = legs["angle"].values
    velocity = legs["velocity"].values
    recorded = Motion(walk.samples.time_s, angle, velocity, walk.touch_time_s, walk.knee_strikes_s)
    motion = add_strike_samples(recorded)
    limit = Limit(
        scene.ground,
        float(rigid_gait["period_s"]),
        float(rigid_gait["step_length_m"]),
        motion,
        walk.steps,
        scene.ground.frame.pendulum_time / (SAMPLING_FACTOR * SAMPLES_PER_PENDULUM_TIME),
        1 if compass else COARSE_STRIDE,
    )
    # Only the compass has point feet in one model and round feet in the other.
    compared = (ALL_SERIES, ALL_POINT_SERIES) if isinstance(config.walker, CompassWalker) else (ALL_SERIES,)
    gaits = COMPASS_SERIES if compass else GAIT_SERIES
    progress.start("tune: rigid limit", len(compared) + len(gaits))

    def start(walker: ContactWalker) -> State:
        return start_state(replace(scene, walker=walker), walk.start)

    series: dict[str, list[Distance]] = {}
    for name in compared:
        walker = scene.walker
        if name != ALL_SERIES:  # point feet, as in the rigid model
            points = config.walker.model_copy(update={"foot_radius_m": 0.0})
            rules = knee_rules(config.walker)
            laws = walker.normal, walker.friction
            ground = config.gravity_m_s2, config.slope_rad
            walker = contact_walker(assembly_of(points), *laws, *ground, rules, drives=contact_drives(config))
        series[name] = limit.series(name, walker, gait, start)
        progress.advance()
    for name in gaits:
        series[name] = limit.series(name, scene.walker, gait)
        progress.advance()
    return LimitFindings(compared, limit.period_s, gait.period_s, series, extrapolate(series[STICTION_SERIES]))


def limit_summary(findings: LimitFindings) -> dict[str, Any]:
    """Summarise convergence orders, settings that reach the paper's 1e-4 rad, and causes of the period difference."""
    reaches = {}
    for name in findings.walk_series:
        distances = [distance for distance in findings.series[name] if distance.angle is not None]
        first = next((distance for distance in distances if (distance.angle or 0.0) <= LARGEST_ERROR.value), None)
        reaches[name] = {
            "claim_rad": LARGEST_ERROR.value,
            "settings": [setting(distance) for distance in distances],
            "first_within_claim": None if first is None else setting(first),
        }
    orders = {name: observed_orders(rows) for name, rows in findings.series.items()}
    return {"orders": orders, "reaches": reaches, "causes": causes(findings)}


def setting(distance: Distance) -> dict[str, Any]:
    differences = ("period_error", "angle", "velocity", "raw_angle", "numerical_time")
    labels = {name: (DISTANCE_LABELS | WALK_LABELS)[name] for name in differences}
    return {
        **values_by_column(distance.setting, FACTOR_LABELS),
        **values_by_column(distance, labels),
        "run_wall_s": distance.wall_s,
    }


def causes(findings: LimitFindings) -> dict[str, Any]:
    """Return the difference in period (s) by cause, found by switching off one property at a time.

    The rest is the joint effect of these properties; it includes creep if the limit without creep was not reached.
    """
    total = findings.contact_period - findings.rigid_period
    farthest = findings.series[findings.walk_series[-1]]
    parts: dict[str, float] = {}
    if findings.without_creep is not None:
        parts["creep_s"] = findings.contact_period - findings.without_creep.period
    if findings.series[NORMAL_SERIES]:
        parts["penetration_and_finite_impact_s"] = findings.contact_period - findings.series[NORMAL_SERIES][-1].period
    if findings.series.get(ALL_POINT_SERIES):
        parts["foot_radius_s"] = findings.contact_period - findings.series[ALL_POINT_SERIES][0].period
    parts["rest_s" if findings.without_creep is None else "together_s"] = total - sum(parts.values())
    return {
        "total_s": total,
        **parts,
        "creep_uncertainty_s": None if findings.without_creep is None else findings.without_creep.uncertainty,
        "left_with_all_off_s": farthest[-1].period_error if farthest else None,
    }


def limit_groups(findings: LimitFindings) -> dict[str, Group]:
    """Build one group per series: each setting, and how its gait and (if compared) walk differ from the rigid ones."""
    groups = {}
    for name, rows in findings.series.items():
        complete = [distance for distance in rows if distance.angle is not None and name in findings.walk_series]
        if rows:
            of = [distance.setting for distance in complete or rows]
            settings = rows_group(of, FACTOR_LABELS, SETTING, "number of the setting; the config's contact is first")
            distances = columns(complete or rows, DISTANCE_LABELS | (WALK_LABELS if complete else {}), SETTING)
            path = f"limit/{name.replace(', ', '-').replace(' ', '-')}"
            groups[path] = Group({**settings.variables, **distances})
    return groups
