"""Compare random walks on compliant ground with the plain integration in the tests, within numerical errors.

    python scripts/contact_campaign.py                 # 200 walks, seeds 0 to 199
    python scripts/contact_campaign.py --walks 6 --seed 3
    python scripts/contact_campaign.py --walker kneed  # every third of the 200 is
    python scripts/contact_campaign.py --walker light  # feet that bounce: 0.02 to 0.4 times critical damping
    python scripts/contact_campaign.py --walker driven  # spring, damper, torque, push-offs
    python scripts/contact_campaign.py --walker uneven  # footholds of drawn heights; every other is driven
    python scripts/contact_campaign.py --walker passing  # slow starts on uneven planes: feet pass again, in the ground
    python scripts/contact_campaign.py --walker unequal  # legs that differ, all of them uneven and driven
    python scripts/contact_campaign.py --walker explicit  # feet that bounce, walked by dop853

Each walk is drawn from a seed of its own: checkerboard, after-mid-swing or plane; a free or a pinned first
stance; ground into which the weight sinks by 1 um to 1 mm, with exponents from 1 to 3 and 0.05 to 3 times critical
damping, for knees also seven times; friction from 0.05 to 3, none at times, with stiction velocities from 10 to 500
mm/s; feet from points to balls of 0.3 m; slopes from 0.3 to 4 degrees for straight legs, 2.3 to 4 for knees, whose
limbs and release are drawn too; and starts about the gait. Falls, trips, slides, flights and feet that come down on
bent knees are among the walks.

The script compares how a walk ends, and its quantities: times (touches, locks of knees, end), positions of touches,
slips, rolling, work lost by channel, and mechanical energy at the end. Each may differ by five times its numerical
error: that of the plain integration (tests/physics/hybrid/plain_walk.py), which is what halving its step changes, and
our own. We walk each at the config's tolerances, and at a hundred and ten thousand times tighter ones. The error of the
first is its change to the second. Of the others it
is the smallest change between any two of the three: otherwise a fault that comes and
goes with the tolerance would vouch for itself. The energy balance of each has to close as well. Prints a table in
Markdown (of the tightest walks), how much the default tolerances err, how well the energy balances, and which walk took
most work; exits 1 if a walk differs.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "physics" / "hybrid"))

import plain_walk

from walkerlab.config.drives import push_offs
from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.config.walkers import Kneed
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.contact_loop import EVENT_TIME
from walkerlab.physics.hybrid.contact_result import RESIDUAL_FACTOR, ContactWalkResult
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import ContactScene, contact_scene, start_state

TIMES = 5.0  # Walks may differ by this multiple of their numerical errors.
TIGHTER = (1.0, 1e-2, 1e-4)  # factors by which the tolerances of the config are multiplied
BALANCED = 5.0  # residual of an energy balance over rtol x (energy + work exchanged); fails at RESIDUAL_FACTOR
BUDGET = 5_000_000
PLAIN_STEPS_S = (4e-5, 5e-6)  # The second one is for walks that differ with the first.
PLANE_MEASURE_M = 0.45  # reference length for judging steps on ground without pads
TERRAINS = {
    "checkerboard": plain_walk.CHECKERBOARD,
    "after-mid-swing": plain_walk.AFTER_MID_SWING,
    "plane": plain_walk.PLANE,
}
RATIOS = (0.05, 0.3, 1.0, 3.0)  # ratios of damping to critical damping
LIGHT = (0.02, 0.04, 0.07, 0.12, 0.2, 0.3, 0.4)  # the same for feet that bounce
SINKS_MM = (0.001, 0.01, 0.06, 0.06, 0.2, 1.0)  # static penetrations
# One of every nine seeds has knees on ground that is damped far above critically from the first touch on. Such ground
# lets go of a foot that is still inside, and the instant of lift is hard to locate.
LOSSY = (2, 5)
SLOPE_GAIT = (0.169539, -0.6057394, -0.861714)  # at one degree: stance angle, velocities
# gait of the built-in kneed walker, with angles from the slope's normal, too
KNEED_GAIT = (0.2385854603, -0.0571481063, -1.1095873312)
KNEED_SLOPE = 0.0504
# Quantities of a walk, grouped by the natural unit of the walker in which their errors are measured.
TAU, LEG, WEIGHT = "pendulum time", "leg length", "weight times leg length"
UNITS = {
    "times (s)": TAU, "places (m)": LEG, "slip (m)": LEG, "rolling (m)": LEG, "lost (J)": WEIGHT, "energy (J)": WEIGHT,
}  # fmt: skip
Quantities = dict[str, Any]  # values by the names above


@dataclass(frozen=True)
class Drawn:
    """A walk to compare: a built-in config, changes to it, and a start state of the rigid model."""

    base: str
    sets: tuple[str, ...]
    start: tuple[float, ...]
    heights_m: tuple[float, ...] = (0.0,)  # heights of the footholds, beginning with the first stance foot's

    @property
    def ground(self) -> str:
        """Terrain and first stance."""
        named = dict(one.split("=") for one in self.sets)
        return f"{self.base}, {named['contact.terrain']}, {named['contact.stance']}"


@dataclass(frozen=True)
class Judged:
    """A walk at one tolerance, compared with the plain one: differences and allowed differences by quantity."""

    tighter: float
    outcome: str
    apart: dict[str, float]
    error: dict[str, float]

    @cached_property
    def wrong(self) -> list[str]:
        """Names of the quantities that differ by more than allowed."""
        return [name for name, apart in self.apart.items() if not apart <= TIMES * self.error[name]]


@dataclass(frozen=True)
class Compared:
    """A random walk, computed by the package and by the plain integration."""

    drawn: Drawn
    expected: str
    steps: int
    judged: tuple[Judged, ...]
    kept: float  # s, change of step times and end time from the default tolerance to the next one
    residuals: tuple[float, ...]  # residuals of the energy balances, over rtol times energy and exchanged work
    evaluations: int  # number of right-hand sides at the default tolerances

    @property
    def wrong(self) -> list[str]:
        """Descriptions of all differences."""
        ends = [f"{one.outcome}, plainly {self.expected}" for one in self.judged if one.outcome != self.expected]
        unbalanced = [
            f"energy balance at {tighter:g}"
            for tighter, residual in zip(TIGHTER, self.residuals, strict=True)
            if residual > BALANCED
        ]
        return ends + [f"{name} at {one.tighter:g}" for one in self.judged for name in one.wrong] + unbalanced


def compass(seed: int, ratios: tuple[float, ...] = RATIOS) -> Drawn:
    """Draw a variation of the paper's walker."""
    die = random.Random(seed)
    slope = die.choice((0.3, 0.7, 1.0, 1.0, 2.0, 2.8, 4.0))
    exponent = die.choice((1.0, 1.3, 1.5, 2.2, 2.2, 3.0))
    # Draw the depth to which a foot sinks rather than the stiffness, so that the ground carries the walker for every
    # exponent.
    depth_mm = die.choice(SINKS_MM)
    stiffness = 196.0 / depth_mm**exponent
    ratio = die.choice(ratios)
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
        f"contact.terrain={die.choice(tuple(TERRAINS))}",
        f"contact.stance={die.choice(('free', 'free', 'pinned'))}",
        f"contact.friction={die.choice(('coulomb',) * 19 + ('none',))}",
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


def kneed(seed: int, ratios: tuple[float, ...] = RATIOS[1:]) -> Drawn:
    """Draw a walker with knees, on ground that suits its weight."""
    die = random.Random(seed)
    thigh, shank, hip = die.uniform(0.3, 0.8), die.uniform(0.03, 0.2), die.uniform(0.2, 1.0)
    weight = 9.81 * (2.0 * (thigh + shank) + hip)
    exponent, depth_mm, ratio = die.choice((1.0, 1.5, 2.2, 2.2)), die.choice(SINKS_MM[1:]), die.choice(ratios)
    full = depth_mm
    if seed % 9 in LOSSY and ratios is not LIGHT:
        ratio, depth_mm, full = 7.0, 0.3, 0.05
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
        f"contact.terrain={die.choice(('plane', *TERRAINS))}",
        f"contact.stance={die.choice(('free', 'free', 'pinned'))}",
        f"contact.exponent={exponent}",
        f"contact.stiffness={weight / depth_mm**exponent:.6g}",
        f"contact.damping={damping:.6g}",
        f"contact.full_damping_penetration={die.choice((0.5, 1.0, 2.0)) * full:g}",
        f"contact.static_friction={static}",
        f"contact.dynamic_friction={0.75 * static:g}",
        f"contact.stiction_velocity={stiction}",
        f"contact.friction_velocity={10.0 * stiction}",
        f"contact.pad_pitch={2.0 * np.sin(half) * die.uniform(0.94, 1.03):.5f}",
    )
    angles, rates = (-half - slope, half - slope, -half - slope), (swing, stance, swing)
    return Drawn("kneed", sets, (*angles, *rates))


def both(seed: int) -> Drawn:
    """Draw a walker, every third one with knees."""
    return kneed(seed) if seed % 3 == 2 else compass(seed)


def light(seed: int) -> Drawn:
    """Draw a walker on lightly damped ground, where feet bounce and the clipped force vanishes again and again."""
    return kneed(seed, LIGHT) if seed % 3 == 2 else compass(seed, LIGHT)


def driven(seed: int) -> Drawn:
    """Draw a walker with a spring, a damper and a torque between the legs, in proportion to its weight. Every other one
    pushes off.
    """
    one, die = both(seed), random.Random(seed)
    weight = 1.0 if one.base == "paper" else 0.08
    keys = {"spring_N_m_per_rad": (0.0, 20.0), "damping_N_m_s_per_rad": (0.0, 0.5), "torque_N_m": (-1.0, 2.0)}
    hip = tuple(f"walker.hip.{key}={weight * die.uniform(*ends):.4f}" for key, ends in keys.items())
    impulse = weight * die.uniform(0.1, 2.0) if seed % 2 else 0.0
    push = (f"push_off.impulse_N_s={impulse:.4f}", f"push_off.duration_s={die.choice((0.002, 0.01, 0.05, 0.2))}")
    return Drawn(one.base, (*one.sets, *hip, *push), one.start)


def uneven(seed: int) -> Drawn:
    """Draw a walker on footholds whose random heights range from a tenth to 1e-4 of a leg. Every other walker is
    driven.
    """
    one, die = (driven if seed % 2 else both)(seed), random.Random(seed)
    share = die.choice((1e-1, 1e-2, 1e-3, 1e-3, 1e-4))
    return replace(one, heights_m=(0.0, *(die.gauss(0.0, share) for _ in range(4))))


def passing(seed: int) -> Drawn:
    """Draw a walker on uneven planes. It starts too slowly to get past the upright position, so its feet pass each
    other again inside the ground. Most walkers have point feet, which come down on each other as they pass.
    """
    one, die = uneven(seed), random.Random(seed)
    angles, rates = np.array(one.start).reshape(2, -1)
    sets = (
        f"contact.terrain={die.choice(('after-mid-swing', 'after-mid-swing', 'plane'))}",
        "contact.stance=free",
        *(() if seed % 4 == 0 else ("walker.foot_radius_m=0.0",)),
    )
    slower = die.uniform(0.2, 0.9) * rates
    return replace(one, sets=(*one.sets, *sets), start=(*angles.tolist(), *slower.tolist()))


def unequal(seed: int) -> Drawn:
    """Draw a driven walker on uneven ground, whose second leg has other dimensions, masses and push-off."""
    one, die = replace(driven(seed), heights_m=uneven(seed).heights_m), random.Random(seed)
    walker = load(Path(one.base), one.sets).config.walker
    near = {
        "leg_length_m": 3e-3,
        "length_m": 3e-3,
        "foot_radius_m": 0.2,
    }  # largest relative changes; all other keys change by at most 0.1

    def beside(block: Any, *names: str) -> str:
        shares = ((name, die.uniform(-1.0, 1.0) * near.get(name, 0.1)) for name in names)
        return ", ".join(f"{name}: {getattr(block, name) * (1.0 + share):.6f}" for name, share in shares)

    if isinstance(walker, Kneed):
        thigh = beside(walker.thigh, "length_m", "mass_kg", "mass_below_hip_m")
        shank = beside(walker.shank, "length_m", "mass_kg", "mass_below_knee_m")
        leg = f"thigh: {{{thigh}}}, shank: {{{shank}}}, {beside(walker, 'foot_radius_m')}"
    else:
        leg = beside(walker, "leg_length_m", "foot_to_mass_m", "leg_mass_kg", "leg_inertia_kg_m2", "foot_radius_m")
    weight = 1.0 if one.base == "paper" else 0.08
    sets = (f"walker.leg_2={{{leg}}}", f"push_off.leg_2.impulse_N_s={weight * die.uniform(0.1, 2.0):.4f}")
    changed = load(Path(one.base), (*one.sets, *sets)).config
    swing, stance, *others = one.start
    behind = changed.walker.swing_angle(stance + changed.slope_rad)
    swing = swing if behind is None else behind - changed.slope_rad
    shank_angle = [swing] if isinstance(walker, Kneed) else []
    return replace(one, sets=(*one.sets, *sets), start=(swing, stance, *shank_angle, *others[len(shank_angle) :]))


def explicit(seed: int) -> Drawn:
    """Draw a walker on lightly damped ground for dop853. Its long steps of high order make the energy balance harder to
    close.
    """
    one = light(seed)
    return replace(one, sets=(*one.sets, "solver.contact.method=dop853"))


WALKERS = {
    "both": both, "compass": compass, "kneed": kneed, "light": light, "driven": driven, "uneven": uneven,
    "passing": passing, "unequal": unequal, "explicit": explicit,
}  # fmt: skip


def plain_scene(config: Config, pitch_m: float, heights_m: tuple[float, ...]) -> plain_walk.Plain:
    """Build the same walker and ground for the plain integration."""
    walker, contact = config.walker, config.contact
    assert contact is not None, "drawn with one"
    si = contact.to_si()
    smooth = contact.friction == "none"
    legs = plain_walk.replace_second_leg(plain_legs(walker), plain_legs(walker.second))
    return plain_walk.Plain(
        *legs, walker.leg_length_m, config.gravity_m_s2, config.slope_rad, si.stiffness,
        si.exponent, si.damping, si.full_damping_penetration, 0.0 if smooth else si.static_friction,
        0.0 if smooth else si.dynamic_friction, si.stiction_velocity, si.friction_velocity,
        TERRAINS[contact.terrain], pitch_m, at_touch(walker), np.array(walker.hip.parameters),
        np.array(push_offs(config.push_off)), config.push_off.duration_s, np.array(heights_m),
    )  # fmt: skip


def plain_legs(walker: Any) -> tuple[Any, ...]:
    """Return masses, levers, inertias and feet of a compass, or of a walker with knees."""
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
    """Whether the trailing knee is released at the first touch of the other foot."""
    return isinstance(walker, Kneed) and walker.knee.release == "touch"


def plainly(scene: plain_walk.Plain, start: Any, pinned: bool, steps: int, step_s: float) -> plain_walk.Walked:
    """Return the walk of the plain integration."""
    # The stance leg is one body in the rigid model. Its angle and its rate come second.
    angles, rates = np.array(start).reshape(2, -1)
    straight = [0, 1] if angles.size == 2 else [0, 1, 2, 1]
    y = plain_walk.start(scene, angles[straight], rates[straight], pinned)
    return plain_walk.walk(scene, y, steps, step_s, 1 if pinned else -1)


def of_plain(plain: plain_walk.Plain, walk: plain_walk.Walked) -> Quantities:
    """Return the compared quantities of the plain walk."""
    times = np.concatenate((walk.times, walk.locks[: walk.times.size], [walk.end_s]))
    energy = plain_walk.energy(plain, walk.ground, walk.levels, walk.end)
    return dict(zip(UNITS, (times, walk.places, walk.slips, walk.rolled, walk.lost, np.array([energy])), strict=True))


def of_ours(plain: plain_walk.Plain, plainly: plain_walk.Walked, walk: ContactWalkResult) -> Quantities:
    """Return the compared quantities of our walk. Its energy is computed by the plain formula, with the ground as it is
    at the end of the plain walk.
    """
    times = np.concatenate((walk.touch_time_s, walk.knee_strikes_s, [walk.end_time_s]))
    lost = walk.dissipated_J[: len(plain_walk.CHANNELS)]
    energy = plain_walk.energy(
        plain, plainly.ground, plainly.levels, plain_walk.of_centre(plain, np.array(walk.end_state))
    )
    found = (times, walk.touch_along_m, walk.slip_m, walk.rolling_m, lost, np.array([energy]))
    return dict(zip(UNITS, found, strict=True))


def rounding(plain: plain_walk.Plain, rounds: int) -> dict[str, float]:
    """Bound the effect of rounding on each quantity by the sum over all steps of the plain integration.

    The time of an event is only known up to rounding. In that time the walker moves by the same fraction of its natural
    units as the time is of a pendulum time.
    """
    tau, weight = (plain.leg / plain.gravity) ** 0.5, plain.gravity * plain.masses.sum()
    share = rounds * np.finfo(float).eps + EVENT_TIME / tau
    units = {TAU: tau, LEG: plain.leg, WEIGHT: weight * plain.leg}
    return {name: share * units[unit] for name, unit in UNITS.items()}


def scene_of(drawn: Drawn) -> tuple[Config, ContactScene]:
    """Build the scene of a drawn walk."""
    config = load(Path(drawn.base), drawn.sets).config
    assert config.contact is not None, "drawn with one"
    pitch = config.contact.pad_pitch
    return config, contact_scene(config, PLANE_MEASURE_M if isinstance(pitch, str) else pitch)


def ours_at(scene: ContactScene, config: Config, drawn: Drawn, steps: int, tighter: float) -> ContactWalkResult:
    """Return our walk at the config's tolerances, or at tighter ones."""
    settings = config.solver.contact
    tolerances = Tolerances(settings.method, tighter * settings.rtol, tighter * settings.atol, BUDGET)
    heights = np.array(drawn.heights_m) if len(drawn.heights_m) > 1 else None
    return scene.walk(start_state(scene, drawn.start), steps, tolerances, heights=heights)


def compare(drawn: Drawn, steps: int) -> Compared:
    """Compute a random walk both ways. If the walks differ, compare again with a shorter plain step, because halving
    the step may change little by chance, which makes the numerical error too small.
    """
    long, short = PLAIN_STEPS_S
    one = compare_with(long, drawn, steps)
    return compare_with(short, drawn, steps) if one.wrong else one


def compare_with(step_s: float, drawn: Drawn, steps: int) -> Compared:
    """Compute a random walk both ways, with plain steps of at most `step_s` and of half that length."""
    (config, scene), start = scene_of(drawn), drawn.start
    plain, pinned = plain_scene(config, scene.pitch_m, drawn.heights_m), scene.pinned
    coarse, fine = (plainly(plain, start, pinned, steps, h) for h in (step_s, 0.5 * step_s))
    expected = of_plain(plain, fine)
    plain_error = apart(of_plain(plain, coarse), expected)
    floor = rounding(plain, fine.rounds)
    walks = [ours_at(scene, config, drawn, steps, tighter) for tighter in TIGHTER]
    found = [of_ours(plain, fine, walk) for walk in walks]
    first, *others = (apart(one, other) for one, other in combinations(found, 2))
    settled = {name: min(first[name], *(other[name] for other in others)) for name in UNITS}
    judged = []
    for tighter, walk, one, own in zip(TIGHTER, walks, found, (first, settled, settled), strict=True):
        error = {name: own[name] + plain_error[name] + floor[name] for name in UNITS}
        judged.append(Judged(tighter, walk.outcome.label, apart(one, expected), error))
    residuals = tuple(RESIDUAL_FACTOR * walk.energy_balance_residual_J / walk.explained_residual_J for walk in walks)
    return Compared(
        drawn,
        Outcome(fine.outcome).label,
        fine.times.size,
        tuple(judged),
        first["times (s)"],
        residuals,
        walks[0].work[0],
    )


def apart(one: Quantities, other: Quantities) -> dict[str, float]:
    """Return the largest difference by quantity, or infinity for rows of different length."""
    return {name: largest(one[name], other[name]) for name in UNITS}


def largest(one: Any, other: Any) -> float:
    """Return the largest difference between two rows of numbers, or infinity if their lengths differ."""
    return float(np.max(np.abs(one - other), initial=0.0)) if one.size == other.size else float("inf")


def spread(numbers: list[float]) -> str:
    """Format the median, the 90 % quantile and the maximum."""
    median, most, largest = np.quantile(numbers, (0.5, 0.9, 1.0))
    return f"{median:.2g} (median), {most:.2g} (90 %), {largest:.2g} (largest)"


def arguments(about: str | None, walks: int, steps: int) -> argparse.Namespace:
    """Parse the selection and length of walks, for a script with the description `about`."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walker", choices=tuple(WALKERS), default="both")
    parser.add_argument("--walks", type=int, default=walks)
    parser.add_argument("--steps", type=int, default=steps)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def walks_of(chosen: argparse.Namespace) -> Iterator[tuple[int, Drawn]]:
    """Yield the selected walks with their seeds."""
    return ((seed, WALKERS[chosen.walker](seed)) for seed in range(chosen.seed, chosen.seed + chosen.walks))


def tell_row(*cells: object) -> None:
    """Print a row of a table in Markdown."""
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def main() -> None:
    """Run the campaign."""
    chosen = arguments(__doc__, walks=200, steps=3)
    found: list[Compared] = []
    tell_row("seed", "walk", "ends", "steps", *(f"{name}: apart, error" for name in UNITS), "")
    tell_row(*["---"] * (5 + len(UNITS)))
    for seed, drawn in walks_of(chosen):
        one = compare(drawn, chosen.steps)
        found.append(one)
        said = f"{', '.join(one.wrong)}: {' '.join(one.drawn.sets)}; {one.drawn.start}" if one.wrong else ""
        last = one.judged[-1]
        numbers = (f"{last.apart[name]:.1e}, {last.error[name]:.1e}" for name in UNITS)
        tell_row(seed, one.drawn.ground, last.outcome, one.steps, *numbers, said)
    wrong = [one for one in found if one.wrong]
    ends = ", ".join(f"{count} {label}" for label, count in Counter(one.expected for one in found).most_common())
    print(f"\n{len(found)} walks: {ends}; {len(wrong)} differ")
    grounds = Counter(one.drawn.ground for one in found)
    print("; ".join(f"{count} {ground}" for ground, count in sorted(grounds.items())))
    (seed, _), most = max(zip(walks_of(chosen), found, strict=True), key=lambda pair: pair[1].evaluations)
    print(f"most work: seed {seed}, {most.evaluations} right-hand sides in {most.steps} steps and how it ended")
    right = [one for one in found if not one.wrong]
    if right:
        tell_spreads(right)
    sys.exit(1 if wrong else 0)


def tell_spreads(right: list[Compared]) -> None:
    """Print the errors at the default tolerances and the residuals of the energy balance."""
    print("at the default tolerances times err by (s)", spread([one.kept for one in right]))
    for number, tighter in enumerate(TIGHTER):
        residuals = [one.residuals[number] for one in right]
        print(f"energy balance at {tighter:g} of these, over rtol x (energy + work exchanged):", spread(residuals))


if __name__ == "__main__":
    main()
