"""Describe how walks ended, and whether the cause is the walker or the ground, for example its pads."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from walkerlab.config.reads import ContactConfig
from walkerlab.config.walkers import Kneed
from walkerlab.outcome import OUTCOME_TEXTS, Outcome, outcome_of

# Explanations of the outcomes that the contact model's ground causes, other than those on pads.
GROUND_CAUSES: Final = {
    "slid": "The ground's friction ends them: contact.static_friction, contact.dynamic_friction, "
    "contact.stiction_velocity.",
    "lifted-off": "The ground throws them up, or they start too fast: contact.stiffness, contact.damping.",
}
# What each `contact.pad_pitch` means, as text that follows the length.
PITCH_SOURCES: Final = {"rigid": ", the rigid gait's step length", "own": ", the contact gait's step length"}
Range = tuple[float, float]


@dataclass(frozen=True)
class Pads:
    """Pads on which walks ended."""

    pitch_m: Range  # minimum and maximum over the walks, m
    step_m: Range | None = None  # minimum and maximum length of the last steps of the walks, m; None if unknown
    laid: str = ""  # value of `contact.pad_pitch`, if it is the same for all walks


def describe_endings(
    outcomes: Mapping[str, int], config: ContactConfig, contact: bool, pads: Pads | None = None
) -> list[dict[str, Any]]:
    """Count and describe the walks that ended early, the most frequent outcome first.

    outcomes  number of walks by outcome; other keys are ignored
    contact   whether they are walks of the contact model
    pads      pads on which the walks with the outcome off-pad ended

    Returns rows with `outcome`, `walks`, `of` (total number of walks), `ground` (whether the ground is the cause) and
    `said` (description).
    """
    total = sum(walks for outcome, walks in outcomes.items() if outcome_of(outcome) is not None)
    rows = []
    for outcome, walks in sorted(outcomes.items(), key=lambda item: -item[1]):
        ending = outcome_of(outcome)
        if ending is not None and ending is not Outcome.WALKED:
            causes = ground_causes(outcome, config, contact, pads)
            aside = "" if OUTCOME_TEXTS[ending].did == outcome else f" ({outcome})"
            description = " ".join([f"{walks:,} of {total:,} walks {OUTCOME_TEXTS[ending].did}{aside}.", *causes])
            rows.append({"outcome": outcome, "walks": walks, "of": total, "ground": bool(causes), "said": description})
    return rows


def ground_causes(outcome: str, config: ContactConfig, contact: bool, pads: Pads | None = None) -> list[str]:
    if not contact or config.contact is None:
        return []
    if outcome != "off-pad":
        return [GROUND_CAUSES[outcome]] if outcome in GROUND_CAUSES else []
    sentences = ["The pads end them, not the walker."]
    if pads is not None:
        steps = "" if pads.step_m is None else f"; their last steps were {format_range(pads.step_m)} long"
        sentences.append(f"The pads' pitch is {format_range(pads.pitch_m)}{PITCH_SOURCES.get(pads.laid, '')}{steps}.")
    other_pitch = "" if config.contact.pad_pitch == "own" else " or contact.pad_pitch=own"
    return [*sentences, f"Try {ground_without_pads(config)}{other_pitch}."]


def ground_without_pads(config: ContactConfig) -> str:
    """Return the --set text for ground without pads: plane if knees let feet clear it, otherwise after-mid-swing."""
    return f"contact.terrain={'plane' if isinstance(config.walker, Kneed) else 'after-mid-swing'}"


def format_range(lengths: Range) -> str:
    least, most = (f"{length:.3g}" for length in lengths)
    return f"{least} m" if least == most else f"{least} to {most} m"
