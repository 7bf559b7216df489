"""Estimate parameters of a walker from a measured walk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import combinations
from typing import TYPE_CHECKING, Final, cast

import numpy as np

from walkerlab.config.fields import leaves, value_at
from walkerlab.config.identify import Identify
from walkerlab.config.reads import IdentifyConfig
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.labels import Label, unit_by_name
from walkerlab.physics.estimation.measurements import MeasuredAngles, MeasuredSteps
from walkerlab.physics.estimation.result import Identification
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.estimated import models_of, question_of, refuse_keys, refuse_model
from walkerlab.pipeline.stages.measured_walk import read_measured
from walkerlab.pipeline.store.columns import numbered, rows_group
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.scene.identification import identify_walk

if TYPE_CHECKING:
    from walkerlab.config.schema import Config

LABELS: Final = {
    "key": Label("", "parameter of the config"),
    "value": Label("SI", "estimate, in the unit of the key"),
    "standard_error": Label("SI", "standard error; absent where the walk leaves the parameter open"),
    "start": Label("SI", "value in the config"),
}
FEWER: Final = "Fit fewer parameters, add what was weighed (--prior), or start nearer to the walk (--set)."


def run(config: IdentifyConfig, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Fit the measured walk; raises ConfigError for an invalid question or file, NoAnswer if no fit converges."""
    refuse(config)
    block = config.identify
    assert block is not None, "refuse rejects a config without the block"
    measured = read_measured(block, config)
    progress.start("identify")
    gait, models = inputs["fixedpoint"].summary, models_of(block)
    result = identify_walk(cast("Config", config), measured, gait, question_of(block), models, progress.note)
    content = content_of(config, result, measured)
    verdict = next(model for model in result.models if model.model == result.model)
    if verdict.fit == "not-converged":
        raise NoAnswer(f"the fit of the {verdict.model} model did not converge: {verdict.reason}", FEWER, content)
    return content


def refuse(config: IdentifyConfig) -> None:
    """Raise ConfigError for an invalid question, or a file without a walk."""
    block = config.identify or Identify()
    if not block.data or not block.fit:
        raise ConfigError(
            "identify needs a measured walk and a parameter to estimate.",
            "For example --data steps.csv --fit walker.hip_mass_kg --fit slope_deg.",
        )
    refuse_model(config, block)
    if block.nuisance and block.level == "steps":
        raise ConfigError(
            f"identify.nuisance: {', '.join(block.nuisance)}: only sampled angles have these.",
            "Leave out --nuisance, or give angles over time (--level angles).",
            ("identify", "nuisance"),
        )
    refuse_keys(config, block)
    measured = read_measured(block, config)
    steps = measured.steps if isinstance(measured, MeasuredAngles) else measured
    values_count = steps.count * len(steps.channels()) + (isinstance(measured, MeasuredAngles) and measured.step.size)
    if values_count + len(block.prior) <= len(block.fit):
        raise ConfigError(
            f"{block.data} holds {values_count} values, too few for {len(block.fit)} parameters.",
            "Measure more steps, or fit fewer parameters.",
        )


def content_of(config: IdentifyConfig, result: Identification, measured: MeasuredSteps | MeasuredAngles) -> Content:
    """Store estimates, steps and, of angles, residuals in phase."""
    known = result.information
    estimates = [
        {**asdict(estimate), "value": float(f"{estimate.value:.12g}"), "start": float(f"{estimate.start:.12g}")}
        for estimate in result.estimates
    ]
    summary = {
        "model": result.model,
        "estimates": estimates,
        "not_identifiable": [asdict(entry) for entry in result.not_identifiable],
        "correlations": {"keys": list(known.keys), "matrix": known.correlations.tolist()},
        "singular_values": known.singular_values.tolist(),
        "directions": [dict(zip(known.keys, row, strict=True)) for row in known.directions.tolist()],
        "noise": {"process": dict(result.process), "measurement": dict(result.measurement)},
        "contributions": dict(known.contributions),
        "steps": result.steps,
        "rms_residual": dict(result.rms_residual),
        "chi_square_per_dof": result.chi_square_per_dof,
        "gait": {name: asdict(value) for name, value in result.gait.items()},
        "models": [asdict(model) for model in result.models],
        "reference_masses_kg": reference_masses(config, [estimate.key for estimate in result.estimates], result.model),
    }
    groups = {"estimates": rows_group(estimates, LABELS, "row", "row"), "steps": step_group(result)}
    groups["covariance"] = Group(
        {"covariance": Variable(known.covariance, ("row", "column"), "1", "covariance, in the keys' units")}
    )
    determined = [place for place, row in enumerate(estimates) if row["standard_error"] is not None]
    if len(determined) > 1:
        pair = worst_pair(known.correlations, determined)
        groups["trade_off"] = Group(
            {"pair": Variable(np.array(pair), ("parameter",), "1", "indices of two parameters")}
        )
    if isinstance(measured, MeasuredAngles):
        groups["samples"] = sample_group(result, measured)
    return Content(groups, summary)


def worst_pair(correlations: Floats, determined: Sequence[int]) -> tuple[int, int]:
    """Return the indices of the two determined parameters that the walk separates worst, by their correlation."""
    return max(combinations(determined, 2), key=lambda pair: abs(float(correlations[pair])))


def step_group(result: Identification) -> Group:
    """Measured and predicted values of each step, and the standard deviation of their difference."""
    columns = numbered(result.steps, "step", "step")
    for table in result.tables:
        parts = {"measured": table.measured, "predicted": table.predicted, "deviation": table.deviation}
        for name, values in parts.items():
            unit = unit_by_name(table.quantity)
            columns[f"{name}_{table.quantity}"] = Variable(values, ("step",), unit, f"{name} {table.quantity}")
    return Group(columns)


def sample_group(result: Identification, measured: MeasuredAngles) -> Group:
    """Residuals of the angles in phase, over the most probable floor; the swing leg's first."""
    fitted = result.fitted
    residuals = (fitted.data.residuals - fitted.data.G @ fitted.heights_m)[-measured.angles_rad.size :].reshape(-1, 2)
    swing_first = np.where((measured.step % 2 == 1)[:, None], residuals[:, ::-1], residuals)
    return Group(
        {
            "phase": Variable(measured.phase, ("sample",), "1", "share of the step's period that has passed"),
            "of_step": Variable(measured.step, ("sample",), "1", "index of the step"),
            "residual_rad": Variable(swing_first, ("sample", "leg"), "rad", "measured minus predicted angle"),
        }
    )


def reference_masses(config: IdentifyConfig, keys: Sequence[str], model: str) -> dict[str, float]:
    """Return the masses that estimated masses refer to: those of the config that were not fitted.

    Empty if no mass was estimated, or for the contact model, whose stiffness sets the scale of mass.
    """
    if model != "rigid" or not any(key.endswith("mass_kg") for key in keys):
        return {}
    fields = (".".join(("walker", *path)) for path, _ in leaves(type(config.walker), held=config.walker))
    masses = {key: value_at(config, key.split(".")) for key in fields if key.endswith("mass_kg") and key not in keys}
    return {key: float(value) for key, value in masses.items() if value}
