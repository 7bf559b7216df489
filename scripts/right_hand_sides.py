"""The right-hand sides of all scenes, and the time of one evaluation."""

from __future__ import annotations

import time
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from walkerlab.config import loader
from walkerlab.evidence.paper.appendix_a import RigidWalker, accelerations, compass, swing_constants
from walkerlab.physics.ground.friction import Coulomb, Frictionless
from walkerlab.physics.ground.walker import ContactWalker, place_on_ground
from walkerlab.physics.kernels import kernel, kernel_part
from walkerlab.physics.mechanics.rigid_model import BENT, Mode, RigidModel, swing_foot
from walkerlab.physics.solvers.system import State, derivative
from walkerlab.scene.contact import contact_scene
from walkerlab.scene.rigid import rigid_walker

ONE_DEGREE = loader.load(None, ("slope_deg=1",)).config
CALLS, STATES = 200_000, 64  # number of calls of a right-hand side, and number of different states for them
FREE = (0.0, 0.7365, -0.2044, 0.1695, 0.65, -0.1, -0.6, -0.86)  # state with both feet slightly inside the ground
ANGLES = (-0.2044, 0.1695, -0.6, -0.86)


for formula in (swing_constants, accelerations):
    kernel_part(formula)


class AppendixA(NamedTuple):
    """The equations of the compass as the paper writes them out, for this walker only."""

    walker: RigidWalker


@derivative.case(AppendixA)
def appendix_a_derivative(system: AppendixA, t: float, y: Any, f: Any) -> None:
    """Evaluate (A.58)."""
    f[0], f[1] = y[2], y[3]
    f[2], f[3] = accelerations(system.walker, y[0], y[1], y[2], y[3])


@kernel
def call_often(system: Any, states: Any, rates: Any, calls: int) -> None:
    """Evaluate right-hand sides at states (STATES, n) in turn, and store every component of each in `rates`."""
    for call in range(calls):
        place = call % states.shape[0]
        derivative(system, 0.0, states[place], rates[place])


def systems() -> dict[str, tuple[Any, State]]:
    """Return every right-hand side to time, with a typical state."""
    rigid = rigid_walker(ONE_DEGREE, "corrected")
    heavy = rigid_walker(loader.load(None, ("slope_deg=1", "walker.leg_inertia_kg_m2=0.1")).config, "corrected")
    walker = walker_of(rigid)
    both = (True, True)
    return {
        "Appendix A": (AppendixA(compass(ONE_DEGREE, "corrected")), ANGLES),
        "rigid": (Mode(rigid, BENT), ANGLES),
        "rigid, inertia": (Mode(heavy, BENT), ANGLES),
        "contact": (place_on_ground(walker, both), FREE),
        "contact, friction of zero": (
            place_on_ground(walker._replace(friction=Coulomb(0.0, 0.0, 0.1, 1.0)), both),
            FREE,
        ),
        "contact, frictionless": (place_on_ground(walker._replace(friction=Frictionless()), both), FREE),
        "contact, inertia": (place_on_ground(walker_of(rigid, "walker.leg_inertia_kg_m2=0.1"), both), FREE),
        "contact, pinned": (place_on_ground(walker, (False, False), pinned=True), ANGLES),
    }


def walker_of(rigid: RigidModel, *sets: str) -> ContactWalker:
    """Build the walker on the ground at one degree, with some keys changed."""
    config = loader.load(None, ("slope_deg=1", *sets)).config
    return contact_scene(config, abs(swing_foot(rigid, ANGLES)[1])).walker


def times_ns(repeats: int) -> dict[str, float]:
    """Return the processor time (ns) of each right-hand side, as medians of repeats that take turns."""
    jobs: dict[str, tuple[Any, Any, Any]] = {}
    for name, (system, state) in systems().items():
        # Slightly different states, as many as fit into the fastest memory.
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
