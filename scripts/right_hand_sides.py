"""The right-hand sides of all scenes, and what one of them takes.

Beside the project's own there are two that leave out less, or more, than it does, and for them to be held against one
that is put together as they are: they tell what leaving out is worth, or would be.
"""

from __future__ import annotations

import time
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from walkerlab.config import loader
from walkerlab.ground.friction import Coulomb, Frictionless
from walkerlab.ground.motion import OnGround, ground_wrench
from walkerlab.ground.walker import ContactWalker, Foot, FootMotion, foot_force, foot_motion
from walkerlab.kernels import inlined, kernel
from walkerlab.mechanics.standing import BENT, Mode, Standing, swing_foot
from walkerlab.mechanics.tree import mass_matrix, sines_cosines, with_centrifugal
from walkerlab.mechanics.tuples import Vector, put, solve_symmetric
from walkerlab.paper.appendix_a import RigidWalker, accelerations, swing_constants
from walkerlab.scene.contact import contact_scene, hinged_walker
from walkerlab.scene.rigid import compass, rigid_walker
from walkerlab.solvers import system as in_arrays
from walkerlab.solvers.in_tuples import blank, derivative
from walkerlab.solvers.system import State

ONE_DEGREE = loader.load(None, ("slope_deg=1",)).config
CALLS, STATES = 200_000, 64  # calls of a right-hand side, and the states that they are at
FREE = (0.0, 0.7365, -0.2044, 0.1695, 0.65, -0.1, -0.6, -0.86)  # both feet a hair inside the ground
SWINGING = (0.0, 0.7365, 0.25, 0.1695, 0.65, -0.1, -0.6, -0.86)  # one foot well over it
ANGLES = (-0.2044, 0.1695, -0.6, -0.86)


class AsItIs(NamedTuple):
    """The walker on the ground with the feet's forces as the project has them."""

    walker: ContactWalker


class EveryFoot(NamedTuple):
    """The walker on the ground whose force laws are evaluated wherever its feet are: what the project does not do."""

    walker: ContactWalker


class PointFeet(NamedTuple):
    """The walker on the ground without any term of a foot's radius: what the project does not have."""

    walker: ContactWalker


@inlined
def wrench_anywhere(
    walker: ContactWalker, foot: Foot, s: Vector, c: Vector, y: State, wrench: tuple[float, float, Vector]
) -> tuple[float, float, Vector]:
    """A foot's force and torques by its force law, times zero where it is over the ground."""
    motion = foot_motion(walker, foot, s, c, y)
    inside = 1.0 if motion.height < 0.0 else 0.0
    force = foot_force(walker, FootMotion(motion.along, -abs(motion.height), motion.slip, motion.vertical_velocity))
    along, normal = inside * force.along, inside * force.normal.force
    torques = wrench[2]
    for k in range(len(s)):
        forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
        upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
        torques = put(torques, k, torques[k] + along * (foot.rolling[k] - upward) + normal * forward)
    return wrench[0] + along, wrench[1] + normal, torques


@inlined
def wrench_of_point(
    walker: ContactWalker, foot: Foot, s: Vector, c: Vector, y: State, wrench: tuple[float, float, Vector]
) -> tuple[float, float, Vector]:
    """A point foot's force and torques."""
    n = len(s)
    along, height, slip, vertical_velocity = y[0], y[1], y[2 + n], y[3 + n]
    for k in range(n):
        forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
        upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
        along, height = along + forward, height + upward
        slip, vertical_velocity = slip - y[4 + n + k] * upward, vertical_velocity + y[4 + n + k] * forward
    if height >= 0.0:
        return wrench
    force = foot_force(walker, FootMotion(along, height, slip, vertical_velocity))
    torques = wrench[2]
    for k in range(n):
        forward = c[k] * foot.lever_x[k] - s[k] * foot.lever_y[k]
        upward = s[k] * foot.lever_x[k] + c[k] * foot.lever_y[k]
        torques = put(torques, k, torques[k] - force.along * upward + force.normal.force * forward)
    return wrench[0] + force.along, wrench[1] + force.normal.force, torques


@inlined
def moved(walker: ContactWalker, s: Vector, c: Vector, y: State, wrench: tuple[float, float, Vector]) -> State:
    """Rates of the state under the ground's force and torques, as in ground/motion.py."""
    n = len(s)
    torques = with_centrifugal(walker.tree, s, c, y, 4 + n, wrench[2])
    alpha = solve_symmetric(mass_matrix(walker.tree, s, c), torques)
    rate = walker.blank
    for i in range(2 + n):
        rate = put(rate, i, y[2 + n + i])
    rate = put(rate, 2 + n, walker.gravity_along + wrench[0] / walker.tree.mass)
    rate = put(rate, 3 + n, wrench[1] / walker.tree.mass - walker.gravity_down)
    for k in range(n):
        rate = put(rate, 4 + n + k, alpha[k])
    return rate


@blank.case(AsItIs)
def as_it_is_blank(system: AsItIs) -> State:
    return system.walker.blank


@derivative.case(AsItIs)
def as_it_is_derivative(system: AsItIs, t: float, y: State) -> State:
    walker = system.walker
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    wrench = ground_wrench(walker, walker.feet[0], s, c, y, (0.0, 0.0, walker.tree.arm_x))
    return moved(walker, s, c, y, ground_wrench(walker, walker.feet[1], s, c, y, wrench))


@blank.case(EveryFoot)
def every_foot_blank(system: EveryFoot) -> State:
    return system.walker.blank


@derivative.case(EveryFoot)
def every_foot_derivative(system: EveryFoot, t: float, y: State) -> State:
    walker = system.walker
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    wrench = wrench_anywhere(walker, walker.feet[0], s, c, y, (0.0, 0.0, walker.tree.arm_x))
    return moved(walker, s, c, y, wrench_anywhere(walker, walker.feet[1], s, c, y, wrench))


@blank.case(PointFeet)
def point_feet_blank(system: PointFeet) -> State:
    return system.walker.blank


@derivative.case(PointFeet)
def point_feet_derivative(system: PointFeet, t: float, y: State) -> State:
    walker = system.walker
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    wrench = wrench_of_point(walker, walker.feet[0], s, c, y, (0.0, 0.0, walker.tree.arm_x))
    return moved(walker, s, c, y, wrench_of_point(walker, walker.feet[1], s, c, y, wrench))


for formula in (swing_constants, accelerations):
    inlined(formula)


class AppendixA(NamedTuple):
    """The compass's equations typed by hand, for one walker only."""

    walker: RigidWalker


@blank.case(AppendixA)
def appendix_a_blank(system: AppendixA) -> State:
    """Two angles and their velocities."""
    return (0.0, 0.0, 0.0, 0.0)


@derivative.case(AppendixA)
def appendix_a_derivative(system: AppendixA, t: float, y: State) -> State:
    """(A.58)."""
    alpha_1, alpha_2 = accelerations(system.walker, y[0], y[1], y[2], y[3])
    return (y[2], y[3], alpha_1, alpha_2)


@kernel
def call_often(system: Any, states: Any, rates: Any, calls: int) -> None:
    """Right-hand sides at states (STATES, n) in turn, every component of each stored into `rates`."""
    for call in range(calls):
        place = call % states.shape[0]
        in_arrays.derivative(system, 0.0, states[place], rates[place])


def systems() -> dict[str, tuple[Any, State]]:
    """Every right-hand side that is timed, and the state around which it is."""
    rigid = rigid_walker(ONE_DEGREE, "corrected")
    heavy = rigid_walker(loader.load(None, ("slope_deg=1", "walker.leg_inertia_kg_m2=0.1")).config, "corrected")
    walker = walker_of(rigid)
    point = walker_of(rigid, "walker.foot_radius_m=0")
    both = (True, True)
    return {
        "Appendix A": (AppendixA(compass(ONE_DEGREE, "corrected")), ANGLES),
        "rigid": (Mode(rigid, BENT), ANGLES),
        "rigid, inertia": (Mode(heavy, BENT), ANGLES),
        "contact": (OnGround(walker, both), FREE),
        "contact, friction of zero": (OnGround(walker._replace(friction=Coulomb(0.0, 0.0, 0.1, 1.0)), both), FREE),
        "contact, frictionless": (OnGround(walker._replace(friction=Frictionless()), both), FREE),
        "contact, inertia": (OnGround(walker_of(rigid, "walker.leg_inertia_kg_m2=0.1"), both), FREE),
        "contact, hinged": (hinged_walker(ONE_DEGREE, walker), ANGLES),
        "radius of zero": (AsItIs(point), FREE),
        "no radius": (PointFeet(point), FREE),
        "swinging foot passed over": (AsItIs(walker), SWINGING),
        "swinging foot evaluated": (EveryFoot(walker), SWINGING),
    }


def walker_of(rigid: Standing, *sets: str) -> ContactWalker:
    """The walker on the ground at one degree, with some keys changed."""
    config = loader.load(None, ("slope_deg=1", *sets)).config
    return contact_scene(config, abs(swing_foot(rigid, ANGLES)[1])).walker


def times_ns(repeats: int) -> dict[str, float]:
    """Nanoseconds of processor time that each right-hand side takes: medians of repeats that take turns."""
    jobs: dict[str, tuple[Any, Any, Any]] = {}
    for name, (system, state) in systems().items():
        # as many different states as fit into the fastest memory, a hair apart
        states = np.array(state) * (1.0 + 1e-6 * np.arange(STATES)[:, np.newaxis])
        jobs[name] = (system, states, np.zeros_like(states))
        call_often(*jobs[name], STATES)
    found: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repeats):
        for name, job in jobs.items():
            start = time.process_time()
            call_often(*job, CALLS)
            found[name].append(1e9 * (time.process_time() - start) / CALLS)
    return {name: median(taken) for name, taken in found.items()}
