"""Headline quantities of each stage's summary, and the quantities that a sweep can record."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, Final

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
"""Headline quantities of each stage; a name that ends in a dot covers all quantities below it."""
MOST: Final = 13
OF_WALKS: Final = (
    "work_per_step_J.", "numerical_error.", "end_time_s", "rhs_evaluations", "accepted_steps", "rejected_steps",
    "energy_balance_residual_J", "slope_rad", "repeats_after", "leaves_gait_at",
)  # fmt: skip
QUANTITIES: Final[Mapping[str, tuple[str, ...]]] = {
    "fixedpoint": (
        *HEADLINES["fixedpoint"], "residual", "energy_drift_J", "min_normal_impulse_N_s", "max_impulse_ratio",
        "work_per_step_J.", "random_starts", "slope_rad", "gaits.", "equation_sets.",
    ),
    "simulate": (*HEADLINES["simulate"], *OF_WALKS, "lost_in_strikes_J"),
    "contact-sim": (
        *HEADLINES["contact-sim"], *OF_WALKS, "rolling_per_step_m", "dissipated_J.", "jacobians", "pitch_m",
    ),
}  # fmt: skip
"""All numeric quantities that each of these stages may have at a point of a sweep, in the notation of `HEADLINES`."""
LAST_OF: Final[Mapping[str, str]] = {"last_step_period_s": "step_periods_s", "last_step_length_m": "step_lengths_m"}
"""Headlines that are the last entry of a list, each with the name of its list."""


def headlines(stage: str, names: Iterable[str]) -> list[str]:
    """Return the names of a stage's headline quantities in order; for an unlisted stage, its first quantities.

    names  dotted names of all its quantities
    """
    unique = list(dict.fromkeys(names))
    if stage not in HEADLINES:
        return [name for name in unique if "." not in name][:MOST]
    matches = ([name for name in unique if stands_for(entry, name)] for entry in HEADLINES[stage])
    return list(chain(*matches))[:MOST]


def stands_for(entry: str, name: str) -> bool:
    """Whether an entry of `HEADLINES` or `QUANTITIES` covers a quantity."""
    return name == entry or (entry.endswith(".") and name.startswith(entry))


def has_quantity(stage: str, name: str) -> bool:
    """Whether a stage may have a quantity of that name; always true for an unlisted stage."""
    return stage not in QUANTITIES or any(stands_for(entry, name) for entry in QUANTITIES[stage])


def claims(compared: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    """Return the study's published values with their verdicts; empty if the scene departs from the study's.

    compared  summary of `compare`; empty if it has no result
    """
    judged: Sequence[Mapping[str, Any]] = compared.get("paper_numbers", ())
    return () if compared.get("departures") else judged
