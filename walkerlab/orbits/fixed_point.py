"""The periodic gaits of a rigid walker: sought in two ways, solved to rounding, judged and compared.

Followed: the two gaits of the small-slope theory are followed to the walker's slope. Drawn: the step map is solved from
random starting values, the paper's way (section 3.3), and from many more where those find nothing: of some walkers few
starts reach a heel strike at all. Led: where none is drawn of a driven walker, gaits of the passive one are followed as
its drive grows. All of it happens with the similar walker of unit size.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np

from walkerlab.hybrid.recorded_walk import take_walk
from walkerlab.hybrid.rigid_walk import LONGEST_SWING
from walkerlab.mechanics.standing import STANCE, SWING, Standing, feet_on_slope, on_slope, swing_foot_motion
from walkerlab.orbits.continuation import Follower, Strides, Way, interpolated
from walkerlab.orbits.newton import Effort, NotConverged
from walkerlab.orbits.shooting import EXACT, NEW, RigidMap, Shooting, on_section, section_of
from walkerlab.orbits.similarity import Units, unit_walker
from walkerlab.orbits.small_slope import SmallSlopeSeed, seeds
from walkerlab.orbits.step_map import Cycle, Stepper, gait_near
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import Floats, State

RANDOM_START = "random start"
SMALLEST_ANGLE = 1e-5  # rad, half the angle between the legs; less on level ground or after a random start is standing
NO_STEP = 1e-3  # of the angle between the legs at heel strike; samples do not tell a smaller one from zero
SAME = 1e-5  # relative distance of states below which two searches found one gait
LOOKING = Tolerances("dop853", 1e-7, 1e-10, 20_000)  # of steps while gaits are looked for; EXACT while they are solved
SOLVED, ENOUGH = 1e-14, 1e-11  # residual wanted, and that of an acceptable gait, which may be rounding on a steep slope
MAX_EVALUATIONS, SHORTEST_MOVE = 60, 2.0**-8  # of Newton's method
# on the way from a vanishing slope
STRIDES = Strides(math.log(2.0), math.log(1.001), 3)  # of the logarithm of the slope's cube root
EVALUATIONS_ON_THE_WAY = 20
LOOSE = 1e-6  # residual that is good enough, relative; a multiplier tends to 1 as the slope vanishes
JUMP, JUMP_IN_TIME = 0.05, 0.02  # a gait further than this from where it was expected is another gait
RETREATS = 5  # halvings of the seed's amplitude, whose error shrinks with the amplitude's square
# angle between the legs (rad), angular velocities (sqrt(g/L)) of swing and stance leg, and of a shank whose knee was
# free at heel strike
MIN_START, MAX_START = np.array([0.0, -1.0, -1.0, -1.0]), np.array([1.2, 1.0, 0.0, 1.0])
DRAWN_FROM = f"legs up to {MAX_START[0]:g} rad apart, rates up to {MAX_START[1]:g} sqrt(g/L)"


@dataclass(frozen=True)
class RigidGait:
    """What a step of a gait shows, SI units."""

    state: State  # just after the heel strike
    period: float  # s
    step_length: float  # m
    multipliers: tuple[complex, ...]  # eigenvalues of the step map's derivative, largest first
    residual: float  # rad, largest component of P(x) - x, velocities times sqrt(L/g); from a step walked by itself
    energy: float  # J, time mean over the step, from the stance foot
    energy_drift: float  # J, between least and most of it
    min_normal_force: float  # N
    max_friction_ratio: float | None  # None if the ground pushes nowhere
    max_scuff_depth: float  # m
    min_normal_impulse: float  # N s, of the ground in the strikes of heel and knee
    max_impulse_ratio: float | None  # None if the ground pushes in neither
    trailing_foot_rises: bool  # after the heel strike
    knee_strike: float | None  # s; None for legs without knees
    work: dict[str, float]  # J a step, by what gives it
    cost_of_transport: float  # work spent over weight and distance
    froude: float  # speed over sqrt(g L)
    swings: int = 1  # how often the swing leg passes the stance leg in a step
    feet_meet: bool = False  # on the ground in mid-swing
    found_by: tuple[str, ...] = ()  # the searches that led here
    z: tuple[float, ...] = ()  # section coordinates of the unit walker

    @property
    def speed(self) -> float:
        """Step length over period (m/s)."""
        return self.step_length / self.period

    @property
    def spectral_radius(self) -> float:
        """Largest magnitude of a multiplier."""
        return abs(self.multipliers[0])

    @property
    def stable(self) -> bool:
        """Whether small disturbances die out."""
        return self.spectral_radius < 1.0

    @property
    def objections(self) -> tuple[str, ...]:
        """What no ground can give, so that this gait is not physical; else empty. An unstable gait is a gait."""
        found = []
        if self.min_normal_force < 0.0:
            found.append(f"the ground would have to pull with {-self.min_normal_force:.3g} N")
        if self.min_normal_impulse < 0.0:
            found.append(f"the ground would have to pull with {-self.min_normal_impulse:.3g} N s in a strike")
        if not self.trailing_foot_rises:
            found.append("the foot behind would have to leave through the ground")
        if self.feet_meet:
            found.append("its feet meet on the ground in mid-swing, where the slightest disturbance may end the step")
        return tuple(found)


def feet_meet(walker: Standing, swing: Floats) -> bool:
    """Whether the swing foot comes down just where the stance foot stands, so that the step map jumps at this gait.

    A foot that came down any further ahead would strike.

    swing  (samples, 2 n) states with both legs straight
    """
    over, ahead = feet_on_slope(walker, swing[:, SWING], swing[:, STANCE]), swing[:, SWING] - swing[:, STANCE]
    down = np.flatnonzero((over[:-1] > 0.0) & (over[1:] <= 0.0))
    where = ahead[down] + np.diff(ahead)[down] * over[down] / (over[down] - over[down + 1])
    return bool(np.any(np.abs(where) < NO_STEP * abs(ahead[-1])))


def measured(walker: Standing, units: Units, gait: Cycle) -> RigidGait | None:
    """The gait after walking one step of it; None if that step does not end.

    walker  the unit walker, whose units are `units`
    """
    start = on_section(walker, gait.z)
    step = take_walk(walker, EXACT, start, 1, sampled=True)
    if step.steps == 0 or step.samples is None:
        return None
    swing = step.samples.state[step.samples.step == 0]
    apart = swing[:, SWING] - swing[:, STANCE]
    rate, n = 1.0 / units.time, len(start) // 2
    return RigidGait(
        state=(*start[:n], *(omega * rate for omega in start[n:])),
        period=float(step.periods_s[0]) * units.time,
        step_length=float(step.lengths_m[0]) * units.length,
        multipliers=tuple(gait.multipliers.tolist()),
        residual=max(abs(end - begin) for end, begin in zip(step.final_state, start, strict=True)),
        energy=step.mean_energy * units.energy,
        energy_drift=step.energy_drift * units.energy,
        min_normal_force=step.min_normal_force * units.force,
        max_friction_ratio=step.max_friction_ratio or None,
        max_scuff_depth=step.max_scuff_depth * units.length,
        min_normal_impulse=(step.min_normal_impulse or 0.0) * units.force * units.time,
        max_impulse_ratio=step.max_impulse_ratio or None,
        trailing_foot_rises=bool(swing_foot_motion(walker, start, start[len(start) // 2 :])[2] >= 0.0),
        work={name: given * units.energy for name, given in step.driven.per_step(1).items()},
        cost_of_transport=step.driven.cost_of_transport(float(step.lengths_m[0])),
        froude=float(step.lengths_m[0] / step.periods_s[0]),
        swings=int(np.count_nonzero(np.diff(np.signbit(apart)))),
        feet_meet=feet_meet(walker, swing[~step.samples.bent[step.samples.step == 0]]),
        knee_strike=None if step.knee_strike_time_s is None else float(step.knee_strike_time_s[0]) * units.time,
        z=tuple(gait.z.tolist()),
    )


@dataclass(frozen=True)
class SearchSettings:
    """How hard to look.

    random_starts   starting values to draw
    further_starts  to draw where nothing is found
    """

    random_starts: int = 100
    further_starts: int = 1000


FOLLOWED = "followed from a vanishing slope"
LED_FROM = (0.02, 0.05)  # rad, slopes on which walkers are looked for a passive gait to lead to a driven one
LED = f"led from passive gaits where nothing else finds one (slopes of {', '.join(map(str, LED_FROM))} rad)"


@dataclass(frozen=True)
class GaitSearch:
    """What was found.

    gaits          every period-1 gait, shortest period first
    chosen         index of the gait to walk; None if there is none that can be walked
    reason         why this one, or why none
    random_hits    for each gait, how many random starts led to it
    random_starts  how many were drawn
    lost           what became of the gaits that were followed and do not reach this walker
    followed       from where, in words
    """

    gaits: tuple[RigidGait, ...]
    chosen: int | None
    reason: str
    random_hits: tuple[int, ...] = ()
    random_starts: int = 0
    lost: tuple[str, ...] = ()
    followed: str = FOLLOWED

    @property
    def sought(self) -> str:
        """How gaits were looked for, in words; a very unstable one may be missed by all of it."""
        starts = f"{self.random_starts} random starts ({DRAWN_FROM}, steps of at most {LONGEST_SWING:g} sqrt(L/g))"
        return f"{self.followed}, and by Newton's method from {starts}"

    @property
    def gait(self) -> RigidGait | None:
        """The chosen gait."""
        return None if self.chosen is None else self.gaits[self.chosen]


def find_gaits(walker: Standing, seed: int = 0, settings: SearchSettings = SearchSettings()) -> GaitSearch:
    """Every period-1 gait of `walker` that the searches find.

    seed  of the random starting values
    """
    if walker.slope <= 0.0 and walker.unpaired == 0.0 and not walker.driven:
        return GaitSearch((), None, NO_DESCENT)
    search = Search(walker)
    generator = np.random.default_rng(seed)
    search.follow_seeds()
    search.draw(generator, settings.random_starts)
    if not search.found and not search.walker.passive:
        search.lead(generator, settings.random_starts)
    if not search.found:
        search.draw(generator, settings.further_starts)
    return search.result()


NO_DESCENT = (
    "every heel strike takes energy, and on a slope that does not descend nothing gives it back; "
    "standing still is no gait"
)
NONE_TO_FOLLOW = {
    True: "the theory of small slopes has no gait of this walker to follow",
    False: "without its drive this walker has no gait to lead to this slope",
}
POINTS_OF_A_LEAD = 60


class SlopeBranch:
    """A gait as a function of the slope: y = (theta_2 + phi, dtheta_1, dtheta_2) / s and T over s^2, s = phi^(1/3).

    In s^2 both gaits of the small-slope theory are smooth, and polynomials through the last points foretell the next.
    """

    def __init__(self, step_map: Stepper, seed: SmallSlopeSeed) -> None:
        """Start from a seed of the walker that has this step map over the slope (rad)."""
        self.step_map, self.seed = step_map, seed

    def follow(self, slope: float) -> tuple[float, Floats | None]:
        """How far the gait can be followed (rad), and z (3,) at `slope` > 0 (rad); None if it is lost before."""
        s = float(np.cbrt(slope))
        follower = self.from_seed if s > np.cbrt(self.seed.slope) else self.begun(s)
        if follower is None:
            return 0.0, None
        way = follower.to(math.log(s))
        if way.at < math.log(s):
            return math.exp(3.0 * way.at), None
        return slope, state_at(s, way.points[-1][1])

    @cached_property
    def from_seed(self) -> Follower | None:
        """The way that all steeper slopes have in common; None if it has no start."""
        return self.begun(float(np.cbrt(self.seed.slope)))

    def begun(self, s: float) -> Follower | None:
        """The way from the first gait at s or, where the seed is too rough for that, nearer to its limit."""
        seed, s_seed = self.seed, float(np.cbrt(self.seed.slope))
        limit = (0.0, np.array([*seed.limit, seed.period]))
        rough = (limit, (s_seed**2, scaled(s_seed, seed.z, seed.period)))
        for _ in range(RETREATS + 1):
            found = self.gait_at(math.log(s), interpolated(rough, s * s))
            if found is not None:
                first = Way(math.log(s), STRIDES.widest, (limit, (s * s, found)))
                return Follower(self.gait_at, first, STRIDES, lambda log_s: math.exp(2.0 * log_s))
            s *= 0.5
        return None

    def gait_at(self, log_s: float, expected: Floats) -> Floats | None:
        """(y, T) near where it is expected; None if Newton's method finds no gait there."""
        s = math.exp(log_s)
        effort = Effort(LOOSE * s, EVALUATIONS_ON_THE_WAY, SHORTEST_MOVE)
        gait = gait_near(self.step_map, state_at(s, expected), s**3, effort)
        if isinstance(gait, NotConverged):
            return None
        found = scaled(s, gait.z, gait.step.period_s)
        moved = np.abs(found - expected)
        near = moved[:3].max() <= JUMP * np.abs(found[:3]).max() and moved[3] <= JUMP_IN_TIME * found[3]
        return found if near else None


def state_at(s: float, y: Floats) -> Floats:
    """Section coordinates (3,) of a scaled gait."""
    return np.array([s * y[0] - s**3, s * y[1], s * y[2]])


def scaled(s: float, z: Floats, period: float) -> Floats:
    """(y, T) of a gait at s."""
    return np.array([(z[0] + s**3) / s, z[1] / s, z[2] / s, period])


@lru_cache(maxsize=16)
def branches(walker: Standing) -> tuple[SlopeBranch, ...]:
    """The gaits of the small-slope theory, for all searches of one walker on whatever slope; `walker` on none."""
    looking = over_slope(walker, LOOKING)
    return tuple(SlopeBranch(looking, seed) for seed in seeds(walker))


def over_slope(walker: Standing, tolerances: Tolerances) -> RigidMap:
    """The step map of a unit walker over the slope (rad)."""
    return RigidMap(partial(on_slope, walker), 1.0, walker, tolerances)


def partly_driven(walker: Standing, slope: float, share: float) -> Standing:
    """The walker with a share of what drives it, on a slope (rad) as much nearer to its own; passive at 0."""
    parts = {name: share * walker[name] for name in ("laws", "push_off")}
    return on_slope(walker.changed(**parts), slope + share * (walker.slope - slope))


@dataclass
class FoundGait:
    """A gait of the unit walker, what it is in SI, and what led to it."""

    cycle: Cycle
    gait: RigidGait
    by: list[str]


class Search:
    """A search in progress."""

    def __init__(self, walker: Standing) -> None:
        """Nothing is found yet."""
        self.walker, self.units = unit_walker(walker)
        self.found: list[FoundGait] = []
        self.lost: list[str] = []
        self.drawn = 0
        self.followed = FOLLOWED if walker.passive else LED
        self.looking = Shooting(self.walker, LOOKING)
        self.step_map = over_slope(self.walker, EXACT)

    def follow_seeds(self) -> None:
        """Follow the gaits of the small-slope theory, which is of passive walkers, to the walker's slope."""
        if self.walker.slope <= 0.0 or not self.walker.passive:
            return
        for branch in branches(on_slope(self.walker, 0.0)):
            (slope, z), name = branch.follow(self.walker.slope), branch.seed.name
            if z is None:
                self.lost.append(f"the gait from the {name} is lost at a slope of {slope:.3g} rad")
            elif not self.keep(z, name):
                self.lost.append(f"the gait from the {name} cannot be solved to rounding")

    def lead(self, generator: np.random.Generator, starts: int) -> None:
        """Follow gaits of the passive walker on slopes that it may walk down to this one, as what drives it grows."""
        # Imported here: gaits that are found otherwise do without.
        from walkerlab.orbits.families import BranchFollower, Seed, ValueSpan

        goal = self.walker
        own = (goal.slope,) if goal.slope > 0.0 else ()
        for slope in (*own, *LED_FROM):
            passive = Search(partly_driven(goal, slope, 0.0))
            passive.follow_seeds()
            passive.draw(generator, starts)
            family = RigidMap(partial(partly_driven, goal, slope), 1.0, goal)
            follower = BranchFollower(family, ValueSpan(0.0, 1.0), most=POINTS_OF_A_LEAD)
            name, lost = f"passive gait at {slope:.3g} rad", "is lost at {:.0%} of the way to this slope and drive"
            led = follower.family([Seed(found.cycle.z, 0.0) for found in passive.found], 1)
            for branch in led:
                end = max(branch.points, key=lambda point: point.value)
                if end.value < 1.0 - SAME or not self.keep(end.z, name):
                    self.lost.append(f"the {name} {lost.format(end.value)}")
            if passive.found and not led:
                self.lost.append(f"the {name} {lost.format(0.0)}")
            if self.found:
                return

    def draw(self, generator: np.random.Generator, count: int) -> None:
        """Solve the step map from random starting values, unless they lead to a gait that was found before."""
        d = int(self.walker.coordinates)
        self.drawn += count
        starts = generator.uniform(MIN_START[:d], MAX_START[:d], (count, d))
        starts[:, 0] = 0.5 * (starts[:, 0] - feet_on_slope(self.walker, 0.0, 0.0))
        known = [(found.cycle.z, found.cycle.DP) for found in self.found]
        led = self.looking.lead(section_of(self.walker), known, starts)
        for z, gait in zip(starts, led, strict=True):
            if gait >= 0:
                self.found[gait].by.append(RANDOM_START)
            elif gait == NEW and not self.stands(z):
                self.keep(z, RANDOM_START)

    def stands(self, z: Floats) -> bool:
        """Whether the legs are together."""
        return bool(abs(feet_on_slope(self.walker, z[0], z[0])) < 2.0 * SMALLEST_ANGLE)

    def keep(self, z: Floats, by: str) -> bool:
        """Solve for the gait near z to rounding and take it among those found; False if there is none."""
        if self.known(z, by):
            return True
        effort = Effort(SOLVED, MAX_EVALUATIONS, SHORTEST_MOVE, rounding=ENOUGH / SOLVED)
        cycle = gait_near(self.step_map, z, float(self.walker.slope), effort)
        if isinstance(cycle, NotConverged) or (self.walker.slope == 0.0 and self.stands(cycle.z)):
            return False
        if self.known(cycle.z, by):
            return True
        gait = measured(self.walker, self.units, cycle)
        if gait is None or gait.residual > ENOUGH:
            return False
        self.found.append(FoundGait(cycle, gait, [by]))
        return True

    def known(self, z: Floats, by: str) -> bool:
        """Whether z is one of the gaits found, which is then noted to be found again."""
        for found in self.found:
            if np.abs(found.cycle.z - z).max() < SAME * np.abs(z).max():
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
            followed = f"{self.followed}, {'; '.join(self.lost)}" if self.lost else NONE_TO_FOLLOW[self.walker.passive]
            starts = f"none of {self.drawn} random starting values ({DRAWN_FROM})"
            reason = f"none found: {followed}; {starts} led to a gait by Newton's method"
        return GaitSearch(gaits, chosen, reason, hits, self.drawn, tuple(self.lost), self.followed)


def preference(gait: RigidGait) -> tuple[bool, int, float]:
    """Smallest of the gait to walk: a stable one, whose leg does not swing back and forth, soonest rid of disturbances.

    A leg that swings back passes its foot through the ground, which the model does not see.
    """
    return not gait.stable, gait.swings, gait.spectral_radius


def choice(gaits: tuple[RigidGait, ...]) -> tuple[int | None, str]:
    """Which gait to walk of those that the ground can carry, by `preference`; and why."""
    walkable = [index for index, gait in enumerate(gaits) if not gait.objections]
    if not walkable:
        objections = dict.fromkeys(objection for gait in gaits for objection in gait.objections)
        return None, "the gaits there cannot be walked: " + "; ".join(objections)
    best = min(walkable, key=lambda index: preference(gaits[index]))
    if gaits[best].stable:
        return best, "it is stable"
    return best, "no gait is stable at this slope; of those that the ground can carry this one is the least unstable"
