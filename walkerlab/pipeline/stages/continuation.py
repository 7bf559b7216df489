"""Follow families of gaits as a parameter varies: branches, bifurcations, cascades and chaos."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from walkerlab.config import analyses, walkers
from walkerlab.config.reads import ContactConfig, ContinuationConfig
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.outcome import outcome_of
from walkerlab.physics.orbits import bifurcations, fixed_point, newton, two_parameters
from walkerlab.physics.orbits.attractors import feigenbaum_ratios, may_diverge
from walkerlab.physics.orbits.families import Crossing, GaitBranch, Seed, ValueSpan, steps_word
from walkerlab.physics.orbits.family_search import CONTACT, RIGID, THOROUGHNESS, Family, FamilySearch
from walkerlab.physics.orbits.step_map import Cycle, StepMap, gait_near
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.family_groups import groups
from walkerlab.pipeline.stages.walk import DEFAULT_TIGHTENING, SAMPLE, evenly_spread, tightened
from walkerlab.pipeline.store.content import Content
from walkerlab.scene.parameter import Parameter, parameter_of
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.subject import contact_map, model_differs, rigid_map, steps_of_stride, unused_key_error
from walkerlab.scene.walk_outcomes import ground_causes, ground_without_pads

Begun = tuple[list[Seed], Callable[[ContactConfig], StepMap]]
"""Seeds of a search, and a function that builds the step map of a config over the parameter."""
MIN_REACH = 1e-9  # a branch that covers less than this fraction of the span counts as a single gait
START_VALUES = 5  # number of values in the span, ends included, at which the search looks for gaits
TIGHT_EFFORT = newton.Effort(1e-13)  # tolerance for gaits that are recomputed to measure the numerical error
GAIT_QUANTITIES = ("step_period_s", "step_length_m")  # quantities of a gait whose numerical error is measured


@dataclass(frozen=True)
class FamilyQuestion:
    """Parameter and span over which gaits are followed."""

    config: ContinuationConfig
    parameter: Parameter
    span: ValueSpan

    def start_values(self) -> list[float]:
        """Return the values at which the search looks for gaits. The config's value comes first if it is in the
        span."""
        current = self.parameter.value_in(self.config)
        spread = np.linspace(self.span.least, self.span.most, START_VALUES)
        # A gait is most likely at the value in the config.
        return [*([current] if current in self.span else []), *(float(value) for value in spread)]

    @property
    def stride(self) -> int:
        parameters = (self.parameter, *(() if self.second is None else (self.second.parameter,)))
        return max(steps_of_stride(self.config, each) for each in parameters)

    @property
    def models(self) -> tuple[str, ...]:
        model = self.config.continuation.model
        return (RIGID, CONTACT) if model == "both" else (model,)

    @property
    def second(self) -> "FamilyQuestion | None":
        """Second parameter and its span, or None if the config has no second key."""
        block = self.config.continuation.second
        return None if block is None else question_over(block, self.config, "continuation", "second")

    def refuse_ends(self, *block: str) -> None:
        """Raise ConfigError for an end of the span that the config rejects."""
        for name, value in (("from", self.span.least), ("to", self.span.most)):
            if self.parameter.config_at(self.config, value) is None:
                raise self.parameter.refusal(self.config, value, (*block, name))

    def touches(self, model: str) -> bool:
        """Whether the parameter affects a model over the span."""
        return model_differs(model, self.config, self.parameter, (self.span.least, self.span.most))

    def touched(self, key: str) -> tuple[str, ...]:
        """Return the requested models that the parameter affects.

        Raises ConfigError if it affects none of them.
        """
        touched = tuple(model for model in self.models if self.touches(model))
        if not touched:
            raise unused_key_error(f"continuation.{key}", self.parameter.key, self.models)
        return touched


def question_over(block: analyses.Span, config: ContinuationConfig, *path: str) -> FamilyQuestion:
    parameter = parameter_of(block.over, config, (*path, "over"))
    return FamilyQuestion(config, parameter, ValueSpan(block.least, block.to))


def run(config: ContinuationConfig, _inputs: Mapping[str, Content], progress: Progress, again: bool = True) -> Content:
    """Follow the requested families of gaits.

    again  whether to solve for some gaits a second time to measure the numerical error

    Raises ConfigError for a key that affects no requested model, NoAnswer if no gait is found in the span.
    """
    block = config.continuation
    families = []
    isolated = []
    question = question_over(block, config, "continuation")
    parameter = question.parameter
    for model in models_of(question):
        search = search_of(model, question, progress)
        family = Family(model, None) if search is None else search.family(np.random.default_rng(config.seed))
        # A branch that can be followed in neither direction consists of a single point.
        short = MIN_REACH * question.span.size
        isolated += [isolated_gait(branch, model, parameter) for branch in family.branches if branch.reach <= short]
        families.append(replace(family, branches=tuple(branch for branch in family.branches if branch.reach > short)))
    answer = summary(families, question, again)
    second = question.second
    answer["left_out"] += isolated
    content = Content(groups(families, answer, config, parameter, None if second is None else second.parameter), answer)
    if not any(family.branches for family in families):
        raise NoAnswer(
            f"no gait was found with {parameter.key} from {block.least:g} to {block.to:g} {parameter.unit}: "
            f"no gait at any of {len(question.start_values())} trial values",
            "Choose another span (--from, --to), or change other parameters.",
            content,
        )
    return content


def refuse(config: ContinuationConfig) -> None:
    """Raise ConfigError for an invalid `continuation` block."""
    models_of(question_over(config.continuation, config, "continuation"))


def models_of(question: FamilyQuestion) -> tuple[str, ...]:
    """Return the models whose gaits are to be followed.

    Raises ConfigError if the contact model is requested but not configured, a key affects no requested model, an end
    of a span is invalid, the second key equals the first, or the second key's range excludes its value in the config.
    """
    config = question.config
    second = question.second
    if question.models != (RIGID,) and config.contact is None:
        raise walkers.contact_required_error("the contact model", config.walker, "Use --model rigid.")
    question.refuse_ends("continuation")
    if second is not None:
        second.refuse_ends("continuation", "second")
        current = second.parameter.value_in(config)
        span = second.span
        name = second.parameter.key
        if second.parameter.path == question.parameter.path:
            raise ConfigError(
                f"continuation.second: {name} is already the parameter that gaits are followed over",
                "Choose another key.",
            )
        if current not in span:
            raise ConfigError(
                f"continuation.second: {name} is {current:g} in the config, outside {span.least:g} to {span.most:g}",
                "Curves begin at the config's own value; choose a range around it.",
            )
        second.touched("second")
    return question.touched("over")


def search_of(model: str, question: FamilyQuestion, progress: Progress) -> FamilySearch | None:
    """Set up the search for a model's families, over both parameters if there are two. Return None if no gait is
    found."""
    seeding = SEEDS[model](question, progress)
    second = question.second
    block = question.config.continuation
    if seeding is None:
        return None
    seeds, map_of = seeding
    plane = None
    if second is not None and second.touches(model):
        parameter = second.parameter
        config = question.config
        plane = two_parameters.Plane(parameter.vary(config, map_of), second.span, parameter.value_in(config))
    periods = min(block.periods, THOROUGHNESS[model].periods)
    step_map = map_of(question.config)
    step_map.stride = question.stride
    return FamilySearch(model, step_map, question.span, seeds, periods, block.points, progress, plane)


def rigid_seeds(question: FamilyQuestion, progress: Progress) -> Begun:
    """Find all one-step gaits of the rigid model at each start value."""
    walker_at = question.parameter.vary(question.config, rigid_walker)
    seeds = list[Seed]()
    progress.start("continuation: gaits of the rigid model")
    for value in question.start_values():
        walker = walker_at(value)
        if walker is not None:
            gaits = fixed_point.find_gaits(walker, question.config.seed).gaits
            seeds += [Seed(np.array(gait.z), value, question.stride) for gait in gaits]
    return seeds, partial(rigid_map, parameter=question.parameter, scale=question.span.size)


def contact_seeds(question: FamilyQuestion, progress: Progress) -> Begun | None:
    """Find a gait of the contact model at the first start value that has one, or return None if none has."""
    from walkerlab.scene.contact import gait_off_pads

    progress.start("continuation: a gait of the contact model")
    for value in question.start_values():
        changed = question.parameter.config_at(question.config, value)
        if changed is None or changed.contact is None:
            continue
        rigid = fixed_point.find_gaits(rigid_walker(changed), changed.seed).gait
        if rigid is None:
            continue
        answer = gait_off_pads(changed, rigid.step_length, rigid.state)
        if answer.gait is None:
            progress.note(f"contact model at {value:g} {question.parameter.unit}: {answer.reason}")
            continue
        length_m = float(answer.gait.lengths_m.mean())
        map_of = partial(contact_map, parameter=question.parameter, scale=question.span.size, step_length_m=length_m)
        return [Seed(map_of(question.config).scale_section(answer.gait.z), value, question.stride)], map_of
    return None


SEEDS: Final[Mapping[str, Callable[[FamilyQuestion, Progress], Begun | None]]] = {
    RIGID: rigid_seeds,
    CONTACT: contact_seeds,
}


def summary(families: Sequence[Family], question: FamilyQuestion, again: bool) -> dict[str, Any]:
    """Summarise the families. Parameter values are in the key's unit, and `again` is as in `run`."""

    def rows(of_model: Callable[[Family], Iterable[Mapping[str, Any]]]) -> list[dict[str, Any]]:
        return [{"model": family.model, **row} for family in families for row in of_model(family)]

    def values_by_model(of_model: Callable[[Family], Any]) -> dict[str, Any]:
        return {family.model: value for family in families if (value := of_model(family)) is not None}

    return {
        "over": question.parameter.key,
        "unit": question.parameter.unit,
        "from": question.config.continuation.least,
        "to": question.config.continuation.to,
        "branches": rows(branch_rows),
        "bifurcations": rows(bifurcation_rows),
        "first_doubling": values_by_model(lambda family: first_doubling(family.branches)),
        "lyapunov": rows(lambda family: map(asdict, family.exponents)),
        "cascades": rows(cascade_rows),
        "limits": rows(limit_rows),
        "numerical_error": values_by_model(sample_again) if again else {},
        "endings": rows(partial(ending_rows, parameter=question.parameter, config=question.config)),
        "attractors": rows(lambda family: [attractor_summary(family)] if family.attractors.found else []),
        "curves": rows(curve_rows),
        "regions": rows(region_rows),
        "left_out": omitted_families(families, question),
    }


def branch_rows(family: Family) -> Iterator[dict[str, Any]]:
    """Yield a row for each branch of a model: its values, the ranges in which it is stable, and its ends."""
    for branch in family.branches:
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


def bifurcation_rows(family: Family) -> Iterator[dict[str, Any]]:
    """Yield a row for each bifurcation of a model, branch by branch."""
    for number, branch in enumerate(family.branches):
        for bifurcation in branch.bifurcations:
            yield {
                "kind": bifurcation.kind,
                "period": branch.period,
                "value": bifurcation.value,
                "multiplier": [bifurcation.multiplier.real, bifurcation.multiplier.imag],
                "branch": number,
            }


def first_doubling(branches: Sequence[GaitBranch]) -> float | None:
    """Return the lowest flip at which a one-step gait loses stability, or None if there is no such flip."""
    flips = [
        flip.value
        for branch in branches
        if branch.period == 1
        for flip in branch.bifurcations
        if flip.kind == "flip" and any(math.isclose(flip.value, end) for pair in branch.stable_ranges for end in pair)
    ]
    return min(flips, default=None)


def limit_rows(family: Family) -> Iterator[dict[str, Any]]:
    """Yield a row for each point where one of a model's assumptions ceases to hold."""
    for branch in family.branches:
        for crossing in branch.crossings:
            what, limit = crossing.monitor.meaning, crossing.monitor.limit
            yield {"period": branch.period, "value": crossing.value, "what": what, "limit": limit}


def sample_again(family: Family) -> dict[str, Any] | None:
    """Solve again for some gaits at tighter tolerances. Return the largest changes, or None if there is no gait."""
    # A second simulation of the same gait would not show the error of Newton's method.
    step_map = family.step_map
    every = [(branch, point) for branch in family.branches for point in branch.points]
    if step_map is None or not every:
        return None
    tighter, by = tightened(step_map.tolerances)
    otherwise = step_map.replace_tolerances(tighter)
    repeated = [
        (point, gait_near(otherwise, point.z, point.value, TIGHT_EFFORT, branch.period))
        for branch, point in (every[place] for place in evenly_spread(len(every), SAMPLE))
    ]
    changes = [
        (np.max(np.abs(gait.periods_s - point.periods_s)), np.max(np.abs(gait.lengths_m - point.lengths_m)))
        for point, gait in repeated
        if isinstance(gait, Cycle)
    ]
    counts = {"walked_again": len(repeated), "of": len(every), "ended_otherwise": len(repeated) - len(changes)}
    largest = dict(zip(GAIT_QUANTITIES, np.max(changes, axis=0).tolist(), strict=True)) if changes else {}
    return {**counts, **largest, **({} if by == DEFAULT_TIGHTENING else {"by": by})}


def ending_rows(family: Family, parameter: Parameter, config: ContactConfig) -> Iterator[dict[str, Any]]:
    """Describe where branches end because of the ground, and the crossings beyond which gaits trip over pads."""
    for branch in family.branches:
        gait = f"the {family.model} model's gait of {branch.period} {steps_word(branch.period)}"
        for end in branch.ends:
            outcome = end.reason.partition(":")[0]
            if outcome_of(outcome) is not None:
                reason = ground_causes(outcome, config, family.model == CONTACT)
                text = " ".join([f"At {end.value:.5g} {parameter.unit} {gait} ends ({end.reason}).", *reason])
                yield {"period": branch.period, "value": end.value, "outcome": outcome, "said": text}
        for crossing in branch.crossings:
            if crossing.monitor.name == "tripped":
                side = side_beyond(branch, crossing, family.step_map)
                text = (
                    f"{side} about {crossing.value:.2g} {parameter.unit} {gait} trips over pads of its own step "
                    f"length: the pads end walks there, not the gait. Try {ground_without_pads(config)}."
                )
                yield {"period": branch.period, "value": crossing.value, "outcome": "off-pad", "said": text}


def side_beyond(branch: GaitBranch, crossing: Crossing, step_map: StepMap | None) -> str:
    """Return the side of a crossing ('above' or 'below') on which the monitored quantity exceeds its limit."""
    assert step_map is not None, "a followed branch has a step map"
    index = list(step_map.monitors).index(crossing.monitor)
    limit = crossing.monitor.limit
    nearest = min(branch.points, key=lambda point: abs(point.value - crossing.value))
    beyond = limit is not None and nearest.monitors[index] > limit
    return "Above" if beyond == (nearest.value > crossing.value) else "Below"


def cascade_rows(family: Family) -> Iterator[dict[str, Any]]:
    """Yield a row for each period-doubling cascade, with the ratios of successive distances between its flips."""
    for first in family.branches:
        if any(is_born_in(first, flip, parent) for parent in family.branches for flip in parent.bifurcations):
            continue
        flips = chain(first, family.branches)
        if len(flips) > 1:
            ratios = feigenbaum_ratios(flips)
            # From here on, distances between flips are assumed to shrink by the last ratio, as a geometric series.
            ends = {"accumulates_at": flips[-1] + (flips[-1] - flips[-2]) / (ratios[-1] - 1.0)} if ratios else {}
            yield {"period": first.period, "flips": flips, "ratios": ratios, **ends}


def chain(branch: GaitBranch, branches: Sequence[GaitBranch]) -> list[float]:
    """Return the values of successive flips: on a branch, on the branch born there, and so on."""
    flips = [bifurcation for bifurcation in branch.bifurcations if bifurcation.kind == "flip"]
    for flip in flips:
        for child in branches:
            if is_born_in(child, flip, branch):
                return [flip.value, *chain(child, branches)]
    return [flip.value for flip in flips[:1]]


def is_born_in(child: GaitBranch, flip: bifurcations.Bifurcation, parent: GaitBranch) -> bool:
    """Whether a branch begins or ends at a flip of another branch."""
    if flip.kind != "flip" or child.period != 2 * parent.period:
        return False
    return child.ends[0].value == flip.value or any(child.closes_on(flip))


def attractor_summary(family: Family) -> dict[str, Any]:
    """Describe over which range an attractor was followed, and how it was lost.

    Just beyond a flip, walks leave the gait slowly. A walk that has not repeated itself therefore counts as aperiodic
    only if neighbouring walks may diverge, no followed gait is stable and no cascade is still doubling.
    """
    attractors = family.attractors
    periodic = [pair for branch in family.branches for pair in branch.stable_ranges]
    # Between the last flip and the limit of the cascade, the stable gaits have longer periods than the gaits followed.
    periodic += [(row["flips"][0], row["accumulates_at"]) for row in cascade_rows(family) if "accumulates_at" in row]
    aperiodic = [
        attractor.value
        for attractor in attractors.found
        if attractor.period == 0
        and may_diverge(family.exponents, attractor.value)
        and not any(min(pair) <= attractor.value <= max(pair) for pair in periodic)
    ]
    return {
        "from": attractors.found[0].value,
        "to": attractors.found[-1].value,
        "aperiodic_from": min(aperiodic, default=None),
        "lost_at": attractors.lost_at,
        "ended": attractors.reason,
        "periods": sorted({attractor.period for attractor in attractors.found}),
    }


def curve_rows(family: Family) -> Iterator[dict[str, Any]]:
    """Yield a row for each bifurcation curve in the plane of both parameters: its two ends, and why it ends there."""
    for curve in family.curves:
        points = list(zip(curve.first.tolist(), curve.second.tolist(), strict=True))
        yield {
            "kind": curve.kind,
            "period": curve.period,
            "points": len(points),
            "begins": list(points[0]),
            "ends": list(points[-1]),
            "reasons": [end.reason for end in curve.ends],
        }


def region_rows(family: Family) -> Iterator[dict[str, Any]]:
    """Yield a row for each attractor period: the fraction of the parameter plane that it occupies."""
    if family.regions is not None:
        periods, counts = np.unique(family.regions.period, return_counts=True)
        for period, cells in zip(periods.tolist(), counts.tolist(), strict=True):
            yield {"period": period, "share": cells / family.regions.period.size}


def isolated_gait(branch: GaitBranch, model: str, parameter: Parameter) -> dict[str, str]:
    """Describe a gait that cannot be followed in either direction, because the step map is discontinuous there."""
    gait = branch.points[0]
    what = f"a gait of the {model} model at {gait.value:.5g} {parameter.unit} ({gait.period_s:.4g} s)"
    return {"what": what, "why": f"it continues in neither direction: {branch.ends[1].reason}", "saves": ""}


def omitted_families(families: Sequence[Family], question: FamilyQuestion) -> list[dict[str, str]]:
    """List the families that were not followed, with the reasons."""
    followed = {family.model: family for family in families}
    entries = []
    second = question.second
    for model in question.models:
        if model not in followed:
            entries.append((f"the {model} model's gaits", f"{question.parameter.key} does not affect this model"))
        elif not followed[model].branches:
            entries.append((f"the {model} model's gaits", "no starting gait was found in the span"))
        elif model == CONTACT and question.config.continuation.periods > THOROUGHNESS[CONTACT].periods:
            what = f"the contact model's gaits of more than {THOROUGHNESS[CONTACT].periods} steps"
            entries.append((what, "its flips are located too coarsely, to about 1e-7, to follow them further"))
    if question.stride > 1:
        entries.append(("attractors, their regions, and gaits of other numbers of steps", "the legs differ"))
    entries += [
        (f"the {family.model} model's plane of both keys", "the second key does not affect this model")
        for family in families
        if second is not None and family.branches and not second.touches(family.model)
    ]
    return [{"what": what, "why": reason, "saves": ""} for what, reason in entries]
