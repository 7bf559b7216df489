"""Sentences of the report, from a file of templates for each section."""

from pathlib import Path

from walkerlab.account import CHANNELS
from walkerlab.prose import Prose, listed, parts
from walkerlab.report import numbers
from walkerlab.report.outcomes import ERRORS, USUAL, ends, off_by, walks
from walkerlab.report.symbols import in_signs


def in_row(text: str) -> str:
    """Join the parts of 'a | b | c' as 'a, b and c'."""
    return listed(parts(text))


WRITTEN = (
    *(numbers.number, numbers.fixed, numbers.quantity, numbers.length, numbers.whole, numbers.span),
    *(numbers.count, listed, numbers.power_of_ten, in_row, in_signs, ends, walks, off_by, len),
)
"""Functions available to the templates."""
KNOWN = {"CHANNELS": CHANNELS, "ERRORS": ERRORS, "USUAL": USUAL}
words = Prose(Path(__file__).parent / "templates" / "words", WRITTEN, KNOWN)
