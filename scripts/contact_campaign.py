"""Random walks on compliant ground against a plain integration written for the tests: the same ends at the same times.

    python scripts/contact_campaign.py                 # 100 walks of the compass, a quarter of an hour
    python scripts/contact_campaign.py --walks 6 --seed 3
    python scripts/contact_campaign.py --walker kneed  # limbs, release of the knee, ground and start drawn

Terrain, first stance, friction, foot radius, exponent, stiffness, damping, slope, pitch and start are drawn; falls,
trips and flights are among the walks, and feet that come down on bent knees. The plain integration
(tests/hybrid/plain_walk.py) walks twice, with one step and with half of it: a walk on which these two differ by more
than they may is left out and counted. Prints a table in Markdown; exits 1 if a walk ends otherwise or a touch or the
lock of a knee lies further off than 1e-6 s.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "hybrid"))

import plain_walk

from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.config.walkers import Kneed
from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.hybrid.contact_run import MethodSettings, walk_contact
from walkerlab.hybrid.outcome import Outcome
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.solvers.registry import method_named

APART_S = 1e-6  # that times may differ by
RTOL, ATOL, BUDGET = 1e-9, 1e-11, 3_000_000
PLAIN_STEPS_S = {"compass": 8e-6, "kneed": 2e-6}
PLANE_MEASURE_M = 0.45  # what steps on ground without pads are judged by
TERRAINS = {
    "checkerboard": plain_walk.CHECKERBOARD,
    "after-mid-swing": plain_walk.AFTER_MID_SWING,
    "plane": plain_walk.PLANE,
}
COMPASS_TERRAINS = ("checkerboard", "after-mid-swing")
SLOPE_GAIT = (0.169539, -0.6057394, -0.861714)  # at one degree: stance angle, velocities
KNEED_GAIT = (0.2385854603, -0.0571481063, -1.1095873312)  # of the built-in walker, likewise from the slope's normal
KNEED_SLOPE = 0.0504


@dataclass(frozen=True)
class Drawn:
    """A walk to be compared: a built-in config, what is changed of it, and a start of the rigid model."""

    base: str
    sets: tuple[str, ...]
    start: tuple[float, ...]


@dataclass(frozen=True)
class Compared:
    """One walk by both."""

    drawn: Drawn
    outcome: str
    expected: str
    steps: int
    apart_s: float  # largest difference of the times of touches and of the end
    own_s: float  # largest difference between the plain walks with a step and with half of it
    slips_apart_m: float

    @property
    def settled(self) -> bool:
        """Whether the plain integration is exact enough to judge by."""
        return self.own_s <= 0.3 * APART_S

    @property
    def ok(self) -> bool:
        """Whether both ended alike, at the same times."""
        return self.outcome == self.expected and self.apart_s <= APART_S


def compass(seed: int) -> Drawn:
    """The paper's walker, changed."""
    die = random.Random(seed)
    slope = die.choice((0.3, 0.7, 1.0, 1.0, 2.0, 2.8, 4.0))
    exponent = die.choice((1.0, 1.3, 1.5, 2.2, 2.2, 3.0))
    # by how much a foot sinks in, so that every exponent gets a ground to walk on
    depth_mm = die.choice((0.03, 0.06, 0.06, 0.2))
    stiffness = 196.0 / depth_mm**exponent
    ratio = die.choice((0.05, 0.3, 1.0, 3.0))
    damping = 2.0 * ratio * (exponent * 196.0 / depth_mm * 20.0 / 1000.0) ** 0.5
    static = die.choice((0.9, 0.9, 0.9, 0.3, 0.05, 3.0))
    stiction = die.choice((20.0, 100.0, 100.0, 500.0))
    radius = die.choice((0.0, 0.001, 0.001, 0.05, 0.3))
    grown = (slope / 1.0) ** (1.0 / 3.0)
    angle = grown * SLOPE_GAIT[0] * die.uniform(0.97, 1.03)
    w_1, w_2 = (grown * w * die.uniform(0.9, 1.15) for w in SLOPE_GAIT[1:])
    pitch = 2.0 * np.sin(0.5 * (2.0 * angle + 2.0 * np.radians(slope))) * die.uniform(0.94, 1.03) + 0.35 * radius
    sets = (
        f"slope_deg={slope}",
        f"walker.foot_radius_m={radius}",
        f"walker.leg_inertia_kg_m2={die.choice((0.0, 0.0, 0.2))}",
        f"contact.terrain={die.choice(COMPASS_TERRAINS)}",
        f"contact.stance={die.choice(('free', 'free', 'pinned'))}",
        f"contact.friction={die.choice(('coulomb',) * 9 + ('none',))}",
        f"contact.exponent={exponent}",
        f"contact.stiffness={stiffness:.6g}",
        f"contact.damping={damping:.6g}",
        f"contact.full_damping_penetration={die.choice((0.5, 1.0, 2.0)) * depth_mm:g}",
        f"contact.static_friction={static}",
        f"contact.dynamic_friction={0.75 * static:g}",
        f"contact.stiction_velocity={stiction}",
        f"contact.friction_velocity={10.0 * stiction}",
        f"contact.pad_pitch={pitch:.5f}",
    )
    start = (-2.0 * float(np.radians(slope)) - angle, angle, w_1, w_2)
    return Drawn("paper", sets, start)


def kneed(seed: int) -> Drawn:
    """A walker with knees of drawn limbs, on ground that carries its weight alike."""
    die = random.Random(seed)
    thigh, shank, hip = die.uniform(0.3, 0.8), die.uniform(0.03, 0.2), die.uniform(0.2, 1.0)
    weight = 9.81 * (2.0 * (thigh + shank) + hip)
    exponent, depth_mm, ratio = die.choice((1.0, 1.5, 2.2, 2.2)), die.choice((0.06, 0.2)), die.choice((0.3, 1.0, 3.0))
    damping = 2.0 * ratio * (exponent * weight / depth_mm * weight / 9.81 / 1000.0) ** 0.5
    static, stiction = die.choice((0.9, 0.9, 0.9, 0.3)), die.choice((10.0, 10.0, 100.0))
    slope = round(KNEED_SLOPE * die.uniform(0.8, 1.4), 5)
    grown = (slope / KNEED_SLOPE) ** (1.0 / 3.0)
    half, swing, stance = (grown * x * die.uniform(0.97, 1.06) for x in KNEED_GAIT)
    sets = (
        f"walker.thigh.mass_kg={thigh:.4f}",
        f"walker.thigh.mass_below_hip_m={die.uniform(0.25, 0.38):.4f}",
        f"walker.shank.mass_kg={shank:.4f}",
        f"walker.shank.mass_below_knee_m={die.uniform(0.1, 0.25):.4f}",
        f"walker.hip_mass_kg={hip:.4f}",
        f"walker.foot_radius_m={die.choice((0.0, 0.0, 0.05, 0.2))}",
        f"walker.knee.release={die.choice(('compression', 'compression', 'touch'))}",
        f"slope_rad={slope}",
        f"contact.terrain={die.choice(('plane', 'plane', 'after-mid-swing'))}",
        f"contact.stance={die.choice(('free', 'free', 'pinned'))}",
        f"contact.exponent={exponent}",
        f"contact.stiffness={weight / depth_mm**exponent:.6g}",
        f"contact.damping={damping:.6g}",
        f"contact.full_damping_penetration={die.choice((0.5, 1.0, 2.0)) * depth_mm:g}",
        f"contact.static_friction={static}",
        f"contact.dynamic_friction={0.75 * static:g}",
        f"contact.stiction_velocity={stiction}",
        f"contact.friction_velocity={10.0 * stiction}",
    )
    angles, rates = (-half - slope, half - slope, -half - slope), (swing, stance, swing)
    return Drawn("kneed", sets, (*angles, *rates))


WALKERS = {"compass": compass, "kneed": kneed}


def plain_scene(config: Config, pitch_m: float) -> plain_walk.Plain:
    """The same walker and ground for the plain integration."""
    walker, contact = config.walker, config.contact
    assert contact is not None, "drawn with one"
    si = contact.in_si()
    smooth = contact.friction == "none"
    return plain_walk.Plain(
        *plain_legs(walker), walker.leg_length_m, config.gravity_m_s2, config.slope_rad, si.stiffness_N_per_m_e,
        si.exponent, si.damping_N_s_m, si.full_damping_penetration_m, 0.0 if smooth else si.static_friction,
        0.0 if smooth else si.dynamic_friction, si.stiction_velocity_m_s, si.friction_velocity_m_s,
        TERRAINS[contact.terrain], pitch_m, at_touch(walker),
    )  # fmt: skip


def plain_legs(walker: Any) -> tuple[Any, ...]:
    """Masses, levers, inertias and feet of a compass, or of a walker with knees."""
    if not isinstance(walker, Kneed):
        return plain_walk.straight_legs(
            walker.leg_length_m, walker.foot_to_mass_m, walker.leg_mass_kg, walker.hip_mass_kg, walker.foot_radius_m,
            walker.leg_inertia_kg_m2,
        )  # fmt: skip
    thigh, shank = walker.thigh, walker.shank
    return plain_walk.kneed_legs(
        thigh.length_m, thigh.mass_below_hip_m, thigh.mass_kg, shank.length_m, shank.mass_below_knee_m, shank.mass_kg,
        walker.hip_mass_kg, walker.foot_radius_m,
    )  # fmt: skip


def at_touch(walker: Any) -> bool:
    """Whether the trailing knee is released at the other foot's first touch."""
    return isinstance(walker, Kneed) and walker.knee.release == "touch"


def plainly(scene: plain_walk.Plain, start: Any, hinged: bool, steps: int, step_s: float) -> tuple[Any, ...]:
    """Outcome, times of touches, of knees' locks and of the end, slips with rolling."""
    # the rigid model's stance leg is one body, whose angle and rate come second
    angles, rates = np.array(start).reshape(2, -1)
    straight = [0, 1] if angles.size == 2 else [0, 1, 2, 1]
    y = plain_walk.start(scene, angles[straight], rates[straight], hinged)
    outcome, done, times, _, slips, rolled, t, _, locks = plain_walk.walk(scene, y, steps, step_s, 1 if hinged else -1)
    return outcome, np.concatenate((times[:done], locks[:done], [t])), np.append(slips[:done], rolled[:done])


def compare(drawn: Drawn, steps: int, step_s: float) -> Compared:
    """Walk a drawn walk both ways."""
    config, start = load(Path(drawn.base), drawn.sets).config, drawn.start
    pads = config.contact is not None and config.contact.pad_pitch not in ("rigid", "own")
    scene = contact_scene(config, float(config.contact.pad_pitch) if config.contact and pads else PLANE_MEASURE_M)
    methods = MethodSettings(method_named("radau5"), RTOL, ATOL, BUDGET)
    walk = walk_contact(
        scene.walker, scene.ground, scene.pinned, STANCE_FOOT, start_state(scene, start), methods, steps, None
    )
    plain, hinged = plain_scene(config, scene.pitch_m), scene.pinned is not None
    coarse = plainly(plain, start, hinged, steps, step_s)
    fine = plainly(plain, start, hinged, steps, 0.5 * step_s)
    times = np.concatenate((walk.touch_time_s, walk.knee_strike_s, [walk.end_time_s]))
    slips = np.append(walk.slip_m, walk.rolling_m)
    return Compared(
        drawn,
        walk.outcome.label,
        Outcome(fine[0]).label,
        int(walk.touch_time_s.size),
        apart(times, fine[1]),
        apart(coarse[1], fine[1]),
        apart(slips, fine[2]),
    )


def apart(one: Any, other: Any) -> float:
    """Largest difference of two rows of numbers; of rows of different length, infinite."""
    return float(np.max(np.abs(one - other), initial=0.0)) if one.size == other.size else float("inf")


def main() -> None:
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walker", choices=tuple(WALKERS), default="compass")
    parser.add_argument("--walks", type=int, default=100)
    parser.add_argument("--steps", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    found: list[Compared] = []
    print("| seed | ends | steps | apart (s) | plain with half the step (s) | slips apart (m) | |")
    print("|---|---|---|---|---|---|---|")
    for seed in range(chosen.seed, chosen.seed + chosen.walks):
        one = compare(WALKERS[chosen.walker](seed), chosen.steps, PLAIN_STEPS_S[chosen.walker])
        found.append(one)
        said = "" if one.ok else f"plain: {one.expected}; {' '.join(one.drawn.sets)}; {one.drawn.start}"
        row = (seed, one.outcome, one.steps, f"{one.apart_s:.1e}", f"{one.own_s:.1e}", f"{one.slips_apart_m:.1e}", said)
        print("| " + " | ".join(str(cell) for cell in row) + " |", flush=True)
    judged = [one for one in found if one.settled]
    wrong = [one for one in judged if not one.ok]
    ends = ", ".join(f"{count} {label}" for label, count in Counter(one.outcome for one in judged).most_common())
    print(f"\n{len(judged)} of {len(found)} judged: {ends}; {len(wrong)} differ; "
          f"times at most {max((one.apart_s for one in judged if one.ok), default=0.0):.1e} s apart")  # fmt: skip
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
