"""Basins of attraction of the rigid walker: the attractor that each start reaches, in how many steps, or how it fails.

All walks are of the similar walker of unit size, on the section just after heel strike, z = (theta_2, dtheta_1,
dtheta_2). Attractors are found by long walks from many starts. A walk has reached an attractor once it is within a
distance from which, as tested, every walk returns to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.hybrid.endings import GOES_ON, REJECTED, WALKED
from walkerlab.hybrid.rigid_lanes import Fates, TwoLegs, new_fates, new_lane_memory, struck, walk_lanes
from walkerlab.hybrid.rigid_walk import hip_above_fall
from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.shooting import Shooting, on_section, section_of, states_on_section
from walkerlab.outcome import Outcome
from walkerlab.solvers.registry import Tolerances
from walkerlab.solvers.system import Floats, Integers

RTOL, ATOL = 1e-6, 1e-8  # of the walks of a basin: errors of 1e-7 a step
FOUND_RTOL, FOUND_ATOL = 1e-11, 1e-13  # of the walks that attractors are taken from
COORDINATES = 3
NONE = -1  # no attractor
LONGEST_PERIOD = 32  # steps; an attractor that repeats itself later, or never, is aperiodic
REPEATS = 1e-7  # distance of states that are called the same
SETTLING = 2_000  # steps after which walks are looked at
FIRST = 64  # starts that walk as long without any attractor known
SETTLING_AGAIN = 400  # at the tight tolerance, from where they were
COMING_BACK = 1_000  # steps in which walks from around an attractor must come ten times nearer to it
WATCHED = 32  # walks that are looked at
CAPTURE = 1e-3  # distance from an attractor at which it is called reached
NEARER, NARROWINGS = 0.25, 6
AROUND = 24  # starts around each point of an attractor that must come back to it
AT_ONCE, BUDGET = 16, 4_000_000  # steps that one walk takes before it is looked at; right-hand sides of these

Walker = TwoLegs | Standing
"""A unit walker: two straight legs walk in lanes, more bodies from one start after the other."""


class Capture(NamedTuple):
    """An observer that ends walks near an attractor, or after their maximum number of steps."""

    points: Any  # (m, 3) points of attractors
    owner: Any  # (m,) which attractor each belongs to
    reach: Any  # (m,) square of the distance at which it is reached
    most: int  # steps
    attractor: Any  # (n,) reached; NONE; written
    last: Any  # (n, 3) where each walk was last; written


@struck.case(Capture)
def captured(observer: Capture, walk: int, step: int, t: float, y: Any) -> int:
    for i in range(3):
        observer.last[walk, i] = y[i + 1]
    for k in range(observer.owner.size):
        a, b, c = y[1] - observer.points[k, 0], y[2] - observer.points[k, 1], y[3] - observer.points[k, 2]
        if a * a + b * b + c * c < observer.reach[k]:
            observer.attractor[walk] = observer.owner[k]
            return WALKED
    return WALKED if step + 1 >= observer.most else GOES_ON


@dataclass(frozen=True, eq=False)
class PeriodicAttractor:
    """A periodic attractor.

    points  (period, 3) on the section in the order of a walk, beginning with the smallest angle
    reach   distance from which all walks return to it; zero if none was found
    """

    points: Floats
    reach: float

    @property
    def period(self) -> int:
        return len(self.points)


@dataclass(frozen=True, eq=False)
class Attractors:
    """Attractors of walks from a set of starts.

    cycles     ordered by period
    aperiodic  whether some walks continue without repeating
    """

    cycles: tuple[PeriodicAttractor, ...] = ()
    aperiodic: bool = False

    def capture(self, n: int, most: int, share: float = 1.0) -> Capture:
        """Return an observer of n walks of at most `most` steps; `share` scales the distances of capture."""
        points = np.concatenate([np.zeros((0, COORDINATES)), *(cycle.points for cycle in self.cycles)])
        owner = np.repeat(np.arange(len(self.cycles)), [cycle.period for cycle in self.cycles])
        reach = np.array([(share * self.cycles[one].reach) ** 2 for one in owner])
        return Capture(points, owner, reach, most, np.full(n, NONE, np.int64), np.zeros((n, COORDINATES)))


@dataclass(frozen=True, eq=False)
class WalkEnds:
    """Ends of walks, (n,) each: outcome, attractor or NO_ATTRACTOR_REACHED, and the number of steps."""

    outcome: Integers
    attractor: Integers
    steps: Integers


@dataclass(frozen=True, eq=False)
class Arrivals(WalkEnds):
    """Ends of walks with their last points on the section."""

    last: Floats  # (n, 3) where they were last


def arrivals(
    walker: Walker,
    attractors: Attractors,
    z: Floats,
    most: int,
    share: float = 1.0,
    tolerances: tuple[float, float] = (RTOL, ATOL),
) -> Arrivals:
    """Walk from section coordinates z (n, 3) to an attractor, a failure, or `most` steps."""
    fates: Fates = new_fates(len(z))
    capture = attractors.capture(len(z), most, share)
    if isinstance(walker, Standing):
        walk_one_by_one(walker, capture, z, fates, tolerances)
    else:
        walk_lanes(walker, new_lane_memory(*tolerances), capture, states_on_section(walker.model, z), fates)
    return Arrivals(fates.outcome, capture.attractor, fates.steps, capture.last)


def walk_one_by_one(
    walker: Standing, capture: Capture, z: Floats, fates: Fates, tolerances: tuple[float, float]
) -> None:
    """Do the same as `walk_lanes` for any walker, checking for capture after each batch of steps."""
    shooting, section = Shooting(walker, Tolerances("dop853", *tolerances, BUDGET)), section_of(walker)
    for number, start in enumerate(z):
        here, steps = start, 0
        outcome = REJECTED if hip_above_fall(walker, on_section(walker, start)) < 0.0 else WALKED
        while outcome == WALKED and steps < capture.most:
            part = shooting.walk(section, here, min(AT_ONCE, capture.most - steps), derived=False)
            outcome, points, taken = int(part.outcome), part.z, part.time.size
            near = ((points[:, None] - capture.points) ** 2).sum(axis=2) < capture.reach
            if near.any():
                taken = int(np.argmax(near.any(axis=1))) + 1
                capture.attractor[number] = capture.owner[np.argmax(near[taken - 1])]
                outcome = WALKED
            if taken:
                capture.last[number] = here = points[taken - 1]
            steps += taken
            if near.any():
                break
        fates.outcome[number], fates.steps[number] = outcome, steps


def find_attractors(walker: Walker, starts: Floats, seed: int) -> Attractors:
    """Find the attractors of walks from section coordinates `starts` (n, 3).

    The first starts walk the full length; later ones only if they do not reach an attractor known by then.

    walker  the unit walker
    seed    of the random starts around attractors
    """

    def with_reaches(cycles: Sequence[Floats]) -> tuple[PeriodicAttractor, ...]:
        generator = np.random.default_rng(seed)
        return tuple(PeriodicAttractor(points, reach_of(walker, points, cycles, generator)) for points in cycles)

    cycles, aperiodic = settled_cycles(walker, starts[:FIRST], Attractors())
    reached = with_reaches(cycles)
    more, beside = settled_cycles(walker, starts[FIRST:], Attractors(reached))
    new = [cycle for cycle in more if not any(same_cycle(cycle, other) for other in cycles)]
    if new:
        reached = with_reaches(in_order([*cycles, *new]))
    return Attractors(reached, aperiodic or beside)


def settled_cycles(walker: Walker, starts: Floats, known: Attractors) -> tuple[list[Floats], bool]:
    """Return the new cycles that walks settle on, and whether any walk settles on none."""
    tight = (FOUND_RTOL, FOUND_ATOL)
    rough = arrivals(walker, known, starts, SETTLING)
    elsewhere = np.flatnonzero((rough.outcome == Outcome.WALKED) & (rough.attractor == NONE))
    points = rough.last[elsewhere]
    _, first = np.unique(np.round(points / (10.0 * REPEATS)), axis=0, return_index=True)
    distinct = points[np.sort(first)][:WATCHED]
    settled = arrivals(walker, Attractors(), distinct, SETTLING_AGAIN, tolerances=tight)
    cycles: list[Floats] = []
    aperiodic = False
    for point in settled.last[settled.outcome == Outcome.WALKED]:
        cycle = cycle_through(walker, point)
        if cycle is None:
            aperiodic = True
        elif not any(same_cycle(cycle, other) for other in cycles):
            cycles.append(cycle)
    return in_order(cycles), aperiodic


def in_order(cycles: Sequence[Floats]) -> list[Floats]:
    return sorted(cycles, key=lambda points: (len(points), *points[0]))


def cycle_through(walker: Walker, point: Floats) -> Floats | None:
    """Return the cycle (period, 3) of a walk from a point (3,), smallest angle first; None if aperiodic."""
    orbit = [point]
    for _ in range(LONGEST_PERIOD):
        step = arrivals(walker, Attractors(), orbit[-1][None, :], 1, tolerances=(FOUND_RTOL, FOUND_ATOL))
        if step.outcome[0] != Outcome.WALKED:
            return None
        orbit.append(step.last[0])
        if np.abs(orbit[-1] - point).max() < REPEATS:
            points = np.array(orbit[:-1])
            return np.roll(points, -int(np.argmin(points[:, 0])), axis=0)
    return None


def same_cycle(one: Floats, other: Floats) -> bool:
    return len(one) == len(other) and bool(np.abs(one - other).max() < 100.0 * REPEATS)


def reach_of(walker: Walker, points: Floats, cycles: Sequence[Floats], generator: np.random.Generator) -> float:
    """Return a distance from a cycle within which walks from all directions returned to it; zero if there is none.

    It is well below the distance to other cycles.
    """
    others = [other for other in cycles if other is not points]
    gap = min((float(np.linalg.norm(p - other, axis=1).min()) for other in others for p in points), default=np.inf)
    reach = min(CAPTURE, 0.25 * gap)
    ways = generator.normal(size=(len(points) * AROUND, COORDINATES))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    for _ in range(NARROWINGS):
        around = np.repeat(points, AROUND, axis=0) + reach * ways
        back = arrivals(walker, Attractors((PeriodicAttractor(points, reach),)), around, COMING_BACK, share=0.1)
        if (back.attractor == 0).all():
            return reach
        reach *= NEARER
    return 0.0


@dataclass(frozen=True)
class Window:
    """A grid of starts over some coordinates of the section, SI units.

    axes          indices into (theta_2, dtheta_1, dtheta_2)
    lower, upper  bounds along each axis
    cells         number along each axis
    rest          (3,) the section's coordinates; those of the axes are replaced
    """

    axes: tuple[int, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    cells: tuple[int, ...]
    rest: tuple[float, ...]

    @property
    def size(self) -> int:
        """Total number of cells."""
        return int(np.prod(self.cells))

    def along(self, axis: int) -> Floats:
        """Return the cell centres along an axis, given by its index in `axes`."""
        width = (self.upper[axis] - self.lower[axis]) / self.cells[axis]
        middles: Floats = np.arange(self.cells[axis], dtype=np.float64) + 0.5
        return self.lower[axis] + width * middles

    def starts(self, cells: Integers, inside: Floats | None = None) -> Floats:
        """Return section coordinates (n, 3) of cells by flat index, the last axis fastest.

        inside  (n, axes) position within each cell, from -1/2 to 1/2; centres by default
        """
        z = np.tile(np.array(self.rest), (len(cells), 1))
        for place, (axis, index) in enumerate(zip(self.axes, np.unravel_index(cells, self.cells), strict=True)):
            width = (self.upper[place] - self.lower[place]) / self.cells[place]
            offset = 0.0 if inside is None else inside[:, place]
            z[:, axis] = self.lower[place] + width * (index + 0.5 + offset)
        return z

    def drawn(self, n: int, generator: np.random.Generator) -> Floats:
        """Draw section coordinates (n, 3) uniformly from the window."""
        z = np.tile(np.array(self.rest), (n, 1))
        z[:, list(self.axes)] = generator.uniform(self.lower, self.upper, (n, len(self.axes)))
        return z


def edge_cells(classes: NDArray[Any]) -> Integers:
    """Return the flat indices of cells that have a neighbour of another class along an axis."""
    from scipy import ndimage  # which nothing else needs

    beside = ndimage.generate_binary_structure(classes.ndim, 1)
    least = ndimage.minimum_filter(classes, footprint=beside, mode="nearest")
    return np.flatnonzero(least != ndimage.maximum_filter(classes, footprint=beside, mode="nearest"))


def inside_cell(refine: int, axes: int) -> Floats:
    """Return the centres (refine^axes, axes) of a cell's subcells, from -1/2 to 1/2."""
    middles = (np.arange(refine) + 0.5) / refine - 0.5
    return np.stack(np.meshgrid(*[middles] * axes, indexing="ij"), axis=-1).reshape(-1, axes)
