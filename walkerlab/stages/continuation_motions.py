"""How gaits of a family move: some of them walk for a stride or a cycle, for whoever wants to see them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from walkerlab.hybrid.recorded_walk import Samples
from walkerlab.mechanics.rigid import knee_of
from walkerlab.orbits.families import GaitBranch, GaitPoint
from walkerlab.orbits.similarity import unit_walker
from walkerlab.orbits.step_map import on_section
from walkerlab.scene.parameter import Parameter
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import RigidScene, coordinates, rigid_walker
from walkerlab.solvers.registry import ENDLESS, Tolerances
from walkerlab.stages.numerical_error import evenly_spread
from walkerlab.stages.simulate import trajectory_group
from walkerlab.store.content import Group

if TYPE_CHECKING:
    from walkerlab.config.reads import ContactConfig

MOST_OF_BRANCH, LONGEST = 12, 4  # gaits of one branch, and steps of a gait, that are walked
STRIDE = 2  # steps, after which each leg is where it was
TOLERANCES = Tolerances("dop853", 1e-9, 1e-11, ENDLESS)
EVERY = 3  # which samples are kept beside those at heel strikes


def motions(branches: Sequence[GaitBranch], config: ContactConfig, parameter: Parameter) -> dict[str, Group]:
    """Some gaits of each branch of the rigid model, walking, by branch and point: branch_0/motion_7."""
    return {
        f"branch_{number}/motion_{place}": group
        for number, branch in enumerate(branches)
        if branch.period <= LONGEST
        for place in evenly_spread(len(branch.points), MOST_OF_BRANCH)
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
    scene = RigidScene(walker, TOLERANCES, coordinates(changed), knee, states=True, energies=True, forces=True)
    walk = scene.walk(start, steps, TOLERANCES)
    if walk.steps < steps or walk.samples is None:
        return
    seen = trajectory_group(scene, walk, thinned(walk.samples))
    yield replace(seen, attrs={"value": point.value, "slope_rad": changed.slope_rad, "steps": period})


def thinned(samples: Samples) -> Samples:
    """Every third sample, and both sides of every heel strike."""
    changes = np.flatnonzero(np.diff(samples.step))
    kept = np.unique(np.concatenate((np.arange(0, samples.time_s.size, EVERY), changes, changes + 1)))
    return Samples(samples.time_s[kept], samples.state[kept], samples.step[kept], samples.bent[kept])
