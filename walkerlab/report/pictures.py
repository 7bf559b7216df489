"""The figures that were drawn, embedded; from the index that the drawing stage left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from walkerlab.report.blocks import CASES, COSTS, MAIN, Picture
from walkerlab.report.drawings import inline
from walkerlab.report.images import data_uri, fitting, pixels
from walkerlab.store.content import Content

PAGES = {"accuracy": COSTS, "stability": CASES}
"""Where figures go whose names begin so; all others are on the report itself."""

Figure = Mapping[str, Any]


def pictures(stored: Mapping[str, Content], folder: Path, *, numbered: bool = True) -> tuple[Picture, ...]:
    """Every figure that `plot` lists, in its order.

    folder    of the run, which the figures' paths are relative to
    numbered  whether the paper's numbers mean something to the reader

    Raises FileNotFoundError if a listed file is not there.
    """
    if "plot" not in stored:
        return ()
    figures: list[Figure] = list(stored["plot"].summary.get("figures", []))
    drawings = [(folder / figure["svg"], folder / figure["png"]) for figure in figures]
    files = fitting(drawings)
    return tuple(
        picture(figure, svg, file, numbered) for figure, (svg, _), file in zip(figures, drawings, files, strict=True)
    )


def picture(figure: Figure, svg: Path, file: Path, numbered: bool) -> Picture:
    """A figure, drawn into the page unless its drawing is too large."""
    width, height = pixels(svg)
    title = title_of(figure, numbered)
    alt = f"{title} {figure.get('alt', '')}".strip()
    vector = file == svg
    return Picture(
        title=title,
        caption=str(figure["caption"]),
        alt=alt,
        svg=inline(svg, alt) if vector else None,
        uri="" if vector else data_uri(file),
        width=width,
        height=height,
        name=svg.stem,
        links=links(figure),
        page=PAGES.get(svg.stem.partition("-")[0], MAIN),
    )


def links(figure: Figure) -> tuple[tuple[str, str], ...]:
    """The files of the drawing, and of the results that it was drawn from."""
    kinds = [(kind.upper(), str(figure[kind])) for kind in ("svg", "png") if kind in figure]
    return (*kinds, *((f"{stage}.h5", f"{stage}.h5") for stage in figure.get("results", ())))


def title_of(figure: Figure, numbered: bool) -> str:
    """A figure's title, with its number if it is one of the paper's and the reader has the paper before them."""
    number = f"Figure {figure['number']}. " if numbered and "number" in figure else ""
    return f"{number}{figure['title']}."
