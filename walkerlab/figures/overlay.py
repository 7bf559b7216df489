"""Two runs over one another: the legs' angles and the energy of each walk in time."""

from collections.abc import Mapping
from typing import Any, Final

from matplotlib.figure import Figure

from walkerlab.figures.canvas import add_legend, blank, entry, files_of, styled
from walkerlab.figures.style import BLUE, ORANGE
from walkerlab.figures.walks import CONTACT_STAGE, RIGID_STAGE
from walkerlab.store.content import Content, Group

ROWS: Final[tuple[tuple[str, Any, str], ...]] = (
    ("angle", 0, "angle of leg 1 (rad)"),
    ("angle", 1, "angle of leg 2 (rad)"),
    ("mechanical_J", slice(None), "energy (J)"),
)
LOOKS: Final[tuple[dict[str, Any], ...]] = (
    {"color": BLUE, "linewidth": 1.3},
    {"color": ORANGE, "linewidth": 1.2, "linestyle": (0.0, (3.2, 1.4))},
)


def overlaid(first: Mapping[str, Content], second: Mapping[str, Content], names: tuple[str, str]) -> list[bytes] | None:
    """SVG and PNG of two runs' walks over one another; None if they have no walk in common that was sampled.

    names  of the runs
    """
    both = [
        (stage, [run[stage].groups["trajectory"] for run in (first, second)])
        for stage in (RIGID_STAGE, CONTACT_STAGE)
        if all(stage in run and run[stage].groups.get("trajectory") for run in (first, second))
    ]
    if not both:
        return None
    with styled():
        return files_of(drawn(both, names), "diff", f"{names[0]} and {names[1]}")


def drawn(both: list[tuple[str, list[Group]]], names: tuple[str, str]) -> Figure:
    """A column for each stage, with both runs' trajectories; a row for each leg's angle and one for the energy."""
    figure = blank(0.5 + 1.9 * len(ROWS))
    axes = figure.subplots(len(ROWS), len(both), sharex="col", sharey="row", squeeze=False)
    for row, (variable, leg, label) in zip(axes, ROWS, strict=True):
        row[0].set_ylabel(label)
        for one, (_, groups) in zip(row, both, strict=True):
            for group, look in zip(groups, LOOKS, strict=True):
                if variable in group.variables:
                    one.plot(group["time"], group[variable][..., leg], **look)
    for top, bottom, (stage, _) in zip(axes[0], axes[-1], both, strict=True):
        top.set_title(stage)
        bottom.set_xlabel("time (s)")
    add_legend(figure, [entry(name, **look) for name, look in zip(names, LOOKS, strict=True)])
    return figure
