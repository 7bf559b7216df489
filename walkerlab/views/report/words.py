"""Sentences of the report: a file of templates for each section."""

from pathlib import Path

from walkerlab.labels import join_words
from walkerlab.physics.energy_channels import CHANNELS
from walkerlab.views.prose import Prose, parts
from walkerlab.views.report import numbers
from walkerlab.views.report.outcomes import ERRORS, USUAL, ends, off_by, walks
from walkerlab.views.report.symbols import in_signs


def in_row(text: str) -> str:
    """The parts of a text as words in a row: 'a, b and c' of 'a | b | c'."""
    return join_words(parts(text))


WRITTEN = (
    *(numbers.number, numbers.fixed, numbers.quantity, numbers.length, numbers.whole, numbers.span),
    *(numbers.count, join_words, numbers.power_of_ten, in_row, in_signs, ends, walks, off_by, len),
)
"""What the templates may call."""
KNOWN = {"CHANNELS": CHANNELS, "ERRORS": ERRORS, "USUAL": USUAL}
words = Prose(Path(__file__).parent / "templates" / "words", WRITTEN, KNOWN)
