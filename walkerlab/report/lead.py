"""What was run, in the paragraphs under the page's title."""

from __future__ import annotations

import math
from typing import Any

from walkerlab.config.reads import RigidConfig
from walkerlab.config.schema import Config
from walkerlab.config.walkers import is_plain_compass
from walkerlab.report.numbers import count, length, listed, number, quantity
from walkerlab.report.results import Results


def title(run: str) -> str:
    """The page's heading."""
    return f"Passive walking: {run}"


def lead(results: Results, run: str) -> tuple[str, ...]:
    """What was run."""
    return (scene(results.config, run),)


def scene(config: Config, run: str) -> str:
    """The walker, its slope and what it was to do."""
    _, _, change = run.partition("@")
    changed = f", changed by {change.replace(',', ', ')}" if change else ""
    start = "its periodic gait" if config.start == "fixed-point" else f"the state {state(config.start)}"
    models = "as a rigid model alone" if config.contact is None else "as a rigid model and as one with contact"
    return (
        f"Config {config.name}{changed}: {walker_in_words(config.walker)}, on a slope of "
        f"{number(config.slope_rad)} rad ({number(math.degrees(config.slope_rad), 3)}°){equations(config)}. "
        f"It is to walk {count(config.strides, 'stride')} ({2 * config.strides} steps) from {start}, {models}."
    )


LEGS = {"straight-legs": "straight legs", "kneed": "kneed legs", "parts": "legs"}
"""What kind of legs a type of walker has."""


def walker_in_words(walker: Any) -> str:
    """Kind, size and mass of a walker."""
    torso = [] if walker.torso is None else [f"a torso of {quantity(walker.torso.mass_kg, 'kg')}"]
    if walker.type == "compass":
        hip = f"a hip of {quantity(walker.hip_mass_kg, 'kg')}"
        legs = f"legs of {length(walker.leg_length_m)} and {quantity(walker.leg_mass_kg, 'kg')} each"
        return f"a compass walker with {listed([legs, hip, *torso])}"
    legs = f"{LEGS[walker.type]} of {length(walker.leg_length_m)}"
    feet = f"feet of radius {length(walker.foot_radius_m)}" if walker.foot_radius_m else "point feet"
    whole = quantity(walker.total_mass_kg, "kg")
    return f"a walker with {listed([legs, feet, *torso])}, {whole} in all"


def equations(config: RigidConfig) -> str:
    """Which equations of motion, where there is more than one set of them."""
    if not is_plain_compass(config.walker):
        return ""
    if config.equations == "as-printed":
        return ", with the equations of motion as the paper prints them, misprint of eq. A.5 included"
    return ", with the corrected equations of motion"


def state(start: tuple[float, ...]) -> str:
    """Four numbers of a state."""
    return f"({', '.join(number(value) for value in start)}) rad and rad/s"
