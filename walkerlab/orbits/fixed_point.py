"""The periodic gaits of a rigid walker: sought in two ways, solved to rounding, judged and compared.

Followed: the two gaits of the small-slope theory are followed to the walker's slope. Drawn: the step map is solved from
random starting values, the paper's way (section 3.3), and from many more where those find nothing: of some walkers few
starts reach a heel strike at all. All of it happens with the similar walker of unit size.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.rigid_walk import EVENTS
from walkerlab.mechanics.standing import Standing, on_slope
from walkerlab.orbits.gait import Gait, measured
from walkerlab.orbits.random_starts import (
    LEAST_START,
    MOST_START,
    NEW,
    SHORTEST_STEP,
    follow_starts,
    known_gaits,
)
from walkerlab.orbits.similarity import unit_walker
from walkerlab.orbits.slope_branch import SlopeBranch
from walkerlab.orbits.small_slope import Vector, seeds
from walkerlab.orbits.step_map import Shooting, new_shooting, newton, variation_size
from walkerlab.solvers.dop853 import new_dop853
from walkerlab.solvers.registry import Tolerances, finder_for

RANDOM_START = "random start"
SMALLEST_ANGLE = 1e-5  # rad, half the angle between the legs; less on level ground or after a random start is standing
SAME = 1e-5  # relative distance of states below which two searches found one gait


@dataclass(frozen=True)
class SearchSettings:
    """How hard to look.

    random_starts  starting values to draw
    further_starts  to draw where nothing is found
    rtol, atol     tolerances while looking; gaits are then solved with the `solved_` ones, down to that residual
    residual       of an acceptable gait, which may be rounding on a steep slope
    budget         right-hand sides for one call of the solver
    """

    random_starts: int = 100
    further_starts: int = 1000
    rtol: float = 1e-8
    atol: float = 1e-11
    solved_rtol: float = 1e-13
    solved_atol: float = 1e-13
    solved_residual: float = 1e-14
    residual: float = 1e-11
    budget: int = 20_000


@dataclass(frozen=True)
class GaitSearch:
    """What was found.

    gaits          every period-1 gait, shortest period first
    chosen         index of the gait to walk; None if there is none that can be walked
    reason         why this one, or why none
    random_hits    for each gait, how many random starts led to it
    random_starts  how many were drawn
    lost           what became of the gaits of the small-slope theory that do not reach this slope
    """

    gaits: tuple[Gait, ...]
    chosen: int | None
    reason: str
    random_hits: tuple[int, ...] = ()
    random_starts: int = 0
    lost: tuple[str, ...] = ()

    @property
    def gait(self) -> Gait | None:
        """The chosen gait."""
        return None if self.chosen is None else self.gaits[self.chosen]


def find_gaits(walker: Standing, seed: int = 0, settings: SearchSettings = SearchSettings()) -> GaitSearch:
    """Every period-1 gait of `walker` that the searches find.

    seed  of the random starting values
    """
    misprinted = (walker.A_centrifugal != walker.A).any() or (walker.B_centrifugal != walker.B).any()
    if walker.slope <= 0.0 and not misprinted:
        return GaitSearch((), None, NO_DESCENT)
    search = Search(walker, settings)
    generator = np.random.default_rng(seed)
    search.follow_seeds()
    search.draw(generator, settings.random_starts)
    if not search.found:
        search.draw(generator, settings.further_starts)
    return search.result()


NO_DESCENT = (
    "every heel strike takes energy, and on a slope that does not descend nothing gives it back; "
    "standing still is no gait"
)
NONE_TO_FOLLOW = "the theory of small slopes has no gait of this walker to follow"


def shooting(walker: Standing, rtol: float, atol: float, budget: int) -> Shooting:
    """The walker's step map at these tolerances."""
    method = new_dop853(variation_size(walker), rtol, atol, budget)
    return new_shooting(walker, method, finder_for(method, EVENTS))


@lru_cache(maxsize=16)
def branches(walker: Standing, settings: SearchSettings) -> tuple[SlopeBranch, ...]:
    """The gaits of the small-slope theory, for all searches of one walker on whatever slope; `walker` on none."""
    looking = shooting(walker, settings.rtol, settings.atol, settings.budget)
    return tuple(SlopeBranch(looking, seed) for seed in seeds(walker))


@dataclass
class FoundGait:
    """A gait with what led to it."""

    z: Vector
    DP: Vector  # derivative of the step map there
    gait: Gait
    by: list[str]


class Search:
    """A search in progress."""

    def __init__(self, walker: Standing, settings: SearchSettings) -> None:
        """Nothing is found yet."""
        self.walker, self.units = unit_walker(walker)
        self.settings = settings
        self.found: list[FoundGait] = []
        self.lost: list[str] = []
        self.drawn = 0
        rtol, atol = settings.solved_rtol, settings.solved_atol
        self.tolerances = Tolerances("dop853", rtol, atol, settings.budget)
        self.looking = shooting(self.walker, settings.rtol, settings.atol, settings.budget)
        self.solving = shooting(self.walker, rtol, atol, settings.budget)

    def follow_seeds(self) -> None:
        """Follow the gaits of the small-slope theory to the walker's slope."""
        if self.walker.slope <= 0.0:
            return
        for branch in branches(on_slope(self.walker, 0.0), self.settings):
            reached, name = branch.follow(self.walker.slope), branch.seed.name
            if reached.z is None:
                self.lost.append(f"the gait from the {name} is lost at a slope of {reached.slope:.3g} rad")
            elif not self.keep(reached.z, name):
                self.lost.append(f"the gait from the {name} cannot be solved to rounding")

    def draw(self, generator: np.random.Generator, count: int) -> None:
        """Solve the step map from random starting values, unless they lead to a gait that was found before."""
        d = len(self.walker.picked)
        self.drawn += count
        starts = generator.uniform(LEAST_START[:d], MOST_START[:d], (count, d))
        starts[:, 0] = 0.5 * starts[:, 0] - self.walker.slope - self.walker.lean
        known = known_gaits(self.looking, [(found.z, found.DP) for found in self.found])
        led = np.zeros(len(starts), np.int64)
        follow_starts(self.looking, known, starts, led)
        for z, gait in zip(starts, led, strict=True):
            if gait >= 0:
                self.found[gait].by.append(RANDOM_START)
            elif gait == NEW and not self.stands(z):
                self.keep(z, RANDOM_START)

    def stands(self, z: Vector) -> bool:
        """Whether the legs are together."""
        return abs(float(z[0]) + self.walker.slope + self.walker.lean) < SMALLEST_ANGLE

    def keep(self, z: Vector, by: str) -> bool:
        """Solve for the gait near z to rounding and take it among those found; False if there is none."""
        if self.known(z, by):
            return True
        z = np.array(z)
        status, period, residual, _ = newton(self.solving, z, self.settings.solved_residual)
        if status != Outcome.WALKED or residual > self.settings.residual or period < SHORTEST_STEP:
            return False
        if self.walker.slope == 0.0 and self.stands(z):
            return False
        if self.known(z, by):
            return True
        gait = measured(self.walker, self.units, self.tolerances, z, self.solving.DP)
        if gait is None or gait.residual > self.settings.residual:
            return False
        self.found.append(FoundGait(z, self.solving.DP.copy(), gait, [by]))
        return True

    def known(self, z: Vector, by: str) -> bool:
        """Whether z is one of the gaits found, which is then noted to be found again."""
        for found in self.found:
            if np.abs(found.z - z).max() < SAME * np.abs(z).max():
                found.by.append(by)
                return True
        return False

    def result(self) -> GaitSearch:
        """The gaits in order, and which one to walk."""
        found = sorted(self.found, key=lambda each: each.gait.period)
        gaits = tuple(replace(each.gait, found_by=tuple(dict.fromkeys(each.by))) for each in found)
        hits = tuple(each.by.count(RANDOM_START) for each in found)
        chosen, reason = choice(gaits)
        if not gaits:
            followed = f"followed from a vanishing slope, {'; '.join(self.lost)}" if self.lost else NONE_TO_FOLLOW
            reason = f"none found: {followed}; {self.drawn_in_vain()}"
        return GaitSearch(gaits, chosen, reason, hits, self.drawn, tuple(self.lost))

    def drawn_in_vain(self) -> str:
        """How many starting values led to no gait, and from which range they were drawn."""
        return (
            f"none of {self.drawn} random starting values (legs up to {MOST_START[0]:g} rad apart, rates up to "
            f"{MOST_START[1]:g} sqrt(g/L)) led to a gait by Newton's method"
        )


def choice(gaits: tuple[Gait, ...]) -> tuple[int | None, str]:
    """Which gait to walk: of those that the ground can carry the one that forgets disturbances soonest; and why."""
    walkable = [index for index, gait in enumerate(gaits) if not gait.objections]
    if not walkable:
        objections = dict.fromkeys(objection for gait in gaits for objection in gait.objections)
        return None, "the gaits there cannot be walked: " + "; ".join(objections)
    best = min(walkable, key=lambda index: gaits[index].spectral_radius)
    if gaits[best].stable:
        return best, "it is stable"
    return best, "no gait is stable at this slope; of those that the ground can carry this one is the least unstable"
