"""Families of gaits over a key of the config: branches, bifurcations, cascades, and the chaos beyond them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np

from walkerlab.config.ground import Footholds
from walkerlab.config.reads import ContactConfig, ContinuationConfig
from walkerlab.config.schema import Output
from walkerlab.config.walkers import without_contact
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.labels import Label
from walkerlab.mechanics.rigid import knee_of
from walkerlab.orbits.attractors import (
    Attractor,
    AttractorBranch,
    Lyapunov,
    close_returns,
    feigenbaum_ratios,
    largest_exponent,
    left_by_flip,
    may_part,
    settled_elsewhere,
    swept,
)
from walkerlab.orbits.bifurcations import Bifurcation
from walkerlab.orbits.continuation import StepControl
from walkerlab.orbits.families import (
    BranchFollower,
    Crossing,
    GaitBranch,
    Seed,
    ValueSpan,
    ends_at,
    steps_word,
)
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.orbits.newton import Effort, Floats
from walkerlab.orbits.plane import CONTROL as CURVE_CONTROL
from walkerlab.orbits.plane import BifurcationCurve, Regions, curve_through, regions_of
from walkerlab.orbits.shooting import on_section
from walkerlab.orbits.similarity import unit_walker
from walkerlab.orbits.step_map import Cycle, Monitor, StepMap, gait_near
from walkerlab.outcome import outcome_of
from walkerlab.scene.endings import causes, without_pads
from walkerlab.scene.families import contact_map, rigid_map, rigid_walkers, walkers_on_ground
from walkerlab.scene.parameter import Parameter, parameter_of
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import RigidScene, coordinates, rigid_walker
from walkerlab.solvers.registry import ENDLESS, Tolerances
from walkerlab.stages.numerical_error import SAMPLE, USUAL, evenly_spread, tightened
from walkerlab.stages.progress import Progress
from walkerlab.stages.simulate import trajectory_group
from walkerlab.stages.walk import only_at
from walkerlab.store.columns import columns, labelled, real_and_imaginary
from walkerlab.store.content import Attribute, Content, Group, Variable

RIGID, CONTACT = "rigid", "contact"
LOOKED_AT = 5  # values of the span at which gaits are sought, its ends among them
BEFORE_FLIP = 0.02  # of the span: how far before the first flip the attractor is looked at
CONTACT_RESIDUAL, CONTACT_SHORTEST, CONTACT_PERIODS = 1e-9, 1e-4, 4
OTHERS_AT, OTHER_PERIODS, RETURNS = 12, (3, 5, 6), 4000  # values, steps of gaits looked for, steps walked for them
STARTS, SCATTER, SETTLING = 40, 0.1, 400  # walks from scattered starts at each value, and how long they settle
CURVE_POINTS, CONFIGS = 120, 256
LONGEST_OF_CURVES: Final = {RIGID: 4, CONTACT: 1}
CONTROLS: Final = {
    RIGID: CURVE_CONTROL,
    CONTACT: StepControl(first=0.03, shortest=1e-4, longest=0.1, turn=0.95, tolerance=1e-8),
}
"""Of curves over two parameters; the contact model's derivatives are good to about 1e-8."""


MOTIONS_OF_BRANCH, LONGEST = 12, 4  # gaits of one branch, and steps of a gait, that are walked
STRIDE = 2  # steps, after which each leg is where it was
TOLERANCES = Tolerances("dop853", 1e-9, 1e-11, ENDLESS)
ALL_OUTPUTS: Final[tuple[Output, ...]] = ("states", "energies", "forces")
EVERY = 3  # which samples are kept beside those at heel strikes

TIGHTEST = Effort(1e-13)  # what gaits are solved to whose numerical error is told
OF_A_GAIT = ("step_period_s", "step_length_m")  # what a family's numerical error is told of
MODEL, KIND = Label("", "model"), Label("", "fold, flip or torus")
PERIOD = Label("1", "steps of the gait")
STANCE = Label("rad", "stance leg just after each heel strike", name="stance_angle")
CURVES = {"model": MODEL, "kind": Label("", "fold or flip"), "period": PERIOD}
BIFURCATIONS = {"kind": KIND, "period": PERIOD, "branch": Label("1", "number of the branch")}
EXPONENTS = {"exponent": Label("1", "largest exponent per step"), "uncertainty": Label("1", "its standard error")}
POINTS = {
    "stable": Label("1", "whether disturbances die out"),
    "periods_s": Label("s", "durations of the steps", ("step",), name="step_period"),
    "lengths_m": Label("m", "lengths of the steps", ("step",), name="step_length"),
    "angles": replace(STANCE, dims=("step",)),
    "z": Label("1", "section coordinates", ("coordinate",), name="section"),
}
ATTRACTORS = {
    "period": Label("1", "steps after which it repeats; 0: never"),
    "periods_s": Label("s", "durations of steps on it", ("visit",), name="step_period"),
    "angles": replace(STANCE, dims=("visit",)),
}
MARKS = {
    "after": Label("1", "point before a bifurcation; -1: none", name="mark_after"),
    "kind": replace(KIND, name="mark_kind"),
    "periods": Label("s", "durations of the steps there", ("step",), name="mark_step_period"),
    "angles": Label("rad", "stance leg just after each heel strike there", ("step",), name="mark_stance_angle"),
}


@dataclass(frozen=True)
class AttractorSampling:
    """How finely attractors are looked at.

    values     of the parameter
    transient, kept  steps walked before the attractor, and on it
    exponents  values at which the Lyapunov exponent is measured
    averaged   steps it is averaged over
    """

    values: int
    transient: int
    kept: int
    exponents: int
    averaged: int


RIGID_SAMPLES = AttractorSampling(240, 500, 96, 16, 1500)
CONTACT_SAMPLES = AttractorSampling(24, 40, 16, 4, 100)


@dataclass(frozen=True)
class FamilyQuestion:
    """What is followed: a parameter of a config over a span."""

    config: ContinuationConfig
    parameter: Parameter
    span: ValueSpan
    periods: int
    points: int

    def looked_at(self) -> list[float]:
        """Values of the span at which gaits are sought: the config's own first."""
        own = self.parameter.value_in(self.config)
        spread = np.linspace(self.span.least, self.span.most, LOOKED_AT)
        return [*([own] if own in self.span else []), *(float(one) for one in spread)]

    @property
    def models(self) -> tuple[str, ...]:
        """The models that are asked for."""
        model = self.config.continuation.model
        return (RIGID, CONTACT) if model == "both" else (model,)

    @property
    def second(self) -> FamilyQuestion | None:
        """The same over the second key, if there is one."""
        block = self.config.continuation.second
        if block is None:
            return None
        parameter = parameter_of(block.over, self.config)
        return replace(self, parameter=parameter, span=ValueSpan(block.least, block.most))

    def touches(self, model: str) -> bool:
        """Whether a model changes over the span."""
        walkers: Callable[..., Callable[[float], Any]] = (
            rigid_walkers if model == RIGID else partial(walkers_on_ground, step_length_m=1.0)
        )
        walker_at = walkers(self.config, self.parameter)
        first, last = ([*numbers_in(walker_at(value))] for value in (self.span.least, self.span.most))
        return len(first) != len(last) or not all(map(np.array_equal, first, last))

    def touched(self, key: str) -> tuple[str, ...]:
        """The models asked for that change over the span; ConfigError, about the block's key, if none does."""
        touched = tuple(model for model in self.models if self.touches(model))
        if not touched:
            raise ConfigError(
                f"continuation.{key}: {self.parameter.key} does not touch the {' or the '.join(self.models)} model",
                "Choose a key that the model is made of, or another model (--model).",
            )
        return touched


def numbers_in(value: Any) -> Iterator[Any]:
    """All that a record and the records in it are made of."""
    if isinstance(value, tuple) or is_dataclass(value):
        for one in value if isinstance(value, tuple) else vars(value).values():
            yield from numbers_in(one)
    else:
        yield value


NO_ATTRACTORS = AttractorBranch()


@dataclass(frozen=True, eq=False)
class Followed:
    """What was found of one model; no map if there was no gait to begin from.

    map_of   the step map over the parameter of another config
    curves   of bifurcations, over the plane of two parameters
    regions  of that plane, by what walks settle on
    """

    model: str
    step_map: StepMap | None
    branches: tuple[GaitBranch, ...]
    map_of: Callable[[ContactConfig], StepMap] | None = None
    attractors: AttractorBranch = NO_ATTRACTORS
    exponents: tuple[Lyapunov, ...] = ()
    curves: tuple[BifurcationCurve, ...] = ()
    regions: Regions | None = None


def run(config: ContinuationConfig, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Follow the families that the config asks for.

    Raises ConfigError for a key that is no number of the model, NoAnswer for a span without a gait.
    """
    block = config.continuation
    parameter = parameter_of(block.over, config)
    asked = FamilyQuestion(config, parameter, ValueSpan(block.least, block.most), block.periods, block.points)
    found = []
    for model in models_of(asked):
        if model == RIGID:
            followed, follower = rigid_branches(asked, progress)
            followed = beyond_flips(followed, follower, asked, RIGID_SAMPLES, progress)
            followed = with_others(followed, asked, follower, progress)
        else:
            limited = replace(asked, periods=min(asked.periods, CONTACT_PERIODS))
            followed, on_ground = contact_branches(limited, progress)
            if on_ground is not None:
                followed = beyond_flips(followed, on_ground, limited, CONTACT_SAMPLES, progress)
        found.append(over_plane(followed, asked, progress))
    said = summary(found, asked)
    content = Content(groups(found, said, asked), said)
    if not any(followed.branches for followed in found):
        raise NoAnswer(
            f"no gait was found with {parameter.key} from {block.least:g} to {block.most:g} {parameter.unit}: "
            f"none at any of {len(asked.looked_at())} values looked at",
            "Choose another span (--from, --to), or change what else the config fixes.",
            content,
        )
    return content


def models_of(asked: FamilyQuestion) -> tuple[str, ...]:
    """The models that are followed.

    Raises ConfigError for one that the config has not, for a key that touches none or cannot have the ends of its span,
    and for a second key that is the first, or whose range leaves out the config's own value.
    """
    config, key, second = asked.config, asked.parameter.key, asked.second
    if asked.models != (RIGID,) and config.contact is None:
        raise without_contact("the contact model", config.walker, "Use --model rigid.")
    for name, value in (("from", asked.span.least), ("to", asked.span.most)):
        if asked.parameter.config_at(config, value) is None:
            raise ConfigError(
                f"continuation.{name}: {key} cannot be {value:g} {asked.parameter.unit}",
                f"`walkerlab schema {key}` says what the key allows.",
            )
    if second is not None:
        own, span, name = second.parameter.value_in(config), second.span, second.parameter.key
        if second.parameter.path == asked.parameter.path:
            raise ConfigError(
                f"continuation.second: {name} is already the number that gaits are followed over", "Choose another key."
            )
        if own not in span:
            raise ConfigError(
                f"continuation.second: {name} is {own:g} in the config, outside {span.least:g} to {span.most:g}",
                "Curves begin at the config's own value; choose a range around it.",
            )
        second.touched("second")
    return asked.touched("over")


def left_out(found: Sequence[Followed], asked: FamilyQuestion) -> list[dict[str, str]]:
    """What was not followed, and why."""
    followed, entries, second = {one.model: one for one in found}, [], asked.second
    for model in asked.models:
        if model not in followed:
            entries.append((f"the {model} model's gaits", f"{asked.parameter.key} does not touch that model"))
        elif not followed[model].branches:
            entries.append((f"the {model} model's gaits", "no gait was found in the span to begin from"))
        elif model == CONTACT and asked.periods > CONTACT_PERIODS:
            what = f"the contact model's gaits of more than {CONTACT_PERIODS} steps"
            entries.append((what, "its flips are located too coarsely, to about 1e-7, to follow them further"))
    entries += [
        (f"the {one.model} model's plane of both keys", "the second key does not touch that model")
        for one in found
        if second is not None and one.branches and not second.touches(one.model)
    ]
    return [{"what": what, "why": why, "saves": ""} for what, why in entries]


def over_plane(followed: Followed, asked: FamilyQuestion, progress: Progress) -> Followed:
    """What was found of a model, with curves and regions of the plane if a second key is asked for that touches it."""
    map_of, second, model = followed.map_of, asked.second, followed.model
    if map_of is None or second is None or not second.touches(model):
        return followed

    @lru_cache(CONFIGS)
    def map_at(value: float) -> StepMap | None:
        changed = second.parameter.config_at(asked.config, value)
        return None if changed is None else map_of(changed)

    own, spans = second.parameter.value_in(asked.config), (asked.span, second.span)
    progress.start(f"continuation: curves of bifurcations of the {model} model")
    found = [
        curve_through(one, branch.period, map_at, spans, own, CURVE_POINTS, progress.advance, CONTROLS[model])
        for branch in followed.branches
        for one in branch.bifurcations
        if branch.period <= LONGEST_OF_CURVES[model] and one.kind != "torus"
    ]
    regions = None
    if model == RIGID:
        progress.start("continuation: regions of the plane of two parameters")
        regions = regions_of(followed.branches, map_at, spans, own, progress.advance)
    return replace(followed, curves=tuple(curve for curve in found if curve is not None), regions=regions)


def rigid_branches(asked: FamilyQuestion, progress: Progress) -> tuple[Followed, BranchFollower]:
    """Every branch of the rigid model's gaits of one step, and the cascades beyond their flips."""
    config, parameter, span = asked.config, asked.parameter, asked.span
    walker_at = rigid_walkers(config, parameter)
    map_of = partial(rigid_map, parameter=parameter, scale=span.size)
    step_map = map_of(config)
    progress.start("continuation: branches of the rigid model")
    follower = BranchFollower(step_map, span, most=asked.points, advance=progress.advance)
    seeds = []
    for value in asked.looked_at():
        walker = walker_at(value)
        if walker is not None:
            section, (_, units) = list(walker.section_indices), unit_walker(walker)
            in_units = [1.0] + [units.time] * (len(section) - 1)
            gaits = find_gaits(walker, config.seed).gaits
            seeds += [Seed(np.array(gait.state)[section] * in_units, value) for gait in gaits]
    branches = follower.family(seeds, asked.periods)
    return Followed(RIGID, step_map, branches, map_of), follower


def contact_branches(asked: FamilyQuestion, progress: Progress) -> tuple[Followed, BranchFollower | None]:
    """The branch of the contact model's gait, and the cascade beyond its flips."""
    from walkerlab.scene.contact import gait_off_pads

    progress.start("continuation: a gait of the contact model")
    for value in asked.looked_at():
        changed = asked.parameter.config_at(asked.config, value)
        rigid = None if changed is None else find_gaits(rigid_walker(changed, changed.equations), changed.seed).gait
        if changed is None or changed.contact is None or rigid is None:
            continue
        found = gait_off_pads(changed, rigid.step_length, rigid.state)
        if found.gait is None:
            progress.note(f"contact model at {value:g} {asked.parameter.unit}: {found.reason}")
            continue
        map_of = partial(
            contact_map, parameter=asked.parameter, scale=asked.span.size, step_length_m=found.gait.step.length_m
        )
        step_map = map_of(asked.config)
        progress.start("continuation: branches of the contact model")
        control = StepControl(tolerance=CONTACT_RESIDUAL, shortest=CONTACT_SHORTEST)
        follower = BranchFollower(step_map, asked.span, control, asked.points, progress.advance)
        seed = Seed(step_map.of_section(found.gait.z), value)
        return Followed(CONTACT, step_map, follower.family([seed], asked.periods), map_of), follower
    return Followed(CONTACT, None, ()), None


def beyond_flips(
    followed: Followed, follower: BranchFollower, asked: FamilyQuestion, samples: AttractorSampling, progress: Progress
) -> Followed:
    """The attractor beyond the first flip of a stable branch, and the exponents along it.

    It is followed from before that flip on or, where that lies outside the span, from an end of the span.
    """
    span = asked.span
    if followed.step_map is None or asked.periods == 1:
        return followed
    begun = first_flip(followed.branches)
    if begun is not None:
        flip, start = begun
        begin, end = max(span.least, flip - BEFORE_FLIP * span.size), span.most
    else:
        followed, first = doubled_outside(followed, follower, asked, samples, progress)
        if first is None:
            return followed
        start, begin = first.last, first.value
        end = span.most if begin - span.least < span.most - begin else span.least
    values = np.linspace(begin, end, samples.values)
    progress.start(f"continuation: attractor of the {followed.model} model", samples.values)
    attractors = swept(follower.step_map, start, values, samples.transient, samples.kept, progress.advance)
    if not attractors.found:
        return replace(followed, attractors=attractors)
    if end < begin:
        attractors = replace(attractors, found=attractors.found[::-1])
    chosen = attractors.found[:: max(1, len(attractors.found) // samples.exponents)]
    progress.start(f"continuation: Lyapunov exponents of the {followed.model} model", len(chosen))
    exponents = []
    for attractor in chosen:
        exponents.append(
            largest_exponent(follower.step_map, attractor.last, attractor.value, samples.kept, samples.averaged)
        )
        progress.advance()
    found = tuple(one for one in exponents if one is not None)
    return replace(followed, attractors=attractors, exponents=found)


def doubled_outside(
    followed: Followed, follower: BranchFollower, asked: FamilyQuestion, samples: AttractorSampling, progress: Progress
) -> tuple[Followed, Attractor | None]:
    """Gaits of 2, 4, 8, ... steps where all of a branch lies beyond a flip outside the span, and where walks settle.

    Both are sought at the branch's ends: a walk leaves its gait there for the attractor, whose near returns are tried.
    Returns the attractor at the least of these values too; None if there is none.
    """
    progress.start(f"continuation: gaits of the {followed.model} model beyond flips outside the span")
    ends = [
        branch.points[place] for branch in followed.branches if branch.period == 1 and branch.flipped_outside
        for place in (0, -1)
    ]  # fmt: skip
    reached = [left_by_flip(follower.step_map, end, samples.transient, samples.kept) for end in ends]
    found = [one for one in reached if isinstance(one, Attractor) and one.period != 1]
    if not found:
        return followed, None
    doublings = [2**k for k in range(1, asked.periods.bit_length())]
    seeds = [seed for one in found for seed in close_returns(follower.step_map, one, doublings, samples.averaged)]
    branches = follower.family(seeds, asked.periods, followed.branches)
    return replace(followed, branches=branches), min(found, key=lambda one: one.value)


def with_others(followed: Followed, asked: FamilyQuestion, follower: BranchFollower, progress: Progress) -> Followed:
    """Gaits of other numbers of steps: near returns of chaotic walks, and where scattered starts settle."""
    if followed.step_map is None or not followed.attractors.found:
        return followed
    generator = np.random.default_rng(asked.config.seed)
    sampled = []
    for chaotic in (False, True):
        found = [one for one in followed.attractors.found if (one.period == 0) is chaotic]
        sampled += found[:: max(1, len(found) // OTHERS_AT)]
    progress.start(f"continuation: other gaits of the {followed.model} model", len(sampled))
    seeds: list[Seed] = []
    for attractor in sampled:
        if attractor.period == 0:
            seeds += close_returns(followed.step_map, attractor, OTHER_PERIODS, RETURNS)
        seeds += settled_elsewhere(followed.step_map, attractor, STARTS, SCATTER, SETTLING, generator)
        progress.advance()
    progress.start(f"continuation: branches of other gaits of the {followed.model} model")
    return replace(followed, branches=follower.family(seeds, asked.periods, followed.branches))


def first_flip(branches: tuple[GaitBranch, ...]) -> tuple[float, Floats] | None:
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


def summary(found: Sequence[Followed], asked: FamilyQuestion) -> dict[str, Any]:
    """What the command prints; values are in the unit of the key that was asked for."""
    config, parameter = asked.config, asked.parameter

    def rows(of_model: Callable[[Followed], Iterable[Mapping[str, Any]]]) -> list[dict[str, Any]]:
        return [{"model": one.model, **row} for one in found for row in of_model(one)]

    return {
        "over": parameter.key,
        "unit": parameter.unit,
        "from": config.continuation.least,
        "to": config.continuation.most,
        "branches": rows(branch_rows),
        "bifurcations": rows(bifurcation_rows),
        "first_doubling": {one.model: flip for one in found if (flip := first_doubling(one.branches)) is not None},
        "lyapunov": rows(lambda one: map(asdict, one.exponents)),
        "cascades": rows(cascade_rows),
        "limits": rows(limit_rows),
        "numerical_error": {one.model: error for one in found if (error := sample_again(one)) is not None},
        "endings": rows(partial(ending_rows, parameter=parameter, config=config)),
        "attractors": rows(lambda one: [attractor_summary(one)] if one.attractors.found else []),
        "curves": rows(curve_rows),
        "regions": rows(region_rows),
        "left_out": left_out(found, asked),
    }


def branch_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """The branches of a model: between which values, how far each is stable, and why it ends."""
    for branch in followed.branches:
        ranges = branch.stable_ranges
        widest = max(ranges, key=lambda pair: pair[1] - pair[0], default=None)
        yield {
            "period": branch.period,
            "from": branch.ends[0].value,
            "to": branch.ends[1].value,
            "points": len(branch.points),
            "stable_range": None if widest is None else list(widest),
            "stable_ranges": [list(pair) for pair in ranges],
            "ends": [{"value": end.value, "reason": end.reason} for end in branch.ends],
        }


def bifurcation_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """The bifurcations of a model, branch by branch."""
    for number, branch in enumerate(followed.branches):
        for one in branch.bifurcations:
            yield {
                "kind": one.kind,
                "period": branch.period,
                "value": one.value,
                "multiplier": [one.multiplier.real, one.multiplier.imag],
                "branch": number,
            }


def first_doubling(branches: Sequence[GaitBranch]) -> float | None:
    """The least flip at which a gait of one step ceases to be stable; None if there is none.

    branches  of one model; one that is unstable on both sides of a flip does not count
    """
    flips = [
        one.value
        for branch in branches
        if branch.period == 1
        for one in branch.bifurcations
        if one.kind == "flip" and any(math.isclose(one.value, end) for pair in branch.stable_ranges for end in pair)
    ]
    return min(flips, default=None)


def limit_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Where assumptions of a model cease to hold."""
    for branch in followed.branches:
        for crossing in branch.crossings:
            monitor = crossing.monitor
            limit = {"what": monitor.meaning, "limit": monitor.limit}
            yield {"period": branch.period, "value": crossing.value, **limit}


def sample_again(followed: Followed) -> dict[str, Any] | None:
    """What tighter tolerances change in some gaits, spread evenly over all branches; None without any.

    They are solved for again, so that what Newton's method left over counts, too.
    """
    step_map, every = followed.step_map, [(branch, point) for branch in followed.branches for point in branch.points]
    if step_map is None or not every:
        return None
    tighter, by = tightened(step_map.tolerances)
    otherwise = step_map.at(tighter)
    again = [
        (point, gait_near(otherwise, point.z, point.value, TIGHTEST, branch.period))
        for branch, point in (every[place] for place in evenly_spread(len(every), SAMPLE))
    ]
    changes = [
        (np.max(np.abs(gait.periods_s - point.periods_s)), np.max(np.abs(gait.lengths_m - point.lengths_m)))
        for point, gait in again
        if isinstance(gait, Cycle)
    ]
    counts = {"walked_again": len(again), "of": len(every), "ended_otherwise": len(again) - len(changes)}
    largest = dict(zip(OF_A_GAIT, np.max(changes, axis=0).tolist(), strict=True)) if changes else {}
    return {**counts, **largest, **({} if by == USUAL else {"by": by})}


def ending_rows(followed: Followed, parameter: Parameter, config: ContactConfig) -> Iterator[dict[str, Any]]:
    """What ends walks along the branches, and what the ground has to do with it, in words: `said`."""
    for branch in followed.branches:
        gait = f"the {followed.model} model's gait of {branch.period} {steps_word(branch.period)}"
        for end in branch.ends:
            outcome = end.reason.partition(":")[0]
            if outcome_of(outcome) is not None:
                why = causes(outcome, config, followed.model == CONTACT)
                said = " ".join([f"At {end.value:.5g} {parameter.unit} {gait} ends ({end.reason}).", *why])
                yield {"period": branch.period, "value": end.value, "outcome": outcome, "said": said}
        for crossing in branch.crossings:
            if crossing.monitor.name == "tripped":
                side = side_beyond(branch, crossing, followed.step_map)
                said = (
                    f"{side} about {crossing.value:.2g} {parameter.unit} {gait} trips over pads of its own step "
                    f"length: the pads end walks there, not the gait. Try {without_pads(config)}."
                )
                yield {"period": branch.period, "value": crossing.value, "outcome": "off-pad", "said": said}


def side_beyond(branch: GaitBranch, crossing: Crossing, step_map: StepMap | None) -> str:
    """On which side of a crossing what is watched is beyond its limit, as its neighbour there has it."""
    assert step_map is not None, "a branch is followed with one"
    place, limit = list(step_map.monitors).index(crossing.monitor), crossing.monitor.limit
    nearest = min(branch.points, key=lambda point: abs(point.value - crossing.value))
    beyond = limit is not None and nearest.monitors[place] > limit
    return "Above" if beyond == (nearest.value > crossing.value) else "Below"


def cascade_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Chains of branches, each born in a flip of the one before, with the ratios of their flips' distances."""
    for first in followed.branches:
        if any(is_born_in(first, flip, other) for other in followed.branches for flip in other.bifurcations):
            continue
        flips = chain(first, followed.branches)
        if len(flips) > 1:
            ratios = feigenbaum_ratios(flips)
            ends = {"accumulates_at": flips[-1] + (flips[-1] - flips[-2]) / (ratios[-1] - 1.0)} if ratios else {}
            yield {"period": first.period, "flips": flips, "ratios": ratios, **ends}


def chain(branch: GaitBranch, branches: Sequence[GaitBranch]) -> list[float]:
    """Flips of a branch, of the branch born there, and so on, wherever a branch is stable before it."""
    flips = [one for one in branch.bifurcations if one.kind == "flip"]
    for flip in flips:
        for child in branches:
            if is_born_in(child, flip, branch):
                return [flip.value, *chain(child, branches)]
    return [flip.value for flip in flips[:1]]


def is_born_in(child: GaitBranch, flip: Bifurcation, parent: GaitBranch) -> bool:
    """Whether a branch begins at a flip of another one, at either of its ends."""
    if flip.kind != "flip" or child.period != 2 * parent.period:
        return False
    return child.ends[0].value == flip.value or ends_at(child, flip, child.period)


def attractor_summary(followed: Followed) -> dict[str, Any]:
    """Over which values the attractor was followed, and what became of it.

    Just beyond a flip walks leave the gait slowly: what has not repeated itself by then counts as aperiodic only where
    neighbours may part, and neither a gait that was followed is stable nor a cascade still doubles.
    """
    attractors, exponents = followed.attractors, followed.exponents
    periodic = [pair for branch in followed.branches for pair in branch.stable_ranges]
    periodic += [(row["flips"][0], row["accumulates_at"]) for row in cascade_rows(followed) if "accumulates_at" in row]
    aperiodic = [
        one.value
        for one in attractors.found
        if one.period == 0
        and may_part(exponents, one.value)
        and not any(min(pair) <= one.value <= max(pair) for pair in periodic)
    ]
    return {
        "from": attractors.found[0].value,
        "to": attractors.found[-1].value,
        "aperiodic_from": min(aperiodic, default=None),
        "lost_at": attractors.lost_at,
        "ended": attractors.reason,
        "periods": sorted({one.period for one in attractors.found}),
    }


def curve_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Curves of bifurcations over the plane: where they begin and end, and why."""
    for curve in followed.curves:
        begins, *_, ends = zip(curve.first.tolist(), curve.second.tolist(), strict=True)
        yield {
            "kind": curve.kind,
            "period": curve.period,
            "points": int(curve.first.size),
            "begins": list(begins),
            "ends": list(ends),
            "reasons": [end.reason for end in curve.ends],
        }


def region_rows(followed: Followed) -> Iterator[dict[str, Any]]:
    """Which share of the plane each kind of attractor has."""
    if followed.regions is not None:
        periods, counts = np.unique(followed.regions.period, return_counts=True)
        for period, cells in zip(periods.tolist(), counts.tolist(), strict=True):
            yield {"period": period, "share": cells / followed.regions.period.size}


def groups(found: Sequence[Followed], said: Mapping[str, Any], asked: FamilyQuestion) -> dict[str, Group]:
    """One group a branch and a curve, and one for bifurcations, exponents and attractor of each model.

    said  the summary, of which branches and curves are stored as tables too
    """
    parameter, second = asked.parameter, asked.second
    value = {"value": Label(parameter.unit, parameter.key)}
    stored: dict[str, Group] = {}
    if said["branches"]:
        ends = {"from": Label(parameter.unit, "where it begins"), "to": Label(parameter.unit, "where it ends")}
        overview = columns(said["branches"], {"model": MODEL, "period": PERIOD, **ends}, "branch")
        stored["branches"] = Group(overview, {"over": parameter.key})
    if said["curves"]:
        stored["curves"] = Group(columns(said["curves"], CURVES, "curve"))
    for one in found:
        if one.step_map is None:
            continue
        own: dict[str, Group] = {}
        if second is not None:
            labels = Label(parameter.unit, parameter.key), Label(second.parameter.unit, second.parameter.key)
            own |= {f"curve_{number}": curve_group(curve, *labels) for number, curve in enumerate(one.curves)}
            if one.regions is not None:
                own["regions"] = regions_group(one.regions, *labels)
        for number, branch in enumerate(one.branches):
            marks = [*birth_of(branch, one.branches), *marks_on(branch)]
            own[f"branch_{number}"] = branch_group(branch, marks, one.step_map.monitors, value)
        rows = list(bifurcation_rows(one))
        if rows:
            multipliers = [complex(*row["multiplier"]) for row in rows]
            both = real_and_imaginary("multiplier", multipliers, ("bifurcation",), "critical multiplier")
            own["bifurcations"] = Group({**columns(rows, value | BIFURCATIONS, "bifurcation"), **both})
        if one.exponents:
            own["lyapunov"] = Group(columns(one.exponents, value | EXPONENTS, "sample"))
        if one.attractors.found:
            own["attractor"] = Group(columns(one.attractors.found, value | ATTRACTORS, "sample"))
        if one.model == RIGID:
            own |= motions(one.branches, asked.config, parameter)
        stored |= {f"{one.model}/{name}": group for name, group in own.items()}
    return stored


def curve_group(curve: BifurcationCurve, first: Label, second: Label) -> Group:
    """A curve over the plane of both parameters."""
    over = {"value": labelled(curve.first, first, "point"), "second": labelled(curve.second, second, "point")}
    return Group(over, {"kind": curve.kind, "period": curve.period})


def regions_group(regions: Regions, first: Label, second: Label) -> Group:
    """What walks settle on over the plane of both parameters."""
    periods = "steps after which walks repeat themselves; 0: never, -1: none goes on"
    axes = {"value": labelled(regions.first, first, "first"), "second": labelled(regions.second, second, "second")}
    return Group({**axes, "period": Variable(regions.period, ("first", "second"), "1", periods)})


class Mark(NamedTuple):
    """A bifurcation among the points of a branch: after which point, and the steps of the gait there."""

    after: int
    kind: str
    value: float
    periods: Floats  # durations of the steps there (s)
    angles: Floats  # of the stance leg just after each heel strike there (rad)


def marks_on(branch: GaitBranch) -> list[Mark]:
    """The bifurcations of a branch in their order along it."""
    return [
        Mark(index, one.kind, one.value, one.gait.periods_s, one.gait.angles)
        for index, (before, after) in enumerate(pairwise(branch.points))
        for one in branch.bifurcations if one.lies_between(before, after)
    ]  # fmt: skip


def birth_of(branch: GaitBranch, branches: Sequence[GaitBranch]) -> list[Mark]:
    """The flip that a branch begins at: its parent's gait, twice."""
    for parent in branches:
        for one in parent.bifurcations:
            if one.kind == "flip" and 2 * parent.period == branch.period and one.value == branch.ends[0].value:
                return [Mark(-1, one.kind, one.value, np.tile(one.gait.periods_s, 2), np.tile(one.gait.angles, 2))]
    return []


def branch_group(
    branch: GaitBranch, marks: Sequence[Mark], monitors: Sequence[Monitor], value: Mapping[str, Label]
) -> Group:
    """The gaits of a branch in their order along it, and where on it its bifurcations are.

    value  label of the parameter's values
    """
    points = branch.points
    multipliers = [point.multipliers for point in points]
    variables = {
        **columns(points, {**value, **POINTS}, "point"),
        **real_and_imaginary("multiplier", multipliers, ("point", "multiplier"), "multiplier"),
    }
    for place, monitor in enumerate(monitors):
        label = Label(monitor.unit, monitor.meaning)
        variables[monitor.name] = labelled([point.monitors[place] for point in points], label, "point")
    if marks:
        labels = MARKS | {"value": Label(value["value"].unit, "where it is", name="mark_value")}
        variables |= columns(marks, labels, "mark")
    attrs: dict[str, Attribute] = {
        "period": branch.period,
        "begins": branch.ends[0].reason,
        "ends": branch.ends[1].reason,
    }
    return Group(variables, attrs)


def motions(branches: Sequence[GaitBranch], config: ContactConfig, parameter: Parameter) -> dict[str, Group]:
    """Some gaits of each branch of the rigid model, walking, by branch and point: branch_0/motion_7."""
    return {
        f"branch_{number}/motion_{place}": group
        for number, branch in enumerate(branches)
        if branch.period <= LONGEST
        for place in evenly_spread(len(branch.points), MOTIONS_OF_BRANCH)
        for group in motion(branch.points[place], branch.period, config, parameter)
    }


def motion(point: Cycle, period: int, config: ContactConfig, parameter: Parameter) -> Iterator[Group]:
    """A gait walking, as `simulate` stores a walk; nothing where the config refuses the value."""
    changed = parameter.config_at(config, point.value)
    if changed is None:
        return
    walker = rigid_walker(changed, changed.equations)
    unit, units = unit_walker(walker)
    section, n = on_section(unit, point.z), len(walker.arm_x)
    start = (*section[:n], *(rate / units.time for rate in section[n:]))
    steps = max(period, STRIDE)
    knee = knee_of(assembly_of(changed.walker, rigid=True))
    scene = RigidScene(walker, TOLERANCES, coordinates(changed), knee, ALL_OUTPUTS, Footholds())
    walk = scene.walk(start, steps, TOLERANCES, sampled=True)
    if walk.steps < steps or walk.samples is None:
        return
    changes = np.flatnonzero(np.diff(walk.samples.step))
    kept = np.unique(np.concatenate((np.arange(0, walk.samples.time_s.size, EVERY), changes, changes + 1)))
    seen = trajectory_group(scene, walk, only_at(walk.samples, kept))
    yield replace(seen, attrs={"value": point.value, "slope_rad": changed.slope_rad, "steps": period})
