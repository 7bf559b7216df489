"""Two runs over one another: the legs' angles and the energy of each walk in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from matplotlib.figure import Figure

from walkerlab.figures.canvas import as_file, blank, entry, legend_above, settle, styled
from walkerlab.figures.style import BLUE, ORANGE
from walkerlab.figures.walks import CONTACT_STAGE, RIGID_STAGE
from walkerlab.store.content import Content, Group

ROWS: Final = (("angle", "angle (rad)"), ("mechanical_J", "energy (J)"))
LOOKS: Final[tuple[dict[str, Any], ...]] = (
    {"color": BLUE, "linewidth": 1.3},
    {"color": ORANGE, "linewidth": 1.2, "linestyle": (0.0, (3.2, 1.4))},
)


def overlaid(first: Mapping[str, Content], second: Mapping[str, Content], names: tuple[str, str]) -> Any:
    """SVG and PNG of two runs' walks over one another; None if they have no walk in common that was sampled.

    names  of the runs
    """
    shown = [stage for stage in (RIGID_STAGE, CONTACT_STAGE) if trajectory(first, stage) and trajectory(second, stage)]
    if not shown:
        return None
    title = f"{names[0]} and {names[1]}"
    with styled():
        figure = drawn(shown, (first, second), names)
        settle(figure)
        return as_file(figure, "svg", "diff", title), as_file(figure, "png", "diff", title)


def trajectory(results: Mapping[str, Content], stage: str) -> Group | None:
    """The samples of a walk, if there are any."""
    return results[stage].groups.get("trajectory") if stage in results else None


def drawn(shown: list[str], runs: tuple[Mapping[str, Content], ...], names: tuple[str, str]) -> Figure:
    """A column for each walk, a row for angles and one for the energy."""
    figure = blank(0.5 + 1.9 * len(ROWS))
    axes = figure.subplots(len(ROWS), len(shown), sharex="col", sharey="row", squeeze=False)
    for (first, *_), (_, label) in zip(axes, ROWS, strict=True):
        first.set_ylabel(label)
    for column, stage in enumerate(shown):
        axes[0][column].set_title(stage)
        axes[-1][column].set_xlabel("time (s)")
        for row, (variable, _) in enumerate(ROWS):
            for run, look in zip(runs, LOOKS, strict=True):
                group = trajectory(run, stage)
                if group is not None and variable in group.variables:
                    axes[row][column].plot(group["time"], group[variable], **look)
    legend_above(figure, [entry(name, **look) for name, look in zip(names, LOOKS, strict=True)])
    return figure
