"""Identify the parameters of a config from a measured walk, with either model or both."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import compress
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from scipy.special import chdtri, fdtrc

from walkerlab.config.fields import value_at
from walkerlab.config.reads import ContactConfig
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.labels import add_unit, unit_by_name
from walkerlab.physics.estimation.fit import MAX_ROUNDS, FitEnd, FitProblem, Fitted, evaluate_at, fit, refit
from walkerlab.physics.estimation.information import information_on, marginalise, open_combinations, robust_covariance
from walkerlab.physics.estimation.judgement import alternates, describe_limp, judge, measure_radius
from walkerlab.physics.estimation.measurements import MeasuredWalk
from walkerlab.physics.estimation.mixed_model import Reduced, estimate_noise, evaluate, reduce
from walkerlab.physics.estimation.prediction import DELAY, EXACT_STEP, NUISANCES, Forecast, effective_directions
from walkerlab.physics.estimation.result import (
    USABLE,
    Estimate,
    EstimateSensitivity,
    FirstLeg,
    Identification,
    Information,
    LegDifference,
    ModelFit,
    Pull,
    StepTable,
    Uncertain,
)
from walkerlab.physics.orbits.family_search import RIGID
from walkerlab.physics.orbits.gradients import sensitivity_norms
from walkerlab.physics.orbits.newton import Effort
from walkerlab.physics.orbits.rigid_map import RigidMap
from walkerlab.physics.orbits.robustness import GaitOnMap, derivative
from walkerlab.physics.orbits.similarity import Units
from walkerlab.physics.orbits.step_map import Cycle, StepMap, gait_near
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats
from walkerlab.scene.parameter import (
    R,
    config_with,
    first_leg_path,
    mass_of_second_leg,
    parameter_keys,
    parameter_of,
)
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.subject import ModelUnderTest, find_model_gait, model_reads, scene_for, steps_of_stride

if TYPE_CHECKING:
    from walkerlab.config.identify import Identify
    from walkerlab.config.schema import Config

Values = tuple[float, ...]


class Fixed(NamedTuple):
    """A parameter, or a property of the clock or a sensor, that is not estimated."""

    name: str
    value: float  # 0 for properties of the clock and the sensors
    scale: float  # typical change
    unit: str
    slope: Floats  # (values,) derivative of the predicted values with respect to the parameter divided by `scale`

    @property
    def measured(self) -> bool:
        """Whether the value was measured or set by a user, and so may be wrong."""
        return self.value != 0.0 and self.name not in KNOWN


LEGS: Final = (1, 2)
Begin = Callable[[str, int], Callable[[], None]]
KEPT_CONFIGS: Final = 512  # maximum number of changed configs in the cache, and of their walkers
SCALE_OF_ZERO: Final = 0.01  # typical change of a parameter that is 0
AT_BOUND: Final = 1e-6  # a parameter this near to a bound, relative to its scale, counts as at the bound
SPREAD_OF_STARTS: Final = 0.1  # largest relative difference of a random start from the config's value
RIGID_WALKS: Final = Tolerances("dop853", 1e-11, 1e-11, 20_000)
# Errors of walks at these tolerances are near 1e-10, far below noise.
CONTACT_WALKS: Final = Tolerances("radau5", 1e-8, 1e-10, 60_000)
MIN_PRIOR_GAIN: Final = 1e-3  # a walk that reduces a prior's variance by a smaller fraction counts as uninformative
STRONG_PULL: Final = 3.0  # a bound or prior that is off by more standard deviations than this contradicts the walk
LINEAR_MOVE: Final = 0.3  # largest change of a parameter, relative to its scale, for which walks count as linear
DECISIVE_GAIN: Final = 3.0  # gain of log-likelihood above which one more parameter explains the walk better
PROMISING_GAIN: Final = 2.0  # fit again if, at unchanged noise, the log-likelihood gains at least this
FAR_FROM_CONFIG: Final = 10.0  # loss of log-likelihood beyond which a walk contradicts the config
# Estimates agree with the config if its values lower the log-likelihood by less than this (two standard errors).
NEAR_CONFIG: Final = 2.0
MAX_FREED: Final = 3  # maximum number of parameters that are freed, one at a time
SMALLEST_CHANGE: Final = 1e-4  # smallest change of a freed parameter, relative to its scale, that may explain the walk
RARE_GAIN: Final = 1e-3  # a gain is real if chance alone would give one as large with less than this probability
REJECTED: Final = 0.05  # probability below which a simpler explanation counts as rejected
UNBOUNDED: Final = (-math.inf, math.inf)
KNOWN: Final = ("gravity_m_s2",)
"""Parameters whose values count as exact."""
GAIT_EFFORT: Final = Effort(1e-9, 40)
GAIT_NAMES: Final = ("period_s", "step_length_m", "spectral_radius", "drop_sensitivity_s_m")


class ConfigFamily:
    """Configs as a function of several parameters."""

    def __init__(self, config: ContactConfig, keys: Sequence[str]) -> None:
        self.parameters = [parameter_of(key, config) for key in keys]
        self.start: Values = tuple(parameter.value_in(config) for parameter in self.parameters)
        self.at = lru_cache(KEPT_CONFIGS)(partial(config_with, config, self.parameters))
        self.rigid_walker = lru_cache(KEPT_CONFIGS)(self.vary(rigid_walker))
        self.stride = max((steps_of_stride(config, each) for each in self.parameters), default=1)

    def admits(self, values: Values) -> bool:
        return self.rigid_walker(values) is not None

    def vary(self, make: Callable[[ContactConfig], R]) -> Callable[[Any], R | None]:
        """Return a function from values to `make(config)`, or to None if the schema or `make` rejects them."""

        def make_at_values(values: Values) -> R | None:
            config = self.at(values)
            try:
                return None if config is None else make(config)
            except ConfigError:
                return None

        return make_at_values

    def scales(self) -> Floats:
        return np.array([abs(value) or SCALE_OF_ZERO for value in self.start])


def step_map_of(subject: ModelUnderTest, family: ConfigFamily, leg: int | None = None) -> StepMap:
    """Return a model's step map as a function of the family's parameter values.

    leg  the leg that swings in the first complete step; by default the one that swings in the subject's state
    """
    swing = steps_before(subject, family, leg)
    step_map: StepMap
    if subject.model == RIGID:
        walker_at = family.vary(lambda config: rigid_walker(config).exchanged) if swing else family.rigid_walker
        step_map = RigidMap(walker_at, 1.0, rigid_walker(subject.config), RIGID_WALKS)
    else:
        from walkerlab.physics.orbits.contact_map import ContactMap

        scene = scene_for(subject.length_m)
        step_map = ContactMap(family.vary(scene), 1.0, CONTACT_WALKS, subject.length_m, scene(subject.config), swing)
    step_map.stride = family.stride
    return step_map


def steps_before(subject: ModelUnderTest, family: ConfigFamily, leg: int | None) -> int:
    """Return the number of steps from the subject's state to the state at which the map of `step_map_of` starts."""
    return ((leg or subject.first_leg) - subject.first_leg) % family.stride


def gait_start(subject: ModelUnderTest, family: ConfigFamily, leg: int | None) -> Floats:
    """Return the section coordinates (d,) of the gait's state from which the map of `step_map_of` starts."""
    p: Any = family.start
    return step_map_of(subject, family).step(subject.z, p).z if steps_before(subject, family, leg) else subject.z


def identify_walk(
    config: Config,
    measured: MeasuredWalk,
    gait: Mapping[str, Any],
    question: Identify,
    note: Callable[[str], None] = lambda _: None,
    begin: Begin = lambda _label, _rounds: lambda: None,
) -> Identification:
    """Fit parameters to a measured walk with each model, and return the likeliest result, preferring models that fit.

    gait   summary of `fixedpoint` for the config
    note   called with each message
    begin  called with the name and the maximum number of rounds of each fit; returns a function to call at each round

    Raises ConfigError for keys that are not parameters, NoAnswer if no model can be fitted.
    """
    subjects = (find_model_gait(model, config, gait, note) for model in question.models)
    results = [identify_with(subject, measured, question, begin) for subject in subjects]
    answers = [result for result in results if isinstance(result, Identification)]
    verdicts = tuple(
        result.models[0] if isinstance(result, Identification) else ModelFit(model, None, "not-converged", (result,))
        for model, result in zip(question.models, results, strict=True)
    )
    if not answers:
        advice = (
            "Start from a config whose walk takes at least as many steps as the recording, or fit fewer parameters."
        )
        raise NoAnswer(f"no walk of the model can be fitted: {verdicts[0].reasons[0]}.", advice)
    return replace(max(answers, key=rank), models=verdicts)


def rank(answer: Identification) -> tuple[bool, float]:
    """Return a sort key that puts results that fit above those that do not, and then sorts by likelihood."""
    verdict = answer.models[0]
    return verdict.usable, verdict.log_likelihood or -math.inf


def identify_with(
    subject: ModelUnderTest, measured: MeasuredWalk, question: Identify, begin: Begin
) -> Identification | str:
    """Fit one model, or return the reason as text if no walk of the model can be fitted.

    If it is not known which leg of two that differ swings first, both are tried.
    """
    stride = ConfigFamily(subject.config, question.keys).stride
    if stride == 1 or measured.first_leg is not None:
        answer = identify_beginning(subject, measured, question, begin)
        stated = FirstLeg(measured.first_leg, "statement", None) if stride > 1 and measured.first_leg else None
        return answer if isinstance(answer, str) else replace(answer, first_leg=stated)
    walks = {leg: replace(measured, first_leg=leg) for leg in LEGS}
    results = {leg: identify_beginning(subject, walk, question, begin) for leg, walk in walks.items()}
    answers = {leg: result for leg, result in results.items() if isinstance(result, Identification)}
    if not answers:
        return next(reason for reason in results.values() if isinstance(reason, str))
    leg = max(answers, key=lambda leg: rank(answers[leg]))
    other = answers.get(sum(LEGS) - leg)
    if other is None or rank(other)[0] < rank(answers[leg])[0]:
        return replace(answers[leg], first_leg=FirstLeg(leg, "likelihood", None))
    gain = rank(answers[leg])[1] - rank(other)[1]
    if gain > DECISIVE_GAIN:
        return replace(answers[leg], first_leg=FirstLeg(leg, "likelihood", gain))
    return replace(answers[leg], first_leg=FirstLeg(leg, "guess", gain), other_differences=other.leg_differences)


def identify_beginning(
    subject: ModelUnderTest, measured: MeasuredWalk, question: Identify, begin: Begin
) -> Identification | str:
    """Fit a model to a walk that begins with a step of `measured.first_leg`. Returns the same as `identify_with`."""
    problem = problem_of(subject, measured, question)
    # Periods alone cannot tell kicks from floor heights, and only the rigid map has derivatives with respect to kicks.
    kicked = subject.model == RIGID and (measured.sampled or len(measured.channels()) > 1)
    problem = replace(problem, forecast=replace(problem.forecast, kicked=kicked))
    fits = [
        fit(problem, start, begin(f"{subject.model} model, start {number} of {question.starts}", MAX_ROUNDS))
        for number, start in enumerate(fit_starts(problem, question.starts), 1)
    ]
    predicted = [result for result in fits if result is not None]
    if not predicted:
        return FitEnd.WALK_FAILS.value
    best = max(predicted, key=lambda result: (not result.reason, result.evaluation.likelihood))
    timed = refit_in_time(best, begin)
    if timed is None:
        return describe(subject, question, best, best)
    return describe(subject, question, evaluate_at(timed.u[: best.u.size], best) or best, timed)


def refit_in_time(first: Fitted, begin: Begin) -> Fitted | None:
    """Fit angles at their sample times, starting from the fit at equal phase.

    Return None if the data are a table of steps or if the fit fails.
    """
    forecast = first.forecast
    if not forecast.measured.sampled:
        return None
    nuisances = forecast.nuisances if DELAY in forecast.nuisances else (*forecast.nuisances, DELAY)
    start = first.u if nuisances == forecast.nuisances else np.append(first.u, 0.0)
    problem = replace(first.problem, forecast=replace(forecast, in_phase=False, nuisances=nuisances))
    fitted = fit(problem, start, begin("angles at their times", MAX_ROUNDS))
    return fitted if fitted is not None and not fitted.reason else None


def problem_of(subject: ModelUnderTest, measured: MeasuredWalk, question: Identify) -> FitProblem:
    family = ConfigFamily(subject.config, question.keys)
    walks = step_map_of(subject, family, measured.first_leg)
    z = gait_start(subject, family, measured.first_leg)
    forecast = Forecast(
        measured=measured,
        nuisances=question.sensors,
        walks=walks,
        admits=family.admits,
        scales=family.scales(),
        z=z,
        directions=effective_directions(walks, z, family.start),
    )
    bounds = [question.fit.get(key) or UNBOUNDED for key in question.keys]
    priors = {index: question.prior[key] for index, key in enumerate(question.keys) if key in question.prior}
    leg_m = subject.config.walker.leg_length_m
    return FitProblem(forecast, leg_m, family.start, bounds, priors, question.loss, question.max_walks)


def fit_starts(problem: FitProblem, count: int) -> list[Floats]:
    """Return the starts of the fit, each (unknowns,): the config's values, then random values near them."""
    rng = np.random.default_rng(0)
    count_parameters = problem.forecast.scales.size
    starts = [problem.initial_unknowns() for _ in range(count)]
    for start in starts[1:]:
        start[:count_parameters] *= 1.0 + SPREAD_OF_STARTS * rng.uniform(-1.0, 1.0, count_parameters)
    return starts


def describe(subject: ModelUnderTest, question: Identify, steps: Fitted, best: Fitted) -> Identification:
    """Build the result of an identification from its fits.

    steps  fit that predicts the step periods. It differs from `best` only if angles were fitted at their sample times
    """
    problem = best.problem
    forecast = best.forecast
    keys = question.keys
    information = information_on(best, keys)
    combinations, left_open = open_combinations(information)
    values = forecast.parameters(best.u)
    deviations = zip(keys, np.sqrt(np.diag(information.covariance)).tolist(), strict=True)
    errors = [None if key in left_open else deviation for key, deviation in deviations]
    units = [parameter_of(key, subject.config).unit for key in keys]
    limits = zip(values, problem.bounds, forecast.scales, strict=True)
    at_bound = [any(abs(value - bound) <= AT_BOUND * scale for bound in bounds) for value, bounds, scale in limits]
    rows = zip(keys, values, errors, units, problem.start, at_bound, strict=True)
    estimates = tuple(Estimate(*row) for row in rows)
    pulls = (*pulls_of_bounds(best, keys), *pulls_of_priors(best, keys, question.prior))
    second_leg = mass_of_second_leg(subject.config) if forecast.walks.stride == 1 and alternates(steps) else None
    fixed = [*fixed_parameters(subject, question, best, fixed_keys(subject, question))]
    # A separate call, because leg 2 follows changes of leg 1 only while no parameter of leg 2 is varied with them.
    other_leg = [*fixed_parameters(subject, question, best, [second_leg])][:1] if second_leg else []
    verdicts = [judge(each) for each in ([best] if steps is best else [steps, best])]
    verdict = next((each for each in verdicts if each[0] not in USABLE), verdicts[-1])
    if verdict[0] in USABLE:
        others = (other_leg, fixed) if len(left_open) < len(keys) else ()
        suggested = next(filter(None, (tuple(suggest_parameter(subject, keys, each, best)) for each in others)), ())
        strong = (describe_pull(pull) for pull in pulls if pull.standard_deviations > STRONG_PULL)
        reasons = (*verdict[1], *strong, *suggested)
        verdict = ("fits-but" if reasons else "fits"), reasons
    elif second_leg and verdict[0] == "misfit" and (describe_limp(steps) or describe_limp(best)):
        verdict = verdict[0], (f"{verdict[1][0]}; estimate a mass of leg 2 as well (--fit {second_leg})",)
    dof = max(1, best.data.residuals.size - best.u.size)
    gait = gait_with_errors(best, information.covariance, subject.units if question.robustness else None)
    walk = forecast.predict(best.u, best.heights_m)
    assert walk is not None, "a fitted walk takes all steps"
    return Identification(
        subject.model,
        estimates,
        pulls,
        combinations,
        information,
        process_noise(best),
        measurement_noise(steps) | measurement_noise(best),
        rms_residuals(steps) | rms_residuals(best),
        best.evaluation.squares / dof,
        gait,
        (ModelFit(subject.model, float(best.evaluation.likelihood), *verdict),),
        step_tables(steps),
        best,
        walk.walk,
        nuisances_with_errors(best, question.sensors),
        tuple(sensitivities(fixed, best, estimates, subject.config)),
        measure_radius(steps, gait["spectral_radius"].value) if gait else None,
        tuple(leg_differences(subject.config, estimates, information)),
    )


def leg_differences(
    config: ContactConfig, estimates: Sequence[Estimate], information: Information
) -> Iterator[LegDifference]:
    """Yield the difference between the legs for each estimated key of leg 2 whose value in leg 1 is known."""
    known = {parameter_of(each.key, config).path: index for index, each in enumerate(estimates)}
    for index, estimate in enumerate(estimates):
        path = parameter_of(estimate.key, config).path
        first = first_leg_path(path)
        value = value_at(config, first)
        if first == path or value is None or estimate.standard_error is None:
            continue
        weights = np.eye(len(estimates))[index]
        if first in known:
            weights[known[first]] = -1.0
            value = estimates[known[first]].value
        error = math.sqrt(weights @ information.covariance @ weights)
        yield LegDifference(estimate.key, estimate.value - value, error, estimate.unit)


def pulls_of_bounds(fitted: Fitted, keys: Sequence[str]) -> Iterator[Pull]:
    """Yield, for each estimate at a bound, how far the data would move it, in standard errors of the free estimate."""
    scales = fitted.forecast.scales
    errors = independent_errors(fitted)
    rows = zip(keys, fitted.u, fitted.evaluation.move, errors, fitted.problem.bounds, scales, strict=False)
    for key, u, move, error, bounds, scale in rows:
        for bound in bounds:
            if abs(u * scale - bound) <= AT_BOUND * scale:
                yield Pull(key, "bound", bound, float(abs(move) / error))


def independent_errors(fitted: Fitted) -> Floats:
    """Return the standard errors of the unknowns, in their scales, if all errors of the data are independent."""
    variances = np.diag(np.linalg.pinv(fitted.evaluation.information, hermitian=True))
    return np.sqrt(np.maximum(variances, 1e-300))


def pulls_of_priors(fitted: Fitted, keys: Sequence[str], priors: Mapping[str, Sequence[float]]) -> Iterator[Pull]:
    """Yield each prior's distance from the estimate based on the walk alone, in standard errors of the difference."""
    for key, u, error, scale in zip(keys, fitted.u, independent_errors(fitted), fitted.forecast.scales, strict=False):
        if key in priors:
            value, sigma = priors[key]
            # The difference between a prior and the estimate that includes it has this variance.
            free = sigma**2 - (error * scale) ** 2
            distance = abs(u * scale - value) / math.sqrt(free) if free > MIN_PRIOR_GAIN * sigma**2 else 0.0
            yield Pull(key, "prior", value, float(distance))


def describe_pull(pull: Pull) -> str:
    return (
        f"the walk contradicts the {pull.against} of {pull.value:g} for {pull.key} by {pull.standard_deviations:.2g} "
        "standard deviations"
    )


def suggest_parameter(
    subject: ModelUnderTest, keys: Sequence[str], others: Sequence[Fixed], fitted: Fitted
) -> Iterator[str]:
    """Yield advice on a fixed parameter or nuisance that would explain the walk better if it were estimated, too, or
    that would alone explain it as well as the estimates do.

    If the estimates from steps disagree with the config, but not widely, a measured parameter is doubted as soon as
    estimating it explains the steps better. Otherwise, and for parameters such as gravity or a spring that the config
    does not have, the gain must be too large to be due to chance.
    """
    data = fitted.data
    priors = np.column_stack((data.prior, np.zeros(len(data.prior))))
    widened = [reduce(replace(data, J=np.column_stack((data.J, other.slope)), prior=priors)) for other in others]
    gains = np.array([evaluate(rows, fitted.noise).likelihood - fitted.evaluation.likelihood for rows in widened])
    measured = np.array([other.measured for other in others], bool)
    values = data.residuals.size
    freedom = max(1, values - fitted.u.size - 1)
    order = np.lexsort((-gains, ~measured)).tolist() if others else []
    alone = max(changes_alone(subject, keys, compress(others, measured), fitted), key=itemgetter(0), default=None)
    if alone is not None:
        yield (
            f"{describe_change(*alone[1:])} would explain the walk as well, with {' and '.join(keys)} as in the "
            f"config: measure it again, or estimate it as well (--fit {alone[1].name})"
        )
        return
    distance = distance_from_config(keys, fitted)
    # Estimates farther away show that the config's values are wrong guesses, unless one change alone explains the walk.
    doubted = measured & (NEAR_CONFIG < distance < FAR_FROM_CONFIG) & (not fitted.forecast.measured.sampled)
    for index in [each for each in order if gains[each] >= PROMISING_GAIN or doubted[each]][:MAX_FREED]:
        other = others[index]
        gain, change = gain_of_freeing(subject, keys, other, widened[index], fitted)
        rare = fdtrc(1, freedom, freedom * math.expm1(2.0 * max(gain, 0.0) / values)) < RARE_GAIN
        if gain > DECISIVE_GAIN and (doubted[index] or rare) and abs(change) > SMALLEST_CHANGE:
            option = "--nuisance" if other.name in NUISANCES else "--fit"
            yield (
                f"{describe_change(other, change)} would raise the log-likelihood by about {gain:.3g}: "
                f"estimate it as well ({option} {other.name})"
            )
            return


def describe_change(other: Fixed, change: float) -> str:
    before = NUISANCES.get(other.name, (other.value, 0.0))[0]
    return f"{other.name} of {add_unit(f'{before + change * other.scale:.4g}', other.unit)} instead of {before:.4g}"


def distance_from_config(keys: Sequence[str], fitted: Fitted) -> float:
    """Return the smallest loss of log-likelihood, to second order, if all estimated parameters but one keep the
    config's values and that one is fitted again.
    """
    count = len(keys)
    moved = fitted.u[:count] - np.array(fitted.problem.start) / fitted.forecast.scales
    information = marginalise(fitted.evaluation.information, count)
    # In each order, the last parameter is the free one.
    orders = [np.roll(np.arange(count), shift) for shift in range(count)]
    rests = [(moved[order[:-1]], marginalise(information[np.ix_(order, order)], count - 1)) for order in orders]
    return min(float(0.5 * moves @ known @ moves) for moves, known in rests)


def changes_alone(
    subject: ModelUnderTest, keys: Sequence[str], others: Iterable[Fixed], fitted: Fitted
) -> Iterator[tuple[Any, Fixed, float]]:
    """Find each fixed parameter whose change alone explains why a walk contradicts the config.

    Yields the log-likelihood, the parameter, and the change in the scale of the parameter. All estimated parameters
    keep the config's values. If there are fewer than two of them, nothing is yielded.
    """
    unsuited = len(keys) < 2 or subject.model != RIGID or fitted.problem.priors
    if unsuited or distance_from_config(keys, fitted) < FAR_FROM_CONFIG:
        return
    # A likelihood-ratio test must not prefer the estimates, which change more parameters, to this single change.
    enough = fitted.evaluation.likelihood - 0.5 * chdtri(len(keys) - 1, REJECTED)
    for other in others:
        problem = problem_for(subject, (other.name,), [UNBOUNDED], fitted.problem)
        refitted = refit(problem, problem.initial_unknowns(), fitted)
        if refitted and refitted.evaluation.likelihood > enough:
            yield refitted.evaluation.likelihood, other, float(refitted.u[0]) - other.value / other.scale


def gain_of_freeing(
    subject: ModelUnderTest, keys: Sequence[str], other: Fixed, rows: Reduced, fitted: Fitted
) -> tuple[float, float]:
    """Return how much the log-likelihood rises if one more parameter is estimated, and how much this parameter changes,
    in its scale.

    Both come from a linearised step with new standard deviations or, if that step is long, from a new fit.

    rows  data of the walk, with the derivative for one more parameter
    """
    problem = fitted.problem
    count = len(keys)
    step = evaluate(rows, fitted.noise).move
    if np.abs([*step[:count], step[-1] if other.value else 0.0]).max() < LINEAR_MOVE:
        noise, _ = estimate_noise(rows, problem.floors, problem.leg_length_m, fitted.noise, fitted.noises)
        linear = evaluate(rows, noise)
        return float(linear.likelihood - fitted.evaluation.likelihood), float(linear.move[-1])
    if not other.measured or subject.model != RIGID:
        return 0.0, 0.0
    wider = problem_for(subject, (*keys, other.name), [*problem.bounds, UNBOUNDED], problem)
    free = fit(wider, np.insert(fitted.u, count, other.value / other.scale))
    if free is None or free.reason:
        return 0.0, 0.0
    gain = float(free.evaluation.likelihood - fitted.evaluation.likelihood)
    return gain, float(free.u[count]) - other.value / other.scale


def problem_for(
    subject: ModelUnderTest, keys: Sequence[str], bounds: Sequence[Sequence[float]], problem: FitProblem
) -> FitProblem:
    """Return a problem that fits the parameters `keys` to the same walk as `problem`."""
    family = ConfigFamily(subject.config, keys)
    walks = step_map_of(subject, family, problem.forecast.measured.first_leg)
    forecast = replace(problem.forecast, walks=walks, admits=family.admits, scales=family.scales())
    return replace(problem, forecast=forecast, start=family.start, bounds=bounds)


def sensitivities(
    others: Sequence[Fixed], fitted: Fitted, estimates: Sequence[Estimate], config: ContactConfig
) -> Iterator[EstimateSensitivity]:
    """Yield how much each determined estimate changes if a fixed parameter is 1 % larger, to first order.

    The changes are those of a least-squares fit with the present noise and without bounds.
    """
    data = fitted.data
    prior = np.column_stack((np.zeros(len(data.prior)), data.prior[:, 1:]))
    for other in others:
        change = one_percent(other, config)
        if other.name in NUISANCES or not change:
            continue
        residuals = -other.slope * change / other.scale
        move = evaluate(reduce(replace(data, residuals=residuals, prior=prior)), fitted.noise).move
        for estimate, by, scale in zip(estimates, move, fitted.forecast.scales, strict=False):
            if estimate.standard_error is not None:
                yield EstimateSensitivity(estimate.key, other.name, float(by * scale), estimate.unit, change)


def one_percent(parameter: Fixed, config: ContactConfig) -> float:
    """Return 1 % of a parameter.

    If it is zero, return 1 % of the leg length for a length, of mass times leg length squared for an inertia, and
    otherwise 0.
    """
    leg, (*block, name) = config.walker.leg_length_m, parameter.name.split(".")
    if parameter.value or parameter.unit == "m":
        return 0.01 * abs(parameter.value or leg)
    if name.endswith("inertia_kg_m2"):
        return 0.01 * float(value_at(config, (*block, name.replace("inertia_kg_m2", "mass_kg")))) * leg**2
    return 0.0


def fixed_keys(subject: ModelUnderTest, question: Identify) -> list[str]:
    """Return the keys of the parameters that the model reads and that are not estimated."""
    config = subject.config
    estimated = {parameter_of(key, config).path for key in question.keys}
    model_config = config_with(config, (), ())
    assert model_config is not None, "the config is valid"
    return [key for key in keys_read_by(subject.model, model_config) if parameter_of(key, config).path not in estimated]


@lru_cache
def keys_read_by(model: str, config: Config) -> tuple[str, ...]:
    """Return the keys of the parameters that a model reads."""
    return tuple(key for key in parameter_keys(config) if model_reads(model, config, key))


def fixed_parameters(
    subject: ModelUnderTest, question: Identify, fitted: Fitted, fixed: Sequence[str]
) -> Iterator[Fixed]:
    """Yield every fixed parameter and, if angles were measured, every nuisance that is not estimated.

    Parameters for which no walk can be predicted at changed values are left out.
    """
    forecast = fitted.forecast
    count = len(question.keys)
    sensors = [name for name in NUISANCES if forecast.measured.sampled and name not in forecast.nuisances]
    family = ConfigFamily(subject.config, (*question.keys, *fixed))
    wide = replace(
        forecast,
        walks=step_map_of(subject, family, forecast.measured.first_leg),
        admits=family.admits,
        scales=family.scales(),
        nuisances=(*forecast.nuisances, *sensors),
    )
    values = np.array(family.start[count:])
    u = np.concatenate((fitted.u[:count], values / wide.scales[count:], fitted.u[count:], np.zeros(len(sensors))))
    indices = [*range(count, count + len(fixed)), *range(u.size - len(sensors), u.size)]
    scales = [*wide.scales[count:].tolist(), *(NUISANCES[name][1] for name in sensors)]
    units = [*(parameter_of(key, subject.config).unit for key in fixed), *map(unit_by_name, sensors)]
    rows = zip((*fixed, *sensors), (*values.tolist(), *[0.0] * len(sensors)), scales, units, indices, strict=True)
    for name, value, scale, unit, index in rows:
        # If the walk at the larger value ends early, the exact difference can still use the other side.
        for exact in (False, True):
            slope = wide.slope_along(u, np.eye(u.size)[index], fitted.heights_m, exact)
            if slope is not None:
                yield Fixed(name, value, scale, unit, slope)
                break


def nuisances_with_errors(fitted: Fitted, names: Sequence[str]) -> dict[str, Uncertain]:
    """Return the estimated properties of clock and sensors with their standard errors."""
    forecast = fitted.forecast
    variances = np.diag(robust_covariance(fitted, np.eye(fitted.u.size)))
    by_name = dict(zip(forecast.nuisances, variances[forecast.unknowns - len(forecast.nuisances) :], strict=True))
    values = forecast.sensors(fitted.u)
    return {name: Uncertain(values[name], NUISANCES[name][1] * math.sqrt(max(by_name[name], 0.0))) for name in names}


def measurement_noise(fitted: Fitted) -> dict[str, float]:
    return dict(zip(fitted.forecast.quantities, fitted.scatter.tolist(), strict=True))


def process_noise(fitted: Fitted) -> dict[str, Any]:
    """Return the floor's roughness and the kicks, with standard errors. Kicks are None if they are not estimated."""
    noise = fitted.noise
    kicks = fitted.data.kicks
    reason = "" if kicks else "only lengths or angles tell kicks from a rough floor, and only with the rigid model"
    return {
        "roughness_m": noise.roughness_m,
        "share_of_leg": noise.roughness_m / fitted.problem.leg_length_m,
        "standard_error": error_of_noise(fitted, "roughness_m"),
        "at_bound": noise.roughness_m == 0.0,
        "kick": noise.kick if kicks else None,
        "kick_standard_error": error_of_noise(fitted, "kick"),
        "kick_reason": reason,
    }


def error_of_noise(fitted: Fitted, name: str) -> float | None:
    """Return the standard error of a disturbance from the curvature of the restricted likelihood, or None if the
    disturbance is zero.
    """
    h = 1e-2
    value = getattr(fitted.noise, name)
    if value == 0.0:
        return None
    logs = evaluate(fitted.rows, fitted.noise._replace(**{name: value * np.exp([-h, 0.0, h])})).restricted
    curvature = (2.0 * logs[1] - logs[0] - logs[2]) / h**2
    return float(value / math.sqrt(curvature)) if curvature > 0.0 else None


def rms_residuals(fitted: Fitted) -> dict[str, float]:
    """Return the rms of measured minus predicted values by quantity, given the most probable floor heights."""
    quantity = fitted.forecast.quantity
    return {
        name: float(np.sqrt(np.mean(fitted.residuals[quantity == index] ** 2)))
        for index, name in enumerate(fitted.forecast.quantities)
    }


def step_tables(fitted: Fitted) -> tuple[StepTable, ...]:
    """Tabulate measured steps, predicted steps on even ground, and the standard deviation of their difference."""
    forecast = fitted.forecast
    steps = forecast.measured.count
    variance = fitted.noise.measurement[forecast.quantity] ** 2
    total = np.sqrt(variance + ((fitted.data.G * fitted.data.spread(fitted.noise)) ** 2).sum(axis=1))
    starts = range(0, steps * len(forecast.channels), steps)
    return tuple(
        StepTable(name, values, fitted.predicted.values[first : first + steps], total[first : first + steps])
        for first, (name, values) in zip(starts, forecast.channels.items(), strict=True)
    )


def gait_with_errors(fitted: Fitted, covariance: Floats, units: Units | None) -> dict[str, Uncertain]:
    """Return period, step length and spectral radius of the identified gait, with errors propagated from the estimates.

    Returns nothing if the identified walker has no gait near the fitted start.

    units  units of the walker, or None to leave out the sensitivity of the gait to a drop of the floor
    """
    forecast = fitted.forecast

    def quantities(move: Floats) -> Floats | None:
        parameters = forecast.parameters(fitted.u + move)
        if not forecast.admits(parameters):
            return None
        z = forecast.walks.rest_on_ground(fitted.predicted.walk.z, parameters)
        stride = forecast.walks.stride
        gait = gait_near(forecast.walks, z, parameters, GAIT_EFFORT, stride)
        if not isinstance(gait, Cycle):
            return None
        radius = float(np.abs(gait.multipliers).max()) ** (1.0 / stride)
        values = (gait.period_s / stride, math.fsum(gait.lengths_m) / stride, radius)
        if units is None:
            return np.array(values)
        norms = sensitivity_norms(GaitOnMap(forecast.walks, parameters, gait.z, gait.DP, units))
        return None if norms is None else np.array((*values, norms[0]))

    centre = quantities(0.0 * fitted.u)
    if centre is None:
        return {}
    slopes = np.zeros((forecast.scales.size, centre.size))
    names = GAIT_NAMES[: centre.size]
    for index, unit in enumerate(np.eye(fitted.u.size)[: forecast.scales.size]):
        # The fit has used the same differences, so these walkers are already cached.
        slope = derivative(lambda share, unit=unit: quantities(share * unit), EXACT_STEP)  # type: ignore[misc]
        if slope is None:
            return {name: Uncertain(float(v), None) for name, v in zip(names, centre, strict=True)}
        slopes[index] = slope / forecast.scales[index]
    errors = np.sqrt(np.maximum(np.einsum("iq,ij,jq->q", slopes, covariance, slopes), 0.0))
    return {name: Uncertain(float(v), float(e)) for name, v, e in zip(names, centre, errors, strict=True)}
