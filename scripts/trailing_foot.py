"""Compare the trailing foot's velocity after a heel strike on compliant ground with that of the rigid model's impact.

    python scripts/trailing_foot.py [--slope 4.2]
    python scripts/trailing_foot.py --config kneed

The walker walks from its rigid gait to its first touch, at which its knees, if any, are locked. From there SciPy's
Radau integrates the same equations and the impulses on both feet, until the leading foot stops sinking in. For
comparison, the script applies the rigid model's impact to the same state. It acts on the leading foot alone and
releases the trailing foot. Stiffness, damping and friction change as in flip_shift.py.
"""

from __future__ import annotations

import argparse
import math
from typing import Any, NamedTuple

import numpy as np
from flip_shift import Ground, config_of
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from walkerlab.evidence.benchmarks.trials import contact_trial
from walkerlab.physics.ground.motion import motion_gradient
from walkerlab.physics.ground.walker import (
    LOCKED,
    FootMotion,
    OnGround,
    feet_motion,
    foot_force,
    place_on_ground,
    sines_cosines,
    to_form,
)
from walkerlab.physics.hybrid.contact_result import walk_contact
from walkerlab.physics.mechanics.tree import add_inertia, projections
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import derivative
from walkerlab.scene.rigid import rigid_walker

Floats = NDArray[np.float64]
GROUNDS = (
    Ground(6.25, 1e-4),
    Ground(6.25, 1e-4, 100.0, 10.0),
    Ground(6.25, 1e-4, 1e4, 100.0),
    Ground(6.25, 1e-4, 100.0, 100.0),
    Ground(3.125, 1e-4, 100.0, 10.0, 0.5),
    Ground(12.5, 1e-4, 100.0, 10.0, 2.0),
)
LEADING, TRAILING = 0, 1  # feet at the first touch
LONGEST = 0.02  # s, longest time that a foot may take to sink in
HEAD = ("stiffness", "damping", "friction", "slips (m/s)", "rises (m/s)", "alone: slips", "rises", "share of impulse")


class Struck(NamedTuple):
    """The trailing foot when the leading one has stopped sinking in."""

    slips: float  # m/s
    rises: float  # m/s
    share: float  # fraction of the leading foot's impulse normal to the ground


def at_touch(ground: Ground, name: str, slope_deg: float) -> tuple[OnGround, Floats]:
    """Return a config's walker on the ground, with each straight leg as one body, and the state at the first touch."""
    config = config_of(ground, f"slope_deg={slope_deg!r}", "contact.terrain=after-mid-swing", of=name)
    rigid = rigid_walker(config, config.equations)
    gait = find_gaits(rigid, config.seed).gait
    assert gait is not None, "the slope has a gait"
    trial = contact_trial(config, tuple(gait.state), gait.step_length, 1)
    methods = Tolerances("radau5", 1e-10, 1e-13, 10**7)
    y = walk_contact(trial.walker, trial.ground, False, TRAILING, trial.start, methods, 1, None).end_state
    assert not trial.walker.whole.release_at_touch, "both knees are still locked as the foot sinks in"
    system = place_on_ground(trial.walker, (True, True), (LOCKED, LOCKED))
    return system, to_form(system.form, y)


def freed(system: OnGround, y: Floats) -> FootMotion:
    """Return the trailing foot after an impact on the leading foot alone: M dv = J' impulse, J v+ = 0."""
    form, n = system.form, int(system.form.bodies)
    s, c, F, U, unused = np.zeros((5, n))
    M, masses = np.zeros((n, n)), np.diag([float(form.mass)] * (2 + n))
    sines_cosines(form, y, s, c)
    add_inertia(form, n, s, c, y[4 + n :], M, unused)
    masses[2:, 2:] = M
    # maps velocities to the tangential and normal velocity of the leading foot
    projections(form.foot_x[LEADING], form.foot_y[LEADING], n, s, c, F, U)
    J = np.array([motion_gradient(form, LEADING, F, U, y, 2 + n + i)[1:] for i in range(2 + n)]).T
    v = y[2 + n :]
    taken = np.linalg.solve(masses, J.T)
    after = v - taken @ np.linalg.solve(J @ taken, J @ v)
    return feet_motion(form, np.concatenate((y[: 2 + n], after)))[TRAILING]


def strike(system: OnGround, y: Floats) -> Struck:
    """Integrate from the touch until the leading foot stops sinking in, with the normal impulses of both feet."""

    def feet(x: Floats) -> tuple[FootMotion, FootMotion]:
        return feet_motion(system.form, x[:-2])

    def rates(t: float, x: Floats) -> Floats:
        pushes = [foot_force(system, foot).normal.force if foot.height < 0.0 else 0.0 for foot in feet(x)]
        f = np.zeros(y.size)
        derivative(system, t, x[:-2], f)
        return np.concatenate((f, pushes))

    def sinking(_t: float, x: Floats) -> float:
        return feet(x)[LEADING].vertical_velocity

    ending: Any = sinking
    ending.terminal, ending.direction = True, 1.0
    start = np.array([*y, 0.0, 0.0])
    run = solve_ivp(rates, (0.0, LONGEST), start, method="Radau", rtol=1e-7, atol=1e-10, events=ending)
    assert run.status == 1, "the leading foot stops"
    end = run.y[:, -1]
    foot = feet(end)[TRAILING]
    return Struck(foot.slip, foot.vertical_velocity, float(end[-1] / end[-2]))


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--config", default="paper", help="name of a built-in one")
    parser.add_argument("--slope", type=float, help="deg; 4.2 for the paper's walker, else the config's")
    asked = parser.parse_args()
    print("".join(f"{name:>17}" for name in HEAD))
    own = 4.2 if asked.config == "paper" else math.degrees(config_of(GROUNDS[0], of=asked.config).slope_rad)
    slope = own if asked.slope is None else asked.slope
    for ground in GROUNDS:
        system, y = at_touch(ground, asked.config, slope)
        found, free = strike(system, y), freed(system, y)
        numbers = (
            ground.stiffer,
            ground.damped,
            ground.rubbed,
            found.slips,
            found.rises,
            free.slip,
            free.vertical_velocity,
        )
        print("".join(f"{number:17.5g}" for number in numbers) + f"{found.share:17.2%}", flush=True)


if __name__ == "__main__":
    main()
