"""Texts for the models, for the outcomes of walks and for their numerical errors."""

from collections.abc import Mapping
from typing import Any

from walkerlab.labels import join_words
from walkerlab.outcome import OUTCOME_TEXTS, Outcome, outcome_of
from walkerlab.views.report.numbers import count, quantity
from walkerlab.views.report.tables import Tone

RIGID_STAGE, CONTACT_STAGE = "simulate", "contact-sim"
MODEL_NAMES = {RIGID_STAGE: "Rigid model", CONTACT_STAGE: "Contact model"}
"""Stages that simulate a walk, with the name of the model."""

WALKED_LABEL = Outcome.WALKED.label


def ends(outcome: str) -> str:
    """Describe how a walk ends. An outcome unknown to this version keeps its name."""
    ending = outcome_of(outcome)
    return f"ends as {outcome}" if ending is None else OUTCOME_TEXTS[ending].does


def walks(steps: int, outcome: str) -> str:
    """Describe how far a walker gets, as the predicate of a sentence about it."""
    if outcome == WALKED_LABEL:
        return f"walks all {count(steps, 'step')}"
    return f"walks {count(steps, 'step')} and then {ends(outcome)}" if steps else f"{ends(outcome)} in its first step"


def tone(outcome: str) -> Tone:
    return "good" if outcome == WALKED_LABEL else "bad"


DEFAULT_CHECK = "a hundred times tighter tolerances"
"""Default tolerances of the second walk that measures the error."""
ERRORS = {
    "step_period_s": ("in period", "s"),
    "step_length_m": ("in step length", "m"),
    "slip_m": ("in slip", "m"),
    "rolling_m": ("in rolling distance", "m"),
    "knee_strike_time_s": ("in knee-strike time", "s"),
    "end_time_s": ("in end time", "s"),
    "cost_of_transport": ("in cost of transport", "1"),
}
"""Text and unit of each quantity that has a numerical error."""


MUCH_SMALLER = 0.01
"""Ratio of the last step's error to the largest one below which the answer gives both."""


def describe_error(error: Mapping[str, Any]) -> str:
    """Describe the numerical errors of a walk and how they were measured."""
    if "reason" in error:
        return f"unknown: {error['reason']}"
    text = join_words(f"{quantity(error[key], unit, 1)} {what}" for key, (what, unit) in ERRORS.items() if key in error)
    last = [steps[-1] for name, steps in error.get("of_steps", {}).items() if name == "step_period_s"]
    if last and last[0] < MUCH_SMALLER * error["step_period_s"]:
        text += f" (in the period of the last step {quantity(last[0], 's', 1)})"
    return f"{text}, by a second walk with {error.get('by', DEFAULT_CHECK)}"
