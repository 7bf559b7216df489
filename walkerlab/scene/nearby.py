"""Where a walker without a gait has one: on other slopes, and on the way from a built-in walker to it.

On a few slopes a gait is sought, and its branch followed over the slope. Where no slope has one, the gait of the
built-in walker most like this one is followed along a straight way of its numbers, slope and gravity among them, to
this walker's.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from walkerlab.config.fields import held, kind, leaves
from walkerlab.config.files import builtin_names
from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.families import BranchFollower, GaitBranch, Seed, ValueSpan
from walkerlab.orbits.fixed_point import SearchSettings, find_gaits
from walkerlab.orbits.shooting import RigidMap
from walkerlab.scene.families import rigid_walkers
from walkerlab.scene.parameter import PHYSICAL, SLOPE, Parameter
from walkerlab.scene.rigid import walker_or_none

SLOPES = (0.7, 1.5, 2.3, 0.35, 0.1)  # of one's own, in the order in which they are looked at
WALKED_ON = (0.03, 0.12)  # rad: slopes that most walkers with a gait have it on
STEEP, STEEPEST = 0.2, 0.35  # rad, up to which gaits are followed: at least, and at most
QUICK = SearchSettings(random_starts=50, further_starts=100)
POINTS = 60  # of a branch
INSIDE = 0.1  # of a range, from its end
OF_A_WALKER = frozenset(PHYSICAL) - {"contact"}  # keys whose numbers lead from one walker to another


@dataclass(frozen=True)
class Met:
    """Gaits that were met: over which values they go on, and over which they are stable too; None if nowhere."""

    whole: tuple[float, float]
    stable: tuple[float, float] | None

    def value_towards(self, wanted: float) -> float:
        """One of the values, of stable gaits if there are any: a little inside of the end that is nearer."""
        low, high = self.stable or self.whole
        near, far = (low, high) if abs(low - wanted) < abs(high - wanted) else (high, low)
        return near + INSIDE * (far - near)


def gaits_on_other_slopes(config: Config) -> Met | None:
    """The range of slopes (rad) nearest to the config's own on which it has a gait, stable ones before others."""
    own = config.slope_rad
    span = ValueSpan(0.02 * own, min(STEEPEST, max(3.0 * own, STEEP)))
    found: list[Met] = []
    for value in (*(factor * own for factor in SLOPES), *WALKED_ON):
        if value in span and not any(one.stable for one in found):
            found += walkable(followed(rigid_walkers(config, SLOPE), span, value))
    return min(found, key=lambda one: (one.stable is None, distance(one.stable or one.whole, own)), default=None)


def distance(span: tuple[float, float], value: float) -> float:
    """How far a value is from a range."""
    return max(span[0] - value, value - span[1], 0.0)


def followed(walker_at: Callable[[float], Standing | None], span: ValueSpan, value: float) -> tuple[GaitBranch, ...]:
    """The branches over a span of the gaits that a walker has at a value."""
    walker = walker_at(value)
    if walker is None:
        return ()
    gaits = [gait for gait in find_gaits(walker, settings=QUICK).gaits if not gait.objections]
    follower = BranchFollower(RigidMap(walker_at, span.size, walker), span, most=POINTS)
    return follower.family([Seed(np.array(gait.z), value) for gait in gaits], 1)


def walkable(branches: tuple[GaitBranch, ...]) -> Iterator[Met]:
    """Stretches of branches on which the ground need not pull, and where on them gaits are stable."""
    for branch in branches:
        good = [point for point in branch.points if point.monitors[0] >= 0.0]
        if len(good) < 2:
            continue
        values = [point.value for point in good]
        whole = (min(values), max(values))
        ranges = [(max(low, whole[0]), min(high, whole[1])) for low, high in branch.stable_ranges]
        yield Met(whole, max((one for one in ranges if one[1] > one[0]), key=lambda one: one[1] - one[0], default=None))


def nearby(config: Config, typed: str = "") -> str:
    """Where gaits are met near a config that has none, with the command that shows one: in words.

    typed  the options that say which config it is, with a blank in front
    """
    if config.slope_rad <= 0.0:
        return ""
    met = gaits_on_other_slopes(config)
    if met is not None:
        in_degrees = tuple(math.degrees(value) for value in met.stable or met.whole)
        what = "A stable gait" if met.stable else "A gait, unstable,"
        slope = met.value_towards(config.slope_rad)
        setting = f"slope_rad={slope:.4g}" if "slope_rad=" in typed else f"slope_deg={math.degrees(slope):.3g}"
        return (
            f"{what} exists from {in_degrees[0]:.3g} to {in_degrees[1]:.3g} deg: "
            f"`walkerlab fixedpoint{typed} --set {setting}`."
        )
    way = way_from_built_in(config)
    if way is None:
        return "No gait was met on gentler or steeper slopes."
    begin, met = way
    share = met.value_towards(1.0)
    there, start = between(begin, config, share), numbers_of(begin)
    sets = "" if there is None else "".join(
        f" --set {'.'.join(path)}={value:.5g}" for path, value in numbers_of(there).items() if value != start[path]
    )  # fmt: skip
    return (
        f"No gait was met on gentler or steeper slopes. From the built-in walker {begin.name} a gait goes on for "
        f"{met.whole[1]:.0%} of the straight way of its numbers to this walker's: "
        f"`walkerlab fixedpoint -c {begin.name}{sets}`."
    )


def way_from_built_in(config: Config) -> tuple[Config, Met] | None:
    """The built-in walker most like the config's, and how far (0 to 1) its gait goes on along the way to this one."""
    own = numbers_of(config)
    others = [load(Path(name)).config for name in builtin_names()]
    like = [one for one in others if one.walker.type == config.walker.type and set(numbers_of(one)) == set(own)]
    if not like:
        return None
    begin = min(like, key=lambda one: (unlikeness(own, numbers_of(one)), one.name))
    branches = followed(lambda share: walker_or_none(between(begin, config, share)), ValueSpan(0.0, 1.0), 0.0)
    return next(((begin, met) for met in walkable(branches)), None)


def numbers_of(config: Config) -> dict[tuple[str, ...], float]:
    """The numbers of walker, slope and gravity, by their paths."""
    own = (path for path, field in leaves(Config, held=config) if "number" in kind(field.annotation))
    values = {path: held(config, path) for path in own if path[0] in OF_A_WALKER}
    return {path: value for path, value in values.items() if isinstance(value, float)}


def unlikeness(one: dict[tuple[str, ...], float], other: dict[tuple[str, ...], float]) -> float:
    """How different two walkers' numbers are, each against the larger of both."""
    return sum(abs(one[key] - other[key]) / max(abs(one[key]), abs(other[key]), 1e-12) for key in one)


def between(begin: Config, end: Config, share: float) -> Config | None:
    """The config a share of the way from one to another; None where the schema refuses it."""
    changed: Config | None = begin
    for path, value in numbers_of(end).items():
        if changed is not None:
            parameter = Parameter(".".join(path), "", path)
            was = parameter.value_in(begin)
            changed = parameter.config_at(changed, was + share * (value - was))
    return changed
