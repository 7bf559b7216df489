"""Describe how walks ended and whether the ground is the cause: pads that end a walk do not limit the walker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from walkerlab.config.walkers import Kneed
from walkerlab.outcome import TOLD, Outcome, outcome_of

if TYPE_CHECKING:
    from walkerlab.config.reads import ContactConfig

GROUNDS: Final = {
    "slid": "The ground's friction ends them: contact.static_friction, contact.dynamic_friction, "
    "contact.stiction_velocity.",
    "lifted-off": "The ground throws them off, or they start too fast: contact.stiffness, contact.damping.",
}
"""What of the contact model's ground has to do with an outcome, beside pads."""
LAID: Final = {
    "rigid": ", the rigid gait's step length",
    "own": ", the contact gait's step length",
}
"""What `contact.pad_pitch` lays the pads for."""
Range = tuple[float, float]


@dataclass(frozen=True)
class Pads:
    """Pads on which walks ended.

    pitch_m  minimum and maximum over the walks, m
    step_m   minimum and maximum length of their last steps, m; None if unknown
    laid     the config's `contact.pad_pitch`, if all have the same
    """

    pitch_m: Range
    step_m: Range | None = None
    laid: str = ""


def endings(
    outcomes: Mapping[str, int], config: ContactConfig, contact: bool, pads: Pads | None = None
) -> list[dict[str, Any]]:
    """Count and describe the walks that ended early, the most frequent outcome first.

    outcomes  number of walks by outcome; other keys are ignored
    contact   whether the contact model walked
    pads      on which walks ended off-pad

    Returns rows of `outcome`, `walks`, `of` (their total), `ground` (whether it is a cause) and `said` (the
    description).
    """
    total = sum(walks for outcome, walks in outcomes.items() if outcome_of(outcome) is not None)
    rows = []
    for outcome, walks in sorted(outcomes.items(), key=lambda one: -one[1]):
        known = outcome_of(outcome)
        if known is not None and known is not Outcome.WALKED:
            why = causes(outcome, config, contact, pads)
            aside = "" if TOLD[known].did == outcome else f" ({outcome})"
            said = " ".join([f"{walks:,} of {total:,} walks {TOLD[known].did}{aside}.", *why])
            rows.append({"outcome": outcome, "walks": walks, "of": total, "ground": bool(why), "said": said})
    return rows


def causes(outcome: str, config: ContactConfig, contact: bool, pads: Pads | None = None) -> list[str]:
    """Return sentences on how the ground caused an outcome; empty if it did not."""
    if not contact or config.contact is None:
        return []
    if outcome != "off-pad":
        return [GROUNDS[outcome]] if outcome in GROUNDS else []
    told = ["The pads end them, not the walker."]
    if pads is not None:
        steps = "" if pads.step_m is None else f"; their last steps were {metres(pads.step_m)} long"
        told.append(f"The pads' pitch is {metres(pads.pitch_m)}{LAID.get(pads.laid, '')}{steps}.")
    own = "" if config.contact.pad_pitch == "own" else " or contact.pad_pitch=own"
    return [*told, f"Try {without_pads(config)}{own}."]


def without_pads(config: ContactConfig) -> str:
    """Return the setting for ground without pads; kneed legs clear a plane."""
    return f"contact.terrain={'plane' if isinstance(config.walker, Kneed) else 'after-mid-swing'}"


def metres(lengths: Range) -> str:
    least, most = (f"{one:.3g}" for one in lengths)
    return f"{least} m" if least == most else f"{least} to {most} m"
