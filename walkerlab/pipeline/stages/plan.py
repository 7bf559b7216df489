"""Find the measurements, and the numbers of steps, that would determine parameters of the walker."""

from bisect import bisect_left
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from walkerlab.config import analyses, identify, reads
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.physics.estimation import fit, measurements, mixed_model, prediction, result
from walkerlab.physics.estimation.information import information_from, open_combinations
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.estimated import refuse_keys, refuse_model
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.scene import identification, parameter
from walkerlab.scene.subject import ModelUnderTest, find_model_gait

ERROR_DIMENSIONS: Final = ("measurement", "steps", "parameter")


def run(config: reads.PlanConfig, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Predict the errors of several ways to measure a walk.

    Raises ConfigError for an invalid request.
    """
    refuse(config)
    block = cast("identify.Identify", config.identify)
    plan = config.plan or analyses.Plan()
    progress.start("plan")
    if block.data:
        progress.note(f"a plan needs no measured walk: {block.data} is not read")
    subject = find_model_gait(block.model, config, inputs["fixedpoint"].summary, progress.note)
    options = plan_measurements(subject, block, plan)
    keys = tuple(options[0].errors)
    units = {key: parameter.parameter_of(key, config).unit for key in keys}
    determining = next((option for option in options if None not in option.errors.values()), None)
    summary = {
        "model": block.model,
        "steps": plan.steps,
        "max_steps": plan.max_steps,
        "measurements": [row_of(option, units, plan.errors) for option in options],
        "simplest": None if determining is None else {
            "measurement": determining.measurement, "start": determining.start,
        },
        "assumptions": plan.model_dump(mode="json", exclude={"steps", "max_steps", "errors"}),
    }  # fmt: skip
    return Content({"errors": curves_of(options, keys)}, summary)


def refuse(config: reads.PlanConfig) -> None:
    """Raise ConfigError for an invalid `plan` or `identify` block."""
    block = config.identify or identify.Identify()
    plan = config.plan or analyses.Plan()
    if not block.fit:
        raise ConfigError("a plan needs a parameter to estimate.", "For example --fit walker.hip_mass_kg.")
    if block.model == "both":
        raise ConfigError("identify.model is `both`, but a plan is for one model.", "Choose --model rigid or contact.")
    refuse_model(config, block)
    refuse_keys(config, block)
    for key in plan.errors:
        if key not in block.keys:
            advice = f"Name one of {', '.join(block.keys)}, or add --fit {key}."
            raise ConfigError(f"plan.errors: {key} is not estimated.", advice, ("plan", "errors"))
    if plan.steps > plan.max_steps:
        text = f"plan.steps: {plan.steps} exceeds plan.max_steps, {plan.max_steps}."
        raise ConfigError(text, "Raise plan.max_steps.", ("plan", "steps"))


def row_of(option: "WayToMeasure", units: Mapping[str, str], wanted: Mapping[str, float]) -> dict[str, Any]:
    errors = [
        {"key": key, "standard_error": error, "unit": units[key]}
        | ({"wanted": wanted[key], "steps_needed": option.steps_needed[key]} if key in wanted else {})
        for key, error in option.errors.items()
    ]
    return {
        "measurement": option.measurement,
        "start": option.start,
        "errors": errors,
        "not_identifiable": [asdict(entry) for entry in option.not_identifiable],
    }


def curves_of(options: "Sequence[WayToMeasure]", keys: Sequence[str]) -> Group:
    """Build the group of errors by number of steps, with missing values for undetermined parameters."""
    counts = list(options[0].curve)
    errors = [[[option.curve[count][key] for key in keys] for count in counts] for option in options]
    steps = Variable(np.array(counts), ("steps",), "1", "number of measured steps")
    meaning = "standard error in the key's unit; missing if the walk does not determine it"
    standard_error = Variable(np.array(errors, float), ERROR_DIMENSIONS, "SI", meaning, missing=True)
    return Group({"steps": steps, "standard_error": standard_error})


STEP_MEASUREMENTS: Final = {
    "periods": (measurements.STEP_PERIOD,),
    "periods and lengths": (measurements.STEP_PERIOD, measurements.STEP_LENGTH),
    "periods, lengths and touch angles": (measurements.STEP_PERIOD, measurements.STEP_LENGTH, measurements.LEG_ANGLE),
}
ANGLES: Final = "angles over time"
SHORTER_WALK: Final = "Plan a shorter walk (plan.max_steps), or one that starts nearer to the gait (plan.start_change)."
AT_GAIT = "at the gait"
OFF_GAIT = "off the gait"
CURVE: Final = (2, 3, 5, 7, 10, 14, 20, 30, 50, 70, 100, 150, 200, 300, 500)
"""Numbers of steps at which errors are listed."""


@dataclass(frozen=True)
class WayToMeasure:
    """A way to measure a walk, and the parameter errors that would remain."""

    measurement: str
    start: str
    errors: dict[str, float | None]  # standard error of each key, in its unit; None if the walk does not determine it
    not_identifiable: tuple[result.Unidentifiable, ...]
    # steps needed to reach the target error of each key; None if the longest walk is too short
    steps_needed: dict[str, int | None]
    curve: dict[int, dict[str, float | None]]  # errors by number of steps


def plan_measurements(
    subject: ModelUnderTest, question: identify.Identify, plan: analyses.Plan
) -> tuple[WayToMeasure, ...]:
    """Compute the parameter errors that would remain after each way of measuring a walk, simple ways first.

    Raises NoAnswer if the model's walk ends early, ConfigError for keys that are not parameters.
    """
    options = []
    for start, change in ((AT_GAIT, 0.0), (OFF_GAIT, plan.start_change)):
        moved = replace(subject, z=subject.z * (1.0 + change))
        of_steps, of_angles = (walk_of(moved, each, question) for each in predict_measured(moved, question, plan))
        for measurement, quantities in (*STEP_MEASUREMENTS.items(), (ANGLES, (measurements.LEG_ANGLE,))):
            walk = of_angles if measurement == ANGLES else of_steps
            errors_after = partial(expected_errors, walk, quantities, question.keys, plan)
            counts = {*(count for count in CURVE if count <= plan.max_steps), plan.max_steps}
            needed = {key: steps_for(key, error, errors_after, plan.max_steps) for key, error in plan.errors.items()}
            curve = {count: errors_after(count)[0] for count in sorted(counts)}
            options.append(WayToMeasure(measurement, start, *errors_after(plan.steps), needed, curve))
    return tuple(options)


Errors = tuple[dict[str, float | None], tuple[result.Unidentifiable, ...]]


def predict_measured(
    subject: ModelUnderTest, question: identify.Identify, plan: analyses.Plan
) -> tuple[measurements.MeasuredWalk, measurements.MeasuredWalk]:
    """Predict the step values and the sampled angles of a walk that starts in the state z of `subject`.

    Raises NoAnswer if the walk ends early.
    """
    family = identification.ConfigFamily(subject.config, question.keys)
    walks = identification.step_map_of(subject, family)
    # The walk is one step longer than the measurement, because samples must lie before its last heel strike.
    level = np.zeros(plan.max_steps + 2)
    walk = walks.take_disturbed_walk(subject.z, family.start, level)  # type: ignore[arg-type]  # values of several parameters
    if walk.durations_s.size <= plan.max_steps:
        raise NoAnswer(
            f"the {subject.model} model takes only {walk.durations_s.size} of {plan.max_steps + 1} steps.",
            SHORTER_WALK,
        )
    steps = slice(plan.max_steps)
    touches = np.append(0.0, np.cumsum(walk.durations_s[steps]))
    times = np.arange(0.0, touches[-1], 1.0 / plan.rate_hz)
    angles = walks.sample_legs(subject.z, family.start, level, times)  # type: ignore[arg-type]
    quantities = walk.durations_s[steps], walk.lengths_m[steps], walk.angles_rad[steps]
    of_steps = measurements.MeasuredWalk(*quantities, first_leg=subject.first_leg)
    return of_steps, replace(measurements.split_into_steps(times, angles, touches), first_leg=subject.first_leg)


@dataclass(frozen=True, eq=False)
class PlannedWalk:
    """Predicted (not measured) walk, with its derivatives."""

    forecast: prediction.Forecast
    data: mixed_model.Linearised
    step: NDArray[np.int64]  # (values,) index of each value's step


def walk_of(subject: ModelUnderTest, measured: measurements.MeasuredWalk, question: identify.Identify) -> PlannedWalk:
    """Return the planned walk with its derivatives.

    Raises NoAnswer if a slightly changed walk ends early.
    """
    problem = identification.problem_of(subject, measured, question)
    if measured.sampled:
        # If `identify` fits angles at their sample times, it always estimates a delay, too.
        nuisances = tuple(dict.fromkeys((*question.sensors, prediction.DELAY)))
        problem = replace(problem, forecast=replace(problem.forecast, in_phase=False, nuisances=nuisances))
    forecast = problem.forecast
    data = fit.linearise(problem, problem.initial_unknowns(), np.zeros(forecast.heights), exact=True)
    if data is None:
        raise NoAnswer(
            f"a {subject.model}-model walk with slightly changed parameters, needed for the derivatives, ends early.",
            SHORTER_WALK,
        )
    steps = np.tile(np.arange(measured.count), len(forecast.channels))
    return PlannedWalk(forecast, data, np.append(steps, np.repeat(measured.step, 2)))


def expected_errors(
    walk: PlannedWalk, measured: Collection[str], keys: tuple[str, ...], plan: analyses.Plan, steps: int
) -> Errors:
    """Return the standard errors of the parameters if `measured` quantities of the first steps are known, and the
    combinations that stay undetermined."""
    noise = {
        measurements.STEP_PERIOD: plan.period_noise_s,
        measurements.STEP_LENGTH: plan.length_noise_m,
        measurements.LEG_ANGLE: plan.angle_noise_rad,
    }
    data = walk.data
    quantities = walk.forecast.quantities
    rows = np.isin(data.quantity, [quantities.index(name) for name in measured]) & (walk.step < steps)
    seen = replace(data, residuals=data.residuals[rows], J=data.J[rows], G=data.G[rows], quantity=data.quantity[rows])
    deviations = mixed_model.Noise(np.array([noise[name] for name in quantities]), plan.roughness_m)
    whole = mixed_model.evaluate(mixed_model.reduce(seen), deviations).information
    information = information_from(whole, keys, walk.forecast.scales, int(np.count_nonzero(rows)))
    combinations, left_open = open_combinations(information)
    errors = zip(keys, np.sqrt(np.diag(information.covariance)).tolist(), strict=True)
    return {key: None if key in left_open else error for key, error in errors}, combinations


def steps_for(key: str, wanted: float, errors_after: Callable[[int], Errors], most: int) -> int | None:
    """Return the smallest number of steps that reduces the error of a key to `wanted`, or None if above `most`."""

    def suffices(count: int) -> bool:
        error = errors_after(count)[0].get(key)
        return error is not None and error <= wanted

    # More steps never increase an error.
    return bisect_left(range(most), True, 1, key=suffices) if suffices(most) else None
