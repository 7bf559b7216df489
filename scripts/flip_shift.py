"""How the contact model's first flip comes to the rigid model's as its ground stiffens and creeps less.

    python scripts/flip_shift.py [--factors 1 10 100] [--velocities 100 25 6.25]

The paper's walker over slope. Two series: the stiction velocity falls on the config's ground; the ground stiffens at
the last of these velocities. With the stiffness k goes the damping as k^(1/2) and the penetration of full damping as
k^(-1/e); with the stiction velocity goes the friction velocity. The observed order comes from the changes between
neighbours, and so does not hang on what else separates the models.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from itertools import pairwise

from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.orbits.families import Span
from walkerlab.scene.parameter import parameter_of
from walkerlab.stages.continuation import Question, contact_branches, first_flip, rigid_branches
from walkerlab.stages.progress import Silent

SPAN = Span(3.9, 4.5)  # deg; holds every flip that is asked for


def config_of(stiffer: float, velocity: float) -> Config:
    """The paper's walker on ground `stiffer` times as stiff, with this stiction velocity (mm/s)."""
    own = load().config.contact
    assert own is not None, "the paper's walker has a contact block"
    changed = {
        "stiffness": own.stiffness * stiffer,
        "damping": own.damping * math.sqrt(stiffer),
        "full_damping_penetration": own.full_damping_penetration * stiffer ** (-1.0 / own.exponent),
        "stiction_velocity": velocity,
        "friction_velocity": own.friction_velocity / own.stiction_velocity * velocity,
    }
    return load(sets=[f"contact.{name}={value!r}" for name, value in changed.items()]).config


def question(config: Config) -> Question:
    """Gaits of one step over the slope."""
    return Question(config, parameter_of("slope_deg", config), SPAN, periods=1, points=400)


def flip(stiffer: float, velocity: float) -> float:
    """Where the contact model's gait of one step first doubles its period (deg)."""
    found = first_flip(contact_branches(question(config_of(stiffer, velocity)), Silent()).branches)
    assert found is not None, "the span holds the flip"
    return found[0]


def rows(name: str, grounds: Sequence[tuple[float, float]], knob: Sequence[float], rigid: float) -> list[float]:
    """Print the series as it is computed; returns its flips.

    grounds  how much stiffer, and the stiction velocity, of each
    knob     what changes
    """
    flips: list[float] = []
    print(f"{name:>24} {'flip (deg)':>12} {'shift (deg)':>12} {'order':>7}")
    for ground, value in zip(grounds, knob, strict=True):
        flips.append(flip(*ground))
        order = ""
        if len(flips) > 2:
            (first, second), ratio = [b - a for a, b in pairwise(flips[-3:])], knob[1] / knob[0]
            order = f"{abs(math.log(abs(first / second)) / math.log(ratio)):.3f}"
        print(f"{value:24g} {flips[-1]:12.6f} {flips[-1] - rigid:12.6f} {order:>7}", flush=True)
    return flips


def limit(flips: Sequence[float]) -> float:
    """Where a series of flips whose changes fall geometrically comes to (deg), by Aitken's formula."""
    first, second = (b - a for a, b in pairwise(flips[-3:]))
    return flips[-1] + second * second / (first - second)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--factors", type=float, nargs="+", default=[1.0, 10.0, 100.0], help="of the stiffness")
    parser.add_argument("--velocities", type=float, nargs="+", default=[100.0, 25.0, 6.25], help="mm/s")
    asked = parser.parse_args()
    found = first_flip(rigid_branches(question(load().config), Silent())[0].branches)
    assert found is not None, "the rigid walker's flip is in the span"
    rigid = found[0]
    print(f"rigid model: {rigid:.7f} deg")
    last = asked.velocities[-1]
    series = (
        ("stiction velocity (mm/s)", [(1.0, velocity) for velocity in asked.velocities], asked.velocities),
        ("times the stiffness", [(factor, last) for factor in asked.factors], asked.factors),
    )
    for name, grounds, knob in series:
        flips = rows(name, grounds, knob, rigid)
        if len(flips) > 2:
            print(f"{'limit':>24} {limit(flips):12.6f} {limit(flips) - rigid:12.6f}")


if __name__ == "__main__":
    main()
