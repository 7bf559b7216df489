"""Sentences of the report: a file of templates for each section."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkerlab.prose import environment, paragraph
from walkerlab.report import numbers
from walkerlab.report.outcomes import ends, walks
from walkerlab.report.symbols import in_signs

if TYPE_CHECKING:
    from jinja2 import Environment

WRITTEN = (
    *(numbers.number, numbers.fixed, numbers.quantity, numbers.length, numbers.whole, numbers.span),
    *(numbers.count, numbers.listed, numbers.power_of_ten, in_signs, ends, walks),
)
"""What the templates may call."""


def words(name: str, *values: Any) -> str:
    """A paragraph of a section, as plain text.

    name    section.macro
    values  what the macro takes
    """
    return paragraph(templates(), name, *values)


@cache
def templates() -> Environment:
    """The templates of all sections."""
    return environment(Path(__file__).parent / "templates" / "words", WRITTEN)
