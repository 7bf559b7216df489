"""The periodic gaits of the rigid model, with the corrected equations and with those that the paper prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from walkerlab.config.reads import FixedPointConfig, RigidConfig
from walkerlab.errors import NoAnswer
from walkerlab.orbits.fixed_point import GaitSearch, find_gaits
from walkerlab.orbits.gait import Gait
from walkerlab.scene.rigid import coordinates, equation_sets, rigid_walker
from walkerlab.stages.progress import Progress
from walkerlab.store.content import Content, Group, Variable

GAIT = ("gait",)
# of each gait: key, attribute, unit, meaning
COLUMNS = (
    ("period_s", "period", "s", "duration of a step"),
    ("step_length_m", "step_length", "m", "length of a step along the slope"),
    ("spectral_radius", "spectral_radius", "1", "largest magnitude of a multiplier"),
    ("stable", "stable", "1", "whether small disturbances die out"),
    ("residual", "residual", "rad", "what is left of P(x) - x, velocities times sqrt(L/g)"),
    ("energy_J", "energy", "J", "time mean of the energy from the stance foot"),
    ("energy_drift_J", "energy_drift", "J", "spread of the energy within the swing"),
    ("min_normal_force_N", "min_normal_force", "N", "least normal force on the stance foot"),
    ("max_friction_ratio", "max_friction_ratio", "1", "largest ratio of tangential to normal force"),
    ("max_scuff_depth_m", "max_scuff_depth", "m", "depth of the swing foot below the slope"),
)


def run(config: FixedPointConfig, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Find the gaits of both sets of equations; raises NoAnswer if those of the config have none to walk."""
    sets = equation_sets(config)
    progress.start("fixedpoint", len(sets))
    searches: dict[str, GaitSearch] = {}
    for equations in sets:
        searches[equations] = find_gaits(rigid_walker(config, equations), config.seed)
        progress.advance()
    chosen = searches[config.equations]
    content = Content(
        {f"{name}/gaits": gaits_group(search, config) for name, search in searches.items() if search.gaits},
        summary(config, searches),
    )
    if chosen.gait is None:
        raise NoAnswer(f"no gait at a slope of {config.slope_rad:.4g} rad: {chosen.reason}", advice(config), content)
    return content


def advice(config: RigidConfig) -> str:
    """What to do about a slope without a gait."""
    walk_anyway = (
        f"to walk there all the same, give a start state (start: [{', '.join(coordinates(config))}]), and the "
        "contact model a pitch of its pads (contact.pad_pitch: a number)"
    )
    if config.slope_rad <= 0.0:
        return f"Let the slope descend in walking direction (slope_deg above 0); {walk_anyway}."
    return f"Try a gentler slope, or a walker with more of its mass at the hip; {walk_anyway}."


def summary(config: RigidConfig, searches: Mapping[str, GaitSearch]) -> dict[str, Any]:
    """What the command prints: the chosen gait of the config's equations, and both sets side by side."""
    sets = {name: set_summary(name, config.slope_rad, search) for name, search in searches.items()}
    return {**sets[config.equations], "state_names": list(coordinates(config)), "equation_sets": sets}


def set_summary(equations: str, slope: float, search: GaitSearch) -> dict[str, Any]:
    """The chosen gait of one set of equations, if there is one, and how the search went."""
    found: dict[str, Any] = {} if search.gait is None else gait_summary(search.gait)
    return {
        **found,
        "equations": equations,
        "slope_rad": slope,
        "gaits_found": len(search.gaits),
        "gaits": [listed(search, index) for index in range(len(search.gaits))],
        "reason": search.reason,
        "random_starts": search.random_starts,
        "random_hits": list(search.random_hits),
        "lost": list(search.lost),
    }


def listed(search: GaitSearch, index: int) -> dict[str, Any]:
    """One of the gaits found, and why it was or was not chosen."""
    gait = search.gaits[index]
    of_gait = gait_summary(gait)
    return {**of_gait, "chosen": index == search.chosen, "objection": "; ".join(gait.objections)}


def gait_summary(gait: Gait) -> dict[str, Any]:
    """One gait in SI units."""
    knee = {} if gait.knee_strike is None else {"knee_strike_s": gait.knee_strike}
    return {
        **knee,
        "state": list(gait.state),
        "multipliers": [[value.real, value.imag] for value in gait.multipliers],
        **{key: getattr(gait, attribute) for key, attribute, _, _ in COLUMNS},
        "found_by": list(gait.found_by),
    }


def gaits_group(search: GaitSearch, config: RigidConfig) -> Group:
    """Every gait found, one row each."""
    gaits = search.gaits
    states = np.array([gait.state for gait in gaits])
    multipliers = np.array([gait.multipliers for gait in gaits])
    found_by = np.array(["; ".join(gait.found_by) for gait in gaits])
    objections = np.array(["; ".join(gait.objections) for gait in gaits])
    variables = {
        "gait": Variable(np.arange(len(gaits)), GAIT, "1", "gait, shortest period first"),
        "coordinate": Variable(np.array(coordinates(config)), ("coordinate",), "", "coordinate of the state"),
        "state": Variable(states, ("gait", "coordinate"), "rad, rad/s", "state just after heel strike"),
        "multiplier_real": Variable(multipliers.real, ("gait", "multiplier"), "1", "multiplier, real part"),
        "multiplier_imag": Variable(multipliers.imag, ("gait", "multiplier"), "1", "multiplier, imaginary part"),
        "random_hits": Variable(np.array(search.random_hits), GAIT, "1", "random starting values that led here"),
        "found_by": Variable(found_by, GAIT, "", "searches that led here"),
        "objections": Variable(objections, GAIT, "", "why the gait cannot be walked"),
    }
    for key, attribute, units, text in COLUMNS:
        variables[key] = Variable(np.array([getattr(gait, attribute) for gait in gaits]), GAIT, units, text)
    attrs: dict[str, Any] = {
        "slope_rad": config.slope_rad,
        "reason": search.reason,
        "random_starts": search.random_starts,
    }
    if gaits[0].knee_strike is not None:
        times = np.array([gait.knee_strike for gait in gaits])
        variables["knee_strike_s"] = Variable(times, GAIT, "s", "time of the knee strike after the heel strike")
    return Group(variables, attrs if search.chosen is None else {**attrs, "chosen": search.chosen})
