"""A walk as a moving picture: the walker on its slope, picture by picture."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from walkerlab.figures import figure_02, figure_06
from walkerlab.figures.canvas import styled
from walkerlab.figures.needs import Results
from walkerlab.figures.stick_diagram import FOOTROOM, HEADROOM, SIDEROOM, Sticks, draw_slope
from walkerlab.figures.style import BLACK, LEGS
from walkerlab.figures.walks import CONTACT_STAGE, RIGID_STAGE

SIZE, DPI = (6.4, 3.6), 100
"""Of a picture, in and pixels per in: both sides are even, as video formats want them."""
STICKS = {RIGID_STAGE: figure_02.sticks_of, CONTACT_STAGE: figure_06.sticks_of}
NEEDS = {RIGID_STAGE: figure_02.FIGURE.needs, CONTACT_STAGE: figure_06.FIGURE.needs}


def why_not(results: Results, stage: str) -> str | None:
    """Why a walk cannot be drawn; None if it can."""
    return next((why for need in NEEDS[stage] if (why := need.missing_in(results, {})) is not None), None)


def sticks_of(results: Results, stage: str) -> Sticks:
    """Where the joints of a walk are."""
    return STICKS[stage](results)


def times(sticks: Sticks, steps: int, rate: int, slower: float) -> NDArray[np.float64]:
    """Times of the pictures (s): the first steps, `rate` pictures a second, so many times slower than life."""
    end = float(sticks.strikes[min(steps, sticks.strikes.size) - 1]) if sticks.strikes.size else float(sticks.time[-1])
    return np.arange(0.0, end, 1.0 / (rate * slower))


def pictures(sticks: Sticks, at: NDArray[np.float64]) -> Iterator[NDArray[np.uint8]]:
    """A picture (height, width, 3) for each time."""
    joints = np.concatenate([sticks.leg(leg) for leg in range(len(LEGS))], axis=1)
    flat = joints.reshape(joints.shape[0], -1)
    # between two samples, straight; both sides of a heel strike are samples, so none is cut across
    places = np.stack([np.interp(at, sticks.time, column) for column in flat.T], axis=1)
    shown = sticks.in_plane(places.reshape(at.size, *joints.shape[1:]))
    with styled():
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        axes.set_aspect("equal")
        length = sticks.leg_length
        points = shown.reshape(-1, 2)
        axes.set_xlim(points[:, 0].min() - SIDEROOM * length, points[:, 0].max() + SIDEROOM * length)
        axes.set_ylim(points[:, 1].min() - FOOTROOM * length, points[:, 1].max() + HEADROOM * length)
        axes.set_xlabel("horizontal position (m)")
        axes.set_ylabel("height (m)")
        draw_slope(axes, sticks)
        legs = [axes.plot([], [], color=look.colour, linestyle=look.style, linewidth=2.2)[0] for look in LEGS]
        (hip,) = axes.plot([], [], linestyle="none", marker="o", markersize=6.0, color=BLACK)
        clock = axes.text(0.01, 0.97, "", transform=axes.transAxes, va="top")
        for time, places in zip(at, shown, strict=True):
            for line, joint in zip(legs, np.split(places, len(LEGS)), strict=True):
                line.set_data(*joint.T)
            hip.set_data(*places[:1].T)
            clock.set_text(f"{time:.2f} s")
            canvas.draw()  # type: ignore[no-untyped-call]
            yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()  # type: ignore[no-untyped-call]
