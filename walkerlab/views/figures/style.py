"""Sizes, fonts, colours and line styles shared by all figures.

The colours are those of Okabe and Ito, for colour-blind readers. Overlapping series also differ in brightness and line
style, so that figures remain readable in greyscale.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

BLACK: Final = "#000000"
ORANGE: Final = "#E69F00"
GREEN: Final = "#009E73"
BLUE: Final = "#0072B2"
VERMILLION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#7F7F7F"
PALE: Final = "#EDEDED"

FIGURE_WIDTH: Final = 7.2
"""Width (in) of a figure on the page, equal to two columns of a journal."""
POINT: Final = 1.0 / 72.0
"""One point (in)."""
PNG_DPI: Final = 160
"""Resolution of PNGs on the page (pixels per inch)."""
EXPORT_DPI: Final = 300
"""Default resolution of exports (pixels per inch), as required by journals."""

RC: Final = {
    "axes.formatter.limits": (-4, 5),
    "axes.formatter.useoffset": False,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.0,
    "axes.titlepad": 4.0,
    "figure.constrained_layout.h_pad": 0.05,
    "figure.constrained_layout.w_pad": 0.05,
    "figure.figsize": (FIGURE_WIDTH, FIGURE_WIDTH),
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "legend.borderaxespad": 0.2,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "lines.dash_capstyle": "butt",
    "mathtext.fontset": "dejavusans",
    # Type 42 is TrueType. The default of matplotlib is Type 3, which many journals reject.
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
    "svg.fonttype": "none",
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
}
"""Settings that differ from matplotlib's defaults. The user's matplotlibrc has no effect on figures.

Labels, ticks and legends have `font.size`, matplotlib's default.
"""
NARROW_BELOW: Final = 5.0
"""Figure width (in) below which fonts and legends are smaller."""
NARROW: Final = {
    "axes.titlesize": 7.2,
    "font.size": 7.2,
    "legend.fontsize": 6.5,
    "legend.handlelength": 1.6,
    "legend.columnspacing": 1.0,
}
"""Further settings for one-column figures. Labels of 7.2 pt have superscripts of 5 pt, which can still be read."""


@dataclass(frozen=True)
class Look:
    """Style of a series: legend label, colour, line style, line width (pt), marker and drawing order."""

    label: str
    colour: str
    style: "LineStyleType"
    width: float
    marker: str
    order: int = 3

    @property
    def line(self) -> dict[str, Any]:
        return {"color": self.colour, "linestyle": self.style, "linewidth": self.width}


RIGID_LOOK: Final = Look("rigid model", BLUE, "-", 1.7, "o", order=3)
CONTACT_LOOK: Final = Look("contact model", ORANGE, (0.0, (3.2, 1.4)), 1.5, "^", order=4)
RECORDED: Final = Look("recorded walk", GREEN, (0.0, (1.0, 1.0)), 1.5, "s", order=5)

LEGS: Final = (
    Look("leg 1 (swings first)", GREEN, "-", 1.0, "o", order=4),
    Look("leg 2 (stands first)", PURPLE, (0.0, (5.0, 1.2)), 1.0, "s", order=3),
)
