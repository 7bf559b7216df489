"""Format docstrings for the API reference: arguments in columns become a list, examples a code block.

This is an extension of griffe, named in scripts/mkdocs.yml.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

ARGUMENT = re.compile(r"^([a-z_]\w*(?:, \w+)*)  +(\S.*)$")
EXAMPLES = re.compile(r"(^>>> .*?)(?=\n\n|\Z)", re.DOTALL | re.MULTILINE)


class Columns(Extension):
    """Extension that reformats every docstring before it is put on a page."""

    def on_instance(self, *, obj: Object, **_: Any) -> None:
        """Reformat the docstring of one object."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)


def as_markdown(text: str) -> str:
    """Convert a docstring of this project to Markdown.

    >>> print(as_markdown("Walk.\\n\\nslope_deg  positive downhill,\\n           deg\\n\\n>>> 1 + 1\\n2"))
    Walk.
    <BLANKLINE>
    - `slope_deg`: positive downhill,
               deg
    <BLANKLINE>
    ```pycon
    >>> 1 + 1
    2
    ```
    """
    listed = "\n".join(ARGUMENT.sub(r"- `\1`: \2", line) for line in text.splitlines())
    return EXAMPLES.sub(r"```pycon\n\1\n```", listed)
