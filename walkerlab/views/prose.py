"""Texts kept as Jinja templates, with a file per subject and a macro per paragraph."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

BLANKS = re.compile(r"[ \n]+")
"""Blanks and line ends of a template, but not the narrow and no-break spaces within numbers."""
BETWEEN_PARTS = re.compile(r"(?:^|[ \n])\|(?=[ \n]|$)")
"""Separator of the parts of a text, as in 'one | two'."""


def parts(text: str) -> list[str]:
    """Split a text at its | marks, dropping empty parts."""
    return [stripped for part in BETWEEN_PARTS.split(text) if (stripped := part.strip(" \n"))]


def f(value: float, spec: str) -> str:
    """Format a number with a format specification, such as .4f."""
    return format(value, spec)


def percent(share: float, digits: int = 3) -> str:
    return f"{100.0 * share:.{digits}g} %"


@dataclass(frozen=True)
class Prose:
    """Renders paragraphs from a folder of templates as plain text."""

    folder: Path
    filters: Sequence[Callable[..., Any]]  # functions that templates may use as filters
    known: Mapping[str, Any]  # global variables of the templates

    @cached_property
    def templates(self) -> "Environment":
        # Imported here: commands that print no prose need no Jinja.
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
        """Render a text, and split it at its | marks, dropping empty parts. The arguments are those of a call."""
        return parts(self(name, *values))

    def terms(self, name: str, *values: Any) -> dict[str, str]:
        """Return the meaning of each word in a macro whose parts have the form 'word: meaning'."""
        return {word: meaning for word, _, meaning in (part.partition(": ") for part in self.parts(name, *values))}
