"""Find gaits of random walkers of every type, and compare the multipliers of each chosen gait with simulated steps.

    python scripts/walker_campaign.py                         # 200 walkers of each type, some two minutes
    python scripts/walker_campaign.py --walkers 20 --types kneed --seed 3

Four things are checked:

- Every search ends in a gait or in an explanation. If it finds no gait, SciPy's `root` tries the step map from 40 other
  starts that walk; a gait that it finds was overlooked.
- The multipliers of a chosen gait agree with walks that start 1e-6, and half of that, to either side of it along every
  coordinate of the step map (unit leg length and gravity). As long as these walks stay within 1e-3 of the gait by
  theory, the trace of the derivative observed over k steps must be the sum of the k-th powers of the multipliers.
- The heel strike of every gait needs the impulse by which the momentum, summed over the masses, changes. A gait is
  rejected if the ground would have to pull.
- The first walkers of a type walk over rough ground from a start near their gait, some of them until a foot lands just
  ahead of the other. SciPy takes the same steps.
`light-hips` are the compasses whose gaits are hardest to follow
from a vanishing slope: without any start drawn at random both ordinary gaits must be found by name, and each repeat
itself in one step of SciPy's DOP853. `kneed-torque` have a constant torque and a spring at the hip: the cost of
transport of each gait is compared with SciPy's integral of the positive power.
The script prints a table in Markdown, then what went wrong, and exits 1 if anything did.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from plain_rigid_walk import plain_walk
from rigid_physics import momentum_of_masses, torque_work_of_a_step

from walkerlab.config.walkers import CompassWalker, Kneed, KneeJoint, PartsWalker, Shank, StraightLegs, Thigh, Torso
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.hybrid.rigid_walk import SHORTEST_LANDING
from walkerlab.physics.mechanics.hinges import HIP_ROW, TORQUE
from walkerlab.physics.mechanics.parts import Assembly
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits.fixed_point import (
    MAX_START,
    MIN_START,
    GaitSearch,
    RigidGait,
    Search,
    SearchSettings,
    find_gaits,
)
from walkerlab.physics.orbits.rigid_map import SHORTEST_STEP, coordinates_of, state_on_section, strike_section
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.orbits.small_slope import LONG_PERIOD, SHORT_PERIOD
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.parts import AnyWalker, assembly_of, knee_locked_at_strike

Draw = np.random.Generator
STEPS = 10
ASIDE = 1e-6  # distance of starts from the gait, in units of leg length and gravity
STILL_LINEAR = 1e-3  # distance from the gait up to which the derivative predicts a walk
# allowed difference of traces, relative to the derivative; covers rounding, divided by ASIDE, and curvature
AGREES = 1e-4
IMPULSES = 1e-8  # N s, allowed difference of impulses for a walker of some kilograms
COSTS = 1e-7  # relative error of an integral whose power has a kink at each turn of the legs
RTOL, ATOL, BUDGET = 1e-12, 1e-15, 1_000_000
LONGEST_SEARCH_S = 60.0  # processor time (s); a longer search would look to a user as if it hung
SETTINGS = SearchSettings(random_starts=30)
FOLLOWED_ONLY = SearchSettings(random_starts=0, further_starts=0)
RETURNS_TO = 1e-7  # rad, rad/s: the tolerance of 1e-11, magnified by the multipliers of an unstable gait
# If no gait is found: number of random starts, number of them that are tried, and maximum number of step maps for each.
OTHER_STARTS, TRIED, EVALUATIONS = 3000, 40, 60
ROUGH_WALKERS, ROUGH_STEPS = (
    10,
    4,
)  # number of walkers of a type, and number of steps; with these SciPy takes some seconds
# maximum roughness over the leg length; smallest and largest initial rates over those of the gait
ROUGHEST, SLOWEST, FASTEST = 0.01, 0.75, 1.05
SAME_TIME = 1e-6  # s, allowed difference of touch times
SOLVED, APART = 1e-9, 1e-3  # residual of a gait; minimum of half the angle between its legs (rad)


def straight_legs(draw: Draw) -> StraightLegs:
    """Draw a walker with arc or point feet, and centres of mass off the line of the legs."""
    radius = float(draw.choice((0.0, draw.uniform(0.02, 0.4))))
    return StraightLegs(
        type="straight-legs",
        leg_length_m=1.0,
        leg_mass_kg=1.0,
        leg_mass_below_hip_m=draw.uniform(0.2, 0.7),
        leg_mass_ahead_m=draw.uniform(-0.02, 0.02),
        leg_inertia_kg_m2=draw.uniform(0.0, 0.08),
        hip_mass_kg=draw.uniform(0.0, 4.0),
        foot_radius_m=radius,
        foot_centre_ahead_m=draw.uniform(0.0, 0.03) if radius else 0.0,
    )


def kneed(draw: Draw, at_heel_strike: Literal["locked", "free"] = "locked") -> Kneed:
    """Draw a walker with light shanks, and knees around the middle of the legs."""
    upper = draw.uniform(0.4, 0.6)
    return Kneed(
        type="kneed",
        thigh=Thigh(
            length_m=upper,
            mass_kg=0.5,
            mass_below_hip_m=upper * draw.uniform(0.3, 0.8),
            inertia_kg_m2=draw.uniform(0.0, 0.005),
        ),
        shank=Shank(
            length_m=1.0 - upper,
            mass_kg=draw.uniform(0.02, 0.15),
            mass_below_knee_m=draw.uniform(0.1, 0.25),
            inertia_kg_m2=draw.uniform(0.0, 0.001),
        ),
        hip_mass_kg=draw.uniform(0.2, 2.0),
        foot_radius_m=float(draw.choice((0.0, draw.uniform(0.02, 0.25)))),
        knee=KneeJoint(at_heel_strike=at_heel_strike),
    )


def kneed_free(draw: Draw) -> Kneed:
    """Draw a kneed walker whose trailing knee is free during the heel strike."""
    return kneed(draw, "free")


def kneed_with_torso(draw: Draw) -> Kneed:
    """Draw a walker with shanks of up to a third of the mass of the thighs, and an upper body."""
    upper = draw.uniform(0.35, 0.65)
    return Kneed(
        type="kneed",
        thigh=Thigh(
            length_m=upper,
            mass_kg=1.0,
            mass_below_hip_m=upper * draw.uniform(0.3, 0.8),
            inertia_kg_m2=draw.uniform(0.0, 0.01),
        ),
        shank=Shank(
            length_m=1.0 - upper,
            mass_kg=draw.uniform(0.02, 0.3),
            mass_below_knee_m=draw.uniform(0.05, 0.25),
            mass_ahead_m=draw.uniform(-0.005, 0.005),
        ),
        hip_mass_kg=draw.uniform(0.0, 2.0),
        foot_radius_m=float(draw.choice((0.0, draw.uniform(0.02, 0.25)))),
        torso=Torso(mass_kg=draw.uniform(0.1, 2.0), above_hip_m=draw.uniform(0.05, 0.5)),
    )


def torso(draw: Draw) -> CompassWalker:
    """Draw a compass with an upper body."""
    return CompassWalker(
        leg_mass_kg=5.0,
        foot_to_mass_m=draw.uniform(0.3, 0.7),
        hip_mass_kg=draw.uniform(0.0, 10.0),
        torso=Torso(
            mass_kg=draw.uniform(0.5, 10.0),
            above_hip_m=draw.uniform(0.05, 0.5),
            inertia_kg_m2=draw.uniform(0.0, 0.5),
        ),
    )


def parts(draw: Draw) -> PartsWalker:
    """Draw a kneed walker of no built-in type: a particle on each shank, and soles off the line of the legs."""
    upper, radius = draw.uniform(0.4, 0.6), draw.uniform(0.0, 0.2)
    thigh = {"mass_kg": 0.5, "centre_m": [draw.uniform(-0.01, 0.01), -upper * draw.uniform(0.4, 0.8)]}
    shank = {"mass_kg": draw.uniform(0.02, 0.1), "centre_m": [0.0, draw.uniform(-0.2, -0.1)]}
    foot = {"centre_m": [draw.uniform(0.0, 0.02), radius + upper - 1.0], "radius_m": radius}
    ankle = {"mass_kg": draw.uniform(0.0, 0.02), "at_m": [0.0, upper - 0.95]}
    knee = {"parent_point_m": [0.0, -upper], "child_point_m": [0.0, 0.0], "locks": True}
    hip = {"parent_point_m": [0.0, 0.0], "child_point_m": [0.0, 0.0]}
    return PartsWalker.model_validate({
        "type": "parts",
        "leg_length_m": 1.0,
        "bodies": [{"name": f"thigh {k}", **thigh} for k in (1, 2)] + [{"name": f"shank {k}", **shank} for k in (1, 2)],
        "hinges": [{"name": "hip", "parent": "thigh 2", "child": "thigh 1", **hip}]
        + [{"name": f"knee {k}", "parent": f"thigh {k}", "child": f"shank {k}", **knee} for k in (1, 2)],
        "particles": [{"name": "hip", "mass_kg": draw.uniform(0.2, 2.0), "body": "thigh 2", "at_m": [0.0, 0.0]}]
        + [{"name": f"ankle {k}", "body": f"shank {k}", **ankle} for k in (1, 2)],
        "feet": [{"body": f"shank {k}", **foot} for k in (1, 2)],
        "legs": [["thigh 1", "shank 1"], ["thigh 2", "shank 2"]],
    })  # fmt: skip


def light_hips(draw: Draw) -> CompassWalker:
    """Draw a compass whose hip is no heavier than a leg, and whose leg masses lie within a quarter of the leg from the
    foot.
    """
    return CompassWalker(
        leg_length_m=1.0,
        foot_to_mass_m=draw.uniform(0.02, 0.25),
        leg_mass_kg=1.0,
        hip_mass_kg=10.0 ** draw.uniform(-2.0, 0.0),
        leg_inertia_kg_m2=float(draw.choice((0.0, draw.uniform(0.0, 0.03)))),
    )


def torque_and_spring(draw: Draw) -> dict[str, Any]:
    """Draw a constant torque and a spring at the hip, and return them as fields of the rigid model."""
    return {"hip": (draw.uniform(0.0, 3.0), 0.0, draw.uniform(0.02, 0.4))}


TYPES: dict[str, Callable[[Draw], AnyWalker]] = {
    "light-hips": light_hips,
    "straight-legs": straight_legs,
    "kneed": kneed,
    "kneed-free": kneed_free,
    "kneed-torque": kneed,
    "kneed-torso": kneed_with_torso,
    "torso": torso,
    "parts": parts,
}


@dataclass
class Tally:
    """Results of the searches for one type of walker."""

    ends: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    slowest_s: float = 0.0
    steps_seen: int = 0  # number of steps over which multipliers were checked
    short_landings: int = 0  # number of walks on rough ground that end because a foot lands just ahead of the other
    overlooked: int = 0  # number of walkers for which only another method finds a gait


def tally(name: str, walkers: int, seed: int) -> Tally:
    """Search for gaits of random walkers of one type, and count the results."""
    draw, found = np.random.default_rng(seed), Tally()
    for index in range(walkers):
        light = name == "light-hips"
        described, slope = TYPES[name](draw), float(10.0 ** draw.uniform(*((-3.5, -1.3) if light else (-2.3, -1.0))))
        assembly = assembly_of(described, rigid=True)
        walker = rigid_on_slope(assembly, 9.81, slope, knee_locked_at_strike(described))
        if name == "kneed-torque":
            walker = walker.changed(**torque_and_spring(draw))
        start = time.process_time()
        search = find_gaits(walker, settings=FOLLOWED_ONLY if light else SETTINGS)
        # The first search of a type compiles, so it may take longer.
        spent = time.process_time() - start if index else 0.0
        found.slowest_s = max(found.slowest_s, spent)
        faults, steps = (ordinary_faults(walker, search), 0) if light else judged(walker, search)
        found.steps_seen += steps
        faults += impulse_faults(assembly, walker, search) + cost_faults(walker, search)
        if index < ROUGH_WALKERS and search.gait is not None:
            rough, short = rough_walk(walker, search.gait, np.random.default_rng((seed, index)))
            faults, found.short_landings = faults + rough, found.short_landings + short
        if spent > LONGEST_SEARCH_S:
            faults.append(f"the search took {spent:.0f} s")
        found.ends[end_of(search)] += 1
        found.overlooked += not search.gaits and overlooks(walker)
        found.wrong += [f"{name} {index} at {slope:.4g} rad: {fault}" for fault in faults]
    return found


def end_of(search: GaitSearch) -> str:
    """Describe the result of a search."""
    if search.gait is None:
        return "only gaits that cannot be walked" if search.gaits else "none found"
    return "a stable gait" if search.gait.stable else "an unstable gait"


def overlooks(walker: RigidModel) -> bool:
    """Whether another method finds a gait of a walker for which a search finds none."""
    search = Search(walker)
    looking, still = search.looking, search.walker.slope + search.walker.lean
    section = strike_section(search.walker)
    d = len(search.walker.section_indices)
    starts = np.random.default_rng(7).uniform(MIN_START[:d], MAX_START[:d], (OTHER_STARTS, d))
    starts[:, 0] = 0.5 * starts[:, 0] - still

    def residual(z: NDArray[np.float64]) -> NDArray[np.float64]:
        step = looking.walk(section, z, derived=False)
        return step.z[0] - z if step.time.size else np.ones(d)

    walking = [z for z in starts if looking.walk(section, z, derived=False).time.size]
    for z in walking[:TRIED]:
        solved = root(residual, z, options={"maxfev": EVALUATIONS})
        step = looking.walk(section, solved.x, derived=False)
        left = np.abs(residual(solved.x)).max()
        if left < SOLVED and abs(solved.x[0] + still) > APART and step.time[0] > SHORTEST_STEP:
            return True
    return False


def judged(walker: RigidModel, search: GaitSearch) -> tuple[list[str], int]:
    """Return the faults of a search's result, and the number of steps over which multipliers were checked."""
    if search.gait is None:
        return ([] if search.reason else ["no gait and no reason"]), 0
    faults = [f"the chosen gait cannot be walked: {objection}" for objection in search.gait.objections]
    steps = 0
    for steps, (seen, expected, size) in enumerate(traces(walker, search.gait), 1):
        if abs(seen - expected) > AGREES * max(1.0, size):
            faults.append(f"{steps} steps do {seen:.6g} to starts aside, the multipliers {expected:.6g}")
            break
    if steps < STEPS and search.gait.stable and not faults:
        faults.append(f"the stable gait is walked for {steps} steps only")
    return faults, steps


def impulse_faults(assembly: Assembly, walker: RigidModel, search: GaitSearch) -> list[str]:
    """Yield a fault if a heel strike has another impulse than the momentum of the masses requires, or needs a pull that
    was not reported.
    """
    faults = []
    for gait in search.gaits:
        step = take_walk(walker, Tolerances("dop853", RTOL, ATOL, BUDGET), gait.state, 1)
        before, after = (momentum_of_masses(assembly, walker.slope, y[0])[1] for y in (step.before, step.after))
        told, said = gait.min_normal_impulse, any("in a strike" in one for one in gait.objections)
        # With knees, the other strike may be the one with the smaller impulse.
        off = told - (after - before)
        if off > IMPULSES or (off < -IMPULSES and gait.knee_strike is None) or said != (told < 0.0):
            faults.append(f"a heel strike's impulse is {after - before:.6g} N s, told is {told:.6g}")
    return faults


def cost_faults(walker: RigidModel, search: GaitSearch) -> list[str]:
    """Yield a fault if the cost of transport of a gait differs from a plain integral of gravity's work and the positive
    work of the torque.
    """
    faults = []
    for gait in search.gaits if walker.laws[HIP_ROW, TORQUE] != 0.0 else ():
        step = take_walk(walker, Tolerances("dop853", RTOL, ATOL, BUDGET), gait.state, 1)
        _, positive = torque_work_of_a_step(walker, gait.state, step)
        cost = math.sin(walker.slope) + positive / (walker.mass * walker.gravity * step.lengths_m[0])
        if abs(gait.cost_of_transport - cost) > COSTS * cost:
            faults.append(f"the gait of {gait.period:.4g} s costs {cost:.10g}, told is {gait.cost_of_transport:.10g}")
    return faults


def rough_walk(walker: RigidModel, gait: RigidGait, draw: Draw) -> tuple[list[str], bool]:
    """Simulate a walk over random heights that starts near a gait. Return its fault, if any, and whether a foot landed
    just ahead of the other.
    """
    n, nearest = len(gait.state) // 2, SHORTEST_LANDING * gait.step_length
    share = draw.uniform(SLOWEST, FASTEST)
    start = (*gait.state[:n], *(share * rate for rate in gait.state[n:]))
    heights = np.append(0.0, draw.normal(0.0, draw.uniform(0.0, ROUGHEST) * walker.leg_length, ROUGH_STEPS))
    tolerances = Tolerances("dop853", RTOL, ATOL, BUDGET)
    walk = take_walk(walker, tolerances, start, ROUGH_STEPS, heights=heights, step_length=gait.step_length)
    touches, outcome, ahead = plain_walk(walker, np.array(start), heights, nearest)
    ended = Outcome.WALKED if walk.outcome is Outcome.LIFTED_OFF else walk.outcome
    faults = []
    if (ended, walk.steps) != (outcome, len(touches)):
        faults.append(
            f"on rough ground: {ended.label} after {walk.steps}, by SciPy {outcome.label} after {len(touches)}"
        )
    elif walk.steps and np.abs(walk.touch_time_s - touches[:, 0]).max() > SAME_TIME:
        faults.append(f"on rough ground feet land at {walk.touch_time_s}, by SciPy at {touches[:, 0]}")
    return faults, bool(ahead) and ahead[-1] < nearest


def ordinary_faults(walker: RigidModel, search: GaitSearch) -> list[str]:
    """Yield faults of the two ordinary gaits, one of which is the chosen gait."""
    found = {name: [gait for gait in search.gaits if name in gait.found_by] for name in (LONG_PERIOD, SHORT_PERIOD)}
    faults = [f"no gait from the {name}" for name, gaits in found.items() if not gaits]
    if not faults and found[LONG_PERIOD] == found[SHORT_PERIOD]:
        faults.append("both seeds lead to one gait")
    for gait in search.gaits:
        step = take_walk(walker, Tolerances("scipy-dop853", 1e-11, 1e-13, BUDGET), gait.state, 1)
        if step.steps < 1 or np.abs(np.subtract(step.final_state, gait.state)).max() > RETURNS_TO:
            faults.append(f"the gait of {gait.period:.4g} s does not repeat itself")
    walkable = [gait for gait in search.gaits if not gait.objections]
    if walkable and search.gait != min(walkable, key=lambda gait: gait.spectral_radius):
        faults.append("the gait chosen is not the least unstable one")
    return faults


def traces(walker: RigidModel, gait: RigidGait) -> Iterator[tuple[float, float, float]]:
    """Yield, for each number of steps from one to ten, the trace of the observed derivative, the sum of powers of the
    multipliers, and the norm of the derivative. Stop when the walks are no longer close enough to the gait for a linear
    prediction, or when one ends.
    """
    unit, units = unit_walker(walker)
    n = len(gait.state) // 2
    z = coordinates_of(unit, (*gait.state[:n], *(rate * units.time for rate in gait.state[n:])))
    whole, half = (differences(unit, z, aside) for aside in (ASIDE, 0.5 * ASIDE))
    for k in range(min(len(whole), len(half))):
        # The effect of curvature is proportional to the square of this distance.
        seen = (4.0 * half[k] - whole[k]) / 3.0
        size = float(np.linalg.norm(seen))
        if size * ASIDE > STILL_LINEAR:
            return
        yield float(np.trace(seen)), sum(value ** (k + 1) for value in gait.multipliers).real, size


def differences(walker: RigidModel, z: NDArray[np.float64], aside: float) -> NDArray[np.float64]:
    """Return the differences (steps, d, d) between walks that start on either side of z, per distance between the
    starts.
    """
    pairs = [(walked(walker, z + move), walked(walker, z - move)) for move in aside * np.eye(z.size)]
    steps = min(len(walk) for pair in pairs for walk in pair)
    return np.array([[(ahead[k] - behind[k]) / (2.0 * aside) for ahead, behind in pairs] for k in range(steps)])


def walked(walker: RigidModel, z: NDArray[np.float64]) -> list[Any]:
    """Return the section coordinates after each of ten steps from z."""
    tolerances = Tolerances("dop853", RTOL, ATOL, BUDGET)
    return [
        coordinates_of(walker, y)
        for y in take_walk(walker, tolerances, state_on_section(walker, z.tolist()), STEPS).after
    ]


ENDS = ("a stable gait", "an unstable gait", "only gaits that cannot be walked", "none found")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign, and return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--walkers", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--types", nargs="+", choices=TYPES, default=list(TYPES))
    options = parser.parse_args(arguments)
    others = ("overlooked", "steps held against multipliers", "short landings", "longest search", "faults")
    print(f"| {' | '.join(('type', *ENDS, *others))} |")
    print("|---" * (1 + len(ENDS) + len(others)) + "|")
    wrong: list[str] = []
    for name in options.types:
        found = tally(name, options.walkers, options.seed)
        counts = " | ".join(str(count) for count in (*(found.ends[end] for end in ENDS), found.overlooked))
        seen = f"{found.steps_seen} | {found.short_landings}"
        row = f"| `{name}` | {counts} | {seen} | {found.slowest_s:.1f} s | {len(found.wrong)} |"
        print(row, flush=True)
        wrong += found.wrong
    print("\n".join(wrong))
    return int(bool(wrong))


if __name__ == "__main__":
    raise SystemExit(main())
