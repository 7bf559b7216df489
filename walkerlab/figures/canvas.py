"""Blank figures, and figures as bytes that are the same whenever the figure is."""

import contextlib
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from walkerlab.figures.style import LEGEND_LETTERS, NARROW, NARROW_BELOW, PNG_DPI, RC, WIDTH

LETTER, BESIDE_LABEL = 0.07, 0.65
"""Width of a legend's letter, and of all that is beside a label, in, at the ordinary size of its letters."""
SHRINKS = 0.7
"""Power of its width that a figure's height follows: letters keep their size."""


@contextlib.contextmanager
def styled(width: float = WIDTH) -> Iterator[None]:
    """Matplotlib's defaults and this project's style on top, whatever the user's own settings are.

    width  of the figures, in; in narrow ones, letters are smaller and lines thinner
    """
    size = {"figure.figsize": (width, width)}
    with matplotlib.style.context(["default", RC, *([NARROW] if width < NARROW_BELOW else []), size]):
        yield


def is_narrow(figure: Any) -> bool:
    """Whether letters are smaller in a figure."""
    return bool(figure.bbox.width < NARROW_BELOW * figure.dpi)


def blank(height: float) -> Figure:
    """A figure of the style's width and of `height` in, or of not as much less if it is narrower."""
    width = matplotlib.rcParams["figure.figsize"][0]
    figure = Figure(figsize=(width, height * (width / WIDTH) ** SHRINKS), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def entry(label: str, **look: Any) -> Line2D:
    """A line, or a mark, in a legend."""
    return Line2D([], [], label=label, **look)


def add_legend(figure: Figure, handles: Sequence[Artist], title: str | None = None, edge: str = "upper") -> None:
    """A legend in a band of its own above all axes, in as few rows as fit into the figure's width.

    title  of what it is the legend
    edge   "lower" puts it below all axes
    """
    labels = np.array([str(handle.get_label()) for handle in handles], dtype=object)
    room = figure.get_figwidth() * LEGEND_LETTERS / matplotlib.rcParams["legend.fontsize"]
    for columns in range(len(labels), 0, -1):
        # on the safe side; matplotlib fills the columns evenly, the first ones first
        letters = sum(max(map(len, column)) for column in np.array_split(labels, columns))
        if letters * LETTER + columns * BESIDE_LABEL < room:
            break
    rows = -(-len(labels) // columns)
    where: dict[str, Any] = {"loc": f"outside {edge} center", "ncols": -(-len(labels) // rows)}
    figure.legend(handles=list(handles), title=title, alignment="left", **where)


def settle(figure: Figure) -> None:
    """Lay the figure out once and for all, so that every file of it is the same drawing."""
    engine = figure.get_layout_engine()
    assert engine is not None, "a figure is laid out once"
    engine.execute(figure)
    if any(axes.get_aspect() != "auto" for axes in figure.axes):
        # Only now have axes of equal scales the size that they are left with.
        engine.execute(figure)
    figure.set_layout_engine(None)


def as_file(figure: Figure, kind: str, name: str, title: str) -> bytes:
    """The figure as SVG with text kept as text, PNG or PDF; `name` makes an SVG's ids differ from other figures'."""
    undated: dict[str, dict[str, Any]] = {
        "svg": {"metadata": {"Date": None, "Creator": None, "Title": title}},
        "png": {"metadata": {"Software": None, "Title": title}, "dpi": PNG_DPI},
        "pdf": {"metadata": {"CreationDate": None, "Title": title}},
    }
    file = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": name}):
        figure.savefig(file, format=kind, **undated[kind])
    return file.getvalue()


@dataclass(frozen=True)
class Drawing:
    """A figure as files' bytes, with its words."""

    svg: bytes
    png: bytes
    title: str
    caption: str


def files_of(figure: Figure, name: str, title: str, kinds: Sequence[str] = ("svg", "png")) -> list[bytes]:
    """A figure, plotted within the style, laid out, as a file of each kind."""
    settle(figure)
    return [as_file(figure, kind, name, title) for kind in kinds]
