"""The figures that were drawn, embedded; from the index that the drawing stage left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from walkerlab.report.blocks import Picture
from walkerlab.report.images import data_uri, fitting, pixels
from walkerlab.store.content import Content


def pictures(stored: Mapping[str, Content], folder: Path) -> tuple[Picture, ...]:
    """Every figure that `plot` lists, in its order.

    folder  of the run, which the figures' paths are relative to

    Raises FileNotFoundError if a listed file is not there.
    """
    if "plot" not in stored:
        return ()
    figures: list[Mapping[str, Any]] = list(stored["plot"].summary.get("figures", []))
    drawings = [(folder / figure["svg"], folder / figure["png"]) for figure in figures]
    files = fitting(drawings)
    found = []
    for figure, (svg, _), file in zip(figures, drawings, files, strict=True):
        width, height = pixels(svg)
        found.append(
            Picture(
                title=title_of(figure),
                caption=str(figure["caption"]),
                alt=f"{title_of(figure)} {figure['caption']}",
                uri=data_uri(file),
                width=width,
                height=height,
            )
        )
    return tuple(found)


def title_of(figure: Mapping[str, Any]) -> str:
    """A figure's title, with its number if it is one of the paper's."""
    number = f"Figure {figure['number']}. " if "number" in figure else ""
    return f"{number}{figure['title']}."
