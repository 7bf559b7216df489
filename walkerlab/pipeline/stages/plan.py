"""Find the measurements, and the numbers of steps, that would determine parameters of the walker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from walkerlab.config.analyses import Plan
from walkerlab.config.identify import Identify
from walkerlab.config.reads import PlanConfig
from walkerlab.errors import ConfigError
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.estimated import refuse_keys, refuse_model
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.scene.measurement_plan import WayToMeasure, plan_measurements
from walkerlab.scene.parameter import parameter_of

if TYPE_CHECKING:
    from walkerlab.config.schema import Config

ERROR_DIMENSIONS: Final = ("measurement", "steps", "parameter")


def run(config: PlanConfig, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Predict the errors of several ways to measure a walk.

    Raises ConfigError for an invalid request.
    """
    refuse(config)
    block = cast("Identify", config.identify)
    plan = config.plan or Plan()
    progress.start("plan")
    if block.data:
        progress.note(f"a plan needs no measured walk: {block.data} is not read")
    gait = inputs["fixedpoint"].summary
    options = plan_measurements(cast("Config", config), gait, block, plan, progress.note)
    keys = tuple(options[0].errors)
    units = {key: parameter_of(key, config).unit for key in keys}
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


def refuse(config: PlanConfig) -> None:
    """Raise ConfigError for an invalid `plan` or `identify` block."""
    block = config.identify or Identify()
    plan = config.plan or Plan()
    if not block.fit:
        raise ConfigError("a plan needs a parameter to estimate.", "For example --fit walker.hip_mass_kg.")
    if block.model == "both":
        raise ConfigError("identify.model is both, but a plan is for one model.", "Choose --model rigid or contact.")
    refuse_model(config, block)
    refuse_keys(config, block)
    for key in plan.errors:
        if key not in block.keys:
            raise ConfigError(
                f"plan.errors: {key} is not estimated.", f"Name one of {', '.join(block.keys)}, or add --fit {key}.",
                ("plan", "errors"),
            )  # fmt: skip
    if plan.steps > plan.max_steps:
        raise ConfigError(
            f"plan.steps: {plan.steps} exceeds plan.max_steps, {plan.max_steps}.", "Raise plan.max_steps.",
            ("plan", "steps"),
        )  # fmt: skip


def row_of(option: WayToMeasure, units: Mapping[str, str], wanted: Mapping[str, float]) -> dict[str, Any]:
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


def curves_of(options: Sequence[WayToMeasure], keys: Sequence[str]) -> Group:
    """Build the group of errors by number of steps, with missing values for undetermined parameters."""
    counts = list(options[0].curve)
    errors = [[[option.curve[count][key] for key in keys] for count in counts] for option in options]
    return Group(
        {
            "steps": Variable(np.array(counts), ("steps",), "1", "number of measured steps"),
            "standard_error": Variable(
                np.array(errors, float),
                ERROR_DIMENSIONS,
                "SI",
                "standard error in the key's unit; missing if the walk does not determine it",
                missing=True,
            ),
        }
    )
