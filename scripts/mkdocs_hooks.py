"""Hooks of the documentation's site: links into the source tree, which the site lacks, become plain text."""

from __future__ import annotations

import re
from typing import Any

SOURCE_LINK = re.compile(r"\[([^\]]*)\]\(\.\./[^)\s]+\)")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Keep the text of each link that leads out of docs/.

    >>> on_page_markdown("See [`tree.py`](../walkerlab/tree.py) and [theory](theory.md).")
    'See `tree.py` and [theory](theory.md).'
    """
    return SOURCE_LINK.sub(r"\1", markdown)
