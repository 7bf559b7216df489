"""Figure 5: angular velocities of both links from the adjusted start, with the rigid model's."""

from __future__ import annotations

from matplotlib.figure import Figure

from walkerlab.figures.illustration import paper_figure
from walkerlab.figures.in_time import legend, line, time_axes
from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import CONTACT, RIGID, Look
from walkerlab.figures.walks import Walk, shown, touch_times
from walkerlab.store.content import Content

TUNE_STAGE = "tune"
STATES = ("time", "velocity")
ADJUSTED = Need(TUNE_STAGE, "adjusted", STATES, "no start of those searched walks")
FROM_RIGID = Need(TUNE_STAGE, "rigid_start", STATES, "the rigid model took no step")


def walk_from(result: Content, group: str, look: Look, outcome: str) -> Walk:
    """A walk that `tune` stored in one of its groups."""
    stored = result[group]
    times = touch_times(stored)
    return Walk(look, outcome, times.size, times, stored["time"], {"velocity": stored["velocity"]})


def walks(results: Results) -> list[Walk]:
    """The rigid model from its start, the contact model from the adjusted one."""
    result = results[TUNE_STAGE]
    outcome = str(result.summary["procedure"]["adjusted"]["outcome"])
    return [walk_from(result, "rigid_start", RIGID, "walked"), walk_from(result, "adjusted", CONTACT, outcome)]


def links(results: Results) -> tuple[str, str]:
    """What to call the legs: as the paper does if the walker is its compass, else by what they do first."""
    if "paper_start" in results[TUNE_STAGE].summary:
        return "link 1", "link 2"
    return "the leg that swings first", "the leg that stands first"


def plot(results: Results) -> Figure:
    """A row for each link."""
    drawn, _ = shown(walks(results))
    figure, axes = time_axes(2, 1.9, drawn)
    for leg, one in enumerate(axes):
        for walk in drawn:
            line(one, walk.time, walk["velocity"][:, leg], walk.look)
        one.set_ylabel("velocity (rad/s)")
        one.set_title(f"({'ab'[leg]}) angular velocity of {links(results)[leg]}")
    legend(figure, drawn)
    return figure


def caption(results: Results) -> str:
    """What the start was, and how the walk went."""
    found = results[TUNE_STAGE].summary["adjustment"]
    extent = shown(walks(results))[1]
    start = (
        "the rigid start as it stands, since no adjustment is needed"
        if not found["needed"]
        else f"the rigid start with velocities scaled by {found['scale_dtheta1']:.4g} and {found['scale_dtheta2']:.4g}"
    )
    legs = "links" if "paper_start" in results[TUNE_STAGE].summary else "legs"
    walked = f"and walks {found['walked_steps']} steps"
    return f"Angular velocities of both {legs}{extent}; the contact model begins at {start}, {walked}."


SEEN = (
    "Two plots over time, one a link: each velocity rises to one hump while its leg swings and to a lower "
    "one while it stands."
)
FIGURE = paper_figure(5, "Angular velocities from the adjusted start", (ADJUSTED, FROM_RIGID), caption, plot, SEEN)
