"""What is said of the paper: templates with numbers.

A package of its own: only results of modules that import it depend on its words.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkerlab.paper import arithmetic, printed
from walkerlab.paper.judged import agreement
from walkerlab.prose import environment, paragraph

if TYPE_CHECKING:
    from jinja2 import Environment


def prose(name: str, *values: Any) -> str:
    """A paragraph as plain text.

    name    file.macro
    values  what the macro takes
    """
    return paragraph(templates(), name, *values)


@cache
def templates() -> Environment:
    """The templates of this folder, which know what the paper prints and what follows from that alone."""
    made = environment(Path(__file__).parent, (f,))
    known = vars(printed) | vars(arithmetic) | {"pi": math.pi, "agreement": agreement}
    made.globals |= {name: value for name, value in known.items() if not name.startswith("_")}
    return made


def f(value: float, spec: str) -> str:
    """A number in a format of Python's, such as .4f."""
    return format(value, spec)
