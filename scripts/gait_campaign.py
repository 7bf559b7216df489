"""Search the gaits of random walkers with light hips, and check that both ordinary gaits are found.

    python scripts/gait_campaign.py                # 400 walkers
    python scripts/gait_campaign.py --walkers 40 --seed 3

The hip weighs at most as much as a leg, whose mass lies within a quarter of its length from the foot: the walkers whose
gaits are hardest to follow from a vanishing slope. Each gait must be found by name, differ from the other, and repeat
itself in one step of SciPy's DOP853. Prints what went wrong; exits 1 if anything did.
"""

from __future__ import annotations

import argparse

import numpy as np

from walkerlab.hybrid.recorded_walk import take_walk
from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.fixed_point import SearchSettings, find_gaits
from walkerlab.orbits.gait import Gait
from walkerlab.orbits.small_slope import LONG_PERIOD, SHORT_PERIOD
from walkerlab.paper.appendix_a import CORRECTED, RigidWalker, assembled
from walkerlab.solvers.registry import method_named

FOLLOWED_ONLY = SearchSettings(random_starts=0, further_starts=0)
RTOL, ATOL, BUDGET = 1e-11, 1e-13, 100_000
RETURNS_TO = 1e-7  # rad, rad/s: the tolerance above, grown by an unstable gait's multipliers


def random_walker(generator: np.random.Generator) -> Standing:
    """A walker of unit leg length, leg mass and gravity."""
    compass = RigidWalker(
        leg_length=1.0,
        foot_to_mass=float(generator.uniform(0.02, 0.25)),
        leg_mass=1.0,
        hip_mass=float(10.0 ** generator.uniform(-2.0, 0.0)),
        leg_inertia=float(generator.choice((0.0, generator.uniform(0.0, 0.03)))),
        gravity=1.0,
        slope=float(10.0 ** generator.uniform(-3.5, -1.3)),
        c21_sign=CORRECTED,
    )
    return assembled(compass)


def faults(walker: Standing) -> list[str]:
    """What is wrong with the gaits found for a walker."""
    search = find_gaits(walker, settings=FOLLOWED_ONLY)
    found = {name: [gait for gait in search.gaits if name in gait.found_by] for name in (LONG_PERIOD, SHORT_PERIOD)}
    wrong = [f"no gait from the {name}" for name, gaits in found.items() if not gaits]
    if not wrong and found[LONG_PERIOD] == found[SHORT_PERIOD]:
        wrong.append("both seeds lead to one gait")
    wrong += [
        f"the gait of {gait.period:.4g} s does not repeat itself" for gait in search.gaits if strays(walker, gait)
    ]
    has_ground = [gait for gait in search.gaits if not gait.objections]
    if has_ground and search.gait != min(has_ground, key=lambda gait: gait.spectral_radius):
        wrong.append("the gait chosen is not the least unstable one")
    return wrong


def strays(walker: Standing, gait: Gait) -> bool:
    """Whether a step of SciPy's DOP853 leads away from the gait's state."""
    method = method_named("scipy-dop853").new(len(gait.state), RTOL, ATOL, BUDGET)
    step = take_walk(walker, method, gait.state, 1)
    return step.steps < 1 or bool(np.abs(np.subtract(step.final_state, gait.state)).max() > RETURNS_TO)


def campaign(walkers: int, seed: int) -> list[str]:
    """What is wrong with the gaits of so many random walkers."""
    generator = np.random.default_rng(seed)
    wrong = []
    for index in range(walkers):
        walker = random_walker(generator)
        wrong += [f"{index}: {walker}: {fault}" for fault in faults(walker)]
    return wrong


def main() -> None:
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--walkers", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    wrong = campaign(arguments.walkers, arguments.seed)
    print("\n".join([*wrong, f"{arguments.walkers} walkers, {len(wrong)} faults"]))
    raise SystemExit(bool(wrong))


if __name__ == "__main__":
    main()
