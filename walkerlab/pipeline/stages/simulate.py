"""Simulate a walk of the rigid model from its fixed point or a given start."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from walkerlab.config import reads, schema
from walkerlab.physics.hybrid.recorded_walk import RigidWalkResult
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.rigid_groups import groups
from walkerlab.pipeline.stages.walk import content_of_walk, measure_pace, rigid_start, summarise_walk
from walkerlab.pipeline.store.content import Content
from walkerlab.scene import omissions, rigid


def run(config: reads.SimulateConfig, inputs: Mapping[str, Content], progress: Progress, again: bool = True) -> Content:
    """Simulate `config.strides` strides.

    again  whether to measure the numerical error by a second walk, which takes about twice as long as the first

    Raises NoAnswer if the integrator fails.
    """
    scene = rigid.rigid_scene(config, config.ground, config.outputs)
    settings = config.solver.rigid
    tolerances = Tolerances(settings.method, settings.rtol, settings.atol, ENDLESS)
    (length, start), steps = rigid_start(config, inputs), 2 * config.strides
    reference = length if "fixedpoint" in inputs or isinstance(config.start, schema.MidStep) else None

    def walk(tolerances: Tolerances, sampled: bool) -> RigidWalkResult:
        progress.start("simulate" if sampled else "simulate: numerical error", steps)
        return scene.walk(start, steps, tolerances, sampled, progress.advance, reference)

    stored = partial(groups, scene)
    return content_of_walk("simulate", walk, tolerances, stored, partial(summary, config), progress, again)


def summary(config: reads.SimulateConfig, walk: RigidWalkResult) -> dict[str, Any]:
    return {
        **summarise_walk(walk),
        **measure_pace(config, walk),
        "start_state": list(walk.start),
        "final_state": list(walk.final_state),
        "energy_drift_J": walk.energy_drift,
        "energy_balance_residual_J": walk.energy_balance_residual,
        "lost_in_strikes_J": walk.lost_in_strikes,
        "mean_energy_J": walk.mean_energy,
        "min_normal_force_N": walk.min_normal_force,
        "max_friction_ratio": walk.max_friction_ratio or None,
        "max_scuff_depth_m": walk.max_scuff_depth,
        "objections": list(walk.objections),
        "equations": config.equations,
        "slope_rad": config.slope_rad,
        "left_out": list(omissions.rigid_walk_omissions(config)),
    }
