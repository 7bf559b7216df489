"""Blank figures, and figures as bytes that are the same whenever the figure is."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.legend_handler import HandlerBase
from matplotlib.lines import Line2D
from matplotlib.transforms import Transform

from walkerlab.figures.style import ONE_COLUMN, PNG_DPI, RC, WIDTH

LETTER, BESIDE_LABEL = 0.07, 0.65
"""Width of a legend's letter, and of all that is beside a label, in."""


@contextlib.contextmanager
def styled(columns: int = 2) -> Iterator[None]:
    """Matplotlib's defaults and this project's style on top, whatever the user's own settings are.

    columns  of a journal that a figure is to fill: in one, letters are smaller and lines thinner
    """
    with matplotlib.style.context(["default", RC, *([ONE_COLUMN] if columns == 1 else [])]):
        yield


def resize(figure: Figure, columns: int) -> None:
    """Make a figure as wide as one column, and not as much lower; as it is for two."""
    if columns == 1:
        _, height = figure.get_size_inches()
        figure.set_size_inches(WIDTH / 2, max(0.62 * height, 2.0))


def blank(height: float) -> Figure:
    """A figure of the common width and of `height` in."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


class UprightLine(Line2D):
    """A line that stands upright in legends, as it does in the figure."""


class UprightHandler(HandlerBase):
    """Draws upright lines in legends."""

    def create_artists(
        self,
        legend: Legend,
        orig_handle: Artist,
        xdescent: float,
        ydescent: float,
        width: float,
        height: float,
        fontsize: float,  # noqa: ARG002 - matplotlib calls it so
        trans: Transform,
    ) -> Sequence[Artist]:
        """One line in the middle, a little taller than the text."""
        middle = 0.5 * width - xdescent
        line = Line2D([middle, middle], [-0.3 * height - ydescent, 1.2 * height - ydescent])
        self.update_prop(line, orig_handle, legend)
        line.set_transform(trans)
        return [line]


def legend_above(figure: Figure, handles: Sequence[Artist]) -> None:
    """A legend in a band of its own above all axes, in as few rows as fit into the figure's width."""
    labels = [str(handle.get_label()) for handle in handles]
    fitting = (columns for columns in range(len(labels), 1, -1) if legend_width(labels, columns) < WIDTH)
    rows = -(-len(labels) // next(fitting, 1))
    figure.legend(
        handles=list(handles),
        loc="outside upper center",
        ncols=-(-len(labels) // rows),
        handler_map={UprightLine: UprightHandler()},
    )


def legend_width(labels: Sequence[str], columns: int) -> float:
    """Width of a legend (in), on the safe side; matplotlib fills the columns evenly, the first ones first."""
    longest = [max(map(len, column)) for column in np.array_split(np.array(labels, dtype=object), columns)]
    return sum(longest) * LETTER + columns * BESIDE_LABEL


def settle(figure: Figure) -> None:
    """Lay the figure out once and for all, so that every file of it is the same drawing."""
    engine = figure.get_layout_engine()
    assert engine is not None, "a figure is laid out once"
    engine.execute(figure)
    if any(axes.get_aspect() != "auto" for axes in figure.axes):
        # Only now have axes of equal scales the size that they are left with.
        engine.execute(figure)
    figure.set_layout_engine(None)


def svg_of(figure: Figure, name: str, title: str) -> bytes:
    """The figure as SVG with text kept as text; `name` makes its ids differ from those of other figures."""
    with matplotlib.rc_context({"svg.hashsalt": name}):
        return saved(figure, "svg", {"Date": None, "Creator": None, "Title": title})


def png_of(figure: Figure, title: str) -> bytes:
    """The figure as PNG."""
    return saved(figure, "png", {"Software": None, "Title": title}, dpi=PNG_DPI)


def bytes_of(figure: Figure, kind: str, name: str, title: str) -> bytes:
    """The figure as SVG, PNG or PDF."""
    if kind == "svg":
        return svg_of(figure, name, title)
    if kind == "png":
        return png_of(figure, title)
    return saved(figure, kind, {"CreationDate": None, "Title": title})


def saved(figure: Figure, kind: str, metadata: dict[str, str | None], **options: Any) -> bytes:
    """The figure's bytes in one of matplotlib's formats."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, metadata=metadata, **options)
    return file.getvalue()
