"""Find the periodic gaits of the rigid model, with the corrected equations and with those printed in the paper."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from walkerlab.config.drives import drives_of, push_offs, springs_of
from walkerlab.config.reads import FixedPointConfig, RigidConfig
from walkerlab.errors import NoAnswer
from walkerlab.labels import Label
from walkerlab.physics.orbits.fixed_point import GaitSearch, RigidGait, find_gaits
from walkerlab.pipeline.progress import Progress, track
from walkerlab.pipeline.store.content import Content, Group, Variable, real_and_imaginary, rows_group, values_by_column
from walkerlab.scene.rigid import rigid_walker, state_names
from walkerlab.scene.studies import equation_sets

GAIT = "gait"
NUMBERS = {
    "period": Label("s", "duration of a step", name="period_s"),
    "step_length": Label("m", "length of a step along the slope", name="step_length_m"),
    "spectral_radius": Label("1", "largest magnitude of a multiplier"),
    "stable": Label("1", "whether small disturbances die out"),
    "residual": Label("rad", "residual P(x) - x, velocities times sqrt(L/g)"),
    "energy": Label("J", "time-averaged energy, with heights from the stance foothold", name="energy_J"),
    "energy_drift": Label("J", "range of the energy within the swing", name="energy_drift_J"),
    "speed": Label("m/s", "step length over period", name="speed_m_s"),
    "froude": Label("1", "speed over sqrt(g L), L the leg length"),
    "cost_of_transport": Label("1", "work spent divided by weight times distance"),
    "min_normal_force": Label("N", "minimum normal force on the stance foot", name="min_normal_force_N"),
    "max_friction_ratio": Label("1", "largest ratio of tangential to normal force"),
    "min_normal_impulse": Label(
        "N s", "minimum normal impulse of the ground in a heel or knee strike", name="min_normal_impulse_N_s"
    ),
    "max_impulse_ratio": Label("1", "largest ratio of tangential to normal impulse in a strike"),
    "max_scuff_depth": Label("m", "largest depth of the swing foot below the slope", name="max_scuff_depth_m"),
}
"""Labels of the fields of `RigidGait` that are stored and printed, by field."""
KNEE_LABELS = {"knee_strike": Label("s", "time of the knee strike after the heel strike", name="knee_strike_s")}
STATE = Label("rad, rad/s", "state just after heel strike", ("coordinate",))


def run(config: FixedPointConfig, _inputs: Mapping[str, Content], progress: Progress, again: bool = True) -> Content:
    """Find the gaits of each set of equations.

    again  whether to suggest nearby gaits if none is found, which takes a second

    Raises NoAnswer if the set of equations in the config has no physical gait.
    """
    sets = equation_sets(config)
    searches: dict[str, GaitSearch] = {
        equations: find_gaits(rigid_walker(config, equations), config.seed)
        for equations in track(progress, "fixedpoint", len(sets), sets)
    }
    chosen = searches[config.equations]
    groups = {f"{name}/gaits": gaits_group(search, config) for name, search in searches.items() if search.gaits}
    content = Content(groups, summary(config, searches))
    if chosen.gait is None:
        nothing = "no gait was found" if chosen.random_starts and not chosen.gaits else "no gait"
        message = f"{nothing} at a slope of {config.slope_rad:.4g} rad: {chosen.reason}"
        nearby = suggest_nearby(config) if again else ""
        raise NoAnswer(message, f"{nearby} {advice(config)}".strip(), content)
    return content


def suggest_nearby(config: RigidConfig) -> str:
    # Imported here, because it is needed only if no gait is found.
    from walkerlab.scene.gait_suggestions import suggest_gaits

    return suggest_gaits(config)


def advice(config: RigidConfig) -> str:
    """Return what to try on a slope without a gait."""
    walk_anyway = (
        f"to walk on this slope anyway, give a start state (start: [{', '.join(state_names(config))}]), and "
        "for the contact model's pads their pitch (contact.pad_pitch: a number)"
    )
    drives = "push_off.impulse_N_s or walker.hip.torque_N_m"
    if any(push_offs(config.push_off)) or config.walker.hip.torque_N_m:
        tried = f"The drive may be too strong or too weak on this slope: try another {drives}"
    elif config.slope_rad <= 0.0:
        tried = f"Let the slope descend in the walking direction (slope_deg above 0), or drive the walker ({drives})"
    else:
        tried = "Find gaits on other slopes with `walkerlab continuation`"
    return f"{tried}; {walk_anyway}."


def summary(config: RigidConfig, searches: Mapping[str, GaitSearch]) -> dict[str, Any]:
    """Summarise the chosen gait of the config's equations, and the gaits of each set of equations."""
    sets = {}
    for equations, search in searches.items():
        gaits = [
            {**gait_summary(gait), "chosen": index == search.chosen, "objection": "; ".join(gait.objections)}
            for index, gait in enumerate(search.gaits)
        ]
        sets[equations] = {
            **({} if search.gait is None else gait_summary(search.gait)),
            "equations": equations,
            "slope_rad": config.slope_rad,
            "gaits_found": len(gaits),
            "gaits": gaits,
            "reason": search.reason,
            "sought": search.method,
            "random_starts": search.random_starts,
            "random_hits": list(search.random_hits),
            "lost": list(search.lost),
        }
    driven = {"driven_by": list(drives_of(config)), "springs": list(springs_of(config))}
    return {**sets[config.equations], **driven, "state_names": list(state_names(config)), "equation_sets": sets}


def labels_of_gait(gait: RigidGait) -> dict[str, Label]:
    """Return the labels of a gait's quantities, including the time of the knee strike for walkers with knees."""
    return NUMBERS if gait.knee_strike is None else NUMBERS | KNEE_LABELS


def gait_summary(gait: RigidGait) -> dict[str, Any]:
    """Summarise one gait in SI units."""
    return {
        "state": list(gait.state),
        **({"multipliers": pairs_of(gait.multipliers)} if gait.multipliers else {}),
        "stride_multipliers": pairs_of(gait.stride_multipliers),
        "gait_steps": [{"period_s": period, "length_m": length} for period, length in gait.steps],
        "asymmetry": gait.asymmetry,
        **values_by_column(gait, labels_of_gait(gait)),
        "step_period_s": gait.period,
        "work_per_step_J": gait.work,
        "found_by": list(gait.found_by),
    }


def pairs_of(multipliers: Sequence[complex]) -> list[list[float]]:
    return [[value.real, value.imag] for value in multipliers]


def gaits_group(search: GaitSearch, config: RigidConfig) -> Group:
    """Build the group of all gaits, one row each."""
    gaits = search.gaits
    differ = not gaits[0].multipliers
    multipliers = [gait.stride_multipliers if differ else gait.multipliers for gait in gaits]
    text = "multiplier of a stride" if differ else "multiplier"
    found_by = np.array(["; ".join(gait.found_by) for gait in gaits])
    objections = np.array(["; ".join(gait.objections) for gait in gaits])
    labels = {"state": STATE, **labels_of_gait(gaits[0])}
    variables = {
        **rows_group(gaits, labels, GAIT, "gait, shortest period first").variables,
        **real_and_imaginary("multiplier", multipliers, (GAIT, "multiplier"), text),
        "coordinate": Variable(np.array(state_names(config)), ("coordinate",), "", "coordinate of the state"),
        "random_hits": Variable(np.array(search.random_hits), (GAIT,), "1", "random starts that found this gait"),
        "found_by": Variable(found_by, (GAIT,), "", "searches that found this gait"),
        "objections": Variable(objections, (GAIT,), "", "why the gait is not physical"),
    }
    chosen: dict[str, Any] = {} if search.chosen is None else {"chosen": search.chosen}
    sought: dict[str, Any] = {"reason": search.reason, "random_starts": search.random_starts}
    return Group(variables, {"slope_rad": config.slope_rad, **sought, **chosen})
