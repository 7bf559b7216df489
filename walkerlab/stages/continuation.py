"""Families of gaits over a key of the config: branches, bifurcations, cascades, and the chaos beyond them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from walkerlab.config.continuation import Continuation
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.mechanics.rigid_compass import RigidWalker
from walkerlab.orbits.attractors import Attractors, Lyapunov, largest_exponent, swept
from walkerlab.orbits.families import Branch, Follower, Limits, Seed, Span
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.orbits.similarity import unit_walker
from walkerlab.orbits.step_maps import CompassMap, StepMap
from walkerlab.scene.parameter import Parameter, parameter_of
from walkerlab.scene.rigid import rigid_walker
from walkerlab.stages.continuation_results import groups, summary
from walkerlab.stages.progress import Progress
from walkerlab.store.content import Content

RIGID, CONTACT = "rigid", "contact"
LOOKED_AT = 5  # values of the span at which gaits are sought, its ends among them
SWEPT = 240  # values of the parameter at which the attractor is sampled
TRANSIENT, KEPT = 500, 96  # steps walked before, and of the attractor
EXPONENTS = 16  # values at which the Lyapunov exponent is measured
AVERAGED = 1500  # steps
ABOVE_FLIP = 0.02  # of the span: how far before the first flip the sweep begins


@dataclass(frozen=True, eq=False)
class Followed:
    """What was found of one model."""

    model: str
    step_map: StepMap
    branches: tuple[Branch, ...]
    attractors: Attractors
    exponents: tuple[Lyapunov, ...]


def run(config: Config, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Follow the families that the config asks for.

    Raises ConfigError for a key that is no number of the model, NoAnswer for a span without a gait.
    """
    asked = config.continuation
    parameter = parameter_of(asked.over, config)
    span = Span(asked.least, asked.most)
    families = {RIGID: follow_rigid}
    found = [families[model](config, parameter, span, asked, progress) for model in models_of(asked)]
    content = Content(groups(found, parameter), summary(found, parameter, asked))
    if not any(followed.branches for followed in found):
        raise NoAnswer(
            f"no gait with {parameter.key} from {asked.least:g} to {asked.most:g}",
            "Choose another span (--from, --to), or change what else the config fixes.",
            content,
        )
    return content


def models_of(asked: Continuation) -> tuple[str, ...]:
    """The models that are followed."""
    return (RIGID, CONTACT) if asked.model == "both" else (asked.model,)


def walkers_over(config: Config, parameter: Parameter) -> Callable[[float], RigidWalker | None]:
    """The rigid walker at a value of the parameter; None where the config refuses the value."""

    def walker_at(value: float) -> RigidWalker | None:
        changed = parameter.config_at(config, value)
        return None if changed is None else rigid_walker(changed, changed.equations)

    return walker_at


def refuse_untouched(parameter: Parameter, model: str, ends: tuple[object, object]) -> None:
    """Raise ConfigError if a model is the same at both ends of the span, or refuses them."""
    if ends[0] == ends[1] and ends[0] is not None:
        raise ConfigError(
            f"continuation.over: {parameter.key} does not touch the {model} model",
            "Choose a key that the model is made of, or another model (--model).",
        )
    if None in ends:
        which = "from" if ends[0] is None else "to"
        raise ConfigError(
            f"continuation.{which}: no walker has {parameter.key} there",
            f"`walkerlab schema {parameter.key}` says what the key allows.",
        )


def follow_rigid(config: Config, parameter: Parameter, span: Span, asked: Continuation, progress: Progress) -> Followed:
    """Every branch of the rigid model, its cascades, attractor and exponents."""
    walker_at = walkers_over(config, parameter)
    refuse_untouched(parameter, RIGID, (walker_at(span.least), walker_at(span.most)))
    step_map = CompassMap(walker_at, span.size)
    progress.start("continuation: branches of the rigid model")
    follower = Follower(step_map, span, limits=Limits(points=asked.points), advance=progress.advance)
    seeds = [seed for value in looked_at(config, parameter, span) for seed in gaits_at(walker_at, value, config.seed)]
    branches = follower.family(seeds, asked.periods)
    return with_attractor(Followed(RIGID, step_map, branches, Attractors((), None, ""), ()), span, progress)


def looked_at(config: Config, parameter: Parameter, span: Span) -> list[float]:
    """Values of the span at which gaits are sought: the config's own first."""
    own = parameter.value_in(config)
    return [*([own] if own in span else []), *(float(one) for one in np.linspace(span.least, span.most, LOOKED_AT))]


def gaits_at(walker_at: Callable[[float], RigidWalker | None], value: float, seed: int) -> list[Seed]:
    """The rigid gaits of one step at a value, as the section has them."""
    walker = walker_at(value)
    if walker is None:
        return []
    _, units = unit_walker(walker)
    return [
        Seed(np.array([gait.state[1], gait.state[2] * units.time, gait.state[3] * units.time]), value)
        for gait in find_gaits(walker, seed).gaits
    ]


def with_attractor(followed: Followed, span: Span, progress: Progress) -> Followed:
    """The attractor beyond the first flip of a stable branch, and the exponents along it."""
    flips = [
        (one.value, branch) for branch in followed.branches if branch.period == 1
        for one in branch.bifurcations if one.kind == "flip"
    ]  # fmt: skip
    if not flips:
        return followed
    flip, branch = min(flips, key=lambda one: one[0])
    begin = max(span.least, flip - ABOVE_FLIP * span.size)
    stable = [point for point in branch.points if point.stable]
    if not stable:
        return followed
    nearest = min(stable, key=lambda point: abs(point.value - begin))
    values = np.linspace(begin, span.most, SWEPT)
    progress.start(f"continuation: attractor of the {followed.model} model", SWEPT)
    attractors = swept(followed.step_map, nearest.z, values, TRANSIENT, KEPT, partial(progress.advance, 1))
    chosen = attractors.found[:: max(1, len(attractors.found) // EXPONENTS)]
    progress.start(f"continuation: Lyapunov exponents of the {followed.model} model", len(chosen))
    exponents = []
    for attractor in chosen:
        exponents.append(largest_exponent(followed.step_map, attractor.last, attractor.value, KEPT, AVERAGED))
        progress.advance()
    found = tuple(one for one in exponents if one is not None)
    return Followed(followed.model, followed.step_map, followed.branches, attractors, found)


def plain_bifurcations(branch: Branch) -> list[dict[str, Any]]:
    """The bifurcations of a branch as JSON has them."""
    return [
        {"kind": one.kind, "period": branch.period, "value": one.value,
         "multiplier": [one.multiplier.real, one.multiplier.imag]}
        for one in branch.bifurcations
    ]  # fmt: skip
