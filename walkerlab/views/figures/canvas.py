"""Set up and lay out figures, and write them to reproducible files."""

import contextlib
import io
import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from walkerlab.labels import add_unit
from walkerlab.views.figures.style import FIGURE_WIDTH, NARROW, NARROW_BELOW, PNG_DPI, RC

MAX_FILL = 0.95
"""Maximum fraction of the available width that a legend, title or label fills."""
LEGEND_ROWS = 3
"""Number of legend rows that fit in a figure's nominal height. Longer legends make the figure taller."""
HEIGHT_EXPONENT = 0.7
"""Power of a figure's width to which its height is proportional. It is below 1, because text hardly shrinks."""

BETWEEN_DECADES: Final = ((6.0, (2.0, 3.0, 5.0)), (15.0, (2.0, 5.0)), (100.0, (3.0,)))
"""Labels between the powers of ten on a short axis: (6, (2, 3, 5)) also labels 2, 3 and 5 times each power if the upper
limit is less than 6 times the lower one."""
RAISED: Final = str.maketrans("0123456789-.e", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻·ᵉ")
MAX_PLAIN_NUMBER: Final = 1e4
"""Largest number that labels show without an exponent."""


@contextlib.contextmanager
def figure_style(width: float = FIGURE_WIDTH) -> Iterator[None]:
    """Apply the project's style, ignoring the user's matplotlib settings. Figures are `width` inches wide."""
    size = {"figure.figsize": (width, width)}
    with matplotlib.style.context(["default", RC, *([NARROW] if width < NARROW_BELOW else []), size]):
        yield


def is_narrow() -> bool:
    return bool(matplotlib.rcParams["figure.figsize"][0] < NARROW_BELOW)


class ShownFigure(Figure):
    """Figure that a notebook shows as a picture, even if it has not set up matplotlib."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.savefig(file, format="png", dpi=PNG_DPI)
        return file.getvalue()


def blank(height: float) -> Figure:
    """Create a figure of the style's width.

    `height` (in) is the height at the default width. In a narrower figure, the height shrinks less than the width.
    """
    width = matplotlib.rcParams["figure.figsize"][0]
    figure = ShownFigure(figsize=(width, height * (width / FIGURE_WIDTH) ** HEIGHT_EXPONENT), layout="constrained")
    # The layout depends on the sizes of texts, which the canvas measures.
    FigureCanvasAgg(figure)
    return figure


def panels(height: float, rows: int = 1, columns: int = 1, **how: Any) -> tuple[Figure, Any]:
    figure = blank(height)
    return figure, figure.subplots(rows, columns, **how)


def label_of(words: str, unit: str) -> str:
    return add_unit(words, re.sub(r"\^([\d.]+|e\b)", lambda power: power[1].translate(RAISED), unit))


def label_ticks(axis: Axis) -> None:
    """Label as many decades of a logarithmic axis as fit, and values between them if the axis spans few."""
    least, last = axis.get_view_interval()
    between = next((subs for span, subs in BETWEEN_DECADES if last < min(span * least, MAX_PLAIN_NUMBER)), ())
    axis.set_major_locator(LogLocator(subs=(1.0, *between)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter((lambda value, _place: f"{value:g}") if between else power_of_ten))


def error_axis(axes: Axes) -> None:
    if np.isfinite(axes.dataLim.intervaly).all():
        axes.set_yscale("log")
        label_ticks(axes.yaxis)


def cost_axis(axes: Axes) -> None:
    """Make the horizontal axis logarithmic. On an empty panel, write that no run reached the end."""
    if np.isfinite(axes.dataLim.intervalx).all():
        axes.set_xscale("log")
        label_ticks(axes.xaxis)
    else:
        axes.text(0.5, 0.5, "no run reached the end", transform=axes.transAxes, ha="center")


def power_of_ten(value: float, _place: float | None = None) -> str:
    """Format a power of ten as an axis label, with superscripts large enough to read on a page."""
    return "10" + str(round(math.log10(value))).translate(RAISED)


def entry(label: str, **look: Any) -> Line2D:
    return Line2D([], [], label=label, **look)


def add_legend(figure: Figure, handles: Sequence[Artist], title: str | None = None, edge: str = "upper") -> None:
    """Draw a legend above all axes, or below them if `edge` is "lower", in as few rows as fit."""
    where: dict[str, Any] = {"title": title, "alignment": "left", "loc": f"outside {edge} center"}
    for rows in range(1, len(handles) + 1):
        legend = figure.legend(handles=list(handles), ncols=-(-len(handles) // rows), **where)
        box = legend.get_window_extent()
        if rows == len(handles) or box.width < MAX_FILL * figure.bbox.width:
            break
        legend.remove()
    figure.set_figheight(figure.get_figheight() + max(0.0, 1.0 - LEGEND_ROWS / rows) * box.height / figure.dpi)


def settle(figure: Figure) -> None:
    """Lay the figure out, once for all of its files, so that they look the same."""
    engine = figure.get_layout_engine()
    assert engine is not None, "a figure is laid out once"
    engine.execute(figure)
    break_lines(figure)
    # The layout is computed again, because wrapped labels and axes of equal scale have changed it.
    engine.execute(figure)
    figure.set_layout_engine(None)


def break_lines(figure: Figure) -> None:
    """Wrap titles and labels that are longer than their axes."""
    for axes in figure.axes:
        box = axes.get_window_extent()
        title = axes.set_title(axes.get_title(matplotlib.rcParams["axes.titlelocation"]))
        for text, room in ((title, box.width), (axes.xaxis.label, box.width), (axes.yaxis.label, box.height)):
            extent = text.get_window_extent()
            longest = max(extent.width, extent.height)
            if longest > MAX_FILL * room:
                letters = int(len(text.get_text()) * MAX_FILL * room / longest)
                text.set_text(textwrap.fill(text.get_text(), letters, break_long_words=False, break_on_hyphens=False))


def as_file(figure: Figure, kind: str, name: str, title: str, dpi: int = PNG_DPI) -> bytes:
    """Return the figure as a file of one kind. `name` keeps the ids in an SVG different from those of other figures."""
    # Equal figures must give byte-identical files, so the files must not contain a date or a version.
    undated: dict[str, dict[str, Any]] = {
        "svg": {"metadata": {"Date": None, "Creator": None, "Title": title}},
        "png": {"metadata": {"Software": None, "Title": title}},
        "pdf": {"metadata": {"CreationDate": None, "Title": title}},
        "eps": {},
        "tiff": {"pil_kwargs": {"compression": "tiff_lzw"}},
    }
    file = io.BytesIO()
    # Without a salt, matplotlib would make ids from random numbers.
    with matplotlib.rc_context({"svg.hashsalt": name}):
        figure.savefig(file, format=kind, dpi=dpi if kind in ("png", "tiff") else PNG_DPI, **undated[kind])
    return file.getvalue()


class Drawing(NamedTuple):
    """Files of a figure as bytes, and its caption."""

    svg: bytes
    png: bytes
    caption: str


def files_of(
    figure: Figure, name: str, title: str, kinds: Sequence[str] = ("svg", "png"), dpi: int = PNG_DPI
) -> list[bytes]:
    """Lay out a figure and return a file of each kind. `name` is as in `as_file`."""
    settle(figure)
    return [as_file(figure, kind, name, title, dpi) for kind in kinds]
