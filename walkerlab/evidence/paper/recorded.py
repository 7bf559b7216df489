"""Comparison of a recorded walk with the walks of both models."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from walkerlab.evidence.paper.differences import Comparison, compare_motion, motion_of, stored_variable, times_of_steps
from walkerlab.evidence.paper.measured import Characteristics, EnergyRecord, characteristics, mean_over_last_steps
from walkerlab.pipeline.stages.walk import last_step
from walkerlab.pipeline.store.content import Content, Group

MODELS = {"rigid": "simulate", "contact": "contact-sim"}


def compare_recorded(inputs: Mapping[str, Content]) -> tuple[dict[str, Group], dict[str, Any]]:
    """Return groups and summary of the recorded walk's differences from each model, or () if no walk was recorded."""
    recorded = inputs.get("recorded-walk")
    if recorded is None:
        return {}, {}
    motion = motion_of(recorded)
    compared: dict[str, Comparison] = {
        model: compare_motion(motion_of(inputs[stage]), motion, f"recorded walk less {model} model")
        for model, stage in MODELS.items()
    }
    groups = {
        f"recorded/{model}/{name}": group for model, each in compared.items() for name, group in each.groups.items()
    }
    walks = {**{model: inputs[stage] for model, stage in MODELS.items()}, "recorded": recorded}
    return groups, {
        "recorded": {
            "name": recorded.summary["name"],
            "doubts": recorded.summary["doubts"],
            "steps": {model: last_step(walk.summary) for model, walk in walks.items()},
            "table3": {model: asdict(characteristics_of(walk)) for model, walk in walks.items()},
            "differences": {model: each.summary for model, each in compared.items()},
        }
    }


def characteristics_of(walk: Content) -> Characteristics:
    """Return the quantities of Table 3 for a stored walk. The mean energy is None if energies were not stored."""
    periods, lengths = (np.array(walk.summary[key]) for key in ("step_periods_s", "step_lengths_m"))
    energy = stored_energy(walk)
    return characteristics(periods, lengths, None if energy is None else energy.mean)


def stored_energy(walk: Content) -> EnergyRecord | None:
    """Return the energy of a stored walk over its last steps, or None if energies were not stored."""
    joules = stored_variable(walk, "trajectory", "mechanical_J")
    if joules is None:
        return None
    return mean_over_last_steps(walk["trajectory"]["time"], joules, times_of_steps(walk, "touch_time_s"))
