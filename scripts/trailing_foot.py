"""What a heel strike on compliant ground leaves of the trailing foot's velocity, beside the rigid model's impact.

    python scripts/trailing_foot.py [--slope 4.2]
    python scripts/trailing_foot.py --config kneed

The walker walks from its rigid gait to its first touch, where its knees are locked if it has any. From there SciPy's
Radau integrates the same equations until the leading foot stops sinking in, with the impulses that both feet take. From
the same state an impact that only the leading foot takes lets the trailing foot go freely, as the rigid model has it.
Stiffness, damping and friction change as in flip_shift.py.
"""

from __future__ import annotations

import argparse
import math
from typing import Any, NamedTuple

import numpy as np
from flip_shift import Ground, config_of
from scipy.integrate import solve_ivp

from walkerlab.benchmarks.contact_trials import contact_trial
from walkerlab.ground.held import NoKnees, NoneBends, always_held, no_stops
from walkerlab.ground.merged import ByKnees, as_fewer, merged_state
from walkerlab.ground.motion import OnGround, motion_gradient
from walkerlab.ground.walker import ContactWalker, FootMotion, foot_force
from walkerlab.hybrid.contact_events import feet_motion
from walkerlab.hybrid.contact_run import walk_contact
from walkerlab.mechanics.tree import mass_matrix, sines_cosines
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.scene.rigid import rigid_walker
from walkerlab.solvers.in_tuples import derivative
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import State

GROUNDS = (
    Ground(6.25, 1e-4),
    Ground(6.25, 1e-4, 100.0, 10.0),
    Ground(6.25, 1e-4, 1e4, 100.0),
    Ground(6.25, 1e-4, 100.0, 100.0),
    Ground(3.125, 1e-4, 100.0, 10.0, 0.5),
    Ground(12.5, 1e-4, 100.0, 10.0, 2.0),
)
LEADING, TRAILING = 0, 1  # feet at the first touch
LONGEST = 0.02  # s, that a foot sinks in for
HEAD = ("stiffness", "damping", "friction", "slips (m/s)", "rises (m/s)", "alone: slips", "rises", "share of impulse")


class Struck(NamedTuple):
    """The trailing foot when the leading one has stopped sinking in."""

    slips: float  # m/s
    rises: float  # m/s
    share: float  # of the impulse normal to the ground that the leading foot took


def at_touch(ground: Ground, name: str, slope_deg: float) -> tuple[ContactWalker, State]:
    """A config's walker, with straight legs as one body each, and its state at its first touch."""
    config = config_of(ground, f"slope_deg={slope_deg!r}", "contact.terrain=after-mid-swing", of=name)
    rigid = rigid_walker(config, config.equations)
    gait = find_gaits(rigid, config.seed).gait
    assert gait is not None, "the slope has a gait"
    trial = contact_trial(config, tuple(gait.state), gait.step_length, 1)
    methods = Tolerances("radau5", 1e-10, 1e-13, 10**7)
    y = walk_contact(trial.walker, trial.ground, None, TRAILING, trial.start, methods, 1, None, False).end_state
    walker = trial.walker
    if isinstance(walker.knees, NoKnees):
        return walker, y
    assert isinstance(walker.merging, ByKnees), "knees lock ideally"
    assert not walker.knees.release_at_touch, "both are still locked as the foot sinks in"
    both = walker.merging.both
    straight = as_fewer(walker, both, both.held, NoneBends(walker.knees.release_at_touch))
    return straight, merged_state(both.onto, np.array(y), straight.blank)


def freed(walker: ContactWalker, y: State) -> FootMotion:
    """The trailing foot after an impact that only the leading foot takes: M dv = J' impulse, J v+ = 0."""
    n = len(walker.tree.arm_x)
    s, c = sines_cosines(walker.tree, y, 2, walker.slope)
    M = np.diag([walker.tree.mass, walker.tree.mass, *[0.0] * n])
    M[2:, 2:] = np.array(mass_matrix(walker.tree, s, c)).reshape(n, n)
    # how fast the leading foot slips and sinks, by each velocity
    foot = walker.feet[LEADING]
    J = np.array([motion_gradient(foot, s, c, y, 2 + n + i)[1:] for i in range(2 + n)]).T
    v = np.array(y[2 + n :])
    taken = np.linalg.solve(M, J.T)
    after = v - taken @ np.linalg.solve(J @ taken, J @ v)
    return feet_motion(walker, (*y[: 2 + n], *after.tolist()))[TRAILING]


def strike(walker: ContactWalker, y: State) -> Struck:
    """Integrate from the touch until the leading foot stops sinking in, with the normal impulses of both feet."""
    system = OnGround(walker, (True, True), always_held(walker.held), no_stops(walker.knees))

    def feet(x: Any) -> tuple[FootMotion, FootMotion]:
        return feet_motion(walker, tuple(x[:-2].tolist()))

    def rates(t: float, x: Any) -> tuple[float, ...]:
        pushes = (foot_force(walker, foot).normal.force if foot.height < 0.0 else 0.0 for foot in feet(x))
        return (*derivative(system, t, tuple(x[:-2].tolist())), *pushes)

    def sinking(_t: float, x: Any) -> float:
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
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--config", default="paper", help="name of a built-in one")
    parser.add_argument("--slope", type=float, help="deg; 4.2 for the paper's walker, else the config's")
    asked = parser.parse_args()
    print("".join(f"{name:>17}" for name in HEAD))
    own = 4.2 if asked.config == "paper" else math.degrees(config_of(GROUNDS[0], of=asked.config).slope_rad)
    slope = own if asked.slope is None else asked.slope
    for ground in GROUNDS:
        walker, y = at_touch(ground, asked.config, slope)
        found, free = strike(walker, y), freed(walker, y)
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
