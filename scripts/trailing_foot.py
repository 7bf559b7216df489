"""What a heel strike on compliant ground leaves of the trailing foot's velocity, beside the rigid model's impact.

    python scripts/trailing_foot.py [--slope 4.2]

The paper's walker walks from its rigid gait to its first touch. From there SciPy's Radau integrates the same equations
until the leading foot stops sinking in, with the impulses that both feet take. From the same state the rigid model's
impact lets the trailing foot go freely. Stiffness, damping and friction change as in flip_shift.py.
"""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

import numpy as np
from flip_shift import Ground, config_of
from scipy.integrate import solve_ivp

from walkerlab.benchmarks.contact_trials import contact_trial
from walkerlab.ground.motion import OnGround
from walkerlab.ground.walker import ContactWalker, FootMotion, foot_force
from walkerlab.hybrid.contact_events import feet_motion
from walkerlab.hybrid.contact_run import MethodSettings, walk_contact
from walkerlab.mechanics.impact import heel_strike
from walkerlab.mechanics.standing import swing_foot_motion
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.scene.rigid import rigid_walker
from walkerlab.solvers.registry import method_named
from walkerlab.solvers.system import State, derivative

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
HEAD = ("stiffness", "damping", "friction", "slips (m/s)", "rises (m/s)", "rigid: slips", "rises", "share of impulse")


class Struck(NamedTuple):
    """The trailing foot when the leading one has stopped sinking in."""

    slips: float  # m/s
    rises: float  # m/s
    share: float  # of the impulse normal to the ground that the leading foot took


def at_touch(ground: Ground, slope_deg: float) -> tuple[ContactWalker, State, tuple[float, float]]:
    """Walker and state at its first touch, and how its trailing foot slips and rises (m/s) after the rigid impact."""
    config = config_of(ground, f"slope_deg={slope_deg!r}", "contact.terrain=after-mid-swing")
    rigid = rigid_walker(config, config.equations)
    gait = find_gaits(rigid, config.seed).gait
    assert gait is not None, "the slope has a gait"
    trial = contact_trial(config, tuple(gait.state), gait.step_length, 1)
    methods = MethodSettings(method_named("radau5"), 1e-10, 1e-13, 10**7)
    y = walk_contact(trial.walker, trial.ground, None, TRAILING, trial.start, methods, 1, None, False).end_state
    after = heel_strike(rigid, (y[2], y[3], y[6], y[7]))
    rises, slips = swing_foot_motion(rigid, after)[1]
    return trial.walker, y, (slips, rises)


def strike(walker: ContactWalker, y: State) -> Struck:
    """Integrate from the touch until the leading foot stops sinking in, with the normal impulses of both feet."""
    system = OnGround(walker, (True, True))

    def feet(x: Any) -> tuple[FootMotion, FootMotion]:
        return feet_motion(walker, tuple(x[:-2].tolist()))

    def rates(t: float, x: Any) -> tuple[float, ...]:
        pushes = (foot_force(walker, foot).normal.force if foot.height < 0.0 else 0.0 for foot in feet(x))
        return (*derivative(system, t, tuple(x[:-2].tolist())), *pushes)

    def sinking(_t: float, x: Any) -> float:
        return feet(x)[LEADING].climb

    ending: Any = sinking
    ending.terminal, ending.direction = True, 1.0
    start = np.array([*y, 0.0, 0.0])
    run = solve_ivp(rates, (0.0, LONGEST), start, method="Radau", rtol=1e-7, atol=1e-10, events=ending)
    assert run.status == 1, "the leading foot stops"
    end = run.y[:, -1]
    foot = feet(end)[TRAILING]
    return Struck(foot.slip, foot.climb, float(end[-1] / end[-2]))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slope", type=float, default=4.2, help="deg")
    asked = parser.parse_args()
    print("".join(f"{name:>17}" for name in HEAD))
    for ground in GROUNDS:
        walker, y, free = at_touch(ground, asked.slope)
        found = strike(walker, y)
        numbers = (ground.stiffer, ground.damped, ground.rubbed, found.slips, found.rises, *free)
        print("".join(f"{number:17.5g}" for number in numbers) + f"{found.share:17.2%}", flush=True)


if __name__ == "__main__":
    main()
