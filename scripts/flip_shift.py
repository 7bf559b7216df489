"""Measure how the contact model's first flip approaches the rigid model's on ground that creeps less and is stiffer.

    python scripts/flip_shift.py [--velocities 100 25 6.25] [--radii 0.001 0.0001 0.00001] [--factors 1 10 100]
                                 [--frictions 0.5 1 2]

The gaits of the paper's walker are followed over slope, in three series, each of which begins where the previous one
ends. First the stiction velocity falls, and the friction velocity with it. Then the rolling ball feet shrink to points.
Then the ground stiffens, with damping as k^p (--damping) and the penetration of full damping as k^(-1/e). A fourth
series begins at the end of the second one: it changes friction and, in proportion, both velocities, so that the creep
stays equal. The observed order comes from the changes between neighbours, so it does not depend on other differences
between the models.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.physics.orbits.families import ValueSpan
from walkerlab.physics.orbits.family_search import first_flip
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages.continuation import FamilyQuestion, search_of
from walkerlab.scene.parameter import parameter_of

SPAN = ValueSpan(3.9, 4.5)  # deg; every flip that the script looks for lies inside


class Ground(NamedTuple):
    """Properties that separate the contact model from the rigid one."""

    velocity: float  # stiction velocity, mm/s
    radius: float  # radius of the ball feet, m
    stiffer: float = 1.0  # factor on the config's stiffness
    damped: float = 1.0  # factor on its damping
    rubbed: float = 1.0  # factor on its coefficients of friction


def config_of(ground: Ground, *more: str, of: str = "paper") -> Config:
    """Return a built-in config with other ground. `more` are further settings, as on the command line."""
    own = load(Path(of)).config.contact
    assert own is not None, "the config has a contact block"
    changed = {
        "stiffness": own.stiffness * ground.stiffer,
        "damping": own.damping * ground.damped,
        "full_damping_penetration": own.full_damping_penetration * ground.stiffer ** (-1.0 / own.exponent),
        "stiction_velocity": ground.velocity,
        "friction_velocity": own.friction_velocity / own.stiction_velocity * ground.velocity,
        "static_friction": own.static_friction * ground.rubbed,
        "dynamic_friction": own.dynamic_friction * ground.rubbed,
    }
    sets = [f"contact.{name}={value!r}" for name, value in changed.items()]
    return load(Path(of), [*sets, f"walker.foot_radius_m={ground.radius!r}", "continuation.periods=1", *more]).config


def question(config: Config) -> FamilyQuestion:
    """Build the request for one-step gaits over a range of slopes."""
    return FamilyQuestion(config, parameter_of("slope_deg", config), SPAN)


def flip(ground: Ground) -> float:
    """Return the slope (deg) at which the contact model's one-step gait first doubles its period."""
    return flip_of("contact", config_of(ground))


def flip_of(model: str, config: Config) -> float:
    """Return the first flip of a model in the span (deg)."""
    search = search_of(model, question(config), Silent())
    found = None if search is None else first_flip(search.branches().branches)
    assert found is not None, "the span holds the flip"
    return found[0]


def rows(name: str, grounds: Sequence[Ground], knob: Sequence[float], rigid: float) -> list[float]:
    """Compute and print a series row by row, and return its flips.

    knob  the property that changes
    """
    flips: list[float] = []
    print(f"{name:>24} {'flip (deg)':>12} {'shift (deg)':>12} {'order':>7}")
    for ground, value in zip(grounds, knob, strict=True):
        flips.append(flip(ground))
        order = ""
        if len(flips) > 2:
            (first, second), ratio = [b - a for a, b in pairwise(flips[-3:])], knob[1] / knob[0]
            order = f"{abs(math.log(abs(first / second)) / math.log(ratio)):.3f}"
        print(f"{value:24g} {flips[-1]:12.6f} {flips[-1] - rigid:12.6f} {order:>7}", flush=True)
    return flips


def limit(flips: Sequence[float]) -> float:
    """Return the limit (deg) of a series of flips whose changes fall geometrically, by Aitken's formula."""
    first, second = (b - a for a, b in pairwise(flips[-3:]))
    return flips[-1] + second * second / (first - second)


def main() -> None:
    """Measure and print all series."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--velocities", type=float, nargs="+", default=[100.0, 25.0, 6.25], help="mm/s")
    parser.add_argument("--radii", type=float, nargs="+", default=[1e-3, 1e-4, 1e-5], help="m")
    parser.add_argument("--factors", type=float, nargs="+", default=[1.0, 10.0, 100.0], help="of the stiffness")
    parser.add_argument("--damping", type=float, default=1.0, help="exponent p with which damping grows with stiffness")
    parser.add_argument("--frictions", type=float, nargs="+", default=[0.5, 1.0, 2.0], help="of its coefficients")
    asked = parser.parse_args()
    rigid = flip_of("rigid", load(None, ["continuation.periods=1"]).config)
    print(f"rigid model: {rigid:.7f} deg")
    velocity, ball, point = asked.velocities[-1], asked.radii[0], asked.radii[-1]
    stiffer = [Ground(velocity, point, factor, factor**asked.damping) for factor in asked.factors]
    series = (
        ("stiction velocity (mm/s)", [Ground(one, ball) for one in asked.velocities], asked.velocities),
        ("radius of the feet (m)", [Ground(velocity, one) for one in asked.radii], asked.radii),
        ("times the stiffness", stiffer, asked.factors),
    )
    rubbing = [Ground(velocity * factor, point, rubbed=factor) for factor in asked.frictions]
    for name, grounds, knob in series:
        flips = rows(name, grounds, knob, rigid)
        if len(flips) > 2:
            print(f"{'limit':>24} {limit(flips):12.6f} {limit(flips) - rigid:12.6f}")
    rows("times the friction", rubbing, asked.frictions, rigid)


if __name__ == "__main__":
    main()
