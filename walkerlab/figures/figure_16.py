"""Figure 16: the plane of two parameters, divided by the curves on which gaits fold or double their period."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from walkerlab.figures.bifurcation_diagram import MARKS, STAGE, label_of
from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, GREEN, ORANGE
from walkerlab.store.content import Group

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

NEEDS: Final = (
    Need(STAGE, "rigid/curve_0", ("value", "second"), "no curves over two parameters (continuation.second)"),
)
COLOURS: Final = {1: BLUE, 2: ORANGE, 4: GREEN}
STYLES: Final[dict[str, LineStyleType]] = {"flip": "-", "fold": "--"}


def curves(results: Results) -> list[Group]:
    """The curves, in the order in which they were followed."""
    found: list[Group] = []
    while (group := results[STAGE].groups.get(f"rigid/curve_{len(found)}")) is not None:
        found.append(group)
    return found


def plot(results: Results) -> Figure:
    """Every curve, by period and kind."""
    figure = blank(4.2)
    axes = figure.subplots()
    drawn = curves(results)
    seen: set[tuple[int, str]] = set()
    for group in drawn:
        period, kind = int(group.attrs["period"]), str(group.attrs["kind"])
        axes.plot(group["value"], group["second"], color=COLOURS.get(period, BLACK), linestyle=STYLES[kind])
        seen.add((period, kind))
    axes.set_xlabel(label_of(results))
    axes.set_ylabel(drawn[0].variables["second"].long_name)
    legend_above(
        figure,
        [
            Line2D(
                [], [], color=COLOURS.get(period, BLACK), linestyle=STYLES[kind],
                label=f"{kind} of the gait of {period} step{'s' if period > 1 else ''}",
            )
            for period, kind in sorted(seen)
        ],
    )  # fmt: skip
    return figure


def caption(results: Results) -> str:
    """What the curves divide."""
    kinds = sorted({str(group.attrs["kind"]) for group in curves(results)}, key=list(MARKS).index)
    return (
        f"Curves of {' and '.join(f'{kind}s' for kind in kinds)} of the rigid model's gaits over two parameters. "
        "Before the first flip, counted from gentle slopes, walks settle on one step; between the curves they settle "
        "on two, then four."
    )


FIGURE = paper_figure(16, "Where gaits change, over two parameters", NEEDS, caption, plot)
