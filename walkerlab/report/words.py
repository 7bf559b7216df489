"""Sentences of the report: a file of templates for each section."""

from __future__ import annotations

from pathlib import Path

from walkerlab.prose import Prose
from walkerlab.report import numbers
from walkerlab.report.outcomes import ends, walks
from walkerlab.report.symbols import in_signs

WRITTEN = (
    *(numbers.number, numbers.fixed, numbers.quantity, numbers.length, numbers.whole, numbers.span),
    *(numbers.count, numbers.listed, numbers.power_of_ten, in_signs, ends, walks),
)
"""What the templates may call."""
words = Prose(Path(__file__).parent / "templates" / "words", WRITTEN, {})
