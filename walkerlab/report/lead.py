"""What was run, in the paragraphs under the page's title."""

from __future__ import annotations

import math
from typing import Any

from walkerlab.config.schema import Config
from walkerlab.config.walkers import is_plain_compass
from walkerlab.report.numbers import length, listed, quantity
from walkerlab.report.results import Results
from walkerlab.report.words import words


def title(run: str) -> str:
    """The page's heading."""
    return f"Passive walking: {run}"


def lead(results: Results, run: str) -> tuple[str, ...]:
    """What was run."""
    return (scene(results.config, run),)


def scene(config: Config, run: str) -> str:
    """The walker, its slope and what it was to do."""
    _, _, change = run.partition("@")
    equations = config.equations if is_plain_compass(config.walker) else ""
    said = change.replace(",", ", "), walker_in_words(config.walker), math.degrees(config.slope_rad), equations
    return words("lead.scene", config, *said)


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
