"""Families of gaits over a key of the config: branches, bifurcations, cascades, and the chaos beyond them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Final

import numpy as np

from walkerlab.config.continuation import Continuation
from walkerlab.config.reads import ContinuationConfig
from walkerlab.config.walkers import without_contact
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.mechanics.standing import Standing
from walkerlab.orbits.attractors import (
    Attractor,
    close_returns,
    largest_exponent,
    left_by_flip,
    settled_elsewhere,
    swept,
)
from walkerlab.orbits.continuation import StepControl
from walkerlab.orbits.families import BranchFollower, GaitBranch, Limits, Seed, ValueSpan
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.orbits.newton import Floats
from walkerlab.orbits.plane import CONTROL as CURVE_CONTROL
from walkerlab.orbits.plane import curve_through, regions_of
from walkerlab.orbits.similarity import unit_walker
from walkerlab.orbits.step_map import StepMap
from walkerlab.scene.families import contact_map, rigid_map, rigid_walkers, walkers_on_ground
from walkerlab.scene.parameter import Parameter, parameter_of
from walkerlab.scene.rigid import rigid_walker
from walkerlab.stages.continuation_results import Followed, groups, motions, summary
from walkerlab.stages.progress import Progress
from walkerlab.store.content import Content

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


def run(config: ContinuationConfig, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Follow the families that the config asks for.

    Raises ConfigError for a key that is no number of the model, NoAnswer for a span without a gait.
    """
    block = config.continuation
    parameter = parameter_of(block.over, config)
    asked = FamilyQuestion(config, parameter, ValueSpan(block.least, block.most), block.periods, block.points)
    found = []
    for model in models_of(block, config, asked):
        followed = FOLLOW[model](asked, progress)
        found.append(over_plane(followed, asked, progress))
    said = summary(found, parameter, block, config) | {"left_out": left_out(found, asked)}
    moving = {
        f"{RIGID}/{path}": group
        for one in found
        if one.model == RIGID
        for path, group in motions(one.branches, config, parameter).items()
    }
    content = Content({**groups(found, parameter, block), **moving}, said)
    if not any(followed.branches for followed in found):
        raise NoAnswer(
            f"no gait was found with {parameter.key} from {block.least:g} to {block.most:g} {parameter.unit}: "
            f"none at any of {len(asked.looked_at())} values looked at",
            "Choose another span (--from, --to), or change what else the config fixes.",
            content,
        )
    return content


def left_out(found: Sequence[Followed], asked: FamilyQuestion) -> list[dict[str, str]]:
    """What was not followed, and why."""
    followed = {one.model: one for one in found}
    entries = []
    for model in wanted_models(asked.config.continuation):
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
        if asked.config.continuation.second is not None
        and one.branches
        and not touches(second_question(asked), one.model)
    ]
    return [{"what": what, "why": why, "saves": ""} for what, why in entries]


def wanted_models(block: Continuation) -> tuple[str, ...]:
    """The models that are asked for."""
    return (RIGID, CONTACT) if block.model == "both" else (block.model,)


def models_of(block: Continuation, config: ContinuationConfig, asked: FamilyQuestion) -> tuple[str, ...]:
    """The models that are followed; ConfigError for one that the key does not touch or that the config has not."""
    if block.model != RIGID and config.contact is None:
        raise without_contact("the contact model", config.walker, "Use --model rigid.")
    wanted = wanted_models(block)
    refuse_values(asked)
    refuse_second(asked)
    touched = tuple(model for model in wanted if touches(asked, model))
    if not touched:
        raise ConfigError(
            f"continuation.over: {asked.parameter.key} does not touch the {' or the '.join(wanted)} model",
            "Choose a key that the model is made of, or another model (--model).",
        )
    return touched


def refuse_values(asked: FamilyQuestion) -> None:
    """Raise ConfigError if the schema refuses an end of the span."""
    for name, value in (("from", asked.span.least), ("to", asked.span.most)):
        if asked.parameter.config_at(asked.config, value) is None:
            raise ConfigError(
                f"continuation.{name}: {asked.parameter.key} cannot be {value:g} {asked.parameter.unit}",
                f"`walkerlab schema {asked.parameter.key}` says what the key allows.",
            )


def refuse_second(asked: FamilyQuestion) -> None:
    """Raise ConfigError if the second key is no number or no other one, if it changes nothing, or starts elsewhere."""
    block = asked.config.continuation.second
    if block is None:
        return
    second = second_question(asked)
    key, own = second.parameter.key, second.parameter.value_in(asked.config)
    if second.parameter.path == asked.parameter.path:
        raise ConfigError(
            f"continuation.second: {key} is already the number that gaits are followed over", "Choose another key."
        )
    if own not in second.span:
        raise ConfigError(
            f"continuation.second: {key} is {own:g} in the config, outside {block.least:g} to {block.most:g}",
            "Curves begin at the config's own value; choose a range around it.",
        )
    wanted = wanted_models(asked.config.continuation)
    if not any(touches(second, model) for model in wanted):
        raise ConfigError(
            f"continuation.second: {key} does not touch the {' or the '.join(wanted)} model",
            "Choose a key that the model is made of, or another model (--model).",
        )


def second_question(asked: FamilyQuestion) -> FamilyQuestion:
    """The same over the second key."""
    block = asked.config.continuation.second
    assert block is not None, "a second key is asked for"
    parameter = parameter_of(block.over, asked.config)
    return replace(asked, parameter=parameter, span=ValueSpan(block.least, block.most))


def touches(asked: FamilyQuestion, model: str) -> bool:
    """Whether a model changes over the span."""
    walker_at: Callable[[float], object] = (
        rigid_walkers(asked.config, asked.parameter)
        if model == RIGID
        else walkers_on_ground(asked.config, asked.parameter, 1.0)
    )
    return walker_at(asked.span.least) != walker_at(asked.span.most)


def over_plane(followed: Followed, asked: FamilyQuestion, progress: Progress) -> Followed:
    """What was found of a model, with curves and regions of the plane if a second key is asked for that touches it."""
    map_of = followed.map_of
    if map_of is None or asked.config.continuation.second is None:
        return followed
    second = second_question(asked)
    if not touches(second, followed.model):
        return followed

    @lru_cache(CONFIGS)
    def map_at(value: float) -> StepMap | None:
        changed = second.parameter.config_at(asked.config, value)
        return None if changed is None else map_of(changed)

    own = second.parameter.value_in(asked.config)
    progress.start(f"continuation: curves of bifurcations of the {followed.model} model")
    curves = [
        curve_through(
            one, branch.period, map_at, (asked.span, second.span), own, CURVE_POINTS, progress.advance,
            CONTROLS[followed.model],
        )
        for branch in followed.branches if branch.period <= LONGEST_OF_CURVES[followed.model]
        for one in branch.bifurcations if one.kind != "torus"
    ]  # fmt: skip
    regions = None
    if followed.model == RIGID:
        progress.start("continuation: regions of the plane of two parameters")
        regions = regions_of(followed.branches, map_at, (asked.span, second.span), own, progress.advance)
    return replace(followed, curves=tuple(curve for curve in curves if curve is not None), regions=regions)


def follow_rigid(asked: FamilyQuestion, progress: Progress) -> Followed:
    """All of the rigid model: branches, cascades, attractor, exponents, and gaits of other numbers of steps."""
    followed, follower = rigid_branches(asked, progress)
    return with_others(beyond_flips(followed, follower, asked, RIGID_SAMPLES, progress), asked, follower, progress)


def rigid_branches(asked: FamilyQuestion, progress: Progress) -> tuple[Followed, BranchFollower]:
    """Every branch of the rigid model's gaits of one step, and the cascades beyond their flips."""
    config, parameter, span = asked.config, asked.parameter, asked.span
    walker_at = rigid_walkers(config, parameter)
    map_of = partial(rigid_map, parameter=parameter, scale=span.size)
    step_map = map_of(config)
    progress.start("continuation: branches of the rigid model")
    follower = BranchFollower(step_map, span, limits=Limits(points=asked.points), advance=progress.advance)
    seeds = [seed for value in asked.looked_at() for seed in gaits_at(walker_at(value), value, config.seed)]
    branches = follower.family(seeds, asked.periods)
    return Followed(RIGID, step_map, branches, map_of), follower


def gaits_at(walker: Standing | None, value: float, seed: int) -> list[Seed]:
    """The rigid gaits of one step at a value of the parameter, as the section has them."""
    if walker is None:
        return []
    _, units = unit_walker(walker)
    in_units = [1.0] + [units.time] * (len(walker.picked) - 1)
    sections = (np.array([gait.state[i] for i in walker.picked]) for gait in find_gaits(walker, seed).gaits)
    return [Seed(section * in_units, value) for section in sections]


def follow_contact(asked: FamilyQuestion, progress: Progress) -> Followed:
    """All of the contact model: its branch, its cascade, its attractor and exponents."""
    asked = replace(asked, periods=min(asked.periods, CONTACT_PERIODS))
    followed, follower = contact_branches(asked, progress)
    return followed if follower is None else beyond_flips(followed, follower, asked, CONTACT_SAMPLES, progress)


def contact_branches(asked: FamilyQuestion, progress: Progress) -> tuple[Followed, BranchFollower | None]:
    """The branch of the contact model's gait, and the cascade beyond its flips."""
    from walkerlab.scene.contact import contact_gait

    progress.start("continuation: a gait of the contact model")
    for value in asked.looked_at():
        changed = asked.parameter.config_at(asked.config, value)
        rigid = None if changed is None else find_gaits(rigid_walker(changed, changed.equations), changed.seed).gait
        if changed is None or changed.contact is None or rigid is None:
            continue
        contact = changed.contact
        if contact.terrain == "checkerboard":
            contact = contact.model_copy(update={"terrain": "after-mid-swing"})
        found = contact_gait(changed.model_copy(update={"contact": contact}), rigid.step_length, rigid.state)
        if found.gait is None:
            progress.note(f"contact model at {value:g} {asked.parameter.unit}: {found.reason}")
            continue
        map_of = partial(
            contact_map, parameter=asked.parameter, scale=asked.span.size, step_length_m=found.gait.step.length_m
        )
        step_map = map_of(asked.config)
        progress.start("continuation: branches of the contact model")
        control = StepControl(tolerance=CONTACT_RESIDUAL, shortest=CONTACT_SHORTEST)
        follower = BranchFollower(step_map, asked.span, control, Limits(points=asked.points), progress.advance)
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


FOLLOW: Final[Mapping[str, Callable[[FamilyQuestion, Progress], Followed]]] = {
    RIGID: follow_rigid,
    CONTACT: follow_contact,
}
