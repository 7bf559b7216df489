"""Sentences of the report, from a template file for each section."""

from pathlib import Path

from walkerlab.config.second_leg import second_leg_in_words
from walkerlab.labels import join_words
from walkerlab.physics.energy_channels import CHANNELS
from walkerlab.views.prose import Prose, parts
from walkerlab.views.report import numbers
from walkerlab.views.report.outcomes import (
    DEFAULT_CHECK,
    ERRORS,
    describe_error,
    describe_limp,
    ends,
    legs_differ,
    walks,
)
from walkerlab.views.report.symbols import typeset


def join_row(text: str) -> str:
    """Join the parts of 'a | b | c' as 'a, b and c'."""
    return join_words(parts(text))


TEMPLATE_FUNCTIONS = (
    *(numbers.number, numbers.fixed, numbers.quantity, numbers.length, numbers.format_integer, numbers.span),
    *(numbers.count, join_words, numbers.power_of_ten, join_row, typeset, ends, walks, describe_error, len),
    *(describe_limp, legs_differ, second_leg_in_words),
)
"""Functions available to the templates."""
TEMPLATE_CONSTANTS = {"CHANNELS": CHANNELS, "ERRORS": ERRORS, "DEFAULT_CHECK": DEFAULT_CHECK}
words = Prose(Path(__file__).parent / "templates" / "words", TEMPLATE_FUNCTIONS, TEMPLATE_CONSTANTS)
