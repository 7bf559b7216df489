"""Search for the periodic gaits of a rigid walker. Each gait is solved to rounding error and measured.

The two gaits of small-slope theory are followed to the walker's slope, and the step map is solved from random starts,
as in the paper (section 3.3). If a driven walker still has no gait, gaits of the passive walker are followed as the
drive grows. All searches use the similar walker of unit size.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np

from walkerlab.physics.hybrid.recorded_walk import describe_pulls, take_walk
from walkerlab.physics.hybrid.rigid_walk import LONGEST_SWING
from walkerlab.physics.mechanics import rigid_model as rigid
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits import rigid_map
from walkerlab.physics.orbits.continuation import Follower, FollowerState, Strides, interpolate
from walkerlab.physics.orbits.newton import Effort, NotConverged
from walkerlab.physics.orbits.similarity import LENGTHS, Units, unit_walker
from walkerlab.physics.orbits.small_slope import SmallSlopeSeed, seeds
from walkerlab.physics.orbits.step_map import Cycle, Stepper, gait_near, sort_multipliers
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, State

RANDOM_START = "random start"
# rad, half the angle between the legs. On level ground, or from a random start, a smaller angle means standing still.
SMALLEST_ANGLE = 1e-5
# Samples do not resolve angles smaller than this fraction of the angle between the legs at heel strike.
ANGLE_NOISE = 1e-3
SAME_GAIT = 1e-5  # states with a smaller relative distance belong to the same gait
# tolerances of steps during the search. The gaits themselves are solved with EXACT_STEPS
SEARCH_TOLERANCES = Tolerances("dop853", 1e-7, 1e-10, 20_000)
# target residual, and largest residual of an acceptable gait, which allows for the rounding errors on steep slopes
SOLVED_RESIDUAL = 1e-14
MAX_RESIDUAL = 1e-11
MAX_GAIT_EVALUATIONS, SHORTEST_MOVE = 60, 2.0**-8  # limits of Newton's method
# settings for following a gait from a vanishing slope
SLOPE_STRIDES = Strides(math.log(2.0), math.log(1.001), 3)  # increments of the logarithm of the slope's cube root
FOLLOWING_EVALUATIONS = 20
# relative residual; a tighter tolerance cannot be met, because a multiplier tends to 1 as the slope vanishes
FOLLOWING_TOLERANCE = 1e-6
# largest relative distance from the prediction. Beyond it, the gait belongs to another branch
MAX_STATE_JUMP = 0.05
MAX_PERIOD_JUMP = 0.02
# Halvings of the seed's amplitude. The error of the seed shrinks with the square of the amplitude.
MAX_RETREATS = 5
# random starts: angle between the legs (rad), angular velocities (sqrt(g/L)) of swing and stance leg, and of a shank
# whose knee was free at heel strike
MIN_START = np.array([0.0, -1.0, -1.0, -1.0])
MAX_START = np.array([1.2, 1.0, 0.0, 1.0])
START_RANGES = f"legs up to {MAX_START[0]:g} rad apart, rates up to {MAX_START[1]:g} sqrt(g/L)"


@dataclass(frozen=True)
class RigidGait:
    """A gait with the quantities of one of its steps, or their means over a stride if the legs differ. SI units."""

    state: State  # just after the heel strike
    period: float  # s
    step_length: float  # m
    # eigenvalues of the step map's derivative, largest first; empty if the legs differ
    multipliers: tuple[complex, ...]
    stride_multipliers: tuple[complex, ...]  # eigenvalues for a stride
    steps: tuple[tuple[float, float], ...]  # period (s) and length (m) of both steps; leg 1 swings in the first
    residual: float  # rad, largest component of P(x) - x from a separate step, with velocities multiplied by sqrt(L/g)
    energy: float  # J, mean over the duration of the step, with heights from the stance foot
    energy_drift: float  # J, maximum minus minimum energy
    min_normal_force: float  # N
    max_friction_ratio: float | None  # None if the ground never pushes
    max_scuff_depth: float  # m
    min_normal_impulse: float  # N s, minimum impulse of the ground at heel and knee strikes
    max_impulse_ratio: float | None  # None if the ground never pushes
    trailing_foot_rises: bool  # whether the trailing foot rises just after the heel strike
    knee_strike: float | None  # s, time from the heel strike; None for legs without knees
    work: dict[str, float]  # J, mean work per step, by source
    cost_of_transport: float  # work divided by weight times distance
    froude: float  # speed over sqrt(g L)
    swings: int = 1  # how often the swing leg passes the stance leg in a step
    feet_meet: bool = False  # whether the feet meet on the ground in mid-swing
    found_by: tuple[str, ...] = ()  # searches that led to this gait
    z: tuple[float, ...] = ()  # section coordinates of the unit walker

    @property
    def speed(self) -> float:
        return self.step_length / self.period

    @property
    def spectral_radius(self) -> float:
        """Largest factor by which a small disturbance grows in a step."""
        return abs(self.multipliers[0]) if self.multipliers else math.sqrt(abs(self.stride_multipliers[0]))

    @property
    def asymmetry(self) -> dict[str, float]:
        """Differences in length and in period between the second and the first step, relative to the mean of both."""
        (first_period, first_length), (second_period, second_length) = self.steps
        return {
            "step_length": (second_length - first_length) / self.step_length,
            "step_period": (second_period - first_period) / self.period,
        }

    @property
    def stable(self) -> bool:
        return self.spectral_radius < 1.0

    @property
    def objections(self) -> tuple[str, ...]:
        """Reasons why no ground can support this gait, or none for a physical gait, stable or not."""
        reasons = describe_pulls(self.min_normal_force, self.min_normal_impulse)
        if not self.trailing_foot_rises:
            reasons.append("the trailing foot would have to pass through the ground")
        if self.feet_meet:
            reasons.append("its feet meet on the ground in mid-swing, where the slightest disturbance may end the step")
        return tuple(reasons)


def feet_meet(walker: RigidModel, swing: Floats) -> bool:
    """Whether the swing foot comes down exactly at the stance foot, in states (samples, 2 n) with straight legs."""
    # The step map is discontinuous at such a gait: slightly further ahead, the touch would be a heel strike.
    if not walker.alike:
        return False
    over = rigid.feet_on_slope(walker, swing[:, rigid.SWING], swing[:, rigid.STANCE])
    ahead = swing[:, rigid.SWING] - swing[:, rigid.STANCE]
    down = np.flatnonzero((over[:-1] > 0.0) & (over[1:] <= 0.0))
    where = ahead[down] + np.diff(ahead)[down] * over[down] / (over[down] - over[down + 1])
    return bool(np.any(np.abs(where) < ANGLE_NOISE * abs(ahead[-1])))


def measure_gait(walker: RigidModel, units: Units, gait: Cycle) -> RigidGait | None:
    """Walk the steps of a gait of the unit walker and measure them in SI units. Return None if a step fails."""
    start = rigid_map.state_on_section(walker, gait.z)
    count = len(gait.steps)
    step = take_walk(walker, rigid_map.EXACT_STEPS, start, count, sampled=True)
    if step.steps < count or step.samples is None:
        return None
    models = (walker, walker.exchanged)[:count]
    swings = [step.samples.state[step.samples.step == k] for k in range(count)]
    bent = [step.samples.bent[step.samples.step == k] for k in range(count)]
    apart = [swing[:, rigid.SWING] - swing[:, rigid.STANCE] for swing in swings]
    n = len(start) // 2
    rates = [rigid.swing_foot_motion(model, y[0], y[0, n:])[2] for model, y in zip(models, swings, strict=True)]
    rate = 1.0 / units.time
    periods = (step.periods_s * units.time).tolist()
    lengths = (step.lengths_m * units.length).tolist()
    return RigidGait(
        state=(*start[:n], *(omega * rate for omega in start[n:])),
        period=math.fsum(periods) / count,
        step_length=math.fsum(lengths) / count,
        multipliers=tuple(gait.multipliers.tolist()) if count == 1 else (),
        stride_multipliers=tuple(sort_multipliers(gait.multipliers ** (STRIDE // count)).tolist()),
        steps=tuple(zip(periods, lengths, strict=True)) * (STRIDE // count),
        residual=max(abs(end - begin) for end, begin in zip(step.final_state, start, strict=True)),
        energy=step.mean_energy * units.energy,
        energy_drift=step.energy_drift * units.energy,
        min_normal_force=step.min_normal_force * units.force,
        max_friction_ratio=step.max_friction_ratio or None,
        max_scuff_depth=step.max_scuff_depth * units.length,
        min_normal_impulse=(step.min_normal_impulse or 0.0) * units.force * units.time,
        max_impulse_ratio=step.max_impulse_ratio or None,
        trailing_foot_rises=bool(min(rates) >= 0.0),
        work={name: work * units.energy for name, work in step.driven.work_per_step(count).items()},
        cost_of_transport=step.driven.cost_of_transport(float(step.lengths_m.sum())),
        froude=float(step.lengths_m.sum() / step.periods_s.sum()),
        swings=max(int(np.count_nonzero(np.diff(np.signbit(each)))) for each in apart),
        feet_meet=any(feet_meet(model, y[~free]) for model, y, free in zip(models, swings, bent, strict=True)),
        knee_strike=None if step.knee_strike_time_s is None else float(step.knee_strike_time_s[0]) * units.time,
        z=tuple(gait.z.tolist()),
    )


@dataclass(frozen=True)
class SearchSettings:
    random_starts: int = 100  # number of random starts
    further_starts: int = 1000  # number of additional random starts if no gait is found


SEED_SOURCE = "followed from a vanishing slope"
MEAN_LEGS_SOURCE = "followed from the gaits of the walker with two mean legs"
PASSIVE_SLOPES = (0.02, 0.05)  # rad, slopes of passive gaits that are followed to a driven gait
DRIVE_SOURCE = f"followed from passive gaits as a last resort (slopes of {', '.join(map(str, PASSIVE_SLOPES))} rad)"


@dataclass(frozen=True)
class GaitSearch:
    gaits: tuple[RigidGait, ...]  # all period-1 gaits found, sorted by period
    chosen: int | None  # index of the gait to simulate; None if no gait is physical
    reason: str  # why this gait was chosen, or why no gait was found
    random_hits: tuple[int, ...] = ()  # for each gait, the number of random starts that led to it
    random_starts: int = 0  # number of random starts
    lost: tuple[str, ...] = ()  # why gaits followed from other walkers did not lead to one of this walker
    followed: str = SEED_SOURCE  # where the gaits were followed from

    @property
    def method(self) -> str:
        """Description of the search, which may miss a very unstable gait."""
        starts = f"{self.random_starts} random starts ({START_RANGES}, steps of at most {LONGEST_SWING:g} sqrt(L/g))"
        return f"{self.followed}, and by Newton's method from {starts}"

    @property
    def gait(self) -> RigidGait | None:
        return None if self.chosen is None else self.gaits[self.chosen]


def find_gaits(walker: RigidModel, seed: int = 0, settings: SearchSettings = SearchSettings()) -> GaitSearch:
    """Find the period-1 gaits of `walker`. `seed` determines the random starting values."""
    if walker.slope <= 0.0 and walker.unpaired == 0.0 and not walker.driven:
        return GaitSearch((), None, NO_DESCENT)
    search = Search(walker)
    generator = np.random.default_rng(seed)
    search.follow_seeds()
    if walker.legs_differ:
        search.follow_difference(seed, settings)
    search.draw(generator, settings.random_starts)
    if not search.records and not search.walker.passive:
        search.follow_drive(generator, settings.random_starts)
    if not search.records:
        search.draw(generator, settings.further_starts)
    return search.result()


NO_DESCENT = (
    "every heel strike takes energy, and a slope that does not descend gives none back; standing still is no gait"
)
NO_SEED_TEXT = {
    True: "small-slope theory yields no starting gait for this walker",
    False: "without its drive this walker has no gait to follow to this slope",
}
MAX_DRIVE_POINTS = 60
STRIDE = 2  # steps
# fields of a model that depend on its legs
LEG_FIELDS = ("A", "B", "arm_x", "arm_y", "laws", "push_off", "lean", *LENGTHS)
DIFFERENCE_STRIDES = Strides(0.25, 1e-3, 3)
MAX_DIFFERENCE_JUMP = 0.05  # distance from the prediction; beyond it the gait belongs to another branch


class SlopeBranch:
    """A gait as a function of the slope phi.

    It is given by y = (theta_2 + phi, dtheta_1, dtheta_2) / s and the period T, where s = phi^(1/3).
    """

    # Both gaits of small-slope theory are smooth in s^2, so a polynomial through the last points predicts the next one.

    def __init__(self, step_map: Stepper, seed: SmallSlopeSeed) -> None:
        self.step_map = step_map
        self.seed = seed

    def follow(self, slope: float) -> tuple[float, Floats | None]:
        """Follow the gait to `slope` > 0 (rad), and return the slope reached and z (3,).

        z is None if the gait is lost.
        """
        s = float(np.cbrt(slope))
        # Below the seed's slope, interpolation between the limit and the seed is accurate enough to start near `slope`.
        follower = self.seed_follower if s > np.cbrt(self.seed.slope) else self.start_follower(s)
        if follower is None:
            return 0.0, None
        state = follower.follow_to(math.log(s))
        if state.value < math.log(s):
            return math.exp(3.0 * state.value), None
        return slope, unscale(s, state.points[-1][1])

    @cached_property
    def seed_follower(self) -> Follower | None:
        return self.start_follower(float(np.cbrt(self.seed.slope)))

    def start_follower(self, s: float) -> Follower | None:
        """Return a follower that starts from the gait at s or, if the seed is too inaccurate there, at a smaller s.

        Returns None if there is no gait at any of them.
        """
        seed = self.seed
        s_seed = float(np.cbrt(self.seed.slope))
        limit = (0.0, np.array([*seed.limit, seed.period]))
        rough = (limit, (s_seed**2, scale_gait(s_seed, seed.z, seed.period)))
        for _ in range(MAX_RETREATS + 1):
            gait = self.gait_at(math.log(s), interpolate(rough, s * s))
            if gait is not None:
                first = FollowerState(math.log(s), SLOPE_STRIDES.widest, (limit, (s * s, gait)))
                return Follower(self.gait_at, first, SLOPE_STRIDES, lambda log_s: math.exp(2.0 * log_s))
            s *= 0.5
        return None

    def gait_at(self, log_s: float, expected: Floats) -> Floats | None:
        s = math.exp(log_s)
        # The residual is in units of z, which is proportional to s.
        effort = Effort(FOLLOWING_TOLERANCE * s, FOLLOWING_EVALUATIONS, SHORTEST_MOVE)
        gait = gait_near(self.step_map, unscale(s, expected), s**3, effort)
        if isinstance(gait, NotConverged):
            return None
        y = scale_gait(s, gait.z, gait.step.period_s)
        moved = np.abs(y - expected)
        near = moved[:3].max() <= MAX_STATE_JUMP * np.abs(y[:3]).max() and moved[3] <= MAX_PERIOD_JUMP * y[3]
        return y if near else None


def unscale(s: float, y: Floats) -> Floats:
    # The slope is s^3, and y[0] contains it.
    return np.array([s * y[0] - s**3, s * y[1], s * y[2]])


def scale_gait(s: float, z: Floats, period: float) -> Floats:
    return np.array([(z[0] + s**3) / s, z[1] / s, z[2] / s, period])


@lru_cache(maxsize=16)
def slope_branches(walker: RigidModel) -> tuple[SlopeBranch, ...]:
    """Return the branches of the small-slope gaits of a walker on level ground.

    They are cached, because searches on all slopes need the same branches.
    """
    looking = map_over_slope(walker, SEARCH_TOLERANCES)
    return tuple(SlopeBranch(looking, seed) for seed in seeds(walker))


def map_over_slope(walker: RigidModel, tolerances: Tolerances) -> rigid_map.RigidMap:
    return rigid_map.RigidMap(partial(rigid.change_slope, walker), 1.0, walker, tolerances)


def average_legs(walker: RigidModel, share: float) -> RigidModel:
    """Return the walker with only the fraction `share` of the difference between its legs. At 0 the legs are equal."""
    # The constants of both models enter the equations linearly, so any weighted mean of the two is a valid walker.

    def blend(model: RigidModel, other: RigidModel) -> RigidModel:
        parts = {name: 0.5 * ((1.0 + share) * model[name] + (1.0 - share) * other[name]) for name in LEG_FIELDS}
        return rigid.replace_fields(model, {**parts, "alike": walker.alike or share == 0.0})

    blended = blend(walker, walker.exchanged)
    return blended if share == 0.0 else rigid.pair(blended, blend(walker.exchanged, walker))


def scale_drive(walker: RigidModel, slope: float, share: float) -> RigidModel:
    """Return the walker with a fraction `share` of its drive, on a slope (rad) between `slope` and the walker's."""

    def weaker(model: RigidModel) -> RigidModel:
        return rigid.replace_fields(model, {name: share * model[name] for name in ("laws", "push_off")})

    driven = weaker(walker) if walker.paired_with is None else rigid.pair(weaker(walker), weaker(walker.paired_with))
    return rigid.change_slope(driven, slope + share * (walker.slope - slope))


@dataclass
class GaitRecord:
    cycle: Cycle
    gait: RigidGait
    by: list[str]


class Search:
    def __init__(self, walker: RigidModel) -> None:
        self.walker, self.units = unit_walker(walker)
        self.records: list[GaitRecord] = []
        self.lost: list[str] = []
        self.drawn = 0
        self.followed = SEED_SOURCE if walker.passive else DRIVE_SOURCE
        if walker.legs_differ:
            self.followed = MEAN_LEGS_SOURCE
        self.looking = rigid_map.RigidStepper(self.walker, SEARCH_TOLERANCES)
        self.step_map = map_over_slope(self.walker, rigid_map.EXACT_STEPS)

    def follow_seeds(self) -> None:
        if self.walker.slope <= 0.0 or not self.walker.passive or self.walker.legs_differ:
            return
        for branch in slope_branches(rigid.change_slope(self.walker, 0.0)):
            (slope, z), name = branch.follow(self.walker.slope), branch.seed.name
            if z is None:
                self.lost.append(f"the gait from the {name} is lost at a slope of {slope:.3g} rad")
            elif not self.keep(z, name):
                self.lost.append(f"the gait from the {name} cannot be solved to rounding")

    def follow_difference(self, seed: int, settings: SearchSettings) -> None:
        """Start with equal legs, the mean of both, and follow their gaits as the difference between the legs grows."""
        goal = self.walker
        if goal.shank != goal.exchanged.shank:
            self.lost.append("only one leg has a knee, so there is no walker with two mean legs to start from")
            return
        family = rigid_map.RigidMap(partial(average_legs, goal), 1.0, goal, SEARCH_TOLERANCES)

        def gait_at(share: float, expected: Floats) -> Floats | None:
            effort = Effort(FOLLOWING_TOLERANCE, FOLLOWING_EVALUATIONS, SHORTEST_MOVE)
            gait = gait_near(family, expected, share, effort, STRIDE)
            if isinstance(gait, NotConverged) or np.abs(gait.z - expected).max() > MAX_DIFFERENCE_JUMP:
                return None
            return gait.z

        for k, gait in enumerate(find_gaits(average_legs(goal, 0.0), seed, settings).gaits):
            first = FollowerState(0.0, DIFFERENCE_STRIDES.widest, ((0.0, np.array(gait.z)),))
            state = Follower(gait_at, first, DIFFERENCE_STRIDES).follow_to(1.0)
            name = f"gait {k + 1} of the walker with two mean legs"
            if state.value < 1.0 or not self.keep(state.points[-1][1], name):
                self.lost.append(f"the {name} is lost at {state.value:.0%} of the difference between the legs")

    def follow_drive(self, generator: np.random.Generator, starts: int) -> None:
        # Imported here, because it is needed only if other searches fail.
        from walkerlab.physics.orbits.families import BranchFollower, Seed, ValueSpan

        goal = self.walker
        slopes = (goal.slope, *PASSIVE_SLOPES) if goal.slope > 0.0 else PASSIVE_SLOPES
        for slope in slopes:
            passive = Search(scale_drive(goal, slope, 0.0))
            passive.follow_seeds()
            passive.draw(generator, starts)
            family = rigid_map.RigidMap(partial(scale_drive, goal, slope), 1.0, goal)
            follower = BranchFollower(family, ValueSpan(0.0, 1.0), max_points=MAX_DRIVE_POINTS)
            name = f"passive gait at {slope:.3g} rad"
            lost = "is lost at {:.0%} of the way to this slope and drive"
            followed = follower.family([Seed(record.cycle.z, 0.0) for record in passive.records], 1)
            for branch in followed:
                end = max(branch.points, key=lambda point: point.value)
                if end.value < 1.0 - SAME_GAIT or not self.keep(end.z, name):
                    self.lost.append(f"the {name} {lost.format(end.value)}")
            if passive.records and not followed:
                self.lost.append(f"the {name} {lost.format(0.0)}")
            if self.records:
                return

    def draw(self, generator: np.random.Generator, count: int) -> None:
        """Solve the step map from random starting values, skipping those that lead to known gaits."""
        d = int(self.walker.coordinates)
        self.drawn += count
        starts = generator.uniform(MIN_START[:d], MAX_START[:d], (count, d))
        # The first coordinate was drawn as the angle between the legs. With both feet on the slope, this determines the
        # angle of the stance leg.
        starts[:, 0] = 0.5 * (starts[:, 0] - rigid.feet_on_slope(self.walker, 0.0, 0.0))
        if self.walker.legs_differ:
            self.search_strides(starts)
            return
        gaits = [(record.cycle.z, record.cycle.DP) for record in self.records]
        results = self.looking.solve_starts(rigid_map.strike_section(self.walker), gaits, starts)
        for z, gait in zip(starts, results, strict=True):
            if gait >= 0:
                self.records[gait].by.append(RANDOM_START)
            elif gait == rigid_map.NEW_GAIT and not self.stands(z):
                self.keep(z, RANDOM_START)

    def search_strides(self, starts: Floats) -> None:
        """Look for fixed points of the stride map near each start (starts, d), and keep those that are new."""
        quick = map_over_slope(self.walker, SEARCH_TOLERANCES)
        effort = Effort(rigid_map.NEAR_RESIDUAL, rigid_map.MAX_START_EVALUATIONS, rigid_map.SMALLEST_MOVE)
        for start in starts:
            gait = gait_near(quick, start, float(self.walker.slope), effort, STRIDE)
            if not isinstance(gait, NotConverged) and not self.stands(gait.z):
                self.keep(gait.z, RANDOM_START)

    def stands(self, z: Floats) -> bool:
        # With the stance leg counted twice, this sum is the angle between the legs if both feet are on the slope.
        return bool(abs(rigid.feet_on_slope(self.walker, z[0], z[0])) < 2.0 * SMALLEST_ANGLE)

    def keep(self, z: Floats, by: str) -> bool:
        """Solve for the gait near z to rounding error, and record it as found by the search `by`.

        Returns whether there is a gait.
        """
        if self.record_hit(z, by):
            return True
        effort = Effort(SOLVED_RESIDUAL, MAX_GAIT_EVALUATIONS, SHORTEST_MOVE, rounding=MAX_RESIDUAL / SOLVED_RESIDUAL)
        cycle = gait_near(self.step_map, z, float(self.walker.slope), effort, STRIDE if self.walker.legs_differ else 1)
        if isinstance(cycle, NotConverged) or (self.walker.slope == 0.0 and self.stands(cycle.z)):
            return False
        # Only the exact solution shows that a rough one belongs to a known gait.
        if self.record_hit(cycle.z, by):
            return True
        gait = measure_gait(self.walker, self.units, cycle)
        if gait is None or gait.residual > MAX_RESIDUAL:
            return False
        self.records.append(GaitRecord(cycle, gait, [by]))
        return True

    def record_hit(self, z: Floats, by: str) -> bool:
        """Whether z is a known gait. If so, record that the search `by` found it again."""
        for record in self.records:
            if np.abs(record.cycle.z - z).max() < SAME_GAIT * np.abs(z).max():
                record.by.append(by)
                return True
        return False

    def result(self) -> GaitSearch:
        records = sorted(self.records, key=lambda each: each.gait.period)
        gaits = tuple(replace(each.gait, found_by=tuple(dict.fromkeys(each.by))) for each in records)
        hits = tuple(each.by.count(RANDOM_START) for each in records)
        chosen, reason = choose_gait(gaits)
        if not gaits:
            followed = f"{self.followed}, {'; '.join(self.lost)}" if self.lost else NO_SEED_TEXT[self.walker.passive]
            starts = f"none of {self.drawn} random starting values ({START_RANGES})"
            reason = f"none found: {followed}; {starts} led to a gait by Newton's method"
        return GaitSearch(gaits, chosen, reason, hits, self.drawn, tuple(self.lost), self.followed)


def preference(gait: RigidGait) -> tuple[bool, int, float]:
    """Return a sort key that prefers stable gaits, then the fewest swings, then the fastest decay of disturbances."""
    # With several swings in a step, the foot passes through the ground several times, which the model ignores.
    return not gait.stable, gait.swings, gait.spectral_radius


def choose_gait(gaits: tuple[RigidGait, ...]) -> tuple[int | None, str]:
    """Choose the gait to walk among the physical ones by `preference`, and return its index and the reason."""
    walkable = [index for index, gait in enumerate(gaits) if not gait.objections]
    if not walkable:
        objections = dict.fromkeys(objection for gait in gaits for objection in gait.objections)
        return None, "the gaits found there are not physical: " + "; ".join(objections)
    best = min(walkable, key=lambda index: preference(gaits[index]))
    if gaits[best].stable:
        return best, "it is stable"
    return best, "no gait is stable at this slope; this is the least unstable of the physical ones"
