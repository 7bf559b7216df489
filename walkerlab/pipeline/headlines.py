"""Name the headline quantities of stages and the quantities that a sweep can record, and compare two runs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

from walkerlab.config.reads import flatten

if TYPE_CHECKING:
    from walkerlab.config.schema import Config
    from walkerlab.pipeline.store.content import Content

HEADLINES: Final[Mapping[str, tuple[str, ...]]] = {
    "fixedpoint": (
        "period_s", "step_length_m", "speed_m_s", "froude", "cost_of_transport", "spectral_radius", "stable",
        "knee_strike_s", "energy_J", "min_normal_force_N", "max_friction_ratio", "max_scuff_depth_m", "gaits_found",
    ),
    "simulate": (
        "outcome", "steps", "last_step_period_s", "last_step_length_m", "speed_m_s", "froude", "cost_of_transport",
        "mean_energy_J", "min_normal_force_N", "max_friction_ratio", "max_scuff_depth_m", "energy_drift_J",
    ),
    "contact-sim": (
        "outcome", "steps", "last_step_period_s", "last_step_length_m", "speed_m_s", "froude", "cost_of_transport",
        "slip_per_step_m", "max_penetration_m", "static_penetration_m", "damping_ratio", "end_time_s",
        "energy_balance_residual_J",
    ),
    "tune": (
        "adjustment.needed", "adjustment.found", "adjustment.scale_dtheta1", "adjustment.scale_dtheta2",
        "map.walks_share", "gait.found", "gait.period_s", "gait.step_length_m", "gait.spectral_radius", "gait.slip_m",
    ),
    "compare": ("verdicts.", "outcomes.", "steps.", "orbit_distance"),
    "accuracy": ("best.",),
    "stability": ("passed", "failed"),
    "continuation": (
        "first_doubling.", "bifurcations.0.value", "bifurcations.1.value", "bifurcations.2.value",
        "cascades.0.accumulates_at", "attractors.0.aperiodic_from", "attractors.0.lost_at",
    ),
    "basin": ("share_walking", "share_walking_gaussian", "margin", "unsettled_cells", "outcomes."),
    "robustness": (
        "gaits.0.spectral_radius", "gait_sensitivity_norm.0.value", "largest_step.0.down_m", "largest_step.0.up_m",
        "largest_push.0.forward_N_s", "largest_push.0.backward_N_s", "rough_ground.0.mean_steps",
        "rough_ground.1.mean_steps", "rough_ground.2.mean_steps",
    ),
    "design": ("quantity", "value", "start_value", "best.", "evaluations", "optima"),
    "identify": (
        "estimates.", "chi_square_per_dof", "noise.process.roughness_m", "gait.period_s.value",
        "gait.spectral_radius.value",
    ),
    "plan": ("steps", "simplest."),
    "plot": (),
    "report": (),
}  # fmt: skip
"""Headline quantities of each stage. A name that ends in a dot covers all quantities below it."""
MAX_HEADLINES: Final = 13
WALK_QUANTITIES: Final = (
    "work_per_step_J.", "asymmetry.", "gait_steps.", "step_period_s", "step_length_m", "numerical_error.",
    "end_time_s", "rhs_evaluations", "accepted_steps",
    "rejected_steps", "energy_balance_residual_J", "slope_rad", "repeats_after", "leaves_gait_at",
)  # fmt: skip
QUANTITIES: Final[Mapping[str, tuple[str, ...]]] = {
    "fixedpoint": (
        *HEADLINES["fixedpoint"], "residual", "energy_drift_J", "min_normal_impulse_N_s", "max_impulse_ratio",
        "work_per_step_J.", "asymmetry.", "gait_steps.", "step_period_s", "random_starts", "slope_rad",
        "gaits.", "equation_sets.",
    ),
    "simulate": (*HEADLINES["simulate"], *WALK_QUANTITIES, "lost_in_strikes_J"),
    "contact-sim": (
        *HEADLINES["contact-sim"], *WALK_QUANTITIES, "rolling_per_step_m", "dissipated_J.", "jacobians", "pitch_m",
    ),
}  # fmt: skip
"""All quantities that a stage may compute at a point of a sweep, written as in `HEADLINES`. A stage that is not listed
may compute any."""
LAST_STEP_SOURCES: Final[Mapping[str, str]] = {
    "last_step_period_s": "step_periods_s",
    "last_step_length_m": "step_lengths_m",
}
"""For each headline that is the last entry of a list, the name of that list."""


def headlines(stage: str, names: Iterable[str]) -> list[str]:
    """Return the names of a stage's headline quantities in order, or its first quantities if the stage is not listed.

    names  dotted names of all quantities of the stage
    """
    unique = list(dict.fromkeys(names))
    if stage not in HEADLINES:
        return [name for name in unique if "." not in name][:MAX_HEADLINES]
    matches = ([name for name in unique if stands_for(entry, name)] for entry in HEADLINES[stage])
    return list(chain(*matches))[:MAX_HEADLINES]


def stands_for(entry: str, name: str) -> bool:
    """Whether an entry of `HEADLINES` or `QUANTITIES` covers a quantity."""
    return name == entry or (entry.endswith(".") and name.startswith(entry))


def has_quantity(stage: str, name: str) -> bool:
    """Whether a stage may have a quantity of that name. This is true for every name if the stage is not listed."""
    return stage not in QUANTITIES or any(stands_for(entry, name) for entry in QUANTITIES[stage])


def claims(compared: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    """Return the study's published values with their verdicts, or () if the scene differs from the study's.

    compared  summary of `compare`; empty if it has no result
    """
    judged: Sequence[Mapping[str, Any]] = compared.get("paper_numbers", ())
    return () if compared.get("departures") else judged


@dataclass(frozen=True)
class Pair:
    """Values of a quantity in two runs, and the change relative to the first value, or None if that is undefined."""

    name: str
    first: Any
    second: Any
    change: float | None


@dataclass(frozen=True)
class RunDifference:
    """Differences between two runs."""

    config: tuple[tuple[str, Any, Any], ...]  # config keys that differ, with both values as JSON
    numbers: Mapping[str, tuple[Pair, ...]]  # all values of a stage in both runs, by stage
    headlines: Mapping[str, tuple[Pair, ...]]  # the headline quantities among the pairs above, by stage
    # only_first, only_second: stages with a result in one run only
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]


def difference(
    first: "Mapping[str, Content]", second: "Mapping[str, Content]", configs: "Sequence[Config | None]"
) -> RunDifference:
    """Compare the results and configs of two runs. An unknown config counts as empty."""
    both = [name for name in first if name in second]
    keys = pairs(*({} if config is None else dict(flatten(config.model_dump(mode="json"))) for config in configs))
    return RunDifference(
        tuple((pair.name, pair.first, pair.second) for pair in keys if pair.first != pair.second),
        {name: pairs(*(dict(flatten(run[name].summary, lists=True)) for run in (first, second))) for name in both},
        {name: pairs(*(headline_values(name, run[name].summary) for run in (first, second))) for name in both},
        tuple(name for name in first if name not in second),
        tuple(name for name in second if name not in first),
    )


def pairs(first: Mapping[str, Any], second: Mapping[str, Any]) -> tuple[Pair, ...]:
    """Pair the values of two results by name."""
    both = {name: (first.get(name), second.get(name)) for name in {**first, **second}}
    return tuple(Pair(name, *values, change(*values)) for name, values in both.items())


def headline_values(stage: str, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the headline quantities of a stage's summary, by name."""
    every = dict(flatten(summary, lists=True)) | last_step_values(summary)
    return {name: every[name] for name in headlines(stage, every)}


def last_step_values(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the headlines in `LAST_STEP_SOURCES` that a summary has."""
    return {name: summary[list_name][-1] for name, list_name in LAST_STEP_SOURCES.items() if summary.get(list_name)}


def change(first: Any, second: Any) -> float | None:
    """Return the relative change from `first` to `second`, or None unless both are numbers and `first` is not 0."""
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (first, second))
    return float(second / first - 1.0) if numbers and first else None
