"""Search for all gait families of one model over a span: branches, cascades, attractors, chaos, bifurcation curves."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from walkerlab.physics.orbits import attractors, two_parameters
from walkerlab.physics.orbits.attractors import Attractor, AttractorBranch, Lyapunov, largest_exponent, settle_elsewhere
from walkerlab.physics.orbits.continuation import StepControl
from walkerlab.physics.orbits.families import BranchFollower, GaitBranch, Seed, ValueSpan
from walkerlab.physics.orbits.step_map import StepMap
from walkerlab.physics.solvers.system import Floats

BEFORE_FLIP = 0.02  # the attractor is followed from this far before the first flip, as a fraction of the span
# search for other gaits: number of parameter values, periods to search for, steps per walk
OTHER_GAIT_VALUES = 12
OTHER_PERIODS = (3, 5, 6)
CLOSE_RETURN_STEPS = 4000
# scattered starts at each value: number, standard deviation (see `settle_elsewhere`), and steps allowed to settle
SCATTERED = 40
SCATTER_WIDTH = 0.1
SCATTER_STEPS = 400
CURVE_POINTS = 120
RIGID = "rigid"
CONTACT = "contact"


class Listener(Protocol):
    def start(self, label: str, total: int | None = None) -> None: ...

    def advance(self, n: int = 1) -> None: ...


@dataclass(frozen=True)
class Thoroughness:
    values: int  # number of parameter values at which to look for attractors
    transient: int  # steps to reach an attractor
    samples: int  # steps on the attractor
    exponents: int  # number of values at which to measure the Lyapunov exponent
    averaged: int  # steps over which to average the exponent
    branch_control: StepControl  # step control along branches
    curve_control: StepControl  # step control along curves of bifurcations
    periods: int  # maximum period of gaits
    curve_periods: int  # maximum period of gaits whose bifurcations are followed over the plane
    other_gaits: bool  # whether to search for gaits of other periods and to find the regions of the plane


# The tolerance suits the contact model's derivatives, which are accurate to about 1e-8.
CURVES_ON_GROUND = StepControl(first=0.03, shortest=1e-4, longest=0.1, turn=0.95, tolerance=1e-8)
THOROUGHNESS = {
    RIGID: Thoroughness(
        values=240,
        transient=500,
        samples=96,
        exponents=16,
        averaged=1500,
        branch_control=StepControl(),
        curve_control=two_parameters.CURVE_CONTROL,
        periods=64,
        curve_periods=4,
        other_gaits=True,
    ),
    # A step on compliant ground takes a thousand times as long, so the search makes do with far fewer steps.
    CONTACT: Thoroughness(
        values=24,
        transient=40,
        samples=16,
        exponents=4,
        averaged=100,
        branch_control=StepControl(tolerance=1e-9, shortest=1e-4),
        curve_control=CURVES_ON_GROUND,
        periods=4,
        curve_periods=1,
        other_gaits=False,
    ),
}


@dataclass(frozen=True, eq=False)
class Family:
    """Search results for one model. `step_map` is None if there was no gait to start from."""

    model: str
    step_map: StepMap | None
    branches: tuple[GaitBranch, ...] = ()
    attractors: AttractorBranch = field(default_factory=AttractorBranch)
    exponents: tuple[Lyapunov, ...] = ()
    curves: tuple[two_parameters.BifurcationCurve, ...] = ()  # bifurcation curves over the plane of two parameters
    regions: two_parameters.Regions | None = None  # periods of attractors over that plane


@dataclass(frozen=True)
class FamilySearch:
    """Search for all gaits of a model over a span, up to `periods` steps, with at most `points` points per branch."""

    model: str
    step_map: StepMap
    span: ValueSpan
    seeds: Sequence[Seed]
    periods: int
    points: int
    listener: Listener
    plane: two_parameters.Plane | None = None

    @property
    def thoroughness(self) -> Thoroughness:
        return THOROUGHNESS[self.model]

    @cached_property
    def follower(self) -> BranchFollower:
        control = self.thoroughness.branch_control
        return BranchFollower(self.step_map, self.span, control, self.points, self.listener.advance)

    @property
    def steps_are_alike(self) -> bool:
        """Whether the legs are equal, which the search for attractors assumes."""
        return self.step_map.stride == 1

    def announce(self, what: str, total: int | None = None) -> None:
        self.listener.start(f"continuation: {what}".format(model=f"the {self.model} model"), total)

    def branches(self) -> Family:
        self.announce("branches of {model}")
        return Family(self.model, self.step_map, self.follower.family(self.seeds, self.periods))

    def family(self, generator: np.random.Generator) -> Family:
        """Run the whole search. `generator` draws the scattered starts."""
        results = self.branches()
        if self.periods > 1 and self.steps_are_alike:
            results = self.add_attractors(results)
        if self.thoroughness.other_gaits and results.attractors.found:
            results = self.add_other_gaits(results, generator)
        return results if self.plane is None else self.add_plane(results, self.plane)

    def add_attractors(self, family: Family) -> Family:
        """Add the attractors beyond the first flip of a stable branch, and their Lyapunov exponents."""
        # Start just before the first flip or, if all flips lie outside the span, at an end of the span.
        span = self.span
        how = self.thoroughness
        flipping = first_flip(family.branches)
        if flipping is not None:
            flip, start = flipping
            begin = max(span.least, flip - BEFORE_FLIP * span.size)
            end = span.most
        else:
            family, first = self.add_doubled_gaits(family)
            if first is None:
                return family
            start = first.last
            begin = first.value
            end = span.most if begin - span.least < span.most - begin else span.least
        values = np.linspace(begin, end, how.values)
        self.announce("attractor of {model}", how.values)
        advance = self.listener.advance
        swept = attractors.sweep_attractor(self.step_map, start, values, how.transient, how.samples, advance)
        if not swept.found:
            return replace(family, attractors=swept)
        # Attractors are listed in order of increasing parameter value.
        if end < begin:
            swept = replace(swept, found=swept.found[::-1])
        chosen = swept.found[:: max(1, len(swept.found) // how.exponents)]
        self.announce("Lyapunov exponents of {model}", len(chosen))
        exponents = []
        for attractor in chosen:
            exponent = largest_exponent(self.step_map, attractor.last, attractor.value, how.samples, how.averaged)
            exponents += [] if exponent is None else [exponent]
            advance()
        return replace(family, attractors=swept, exponents=tuple(exponents))

    def add_doubled_gaits(self, family: Family) -> tuple[Family, Attractor | None]:
        """Add gaits of 2, 4, 8, ... steps beyond flips outside the span.

        Returns the family, and the attractor of these gaits at the smallest value or None if there is none.
        """
        # A walk from an end of the branch leaves the gait for the attractor. The points to which it nearly returns are
        # the seeds.
        how = self.thoroughness
        self.announce("gaits of {model} beyond flips outside the span")
        ends = [
            branch.points[end] for branch in family.branches if branch.period == 1 and branch.flipped_outside
            for end in (0, -1)
        ]  # fmt: skip
        reached = [attractors.leave_by_flip(self.step_map, end, how.transient, how.samples) for end in ends]
        doubled = [attractor for attractor in reached if isinstance(attractor, Attractor) and attractor.period != 1]
        if not doubled:
            return family, None
        doublings = [2**k for k in range(1, self.periods.bit_length())]
        seeds = [seed for a in doubled for seed in attractors.close_returns(self.step_map, a, doublings, how.averaged)]
        branches = self.follower.family(seeds, self.periods, family.branches)
        return replace(family, branches=branches), min(doubled, key=lambda attractor: attractor.value)

    def add_other_gaits(self, family: Family, generator: np.random.Generator) -> Family:
        sampled = []
        for chaotic in (False, True):
            alike = [attractor for attractor in family.attractors.found if (attractor.period == 0) is chaotic]
            sampled += alike[:: max(1, len(alike) // OTHER_GAIT_VALUES)]
        self.announce("other gaits of {model}", len(sampled))
        seeds: list[Seed] = []
        for attractor in sampled:
            if attractor.period == 0:
                seeds += attractors.close_returns(self.step_map, attractor, OTHER_PERIODS, CLOSE_RETURN_STEPS)
            seeds += settle_elsewhere(self.step_map, attractor, SCATTERED, SCATTER_WIDTH, SCATTER_STEPS, generator)
            self.listener.advance()
        self.announce("branches of other gaits of {model}")
        return replace(family, branches=self.follower.family(seeds, self.periods, family.branches))

    def add_plane(self, family: Family, plane: two_parameters.Plane) -> Family:
        span = self.span
        advance = self.listener.advance
        how = self.thoroughness
        self.announce("curves of bifurcations of {model}")
        curves = [
            two_parameters.follow_curve(
                bifurcation, branch.period, span, plane, CURVE_POINTS, advance, how.curve_control
            )
            for branch in family.branches
            for bifurcation in branch.bifurcations
            if branch.period <= how.curve_periods * self.step_map.stride and bifurcation.kind != "torus"
        ]
        regions = None
        if self.thoroughness.other_gaits and self.steps_are_alike:
            self.announce("regions of the plane of two parameters")
            regions = two_parameters.find_regions(family.branches, span, plane, advance)
        return replace(family, curves=tuple(curve for curve in curves if curve is not None), regions=regions)


def first_flip(branches: Sequence[GaitBranch]) -> tuple[float, Floats] | None:
    """Return the smallest value at which a period-1 gait flips, and z (d,) of the stable gait nearest to it."""
    flips = [
        (bifurcation.value, branch) for branch in branches if branch.period == 1
        for bifurcation in branch.bifurcations if bifurcation.kind == "flip"
    ]  # fmt: skip
    for flip, branch in sorted(flips, key=lambda bifurcation: bifurcation[0]):
        stable = [point for point in branch.points if point.stable]
        if stable:
            return flip, min(stable, key=lambda point: abs(point.value - flip)).z
    return None
