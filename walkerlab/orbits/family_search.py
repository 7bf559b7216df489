"""The families of one model over a span: branches with their cascades, attractors and chaos, and a plane's curves.

All of it from seeds on a step map, whatever the model; how thoroughly it is done is what sets models apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from walkerlab.orbits.attractors import (
    Attractor,
    AttractorBranch,
    Lyapunov,
    close_returns,
    largest_exponent,
    left_by_flip,
    settled_elsewhere,
    swept,
)
from walkerlab.orbits.continuation import StepControl
from walkerlab.orbits.families import BranchFollower, GaitBranch, Seed, ValueSpan
from walkerlab.orbits.plane import CONTROL, BifurcationCurve, Plane, Regions, curve_through, regions_of
from walkerlab.orbits.step_map import StepMap
from walkerlab.solvers.system import Floats

BEFORE_FLIP = 0.02  # of the span: how far before the first flip the attractor is looked at
OTHERS_AT, OTHER_PERIODS, RETURNS = 12, (3, 5, 6), 4000  # values, steps of gaits looked for, steps walked for them
STARTS, SCATTER, SETTLING = 40, 0.1, 400  # walks from scattered starts at each value, and how long they settle
CURVE_POINTS = 120
RIGID, CONTACT = "rigid", "contact"


class Listener(Protocol):
    """Whom a search tells how far it has come."""

    def start(self, label: str, total: int | None = None) -> None:
        """A piece of work begins, of so many parts if their number is known."""

    def advance(self, n: int = 1) -> None:
        """So many more parts are done."""


@dataclass(frozen=True)
class Thoroughness:
    """How thoroughly a model's families are sought.

    values     of the parameter at which attractors are looked at
    transient, kept  steps walked before an attractor, and on it
    exponents  values at which the Lyapunov exponent is measured
    averaged   steps it is averaged over
    along, over_plane  how far steps along branches go, and along curves of bifurcations over two parameters
    periods    steps of the longest gaits that can be followed
    of_curves  steps of the longest gaits whose bifurcations are followed over a plane
    others     whether gaits of other numbers of steps are sought, and the regions of a plane
    """

    values: int
    transient: int
    kept: int
    exponents: int
    averaged: int
    along: StepControl
    over_plane: StepControl
    periods: int
    of_curves: int
    others: bool


CURVES_ON_GROUND = StepControl(first=0.03, shortest=1e-4, longest=0.1, turn=0.95, tolerance=1e-8)
"""The contact model's derivatives are good to about 1e-8."""
THOROUGHNESS = {
    RIGID: Thoroughness(240, 500, 96, 16, 1500, StepControl(), CONTROL, 64, 4, others=True),
    CONTACT: Thoroughness(
        24, 40, 16, 4, 100, StepControl(tolerance=1e-9, shortest=1e-4), CURVES_ON_GROUND, 4, 1, others=False
    ),
}


NO_ATTRACTORS = AttractorBranch()


@dataclass(frozen=True, eq=False)
class Family:
    """What was found of one model; no map if there was no gait to begin from.

    curves   of bifurcations, over the plane of two parameters
    regions  of that plane, by what walks settle on
    """

    model: str
    step_map: StepMap | None
    branches: tuple[GaitBranch, ...] = ()
    attractors: AttractorBranch = NO_ATTRACTORS
    exponents: tuple[Lyapunov, ...] = ()
    curves: tuple[BifurcationCurve, ...] = ()
    regions: Regions | None = None


@dataclass(frozen=True)
class FamilySearch:
    """A search for all gaits of a model over a span, from seeds: of how many steps, and points a branch, at most."""

    model: str
    step_map: StepMap
    span: ValueSpan
    seeds: Sequence[Seed]
    periods: int
    points: int
    listener: Listener
    plane: Plane | None = None

    @property
    def how(self) -> Thoroughness:
        """How thoroughly this model's are sought."""
        return THOROUGHNESS[self.model]

    @cached_property
    def follower(self) -> BranchFollower:
        """Of its branches."""
        return BranchFollower(self.step_map, self.span, self.how.along, self.points, self.listener.advance)

    def tell(self, what: str, total: int | None = None) -> None:
        """Begin a piece of work."""
        self.listener.start(f"continuation: {what}".format(model=f"the {self.model} model"), total)

    def branches(self) -> Family:
        """The branches that the seeds lie on, and the cascades beyond their flips."""
        self.tell("branches of {model}")
        return Family(self.model, self.step_map, self.follower.family(self.seeds, self.periods))

    def family(self, generator: np.random.Generator) -> Family:
        """All that is sought.

        generator  of scattered starts
        """
        found = self.branches()
        if self.periods > 1:
            found = self.with_attractors(found)
        if self.how.others and found.attractors.found:
            found = self.with_others(found, generator)
        return found if self.plane is None else self.over_plane(found, self.plane)

    def with_attractors(self, family: Family) -> Family:
        """The attractor beyond the first flip of a stable branch, and the exponents along it.

        It is followed from before that flip on or, where that lies outside the span, from an end of the span.
        """
        span, how = self.span, self.how
        begun = first_flip(family.branches)
        if begun is not None:
            flip, start = begun
            begin, end = max(span.least, flip - BEFORE_FLIP * span.size), span.most
        else:
            family, first = self.doubled_outside(family)
            if first is None:
                return family
            start, begin = first.last, first.value
            end = span.most if begin - span.least < span.most - begin else span.least
        values = np.linspace(begin, end, how.values)
        self.tell("attractor of {model}", how.values)
        attractors = swept(self.step_map, start, values, how.transient, how.kept, self.listener.advance)
        if not attractors.found:
            return replace(family, attractors=attractors)
        if end < begin:
            attractors = replace(attractors, found=attractors.found[::-1])
        chosen = attractors.found[:: max(1, len(attractors.found) // how.exponents)]
        self.tell("Lyapunov exponents of {model}", len(chosen))
        exponents = []
        for attractor in chosen:
            exponents.append(largest_exponent(self.step_map, attractor.last, attractor.value, how.kept, how.averaged))
            self.listener.advance()
        found = tuple(one for one in exponents if one is not None)
        return replace(family, attractors=attractors, exponents=found)

    def doubled_outside(self, family: Family) -> tuple[Family, Attractor | None]:
        """Gaits of 2, 4, 8, ... steps where all of a branch lies beyond a flip outside the span, and their attractor.

        Both are sought at the branch's ends: a walk leaves its gait there for the attractor, whose near returns are
        tried. Returns the attractor at the least of these values too; None if there is none.
        """
        how = self.how
        self.tell("gaits of {model} beyond flips outside the span")
        ends = [
            branch.points[place] for branch in family.branches if branch.period == 1 and branch.flipped_outside
            for place in (0, -1)
        ]  # fmt: skip
        reached = [left_by_flip(self.step_map, end, how.transient, how.kept) for end in ends]
        found = [one for one in reached if isinstance(one, Attractor) and one.period != 1]
        if not found:
            return family, None
        doublings = [2**k for k in range(1, self.periods.bit_length())]
        seeds = [seed for one in found for seed in close_returns(self.step_map, one, doublings, how.averaged)]
        branches = self.follower.family(seeds, self.periods, family.branches)
        return replace(family, branches=branches), min(found, key=lambda one: one.value)

    def with_others(self, family: Family, generator: np.random.Generator) -> Family:
        """Gaits of other numbers of steps: near returns of chaotic walks, and where scattered starts settle."""
        sampled = []
        for chaotic in (False, True):
            found = [one for one in family.attractors.found if (one.period == 0) is chaotic]
            sampled += found[:: max(1, len(found) // OTHERS_AT)]
        self.tell("other gaits of {model}", len(sampled))
        seeds: list[Seed] = []
        for attractor in sampled:
            if attractor.period == 0:
                seeds += close_returns(self.step_map, attractor, OTHER_PERIODS, RETURNS)
            seeds += settled_elsewhere(self.step_map, attractor, STARTS, SCATTER, SETTLING, generator)
            self.listener.advance()
        self.tell("branches of other gaits of {model}")
        return replace(family, branches=self.follower.family(seeds, self.periods, family.branches))

    def over_plane(self, family: Family, plane: Plane) -> Family:
        """The family with curves of its bifurcations, and perhaps regions, over the plane of both parameters."""
        span, advance = self.span, self.listener.advance
        self.tell("curves of bifurcations of {model}")
        found = [
            curve_through(one, branch.period, span, plane, CURVE_POINTS, advance, self.how.over_plane)
            for branch in family.branches
            for one in branch.bifurcations
            if branch.period <= self.how.of_curves and one.kind != "torus"
        ]
        regions = None
        if self.how.others:
            self.tell("regions of the plane of two parameters")
            regions = regions_of(family.branches, span, plane, advance)
        return replace(family, curves=tuple(curve for curve in found if curve is not None), regions=regions)


def first_flip(branches: Sequence[GaitBranch]) -> tuple[float, Floats] | None:
    """The least value at which a gait of one step flips, and the stable gait nearest to it."""
    flips = [
        (one.value, branch) for branch in branches if branch.period == 1
        for one in branch.bifurcations if one.kind == "flip"
    ]  # fmt: skip
    for flip, branch in sorted(flips, key=lambda one: one[0]):
        stable = [point for point in branch.points if point.stable]
        if stable:
            return flip, min(stable, key=lambda point: abs(point.value - flip)).z
    return None
