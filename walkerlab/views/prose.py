"""Render texts from Jinja templates. There is one file for each subject and one macro for each paragraph."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

BLANKS = re.compile(r"[ \n]+")
"""Pattern of blanks and line ends in a template. It leaves out the narrow and no-break spaces in numbers."""
BETWEEN_PARTS = re.compile(r"(?:^|[ \n])\|(?=[ \n]|$)")
"""Separator of the parts of a text, as in 'one | two'."""


def parts(text: str) -> list[str]:
    """Split a text at each |, and drop empty parts."""
    return [stripped for part in BETWEEN_PARTS.split(text) if (stripped := part.strip(" \n"))]


def f(value: float, spec: str) -> str:
    """Format a number by a format specification, such as .4f."""
    return format(value, spec)


def percent(share: float, digits: int = 3) -> str:
    return f"{100.0 * share:.{digits}g} %"


@dataclass(frozen=True)
class Prose:
    """Renders paragraphs, as plain text, from a folder of templates."""

    folder: Path
    filters: Sequence[Callable[..., Any]]  # functions that templates may use as filters
    known: Mapping[str, Any]  # global variables of the templates

    @cached_property
    def templates(self) -> "Environment":
        # Imported here, because commands that print no prose need no Jinja.
        from jinja2 import Environment, FileSystemLoader, StrictUndefined

        # Texts are not escaped here: terminals show them as they are, and pages escape them later.
        environment = Environment(loader=FileSystemLoader(self.folder), undefined=StrictUndefined)
        environment.filters |= {function.__name__: function for function in self.filters}
        environment.globals |= self.known
        return environment

    def __call__(self, name: str, *values: Any) -> str:
        """Render a paragraph on one line.

        name    file.macro
        values  arguments of the macro
        """
        file, _, macro = name.partition(".")
        rendered = getattr(self.templates.get_template(f"{file}.j2").module, macro)(*values)
        return BLANKS.sub(" ", rendered).strip()

    def parts(self, name: str, *values: Any) -> list[str]:
        """Render a text, split it at each |, and drop empty parts. The arguments are those of `__call__`."""
        return parts(self(name, *values))

    def terms(self, name: str, *values: Any) -> dict[str, str]:
        """Render a text whose parts have the form 'word: meaning', and return the meaning of each word."""
        return {word: meaning for word, _, meaning in (part.partition(": ") for part in self.parts(name, *values))}
