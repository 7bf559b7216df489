"""Figure 16: the plane of two parameters: what walks settle on, and the curves on which gaits fold or double."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from walkerlab.figures.bifurcation_diagram import MARKS, STAGE, label_of
from walkerlab.figures.canvas import blank, legend_above
from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, GREY, ORANGE
from walkerlab.store.content import Group

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

NEED: Final = Need(STAGE, "curves", ("model", "period"), "no curves over two parameters (continuation.second)")
COLOURS: Final = {"rigid": BLACK, "contact": ORANGE}
STYLES: Final[dict[str, LineStyleType]] = {"flip": "-", "fold": (0.0, (3.0, 1.5))}
WIDTHS: Final = {1: 1.4, 2: 1.0}
FINEST: Final = 0.6
DOUBLED: Final = {1: "#DCE9F5", 2: "#A9CCE8", 4: "#6CA6D4", 8: "#3B7DB5", 16: "#1F5488"}
OTHER, APERIODIC, NOTHING = "#B5DDC0", "#F2C7A0", "#F4F4F4"


def curves(results: Results) -> list[tuple[str, Group]]:
    """The curves with their models, in the order in which they were followed."""
    found: list[tuple[str, Group]] = []
    for model in COLOURS:
        number = 0
        while (group := results[STAGE].groups.get(f"{model}/curve_{number}")) is not None:
            found.append((model, group))
            number += 1
    return found


def plot(results: Results) -> Figure:
    """Regions by what walks settle on, and every curve over them."""
    figure = blank(4.4)
    axes = figure.subplots()
    regions = results[STAGE].groups.get("rigid/regions")
    key = [] if regions is None else draw_regions(axes, regions)
    legend_above(figure, [*key, *draw_curves(axes, curves(results))])
    axes.set_xlabel(label_of(results))
    axes.set_ylabel(curves(results)[0][1].variables["second"].long_name)
    return figure


def region_kinds(regions: Group) -> list[tuple[str, str, np.ndarray]]:
    """Colour, name and cells of what walks settle on, of what there is."""
    period = regions["period"]
    other = (period > 0) & ~np.isin(period, list(DOUBLED))
    kinds = [(colour, f"{n} step{'s' if n > 1 else ''}", period == n) for n, colour in DOUBLED.items()]
    kinds += [
        (OTHER, "another number of steps", other),
        (APERIODIC, "never repeats itself", period == 0),
        (NOTHING, "none goes on", period < 0),
    ]
    return [kind for kind in kinds if kind[2].any()]


def draw_regions(axes: Axes, regions: Group) -> list[Artist]:
    """Each cell in the colour of what walks settle on there; returns the key."""
    kinds = region_kinds(regions)
    numbers = np.argmax(np.array([where for _, _, where in kinds]), axis=0)
    colours = ListedColormap([colour for colour, _, _ in kinds])
    bounds = BoundaryNorm(np.arange(len(kinds) + 1) - 0.5, len(kinds))
    axes.pcolormesh(
        regions["value"], regions["second"], numbers.T, cmap=colours, norm=bounds, shading="nearest", rasterized=True
    )
    return [Patch(facecolor=colour, edgecolor=GREY, linewidth=0.3, label=name) for colour, name, _ in kinds]


def draw_curves(axes: Axes, drawn: list[tuple[str, Group]]) -> list[Artist]:
    """Every curve, by model, kind and period; returns the key."""
    seen: dict[tuple[str, str], None] = {}
    for model, group in drawn:
        kind = str(group.attrs["kind"])
        axes.plot(
            group["value"], group["second"], color=COLOURS[model], linestyle=STYLES[kind],
            linewidth=WIDTHS.get(int(group.attrs["period"]), FINEST),
        )  # fmt: skip
        seen[model, kind] = None
    return [
        Line2D([], [], color=COLOURS[model], linestyle=STYLES[kind], label=f"{kind}s, {model} model")
        for model, kind in sorted(seen, key=lambda one: (list(COLOURS).index(one[0]), one[1]))
    ]


def caption(results: Results) -> str:
    """What the curves divide, and how much of the plane walks."""
    drawn = curves(results)
    kinds = sorted({str(group.attrs["kind"]) for _, group in drawn}, key=list(MARKS).index)
    models = " and ".join(model for model in COLOURS if any(model == one for one, _ in drawn))
    said = [
        f"Curves of {' and '.join(f'{kind}s' for kind in kinds)} of the {models} model's gaits over two parameters."
    ]
    regions = results[STAGE].groups.get("rigid/regions")
    if regions is not None:
        shares = ", ".join(f"{name} in {100.0 * where.mean():.3g} %" for _, name, where in region_kinds(regions))
        said.append(
            "Shaded: what walks of the rigid model settle on, led from cell to cell from the gait of one step: "
            f"{shares} of the plane."
        )
    return " ".join(said)


SEEN = "A plane of two parameters, shaded by what walks settle on, with the curves of flips and folds between."
FIGURE = paper_figure(16, "Where gaits change, over two parameters", (NEED,), caption, plot, SEEN)
