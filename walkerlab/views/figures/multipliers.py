"""Multipliers of a gait in the unit circle."""

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.patches import Circle

from walkerlab.views.figures.canvas import figure_style, panels, settle
from walkerlab.views.figures.style import BLACK, BLUE, GREY, VERMILLION


def draw_multipliers(multipliers: Sequence[complex]) -> Figure:
    """Draw a gait's multipliers and the unit circle, inside which all multipliers of a stable gait lie."""
    with figure_style(4.0):
        figure, axes = panels(4.0)
        axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color=GREY))
        axes.axhline(color=GREY, linewidth=0.5)
        axes.axvline(color=GREY, linewidth=0.5)
        for multiplier in multipliers:
            colour = BLUE if abs(multiplier) < 1.0 else VERMILLION
            axes.plot(multiplier.real, multiplier.imag, "o", color=colour, markeredgecolor=BLACK)
        extent = 1.1 * max(1.0, *map(abs, multipliers))
        axes.set(
            xlim=(-extent, extent), ylim=(-extent, extent), aspect="equal", xlabel="real part", ylabel="imaginary part"
        )
        axes.set_title(f"Multipliers; the largest has magnitude {max(map(abs, multipliers)):.3g}")
        settle(figure)
    return figure
