"""Suggest changes that give a walker a gait: feet ahead of the shanks, or another slope.

For kneed walkers, the search also moves the feet slightly ahead of the shanks, as in real machines. It looks for gaits
on a few slopes and follows their branches as the slope changes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from walkerlab.config import files, loader, reads, schema, walkers
from walkerlab.physics.orbits import fixed_point, rigid_map
from walkerlab.physics.orbits.families import BranchFollower, GaitBranch, Seed, ValueSpan
from walkerlab.scene.parameter import SLOPE, Parameter
from walkerlab.scene.rigid import rigid_walker

SLOPE_FACTORS = (0.7, 1.5, 2.3, 0.35, 0.1)  # slopes to try in this order, relative to the config's slope
# rad. Most walkers that have gaits have them on these slopes.
COMMON_SLOPES = (0.03, 0.12)
# rad. Gaits are followed at least to the first slope, and at most to the second.
MIN_FOLLOWED_TO = 0.2
MAX_FOLLOWED_TO = 0.35
SUGGESTION_SEARCH = fixed_point.SearchSettings(random_starts=50, further_starts=100)
SUGGESTION_POINTS = 60  # maximum number of points of a branch
INSET = 0.1  # distance kept from the end of a range, as a fraction of the range
FOOT_KEY = "foot_centre_ahead_m"
FOOT_SHARES = (0.02, 0.03, 0.04, 0.05)  # distances of the feet ahead of the shanks, in leg lengths


@dataclass(frozen=True)
class SlopeRange:
    """Range of slopes (rad) with gaits, and the part of it with stable gaits, or None if no gait is stable."""

    slopes: tuple[float, float]
    stable: tuple[float, float] | None

    def nearest_slope(self, target: float) -> float:
        """Find the end of the range (of the stable gaits, if there are any) that is nearer to `target`, and return a
        slope just inside it.
        """
        low, high = self.stable or self.slopes
        near, far = (low, high) if abs(low - target) < abs(high - target) else (high, low)
        return near + INSET * (far - near)


def find_slopes_with_gaits(config: schema.Config) -> SlopeRange | None:
    """Return the nearest range of slopes with gaits, or None if no gait is found. Stable gaits take precedence."""
    slope = config.slope_rad
    span = ValueSpan(0.02 * slope, min(MAX_FOLLOWED_TO, max(3.0 * slope, MIN_FOLLOWED_TO)))
    ranges: list[SlopeRange] = []
    for value in (*(factor * slope for factor in SLOPE_FACTORS), *COMMON_SLOPES):
        # A search is slow, so it stops at the first stable gaits.
        if value in span and not any(candidate.stable for candidate in ranges):
            ranges += walkable_ranges(follow(SLOPE.vary(config, rigid_walker), span, value))
    return min(ranges, key=lambda r: (r.stable is None, distance(r.stable or r.slopes, slope)), default=None)


def distance(span: tuple[float, float], value: float) -> float:
    return max(span[0] - value, value - span[1], 0.0)


def follow(walker_at: rigid_map.WalkerAt, span: ValueSpan, value: float) -> tuple[GaitBranch, ...]:
    walker = walker_at(value)
    if walker is None:
        return ()
    gaits = [gait for gait in fixed_point.find_gaits(walker, settings=SUGGESTION_SEARCH).gaits if not gait.objections]
    follower = BranchFollower(rigid_map.RigidMap(walker_at, span.size, walker), span, max_points=SUGGESTION_POINTS)
    return follower.family([Seed(np.array(gait.z), value) for gait in gaits], 1)


def walkable_ranges(branches: tuple[GaitBranch, ...]) -> Iterator[SlopeRange]:
    """Yield, for each branch, the range of slopes on which the ground need not pull on the foot, and the longest range
    of stable gaits in it.
    """
    for branch in branches:
        # The first monitor of the rigid model is the minimum normal force.
        good = [point for point in branch.points if point.monitors[0] >= 0.0]
        if len(good) < 2:
            continue
        values = [point.value for point in good]
        slopes = (min(values), max(values))
        ranges = [(max(low, slopes[0]), min(high, slopes[1])) for low, high in branch.stable_ranges]
        proper = [(low, high) for low, high in ranges if high > low]
        yield SlopeRange(slopes, max(proper, key=lambda ends: ends[1] - ends[0], default=None))


def suggest_gaits(scene: reads.RigidConfig) -> str:
    """Suggest commands that find gaits for similar walkers or slopes, if a scene has no gait. If the slope does not
    descend, return ''."""
    if scene.slope_rad <= 0.0:
        return ""
    config = rigid_config(scene)
    feet = find_gait_with_feet_ahead(config)
    suitable = find_slopes_with_gaits(config)
    advice = []
    if feet is not None:
        ahead_m, gait = feet
        description = "a stable gait" if gait.stable else "a gait, unstable"
        command = f"`walkerlab fixedpoint --set walker.{FOOT_KEY}={ahead_m:.3g}`"
        advice.append(f"With its feet {ahead_m:.3g} m ahead of the shanks this walker has {description}: {command}.")
    if suitable is not None:
        first, last = round_inward(*map(math.degrees, suitable.stable or suitable.slopes))
        description = "A stable gait" if suitable.stable else "A gait, unstable,"
        slope_deg = math.degrees(suitable.nearest_slope(config.slope_rad))
        command = f"`walkerlab fixedpoint --set slope_deg={slope_deg:.3g}`"
        advice.append(f"{description} exists at least from {first:.3g} to {last:.3g} deg: {command}.")
    if not advice:
        feet_tried = name_feet_tried(config)
        advice.append(f"No gait was found on gentler or steeper slopes{feet_tried}.{suggest_walkers(config)}")
    return " ".join(advice)


def round_inward(low: float, high: float) -> tuple[float, float]:
    """Round the ends of a range of positive values inward to three digits, or not at all if the range is too narrow."""
    steps = [10.0 ** (math.floor(math.log10(end)) - 2) for end in (low, high)]
    rounded = math.ceil(low / steps[0]) * steps[0], math.floor(high / steps[1]) * steps[1]
    return rounded if rounded[0] < rounded[1] else (low, high)


def rigid_config(scene: reads.RigidConfig) -> schema.Config:
    """Return a config with only the keys on which a gait of the rigid model depends."""
    data = {name: getattr(scene, name) for name in reads.keys_of(reads.RigidConfig)}
    push_off = {"impulse_N_s": scene.push_off.impulse_N_s, "leg_2": scene.push_off.leg_2}
    return schema.Config.model_validate({**data, "push_off": push_off})


def find_gait_with_feet_ahead(config: schema.Config) -> tuple[float, fixed_point.RigidGait] | None:
    """Return the distance of the feet ahead of the shanks (m) that gives the most stable gait, and that gait.

    Returns None if no distance gives a gait.
    """
    candidates = []
    for ahead_m in feet_ahead(config):
        walker = Parameter(f"walker.{FOOT_KEY}", "m", ("walker", FOOT_KEY)).vary(config, rigid_walker)(ahead_m)
        gaits = () if walker is None else fixed_point.find_gaits(walker, settings=SUGGESTION_SEARCH).gaits
        candidates += [(ahead_m, gait) for gait in gaits if not gait.objections]
    return min(candidates, key=lambda candidate: candidate[1].spectral_radius, default=None)


def feet_ahead(config: schema.Config) -> tuple[float, ...]:
    if not isinstance(config.walker, walkers.Kneed):
        return ()
    # The distances are rounded as in the suggested command, so that the command finds the same gait.
    return tuple(float(f"{share * config.walker.leg_length_m:.3g}") for share in FOOT_SHARES)


def name_feet_tried(config: schema.Config) -> str:
    tried = feet_ahead(config)
    return f", nor with feet {tried[0]:g} to {tried[-1]:g} m ahead of the shanks (walker.{FOOT_KEY})" if tried else ""


def suggest_walkers(config: schema.Config) -> str:
    names = [name for name in files.builtin_names() if loader.load(Path(name)).config.walker.type == config.walker.type]
    if not names:
        return ""
    return f" Begin with a built-in walker of this type (`-c NAME`: {', '.join(names)}) and change one key at a time."
