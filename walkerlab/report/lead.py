"""What was run, in the paragraphs under the page's title."""

from __future__ import annotations

import math
from typing import Any

from walkerlab.config.schema import Config
from walkerlab.report.numbers import count, length, number, quantity
from walkerlab.report.results import Results
from walkerlab.report.tracks import leg_length

ROUND = 0.01
"""Radius of a foot, in leg lengths, above which it is called round."""


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
        f"Config {config.name}{changed}: {walker(config.walker)} on a slope of {number(config.slope_rad)} rad "
        f"({number(math.degrees(config.slope_rad), 3)}°), with the {equations(config)}. "
        f"It is to walk {count(config.strides, 'stride')} ({2 * config.strides} steps) from {start}, {models}."
    )


def walker(config: Any) -> str:
    """The walker of any type: its legs, its feet and its hip."""
    feet = getattr(config, "foot_radius_m", 0.0)
    round_feet = f" and round feet of {length(feet)}" if feet > ROUND * leg_length(config) else ""
    hip = getattr(config, "hip_mass_kg", None)
    at_hip = "" if hip is None else f" and a hip of {quantity(hip, 'kg')}"
    torso = "" if getattr(config, "torso", None) is None else ", with a torso"
    mass = getattr(config, "leg_mass_kg", None)
    legs = f"legs of {length(leg_length(config))}{round_feet}" + (
        "" if mass is None else f" and {quantity(mass, 'kg')}"
    )
    return f"a {config.type.replace('-', ' ')} walker with {legs}{at_hip}{torso}"


def equations(config: Config) -> str:
    """Which equations of motion."""
    if config.equations == "as-printed":
        return "equations of motion as the paper prints them, misprint of eq. A.5 included"
    return "corrected equations of motion"


def state(start: tuple[float, ...]) -> str:
    """Four numbers of a state."""
    return f"({', '.join(number(value) for value in start)}) rad and rad/s"
