"""Basins of attraction of the rigid walker: which attractor each start reaches, in how many steps, or how it fails.

All walks use the unit walker and start on the section just after heel strike, z = (theta_2, dtheta_1, dtheta_2). A walk
counts as having reached an attractor once it is within a distance from which every test walk returned to it. If the
legs differ, points of attractors lie on the section from which leg 1 swings, a stride apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.endings import GOES_ON, REJECTED, WALKED
from walkerlab.physics.hybrid.rigid_lanes import Fates, TwoLegs, new_fates, new_lane_memory, record_strike, walk_lanes
from walkerlab.physics.hybrid.rigid_walk import hip_above_fall
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits.rigid_map import RigidStepper, state_on_section, states_on_section, strike_section
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, Integers

# tolerances of walks in a basin, which cause errors of 1e-7 per step
RTOL, ATOL = 1e-6, 1e-8
CYCLE_TOLERANCES = 1e-11, 1e-13  # rtol and atol of walks that determine attractors
SECTION_SIZE = 3
UNREACHED = -1  # attractor index of a walk that reaches no attractor
MAX_CYCLE_PERIOD = 32  # steps; longer cycles count as aperiodic
CYCLE_DISTANCE = 1e-7  # states closer than this count as equal
SETTLING_STEPS = 2_000  # steps before a walk is checked for a cycle
FIRST_STARTS = 64  # number of starts that walk all SETTLING_STEPS, because no attractor is known yet
RESETTLING_STEPS = 400  # further steps of settled walks, at tight tolerances
RETURN_STEPS = 1_000  # steps within which a walk near an attractor must come ten times closer to it
MAX_SETTLED_WALKS = 32  # maximum number of settled walks that are continued
CAPTURE = 1e-3  # largest distance at which an attractor counts as reached
NARROWING = 0.25
NARROWINGS = 6
STARTS_PER_POINT = 24  # test walks started around each point of an attractor; all must return to it
STEPS_PER_LOOK = 16  # steps between checks for capture
BATCH_BUDGET = 4_000_000  # right-hand-side evaluations per step

# Unit walker. Walks of two equal straight legs run side by side in lanes, those of other walkers one by one.
Walker = TwoLegs | RigidModel


class Capture(NamedTuple):
    """Observer that ends a walk near an attractor or after `max_steps` steps."""

    points: Any  # (m, 3) points of attractors
    owner: Any  # (m,) index of the attractor of each point
    reach: Any  # (m,) squared capture distance of each point
    max_steps: int
    attractor: Any  # (n,) output: index of the attractor reached, or UNREACHED
    last: Any  # (n, 3) output: last section point of each walk


@record_strike.case(Capture)
def check_capture(observer: Capture, walk: int, step: int, t: float, y: Any) -> int:
    for i in range(3):
        observer.last[walk, i] = y[i + 1]
    for k in range(observer.owner.size):
        a, b, c = y[1] - observer.points[k, 0], y[2] - observer.points[k, 1], y[3] - observer.points[k, 2]
        # The comparison is strict, so that an attractor with a reach of zero captures nothing.
        if a * a + b * b + c * c < observer.reach[k]:
            observer.attractor[walk] = observer.owner[k]
            return WALKED
    return WALKED if step + 1 >= observer.max_steps else GOES_ON


@dataclass(frozen=True, eq=False)
class PeriodicAttractor:
    points: Floats  # (period, 3) section points in walking order, a stride apart, starting with the smallest angle
    reach: float  # largest of the distances tried at which all test walks return to it, or zero if there is none

    @property
    def period(self) -> int:
        return len(self.points)


@dataclass(frozen=True, eq=False)
class Attractors:
    """Attractors of walks from a set of starts."""

    cycles: tuple[PeriodicAttractor, ...] = ()  # ordered by period
    aperiodic: bool = False  # whether some walks continue without repeating

    def capture(self, n: int, max_steps: int, share: float = 1.0) -> Capture:
        """Return an observer for n walks of at most `max_steps` steps. `share` scales the capture distances."""
        points = np.concatenate([np.zeros((0, SECTION_SIZE)), *(cycle.points for cycle in self.cycles)])
        owner = np.repeat(np.arange(len(self.cycles)), [cycle.period for cycle in self.cycles])
        reach = np.array([(share * self.cycles[index].reach) ** 2 for index in owner])
        return Capture(points, owner, reach, max_steps, np.full(n, UNREACHED, np.int64), np.zeros((n, SECTION_SIZE)))


@dataclass(frozen=True, eq=False)
class WalkEnds:
    """How n walks ended: their outcomes, the attractors reached (or UNREACHED) and the numbers of steps, (n,) each."""

    outcome: Integers
    attractor: Integers
    steps: Integers


@dataclass(frozen=True, eq=False)
class Arrivals(WalkEnds):
    last: Floats  # (n, 3) last section point of each walk


def walk_to_attractor(
    walker: Walker,
    attractors: Attractors,
    z: Floats,
    max_steps: int,
    share: float = 1.0,
    tolerances: tuple[float, float] = (RTOL, ATOL),
) -> Arrivals:
    """Walk from section coordinates z (n, 3) until each reaches an attractor, fails, or has taken `max_steps` steps."""
    fates: Fates = new_fates(len(z))
    capture = attractors.capture(len(z), max_steps, share)
    if isinstance(walker, RigidModel):
        walk_one_by_one(walker, capture, z, fates, tolerances)
    else:
        walk_lanes(walker, new_lane_memory(*tolerances), capture, states_on_section(walker.model, z), fates)
    return Arrivals(fates.outcome, capture.attractor, fates.steps, capture.last)


def walk_one_by_one(
    walker: RigidModel, capture: Capture, starts: Floats, fates: Fates, tolerances: tuple[float, float]
) -> None:
    """Walk from one start after another with any walker, and check for capture after each batch of steps."""
    shooting = RigidStepper(walker, Tolerances("dop853", *tolerances, BATCH_BUDGET))
    section = strike_section(walker)
    stride = stride_of(walker)
    for number, start in enumerate(starts):
        z = start
        steps = 0
        outcome = REJECTED if hip_above_fall(walker, state_on_section(walker, start)) < 0.0 else WALKED
        while outcome == WALKED and steps < capture.max_steps:
            part = shooting.walk(section, z, min(STEPS_PER_LOOK, capture.max_steps - steps), derived=False)
            outcome = int(part.outcome)
            points = part.z
            steps_taken = part.time.size
            near = ((points[:, None] - capture.points) ** 2).sum(axis=2) < capture.reach
            # The points of attractors lie a stride apart, so only whole strides are compared with them.
            near[np.arange(1, len(near) + 1) % stride != 0] = False
            if near.any():
                steps_taken = int(np.argmax(near.any(axis=1))) + 1
                capture.attractor[number] = capture.owner[np.argmax(near[steps_taken - 1])]
                outcome = WALKED
            if steps_taken:
                capture.last[number] = z = points[steps_taken - 1]
            steps += steps_taken
            if near.any():
                break
        fates.outcome[number], fates.steps[number] = outcome, steps


def stride_of(walker: Walker) -> int:
    """Return the number of steps after which a walker returns to its first section."""
    return 2 if isinstance(walker, RigidModel) and walker.legs_differ else 1


def find_attractors(walker: Walker, starts: Floats, seed: int) -> Attractors:
    """Find the attractors that the unit walker reaches from section coordinates `starts` (n, 3)."""
    # Walks from the first starts have the full length. Walks from later starts have it only if they reach no attractor
    # known by then.

    def add_reaches(cycles: Sequence[Floats]) -> tuple[PeriodicAttractor, ...]:
        generator = np.random.default_rng(seed)
        return tuple(PeriodicAttractor(points, find_reach(walker, points, cycles, generator)) for points in cycles)

    cycles, aperiodic = find_cycles(walker, starts[:FIRST_STARTS], Attractors())
    reached = add_reaches(cycles)
    more, also_aperiodic = find_cycles(walker, starts[FIRST_STARTS:], Attractors(reached))
    new = [cycle for cycle in more if not any(same_cycle(cycle, cycle_before) for cycle_before in cycles)]
    if new:
        reached = add_reaches(order_cycles([*cycles, *new]))
    return Attractors(reached, aperiodic or also_aperiodic)


def find_cycles(walker: Walker, starts: Floats, attractors: Attractors) -> tuple[list[Floats], bool]:
    """Return the cycles other than `attractors` that walks settle on, and whether any walk stays aperiodic."""
    rough = walk_to_attractor(walker, attractors, starts, SETTLING_STEPS)
    elsewhere = np.flatnonzero((rough.outcome == Outcome.WALKED) & (rough.attractor == UNREACHED))
    points = rough.last[elsewhere]
    # Most walks end on the same few cycles, so walks that end at the same point are continued only once.
    _, first = np.unique(np.round(points / (10.0 * CYCLE_DISTANCE)), axis=0, return_index=True)
    # `np.unique` sorts by value. Sorting the indices restores the order of the starts.
    distinct = points[np.sort(first)][:MAX_SETTLED_WALKS]
    settled = walk_to_attractor(walker, Attractors(), distinct, RESETTLING_STEPS, tolerances=CYCLE_TOLERANCES)
    cycles: list[Floats] = []
    aperiodic = False
    for point in settled.last[settled.outcome == Outcome.WALKED]:
        cycle = cycle_through(walker, point)
        if cycle is None:
            aperiodic = True
        elif not any(same_cycle(cycle, previous) for previous in cycles):
            cycles.append(cycle)
    return order_cycles(cycles), aperiodic


def order_cycles(cycles: Sequence[Floats]) -> list[Floats]:
    return sorted(cycles, key=lambda points: (len(points), *points[0]))


def cycle_through(walker: Walker, point: Floats) -> Floats | None:
    """Return the cycle (period, 3) through a point (3,), beginning with the point of smallest angle.

    Returns None if the walk does not return to the point.
    """
    orbit = [point]
    for _ in range(MAX_CYCLE_PERIOD):
        start = orbit[-1][None, :]
        ahead = walk_to_attractor(walker, Attractors(), start, stride_of(walker), tolerances=CYCLE_TOLERANCES)
        if ahead.outcome[0] != Outcome.WALKED:
            return None
        orbit.append(ahead.last[0])
        if np.abs(orbit[-1] - point).max() < CYCLE_DISTANCE:
            points = np.array(orbit[:-1])
            return np.roll(points, -int(np.argmin(points[:, 0])), axis=0)
    return None


def same_cycle(first: Floats, second: Floats) -> bool:
    return len(first) == len(second) and bool(np.abs(first - second).max() < 100.0 * CYCLE_DISTANCE)


def find_reach(walker: Walker, points: Floats, cycles: Sequence[Floats], generator: np.random.Generator) -> float:
    """Return a distance from a cycle at which test walks from all directions return to it, or zero."""
    # The distance is at most a quarter of the gap to the nearest other cycle.
    foreign = [cycle for cycle in cycles if cycle is not points]
    gap = min((float(np.linalg.norm(p - cycle, axis=1).min()) for cycle in foreign for p in points), default=np.inf)
    reach = min(CAPTURE, 0.25 * gap)
    directions = generator.normal(size=(len(points) * STARTS_PER_POINT, SECTION_SIZE))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for _ in range(NARROWINGS):
        around = np.repeat(points, STARTS_PER_POINT, axis=0) + reach * directions
        this = Attractors((PeriodicAttractor(points, reach),))
        back = walk_to_attractor(walker, this, around, RETURN_STEPS, share=0.1)
        if (back.attractor == 0).all():
            return reach
        reach *= NARROWING
    return 0.0


@dataclass(frozen=True)
class Window:
    """Grid of starts over some of the section coordinates, in SI units."""

    axes: tuple[int, ...]  # indices into (theta_2, dtheta_1, dtheta_2)
    lower: tuple[float, ...]  # lower bound along each axis
    upper: tuple[float, ...]  # upper bound along each axis
    cells: tuple[int, ...]  # number of cells along each axis
    rest: tuple[float, ...]  # (3,) section coordinates; the coordinates in `axes` are replaced

    @property
    def size(self) -> int:
        return int(np.prod(self.cells))

    def cell_centres(self, axis: int) -> Floats:
        """Return the cell centres along the axis with this index in `axes`."""
        width = (self.upper[axis] - self.lower[axis]) / self.cells[axis]
        middles: Floats = np.arange(self.cells[axis], dtype=np.float64) + 0.5
        return self.lower[axis] + width * middles

    def starts(self, cells: Integers, inside: Floats | None = None) -> Floats:
        """Return section coordinates (n, 3) in the cells with these flat indices (last axis fastest).

        inside  (n, axes) position within each cell, in cell widths from -1/2 to 1/2; cell centres by default
        """
        z = np.tile(np.array(self.rest), (len(cells), 1))
        for k, (axis, index) in enumerate(zip(self.axes, np.unravel_index(cells, self.cells), strict=True)):
            width = (self.upper[k] - self.lower[k]) / self.cells[k]
            offset = 0.0 if inside is None else inside[:, k]
            z[:, axis] = self.lower[k] + width * (index + 0.5 + offset)
        return z

    def draw(self, n: int, generator: np.random.Generator) -> Floats:
        """Draw section coordinates (n, 3) uniformly from the window."""
        z = np.tile(np.array(self.rest), (n, 1))
        z[:, list(self.axes)] = generator.uniform(self.lower, self.upper, (n, len(self.axes)))
        return z


def edge_cells(classes: NDArray[Any]) -> Integers:
    """Return the flat indices of the cells with a neighbour of another class along some axis."""
    from scipy import ndimage  # only needed here

    neighbours = ndimage.generate_binary_structure(classes.ndim, 1)
    minima = ndimage.minimum_filter(classes, footprint=neighbours, mode="nearest")
    return np.flatnonzero(minima != ndimage.maximum_filter(classes, footprint=neighbours, mode="nearest"))


def subcell_centres(refine: int, axes: int) -> Floats:
    """Return the centres (refine^axes, axes) of a cell's subcells, in cell widths from the cell's centre."""
    middles = (np.arange(refine) + 0.5) / refine - 0.5
    return np.stack(np.meshgrid(*[middles] * axes, indexing="ij"), axis=-1).reshape(-1, axes)
