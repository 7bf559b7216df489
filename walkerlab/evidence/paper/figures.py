"""Figures on the paper's claim: difference between the walks of both models (figure 8), and rigid limit (figure 12)."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from walkerlab.evidence.paper.printed import LARGEST_ERROR
from walkerlab.labels import RIGID_STAGE
from walkerlab.views.figures import walks
from walkerlab.views.figures.canvas import add_legend, blank, cost_axis, entry, error_axis, label_of, power_of_ten
from walkerlab.views.figures.illustration import Drawn, Need, Results, paper_figure
from walkerlab.views.figures.style import BLACK, BLUE, GREY, ORANGE, RECORDED, RIGID_LOOK, VERMILLION, Look

TIME_LOOK: Final = Look("difference at the same time", VERMILLION, (0.0, (3.2, 1.4)), 1.2, "", order=3)
PHASE_LOOK: Final = Look("at the same phase of a step", BLACK, "-", 1.2, "", order=4)
PAPER_ERROR: Final = Look("largest error in the paper", GREY, ":", 1.6, "", order=2)
AXIS_MARGIN = 3.0
"""Factor by which the axis extends beyond the extreme errors."""
ZERO_CROSSING = 1e-3
"""Smallest error shown, as a fraction of the largest. Where the difference changes sign, errors fall to zero."""
LEG_QUANTITIES = (("a", "angle", "angle_error_rad"), ("b", "angular velocity", "velocity_error_rad_s"))
"""Compared quantities: letter of the panel, words for the title, and NAME of the stored raw_NAME and aligned_NAME."""
RAW_ERRORS = Need(
    walks.COMPARE_STAGE, "errors", ("time", *(f"raw_{name}" for _, _, name in LEG_QUANTITIES)), walks.NO_STATES
)
ALIGNED_ERRORS = Need(
    walks.COMPARE_STAGE,
    "aligned",
    ("phase", *(f"aligned_{name}" for _, _, name in LEG_QUANTITIES)),
    "no step was completed by both models",
)


def draw_differences(results: Results) -> Drawn:
    """Plot the errors of each leg's angle and angular velocity over the rigid walk's steps, on logarithmic scales."""
    (rigid,), _ = walks.first_strides([walks.walk_of(results[RIGID_STAGE], RIGID_LOOK)])
    raw, aligned = (results[walks.COMPARE_STAGE][need.group] for need in (RAW_ERRORS, ALIGNED_ERRORS))
    claimed = bool(walks.claims_in(results))
    early = raw["time"] <= rigid.time[-1]
    in_phase = [(aligned, PHASE_LOOK)]
    summary = results[walks.COMPARE_STAGE].summary.get("recorded", {})
    if (recorded := results[walks.COMPARE_STAGE].groups.get("recorded/rigid/aligned")) is not None:
        in_phase.append((recorded, replace(RECORDED, label=f"{summary['name']}, at the same phase")))
    figure, axes = walks.time_axes(4, 1.55, [rigid])
    rows = [(*quantity, leg) for quantity in LEG_QUANTITIES for leg in (0, 1)]
    for panel, (letter, words, name, leg) in zip(axes, rows, strict=True):
        errors = [np.abs(raw[f"raw_{name}"][early, leg])]
        walks.line(panel, raw["time"][early], errors[0], TIME_LOOK)
        for group, look in in_phase:
            errors.append(np.abs(group[f"aligned_{name}"][: rigid.strikes.size, :, leg]))
            for begin, end, error in zip((0.0, *rigid.strikes), rigid.strikes, errors[-1], strict=False):
                walks.line(panel, begin + (end - begin) * group["phase"], error, look)
        largest = max(float(error.max()) for error in errors)
        bottom = ZERO_CROSSING * largest
        top = AXIS_MARGIN * largest
        if claimed:
            panel.axhline(LARGEST_ERROR.value, **PAPER_ERROR.line)
            bottom = min(LARGEST_ERROR.value / AXIS_MARGIN, bottom)
            top = max(AXIS_MARGIN * LARGEST_ERROR.value, top)
        panel.set_yscale("log", subs=[])
        panel.yaxis.set_major_formatter(power_of_ten)
        panel.set(ylim=(bottom, top), ylabel=label_of("error", raw.variables[f"raw_{name}"].units))
        panel.set_title(f"({letter}{leg + 1}) {words} of leg {leg + 1}")
    looks = [TIME_LOOK, PHASE_LOOK, *([PAPER_ERROR] if claimed else []), *(look for _, look in in_phase[1:])]
    add_legend(figure, [*(entry(look.label, **look.line) for look in looks), walks.strike_entry(rigid.look)])
    caption_values = []
    for _, words, name in LEG_QUANTITIES:
        at_once = np.abs(raw[f"raw_{name}"]).max()
        in_phase = np.abs(aligned[f"aligned_{name}"]).max()
        caption_values.append((words, at_once, in_phase, raw.variables[f"raw_{name}"].units))
    return figure, (caption_values, LARGEST_ERROR.text if claimed else "", largest_of_recorded(summary))


def largest_of_recorded(summary: Mapping[str, Any]) -> tuple[str, list[tuple[str, float, str]]] | None:
    """Return the name of the recorded walk and its largest differences from the rigid walk at the same phase.

    Return None if no walk was recorded.
    """
    if not summary:
        return None
    differences = summary["differences"]["rigid"]
    units = {"angle_error_rad": "rad", "velocity_error_rad_s": "rad/s"}
    return summary["name"], [
        (words, differences[f"max_{name}"]["aligned"], units[name]) for _, words, name in LEG_QUANTITIES
    ]


ALIGNED_ANGLE = "angle_error_rad"
NUMERICAL_ERROR = "numerical_time_s"
RUN_TIME = "wall_s"
LIMITS: Final = (("limit/all", "(a) the config's feet"), ("limit/all-point-foot", "(b) point feet"))
ERROR_LOOKS: Final = {
    "raw_angle_error_rad": Look("angle at the same time (rad)", VERMILLION, ":", 1.2, "v"),
    ALIGNED_ANGLE: Look("angle in phase (rad)", BLUE, "-", 1.6, "o"),
    "velocity_error_rad_s": Look("angular velocity in phase (rad/s)", ORANGE, "--", 1.4, "s"),
    NUMERICAL_ERROR: Look("numerical error, last touch (s)", GREY, "-.", 1.0, "x"),
}
LIMIT_NEED = Need(
    walks.TUNE_STAGE, LIMITS[0][0], (RUN_TIME, *ERROR_LOOKS), "there is no gait to take to the rigid limit"
)
CLAIM_LINE: Final[dict[str, Any]] = {"color": BLACK, "linestyle": (0.0, (1.0, 2.0)), "linewidth": 1.0}
CONFIG_MARKER: Final[dict[str, Any]] = {
    "color": BLACK,
    "linestyle": "",
    "marker": "o",
    "markersize": 9,
    "fillstyle": "none",
}
MIN_ERROR = 1e-14
"""Error shown in place of zero, which a logarithmic axis cannot show."""


def draw_limit(results: Results) -> Drawn:
    """Plot errors against run time, one point per setting, from the config's contact to the most rigid one."""
    figure = blank(3.6)
    claimed = bool(walks.claims_in(results))
    # Walkers whose feet roll in both models have no series with point feet.
    stored = results[walks.TUNE_STAGE].groups
    stored_series = [
        (stored[name], title) for name, title in LIMITS if name in stored and ALIGNED_ANGLE in stored[name].variables
    ]
    panels = figure.subplots(1, len(stored_series), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (rows, title) in zip(panels, stored_series, strict=True):
        for name, look in ERROR_LOOKS.items():
            values = np.maximum(np.abs(rows[name]), MIN_ERROR)
            axes.plot(rows[RUN_TIME], values, **look.line, marker=look.marker, markersize=4)
            if name != NUMERICAL_ERROR:
                axes.plot(rows[RUN_TIME][:1], values[:1], **CONFIG_MARKER)
        cost_axis(axes)
        error_axis(axes)
        axes.set(title=title if len(stored_series) > 1 else "", xlabel="run time of the walk (s)")
        if claimed:
            axes.axhline(LARGEST_ERROR.value, **CLAIM_LINE)
    panels[0].set_ylabel("error")
    key = [entry(look.label, **look.line, marker=look.marker, markersize=4) for look in ERROR_LOOKS.values()]
    if claimed:
        key.append(entry("the paper's claim", **CLAIM_LINE))
    add_legend(figure, [*key, entry("the config's contact", **CONFIG_MARKER)])
    first, *point_feet = [rows[ALIGNED_ANGLE] for rows, _ in stored_series]
    claim = LARGEST_ERROR.text if claimed else ""
    pushes = results[walks.TUNE_STAGE].identity.config_slice["push_off"]["impulse_N_s"] != 0.0
    return figure, (first[0], first[-1], point_feet[0][-1] if point_feet else None, claim, pushes)


FIGURES = (
    paper_figure(8, (RAW_ERRORS, ALIGNED_ERRORS, walks.STEPS_TAKEN[RIGID_STAGE]), draw_differences),
    paper_figure(12, (LIMIT_NEED,), draw_limit),
)
