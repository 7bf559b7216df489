"""Estimate parameters of a walker from a measured walk."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final, cast

import numpy as np

from walkerlab.config.fields import leaves, value_at
from walkerlab.config.identify import Identify
from walkerlab.config.reads import IdentifyConfig
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.labels import Label, unit_by_name
from walkerlab.physics.estimation.information import is_open
from walkerlab.physics.estimation.measurements import MeasuredWalk
from walkerlab.physics.estimation.prediction import GAIN, OFFSET
from walkerlab.physics.estimation.result import Estimate, Identification, Information, Pull
from walkerlab.physics.hybrid.rigid_measures import FootholdsOfWalk, places
from walkerlab.physics.mechanics.rigid_model import STRAIGHT, apply_couplings
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.estimated import refuse_keys, refuse_model
from walkerlab.pipeline.stages.measured_walk import SAME_TOUCHES, MeasuredFile
from walkerlab.pipeline.stages.rigid_groups import place_variables, reorder_by_leg
from walkerlab.pipeline.stages.walk import leg_labels, variables_over_time
from walkerlab.pipeline.store.content import Content, Group, Variable, numbered, rows_group
from walkerlab.scene.identification import LEGS, identify_walk
from walkerlab.scene.parameter import SLOPE, config_with, parameter_of
from walkerlab.scene.rigid import rigid_walker

LABELS: Final = {
    "key": Label("", "parameter of the config"),
    "value": Label("SI", "estimate, in the unit of the key"),
    "standard_error": Label("SI", "standard error; absent if the walk does not determine the parameter"),
    "start": Label("SI", "value in the config"),
}
SHOWN_STEPS = 10
"""Number of steps that the motion player shows."""
SHOWN_SAMPLES = 800
"""Approximate number of samples that the motion player shows."""
FIT_FEWER: Final = "Fit fewer parameters, add measured values as priors (--prior), or start closer to the walk (--set)."


def run(config: IdentifyConfig, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Fit the config's parameters to the measured walk.

    Raises ConfigError for an invalid config or file, NoAnswer if no fit converges.
    """
    file = read_data(config)
    gait = inputs["fixedpoint"].summary
    for doubt in file.doubts():
        progress.note(doubt)

    def begin(label: str, rounds: int) -> Callable[[], None]:
        progress.start(label, rounds)
        return progress.advance

    def ask(measured: MeasuredWalk) -> Identification:
        return identify_walk(cast("Config", config), measured, gait, file.block, progress.note, begin)

    result = identify_divided(file, ask)
    content = content_of(config, result)
    verdict = result.verdict
    if verdict.fit == "not-converged":
        open_combinations = "".join(f"; open: {entry.combination}" for entry in result.not_identifiable)
        reason = f"the fit of the {verdict.model} model did not converge: {verdict.reasons[0]}{open_combinations}"
        raise NoAnswer(reason, FIT_FEWER, content)
    return content


def refuse(config: IdentifyConfig) -> None:
    """Raise ConfigError for an invalid `identify` block, or a file without a walk."""
    read_data(config)


def read_data(config: IdentifyConfig) -> MeasuredFile:
    """Read the file of the `identify` block.

    Raises ConfigError for an invalid block, or a file without a walk.
    """
    block = config.identify or Identify()
    if not block.data or not block.fit:
        advice = "For example --data steps.csv --fit walker.hip_mass_kg --fit slope_deg."
        raise ConfigError("identify needs a measured walk and a parameter to estimate.", advice)
    refuse_model(config, block)
    if block.sensors and block.level == "steps":
        raise ConfigError(
            f"identify.nuisance: {', '.join(block.sensors)}: only sampled angles have these sensor properties.",
            "Leave out `--nuisance` and `--camera-tilt free`, or give angles over time (`--level angles`).",
            ("identify", "nuisance"),
        )
    refuse_keys(config, block)
    file = MeasuredFile(block, config)
    measured = next(file.divisions())
    values_count = measured.count * len(measured.channels()) + measured.step.size
    if values_count + len(block.prior) <= len(block.fit):
        raise ConfigError(
            f"{block.data} holds {values_count} values, too few for {len(block.fit)} parameters.",
            "Measure more steps, or fit fewer parameters.",
        )
    return file


def identify_divided(file: MeasuredFile, ask: Callable[[MeasuredWalk], Identification]) -> Identification:
    """Fit every way to divide the walk into steps. Return the first good fit or, if none is good, the most usable
    one."""
    answers = list[Identification]()
    problems = list[NoAnswer]()
    for measured in file.divisions():
        try:
            answers.append(refit_with_new_strikes(file, ask, ask(measured)))
        except NoAnswer as error:
            problems.append(error)
            continue
        if answers[-1].verdict.fit == "fits":
            return answers[-1]
    if not answers:
        raise problems[0]
    return max(answers, key=lambda answer: answer.verdict.usable)


def refit_with_new_strikes(
    file: MeasuredFile, ask: Callable[[MeasuredWalk], Identification], before: Identification
) -> Identification:
    """Fit again if the heel strikes move with the identified slope, sensors or soles. If that fails, keep the old
    fit."""
    if not before.measured.sampled:
        return before
    identified = identified_config(file.config, before)
    # The sum of the angles at a strike is off by twice the error of one angle, to which slope and sensor contribute.
    touch_sum = 2.0 * (before.sensors[OFFSET] - identified.slope_rad + file.config.slope_rad)
    same_soles = rigid_walker(identified).alike
    if same_soles and abs(touch_sum - before.measured.touch_sum_rad) < SAME_TOUCHES:
        return before
    on_slope = SLOPE.config_at(identified, file.config.slope_rad)
    try:
        refit = ask(file.divide_at(touch_sum, on_slope))
    except (ConfigError, NoAnswer):
        return before
    return refit if refit.verdict.usable else before


def content_of(config: IdentifyConfig, result: Identification) -> Content:
    """Build the content to store: estimates, steps and, for measured angles, residuals over the phase of a step."""
    known = result.information
    block = config.identify or Identify()
    estimates = [
        {**asdict(estimate), "value": float(f"{estimate.value:.12g}"), "start": float(f"{estimate.start:.12g}")}
        for estimate in result.estimates
    ]
    summary = {
        "model": result.model,
        "level": block.level,
        "estimates": estimates,
        "not_identifiable": [asdict(entry) for entry in result.not_identifiable],
        "correlations": {"keys": list(known.keys), "matrix": known.correlations.tolist()},
        "degrees_of_freedom": known.freedom,
        "singular_values": known.singular_values.tolist(),
        "directions": [dict(zip(known.keys, row, strict=True)) for row in known.directions.tolist()],
        "noise": {"process": dict(result.process), "measurement": dict(result.measurement)},
        "contributions": dict(known.contributions),
        "pulls": [asdict(pull) for pull in result.pulls],
        "prior": [
            prior_row(estimate, pull, block.prior[pull.key][1])
            for pull in result.pulls
            for estimate in result.estimates
            if pull.against == "prior" and estimate.key == pull.key
        ],
        "sensitivity": [asdict(sensitivity) for sensitivity in result.sensitivities],
        "nuisance": {name: asdict(value) for name, value in result.nuisances.items()},
        "steps": result.measured.count,
        "rms_residual": dict(result.rms_residual),
        "chi_square_per_dof": result.chi_square_per_dof,
        "gait": {name: asdict(value) for name, value in result.gait.items()},
        "leg_differences": [asdict(difference) for difference in result.leg_differences],
        "other_leg_differences": [asdict(difference) for difference in result.other_differences],
        "first_leg": None if result.first_leg is None else asdict(result.first_leg),
        "measured_spectral_radius": None if result.measured_radius is None else asdict(result.measured_radius),
        "models": [{**asdict(model), "reason": "; ".join(model.reasons)} for model in result.models],
        "reference_masses_kg": reference_masses(config, [estimate.key for estimate in result.estimates], result.model),
    }
    groups = {"estimates": rows_group(estimates, LABELS, "row", "row"), "steps": step_group(result)}
    covariance = Variable(known.covariance, ("row", "column"), "1", "covariance, in the keys' units")
    groups["covariance"] = Group({"covariance": covariance})
    moves = worst_moves(known)
    if moves is not None:
        meaning = "standard deviations of the two worst-determined combinations, in the keys' units, the worst first"
        groups["worst"] = Group({"moves": Variable(moves, ("combination", "parameter"), "1", meaning)})
    if result.measured.sampled:
        groups["samples"] = sample_group(result)
        groups |= motions(identified_config(config, result), result)
    return Content(groups, summary)


def prior_row(estimate: Estimate, pull: Pull, sigma: float) -> dict[str, Any]:
    """Return the row of a prior. Its distance from the walk's own estimate is in standard errors of the difference."""
    return {
        "key": pull.key,
        "value": pull.value,
        "standard_deviation": sigma,
        "unit": estimate.unit,
        "distance": pull.standard_deviations,
    }


def worst_moves(known: Information) -> Floats | None:
    """Return changes of one standard deviation along the two combinations of parameters that the walk determines worst.

    The changes (2, parameters) are independent of each other and in the keys' units. The worst determined one is first.
    Returns None if the walk determines fewer than two combinations.
    """
    worst = known.directions[~is_open(known.singular_values)][-2:]
    if len(worst) < 2:
        return None
    variances, axes = np.linalg.eigh(worst @ (known.covariance / np.outer(known.scales, known.scales)) @ worst.T)
    moves = np.sqrt(np.maximum(variances, 0.0))[:, None] * (axes.T @ worst) * known.scales
    return np.asarray(moves[::-1])


def step_group(result: Identification) -> Group:
    """Build the group of measured and predicted step quantities, with the standard deviations of their differences."""
    columns = numbered(result.measured.count, "step", "step")
    for table in result.tables:
        parts = {"measured": table.measured, "predicted": table.predicted, "deviation": table.deviation}
        for name, values in parts.items():
            unit = unit_by_name(table.quantity)
            columns[f"{name}_{table.quantity}"] = Variable(values, ("step",), unit, f"{name} {table.quantity}")
    return Group(columns)


def angle_residuals(result: Identification) -> Floats:
    """Return the measured minus the predicted angles (samples, 2), given the most probable floor heights."""
    return result.fitted.residuals[-result.measured.angles_rad.size :].reshape(-1, 2)


def sample_group(result: Identification) -> Group:
    """Build the group of angle residuals (swing leg, stance leg) over the phase of a step."""
    measured = result.measured
    swing_first = reorder_by_leg(angle_residuals(result), 1 - measured.step % 2)
    phase = Variable(measured.phase, ("sample",), "1", "elapsed fraction of the step's period")
    step = Variable(measured.step, ("sample",), "1", "index of the step")
    residual = Variable(swing_first, ("sample", "leg"), "rad", "measured minus predicted angle")
    return Group({"phase": phase, "of_step": step, "residual_rad": residual})


def identified_config(config: IdentifyConfig, result: Identification) -> IdentifyConfig:
    parameters = [parameter_of(estimate.key, config) for estimate in result.estimates]
    changed = config_with(config, parameters, [estimate.value for estimate in result.estimates])
    assert changed is not None, "estimates give a valid walker"
    return changed


def motions(config: IdentifyConfig, result: Identification) -> dict[str, Group]:
    """Build the identified and measured motions of the first steps, or an empty mapping for kneed walkers,
    because their shank angles are not read.

    Both motions use the identified footholds and the same phases. Angles are corrected for sensor offset and gain.

    config  config of the identified walker
    """
    measured = result.measured
    walker = rigid_walker(config)
    # In the motion player, leg 1 is the one that swings first.
    walker = walker.exchanged if measured.first_leg == LEGS[1] else walker
    walk = result.walk
    sensors = result.sensors
    if walker.kneed or walker.exchanged.kneed:
        return {}
    shown = np.flatnonzero(measured.step < SHOWN_STEPS)
    sides = np.flatnonzero(np.diff(measured.step[shown])) + np.array([[0], [1]])
    every = max(1, shown.size // SHOWN_SAMPLES)
    rows = np.union1d(shown[::every], shown[sides])
    step = measured.step[rows]
    stance = 1 - measured.step[rows] % 2
    residuals = angle_residuals(result)[rows] / sensors[GAIN]
    seen = (measured.angles_rad[rows] - sensors[OFFSET]) / sensors[GAIN]
    along, touches = (np.append(0.0, np.cumsum(each)) for each in (walk.lengths_m, walk.durations_s))
    time = touches[step] + measured.phase[rows] * walk.durations_s[step]
    set_down = np.append((seen - residuals)[0, 1], walk.angles_rad)
    footholds = FootholdsOfWalk(along, result.fitted.heights_m[: along.size], set_down)
    about = {"slope_rad": config.slope_rad, "leg_m": config.walker.leg_length_m}
    about["foot_radius_m"] = config.walker.foot_radius_m
    groups = {}
    for name, angle in (("identified", seen - residuals), ("measured", seen)):
        bodies = np.zeros((rows.size, len(walker.arm_x)))
        bodies[:, :2] = reorder_by_leg(angle, stance)
        straight = np.array([apply_couplings(walker, STRAIGHT, row) for row in bodies])
        variables = {**variables_over_time(time=time, step=step, stance_leg=stance + 1, angle=angle), **leg_labels()}
        variables |= place_variables(places(walker, (), footholds, straight, step), stance)
        groups[f"{name}_motion"] = Group(variables, about)
    return groups


def reference_masses(config: IdentifyConfig, keys: Sequence[str], model: str) -> dict[str, float]:
    """Return the masses that were taken from the config, not fitted. The estimated masses are relative to them."""
    # The contact model needs no reference, because the stiffness sets the scale of mass.
    if model != "rigid" or not any(key.endswith("mass_kg") for key in keys):
        return {}
    fields = (".".join(("walker", *path)) for path, _ in leaves(type(config.walker), held=config.walker))
    masses = {key: value_at(config, key.split(".")) for key in fields if key.endswith("mass_kg") and key not in keys}
    return {key: float(value) for key, value in masses.items() if value}
