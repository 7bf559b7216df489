"""Balls, blocks, rods and wheels on the ground of the contact model: any two bodies, driven by the walkers' own code.

A walker has two bodies and two feet; so has everything here, with a second body or foot that takes no part. The rules
by which walks end are put out of reach, and the run ends at a given time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walkerlab.ground.compliant import contact_walker
from walkerlab.ground.friction import Coulomb
from walkerlab.ground.normal_force import NormalLaw
from walkerlab.ground.terrain import checkerboard
from walkerlab.ground.walker import ContactWalker, FootMotion, one_foot_motion
from walkerlab.hybrid.contact_events import LAST_TOUCH, Frame, JudgedGround
from walkerlab.hybrid.contact_run import new_observer, new_walk_state, walk_on
from walkerlab.hybrid.contact_walk import LONGEST_FLIGHT, LONGEST_STEP
from walkerlab.hybrid.outcome import Outcome
from walkerlab.mechanics.parts import Assembly, BallFoot, Body, Position, Revolute
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import State

Array = NDArray[np.float64]
ENDLESS = 1e7  # m, an area without edges, and a hip that cannot fall
OUT_OF_REACH: Position = (0.0, 1e3)  # m, where a foot is that takes no part
BUDGET = 2_000_000  # right-hand sides
SAMPLES = 4000
ALONG, HEIGHT, ANGLE, ALONG_RATE, HEIGHT_RATE, ANGLE_RATE = 0, 1, 2, 4, 5, 6  # of the first body, in the state


@dataclass(frozen=True)
class Rig:
    """Something on the ground."""

    walker: ContactWalker
    ground: JudgedGround


@dataclass(frozen=True)
class ParticleRun:
    """What it did."""

    times: Array  # (samples,) s
    states: Array  # (samples, 8)
    end: State
    dissipated: Array  # (3,) J
    work: NDArray[np.int64]


def rig(
    mass: float, inertia: float, feet: tuple[Position, Position], normal: NormalLaw, friction: Coulomb,
    gravity: float, slope: float = 0.0,
) -> Rig:  # fmt: skip
    """One body whose centre of mass is its frame's origin, with point feet fixed to it.

    The second body is hinged at that centre, has the same inertia, no mass, and nothing to do.
    """
    origin = (0.0, 0.0)
    assembly = Assembly(
        bodies=(Body("body", mass, origin, inertia), Body("idle", 0.0, origin, inertia)),
        joints=(Revolute("hinge", "body", origin, "idle", origin),),
        feet=(BallFoot("first", "body", feet[0], 0.0), BallFoot("second", "body", feet[1], 0.0)),
    )
    walker = contact_walker(assembly, normal, friction, gravity, slope)
    frame = Frame(-ENDLESS, 1.0, True)
    return Rig(walker, JudgedGround(checkerboard(ENDLESS, (0.0, 0.0)), frame))


def state(at: Position, velocity: Position, angle: float = 0.0, rate: float = 0.0) -> State:
    """A state of the rig: where its centre of mass is along and over the slope, and how it moves and turns."""
    return (*at, angle, 0.0, *velocity, rate, 0.0)


def run_until(of: Rig, start: State, duration_s: float, rtol: float = 1e-9, atol: float = 1e-12) -> ParticleRun:
    """Let it move for a time; samples evenly spaced. Raises ArithmeticError if the budget does not suffice."""
    frame = of.ground.frame._replace(pendulum_time=2.0 * duration_s / LONGEST_FLIGHT)
    ground = JudgedGround(of.ground.terrain, frame)
    walk_state = new_walk_state(of.walker, ground.terrain, 1, 1, start)
    walk_state.at_zero[:] = 0
    walk_state.times[LAST_TOUCH] = duration_s - LONGEST_STEP * frame.pendulum_time
    observer = new_observer(of.walker, walk_state, start, np.arange(SAMPLES, dtype=np.float64) * duration_s / SAMPLES)
    stopped = walk_on(of.walker, ground, Tolerances("radau5", rtol, atol, BUDGET), walk_state, observer, start)
    if stopped.outcome is not Outcome.NO_HEEL_STRIKE:
        raise ArithmeticError(f"ended as {stopped.outcome.label} at {stopped.time_s:.4g} s of {duration_s:.4g} s")
    seen = int(observer.recorded[0])
    return ParticleRun(
        observer.times[:seen].copy(),
        observer.states[:seen].copy(),
        stopped.state,
        observer.dissipated.copy(),
        stopped.work,
    )


def first_foot(of: Rig, y: Array) -> FootMotion:
    """Where the first foot is."""
    return one_foot_motion(of.walker.whole, 0, y)


def next_landing(height: float, vertical_velocity: float, gravity: float) -> float:
    """Time (s) until something in free flight comes down to height zero."""
    return (vertical_velocity + math.sqrt(vertical_velocity * vertical_velocity + 2.0 * gravity * height)) / gravity
