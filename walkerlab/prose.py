"""Sentences as templates with numbers: a file for each subject, and in it a macro for each paragraph."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

BLANKS = re.compile(r"[ \n]+")
"""Where a template's lines end; the narrow and the unbreakable blanks of numbers are others."""


def environment(folder: Path, filters: Iterable[Callable[..., Any]]) -> Environment:
    """The templates of a folder, which may call some functions by their names; an unknown name is an error."""
    # Imported here: what says nothing needs no templates.
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(loader=FileSystemLoader(folder), undefined=StrictUndefined)  # plain text: pages escape it
    made.filters |= {function.__name__: function for function in filters}
    return made


def paragraph(templates: Environment, name: str, *values: Any) -> str:
    """A paragraph as plain text on one line.

    name    file.macro
    values  what the macro takes
    """
    file, _, macro = name.partition(".")
    return BLANKS.sub(" ", getattr(templates.get_template(f"{file}.j2").module, macro)(*values)).strip()
