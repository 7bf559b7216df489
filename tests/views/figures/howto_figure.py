"""The example figure of docs/adding.md, made by the code on that page."""

import re
from pathlib import Path

PAGE = (Path(__file__).parents[3] / "docs" / "adding.md").read_text(encoding="utf-8")


def example():
    """Yield the figure. Its words exist only while they are written into a file."""
    names = {}
    exec(re.search(r"```python\n(from walkerlab\.views\.figures\.canvas.*?)```", PAGE, re.DOTALL)[1], names)
    return names["FIGURE"]


FIGURE = example()
