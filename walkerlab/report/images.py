"""Which form of a drawn figure goes into the page, and pixels as data: URIs, so that it needs no other file."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from pathlib import Path

MAX_BYTES = 1_400_000
"""Of all images together; the largest drawings are embedded as pixels until they fit."""

TYPES = {".svg": "image/svg+xml", ".png": "image/png"}
VIEW_BOX = re.compile(rb'\bviewBox="0 0 ([\d.]+) ([\d.]+)"')


def fitting(drawings: Sequence[tuple[Path, Path]], most: int = MAX_BYTES) -> list[Path]:
    """For each (SVG, PNG) the file to embed: the SVG, unless they take too much room together.

    Raises FileNotFoundError if one is not there.
    """
    chosen = [svg for svg, _ in drawings]
    sizes = [svg.stat().st_size for svg in chosen]
    for index in sorted(range(len(drawings)), key=lambda index: -sizes[index]):
        if sum(sizes) <= most:
            break
        png = drawings[index][1]
        if png.stat().st_size < sizes[index]:
            chosen[index], sizes[index] = png, png.stat().st_size
    return chosen


def data_uri(path: Path) -> str:
    """A drawing as the address of itself."""
    return f"data:{TYPES[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"


def pixels(svg: Path) -> tuple[int, int]:
    """Width and height of a drawing in CSS pixels, to keep its place while it loads; (0, 0) if it does not say."""
    with svg.open("rb") as file:
        found = VIEW_BOX.search(file.read(2000))
    return (round(float(found[1])), round(float(found[2]))) if found else (0, 0)
