"""Render the sentences of the report, from a template file for each section, and name models, outcomes and errors."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from walkerlab.config.second_leg import describe_second_leg
from walkerlab.labels import CONTACT_STAGE, RIGID_STAGE, join_words
from walkerlab.outcome import OUTCOME_TEXTS, Outcome, outcome_of
from walkerlab.physics.energy_channels import CHANNELS
from walkerlab.views.prose import Prose, parts
from walkerlab.views.report import numbers
from walkerlab.views.report.numbers import count, number, quantity, typeset
from walkerlab.views.report.tables import Tone

MODEL_NAMES = {RIGID_STAGE: "Rigid model", CONTACT_STAGE: "Contact model"}
"""Names of the models, by the stage that simulates a walk with them."""

WALKED_LABEL = Outcome.WALKED.label


def ends(outcome: str) -> str:
    """Describe how a walk ends, or return the name of an outcome that this version does not know."""
    ending = outcome_of(outcome)
    return f"ends as {outcome}" if ending is None else OUTCOME_TEXTS[ending].does


def walks(steps: int, outcome: str) -> str:
    """Describe how far a walker gets, as a predicate: 'walks all 10 steps', or 'walks 3 steps and then falls'."""
    if outcome == WALKED_LABEL:
        return f"walks all {count(steps, 'step')}"
    return f"walks {count(steps, 'step')} and then {ends(outcome)}" if steps else f"{ends(outcome)} in its first step"


def tone(outcome: str) -> Tone:
    return "good" if outcome == WALKED_LABEL else "bad"


DEFAULT_CHECK = "a hundred times tighter tolerances"
"""Default tolerances of the second walk that measures the error."""
ERROR_TEXTS = {
    "step_period_s": ("in period", "s"),
    "step_length_m": ("in step length", "m"),
    "slip_m": ("in slip", "m"),
    "rolling_m": ("in rolling distance", "m"),
    "knee_strike_time_s": ("in knee-strike time", "s"),
    "end_time_s": ("in end time", "s"),
    "cost_of_transport": ("in cost of transport", "1"),
}
"""Text and unit of each quantity that has a numerical error."""


MAX_LAST_ERROR_RATIO = 0.01
"""The answer also gives the error of the last step if it is less than this fraction of the largest error."""


def describe_error(error: Mapping[str, Any]) -> str:
    """Describe the numerical errors of a walk and how they were measured."""
    if "reason" in error:
        return f"unknown: {error['reason']}"
    errors = (f"{quantity(error[key], unit, 1)} {what}" for key, (what, unit) in ERROR_TEXTS.items() if key in error)
    text = join_words(errors)
    last = [steps[-1] for name, steps in error.get("of_steps", {}).items() if name == "step_period_s"]
    if last and last[0] < MAX_LAST_ERROR_RATIO * error["step_period_s"]:
        text += f" (in the period of the last step {quantity(last[0], 's', 1)})"
    return f"{text}, by a second walk with {error.get('by', DEFAULT_CHECK)}"


def legs_differ(gait: Mapping[str, Any]) -> bool:
    """Whether the legs of a gait's walker differ. Multipliers are then those of a stride, not of a step."""
    return "gait_steps" in gait and "multipliers" not in gait


def describe_limp(gait: Mapping[str, Any]) -> str:
    """Return the end of a sentence about a multiplier: how the steps of the two legs differ, or '' if they do not."""
    if not legs_differ(gait):
        return ""
    period, length = (gait["asymmetry"][f"step_{name}"] for name in ("period", "length"))
    return (
        f" per step. It limps: the step in which leg 2 swings takes {compare(period, 'more', 'less')} time and is "
        f"{compare(length, 'longer', 'shorter')} than the step in which leg 1 swings"
    )


def compare(asymmetry: float, more: str, less: str) -> str:
    """Compare a second value with a first, as '5.3 % more'. `asymmetry` is their difference divided by their mean."""
    percent = 100.0 * ((2.0 + asymmetry) / (2.0 - asymmetry) - 1.0)
    return f"{number(abs(percent), 2)} % {more if percent > 0.0 else less}"


def join_row(text: str) -> str:
    """Join the parts of 'a | b | c' as 'a, b and c'."""
    return join_words(parts(text))


TEMPLATE_FUNCTIONS = (
    *(numbers.number, numbers.fixed, numbers.quantity, numbers.length, numbers.format_integer, numbers.span),
    *(numbers.count, join_words, numbers.power_of_ten, join_row, typeset, ends, walks, describe_error, len),
    *(describe_limp, legs_differ, describe_second_leg),
)
"""Functions that templates can use."""
TEMPLATE_CONSTANTS = {"CHANNELS": CHANNELS, "ERRORS": ERROR_TEXTS, "DEFAULT_CHECK": DEFAULT_CHECK}
words = Prose(Path(__file__).parent / "templates" / "words", TEMPLATE_FUNCTIONS, TEMPLATE_CONSTANTS)
