"""Suggest changes that give a walker a gait: its feet ahead of its shanks, or another slope.

A kneed walker is tried with its feet slightly ahead of the shanks, as in real machines. On a few slopes a gait is
searched for, and its branch is followed over the slope.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from walkerlab.config.files import builtin_names
from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.config.walkers import Kneed
from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.families import BranchFollower, GaitBranch, Seed, ValueSpan
from walkerlab.orbits.fixed_point import RigidGait, SearchSettings, find_gaits
from walkerlab.orbits.shooting import RigidMap
from walkerlab.scene.families import rigid_walkers
from walkerlab.scene.parameter import SLOPE, Parameter
from walkerlab.scene.rigid import walker_or_none

SLOPES = (0.7, 1.5, 2.3, 0.35, 0.1)  # of one's own, in the order in which they are looked at
WALKED_ON = (0.03, 0.12)  # rad: slopes that most walkers with a gait have it on
STEEP, STEEPEST = 0.2, 0.35  # rad, up to which gaits are followed: at least, and at most
QUICK = SearchSettings(random_starts=50, further_starts=100)
POINTS = 60  # of a branch
INSIDE = 0.1  # of a range, from its end
AHEAD = "foot_centre_ahead_m"
FEET_AHEAD = (0.02, 0.03, 0.04, 0.05)  # of a kneed walker, in leg lengths


@dataclass(frozen=True)
class Met:
    """A range of slopes with gaits, and the part of it where they are stable; None if nowhere."""

    whole: tuple[float, float]
    stable: tuple[float, float] | None

    def value_towards(self, wanted: float) -> float:
        """Return a slope slightly inside the nearer end of the range, of stable gaits if there are any."""
        low, high = self.stable or self.whole
        near, far = (low, high) if abs(low - wanted) < abs(high - wanted) else (high, low)
        return near + INSIDE * (far - near)


def gaits_on_other_slopes(config: Config) -> Met | None:
    """Return the nearest range of slopes (rad) with gaits, stable ones first; None if none is found."""
    own = config.slope_rad
    span = ValueSpan(0.02 * own, min(STEEPEST, max(3.0 * own, STEEP)))
    found: list[Met] = []
    for value in (*(factor * own for factor in SLOPES), *WALKED_ON):
        if value in span and not any(one.stable for one in found):
            found += walkable(followed(rigid_walkers(config, SLOPE), span, value))
    return min(found, key=lambda one: (one.stable is None, distance(one.stable or one.whole, own)), default=None)


def distance(span: tuple[float, float], value: float) -> float:
    return max(span[0] - value, value - span[1], 0.0)


def followed(walker_at: Callable[[float], Standing | None], span: ValueSpan, value: float) -> tuple[GaitBranch, ...]:
    """Return the branches over a span through the gaits of a walker at a value."""
    walker = walker_at(value)
    if walker is None:
        return ()
    gaits = [gait for gait in find_gaits(walker, settings=QUICK).gaits if not gait.objections]
    follower = BranchFollower(RigidMap(walker_at, span.size, walker), span, most=POINTS)
    return follower.family([Seed(np.array(gait.z), value) for gait in gaits], 1)


def walkable(branches: tuple[GaitBranch, ...]) -> Iterator[Met]:
    """Yield ranges of branches where the ground need not pull, and where gaits on them are stable."""
    for branch in branches:
        good = [point for point in branch.points if point.monitors[0] >= 0.0]
        if len(good) < 2:
            continue
        values = [point.value for point in good]
        whole = (min(values), max(values))
        ranges = [(max(low, whole[0]), min(high, whole[1])) for low, high in branch.stable_ranges]
        yield Met(whole, max((one for one in ranges if one[1] > one[0]), key=lambda one: one[1] - one[0], default=None))


def nearby(config: Config, typed: str = "") -> str:
    """Describe where gaits exist near a config without one, with the commands that show them.

    typed  command-line options that select the config, with a leading space
    """
    if config.slope_rad <= 0.0:
        return ""
    feet, met = gait_with_feet_ahead(config), gaits_on_other_slopes(config)
    advice = []
    if feet is not None:
        ahead_m, gait = feet
        what = "a stable gait" if gait.stable else "a gait, unstable"
        command = f"`walkerlab fixedpoint{typed} --set walker.{AHEAD}={ahead_m:.3g}`"
        advice.append(f"With its feet {ahead_m:.3g} m ahead of the shanks this walker has {what}: {command}.")
    if met is not None:
        in_degrees = tuple(math.degrees(value) for value in met.stable or met.whole)
        what = "A stable gait" if met.stable else "A gait, unstable,"
        slope = met.value_towards(config.slope_rad)
        setting = f"slope_rad={slope:.4g}" if "slope_rad=" in typed else f"slope_deg={math.degrees(slope):.3g}"
        command = f"`walkerlab fixedpoint{typed} --set {setting}`"
        advice.append(f"{what} exists from {in_degrees[0]:.3g} to {in_degrees[1]:.3g} deg: {command}.")
    if not advice:
        advice.append(f"No gait was met on gentler or steeper slopes{with_feet_ahead(config)}.{begin_with(config)}")
    return " ".join(advice)


def gait_with_feet_ahead(config: Config) -> tuple[float, RigidGait] | None:
    """Return the most stable gait of a kneed walker with its feet ahead, and how far ahead (m); None without one."""
    found = []
    for ahead_m in feet_ahead(config):
        walker = walker_or_none(Parameter(f"walker.{AHEAD}", "m", ("walker", AHEAD)).config_at(config, ahead_m))
        gaits = () if walker is None else find_gaits(walker, settings=QUICK).gaits
        found += [(ahead_m, gait) for gait in gaits if not gait.objections]
    return min(found, key=lambda one: one[1].spectral_radius, default=None)


def feet_ahead(config: Config) -> tuple[float, ...]:
    """Return the foot positions (m ahead of the shank) to try; none for straight legs."""
    if not isinstance(config.walker, Kneed):
        return ()
    return tuple(float(f"{share * config.walker.leg_length_m:.3g}") for share in FEET_AHEAD)


def with_feet_ahead(config: Config) -> str:
    """Describe the foot positions tried, as the end of a sentence; empty for straight legs."""
    tried = feet_ahead(config)
    return f", nor with feet {tried[0]:g} to {tried[-1]:g} m ahead of the shanks (walker.{AHEAD})" if tried else ""


def begin_with(config: Config) -> str:
    """Suggest built-in walkers of the same type; empty without one."""
    alike = [name for name in builtin_names() if load(Path(name)).config.walker.type == config.walker.type]
    if not alike:
        return ""
    return f" Begin with a built-in walker of this type (`-c NAME`: {', '.join(alike)}) and change one key at a time."
