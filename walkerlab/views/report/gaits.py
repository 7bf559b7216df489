"""Tabulate gaits, with values and multipliers, and build the section that lists all gaits."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.labels import add_unit, unit_by_name
from walkerlab.views.report import numbers
from walkerlab.views.report.blocks import Paragraph, Results, Section, stage_section
from walkerlab.views.report.tables import Column, Table, measured, side_by_side, table
from walkerlab.views.report.words import legs_differ, words

COORDINATE_NAME = re.compile(r"(?P<rate>d)?theta(?:_(?P<index>\d+))?(?:_(?P<body>[a-z]\w*))?")
COMPASS_STATE = ("theta_1", "theta_2", "dtheta_1", "dtheta_2")
"""Coordinates of a compass, for results that do not store the names of the coordinates."""
LEG_ROLES = {"1": "swing", "2": "stance"}
"""Role of each leg in the step that begins in a gait's state."""
SETS = {"as-printed": "as printed", "corrected": "corrected"}
"""Sets of equations: stored name and display name."""


def gait_table(sets: Mapping[str, Mapping[str, Any]], names: Sequence[str], note: str = "") -> Table:
    """Tabulate gaits and their multipliers, with a column for each set of equations.

    sets   gait by the name of its set of equations
    names  names of the gait's coordinates
    """
    six = partial(numbers.fixed, decimals=6)
    five = partial(numbers.fixed, decimals=5)
    multipliers = range(max(len(multipliers_of(gait)) for gait in sets.values()))
    differ = any(legs_differ(gait) for gait in sets.values())
    first = "multipliers of a stride " if differ else "multipliers "
    titles = [numbers.typeset(f"{'' if place else first}lambda_{place + 1}") for place in multipliers]
    lines = [
        *(Column(coordinate(name), partial(state_at, place), six) for place, name in enumerate(names)),
        measured("step period T", "period_s", six),
        measured("step length S", "step_length_m", six),
        *(asymmetry_lines(six) if differ else ()),
        *(Column(title, partial(multiplier, place)) for place, title in enumerate(titles)),
        Column(f"spectral radius{' per step' if differ else ''}", "spectral_radius", five),
        Column("stable", "stable"),
        *work_columns(partial(numbers.number, digits=4)),
        measured("speed", "speed_m_s", partial(numbers.fixed, decimals=4)),
        measured("Froude number", "froude", partial(numbers.fixed, decimals=4)),
        measured("cost of transport", "cost_of_transport", five),
        measured("mean energy above the stance foot", "energy_J", partial(numbers.fixed, decimals=3)),
        measured("energy drift", "energy_drift_J", partial(numbers.number, digits=2)),
        measured("minimum normal force", "min_normal_force_N", partial(numbers.number, digits=4)),
        Column("largest friction ratio", "max_friction_ratio", partial(numbers.fixed, decimals=4)),
        measured("minimum normal impulse", "min_normal_impulse_N_s", partial(numbers.number, digits=4)),
        Column("largest impulse ratio", "max_impulse_ratio", partial(numbers.fixed, decimals=4)),
        measured("scuffing depth", "max_scuff_depth_m", lambda depth: numbers.number(numbers.drop_rounding(depth), 4)),
        Column("residual of the step map", "residual", partial(numbers.power_of_ten, digits=2)),
    ]
    both = len(sets) > 1
    # The corrected equations need a label only next to the printed ones.
    gaits = {"value" if list(sets) == ["corrected"] else SETS[name]: gait for name, gait in sets.items()}
    caption = f"Fixed point of the step map and its multipliers{', under both sets of equations' if both else ''}"
    return side_by_side(caption, lines, gaits, note=note)


def multipliers_of(gait: Mapping[str, Any]) -> Sequence[Sequence[float]]:
    """Return the multipliers of a step or, if the legs differ, of a stride."""
    multipliers: Sequence[Sequence[float]] = gait.get("multipliers", gait.get("stride_multipliers", ()))
    return multipliers


def step_value(place: int, key: str, gait: Mapping[str, Any]) -> float:
    return float(gait["gait_steps"][place][key])


def asymmetry_lines(written: Callable[[Any], str]) -> Iterator[Column]:
    """Yield table lines for the periods and lengths of a gait's two steps, and for their asymmetries."""
    for index, leg in enumerate(("leg 1", "leg 2")):
        for name, key in (("period", "period_s"), ("length", "length_m")):
            title = add_unit(f"{name} of the step in which {leg} swings", unit_by_name(key))
            yield Column(title, partial(step_value, index, key), written, numeric=True)
    for name in ("step_period", "step_length"):
        words = f"asymmetry of the {name.replace('_', ' ')} (second minus first, over the mean)"
        yield Column(words, f"asymmetry/{name}", lambda share: f"{numbers.fixed(100.0 * share, 2)} %")


WORK_SOURCES = {"gravity": "gravity", "push_off": "the push-off", "hip": "the hip", "knees": "the knees"}
"""Sources of a step's work: stored name and display name."""


WORK_ROUNDING = 1e-12
"""Fraction of the largest contribution to the work below which a contribution is a rounding error."""


def source_work(name: str, record: Mapping[str, Any]) -> float | None:
    """Return the work of a source, or None if it may be nothing but rounding."""
    work = record.get("work_per_step_J") or {}
    largest = max(map(abs, work.values()), default=0.0)
    return work[name] if abs(work.get(name, 0.0)) > WORK_ROUNDING * largest else None


def work_columns(written: Callable[[Any], str]) -> Iterator[Column]:
    """Yield a column for the work of each source per step. Values that may be nothing but rounding are omitted."""
    for name, source in WORK_SOURCES.items():
        yield Column(f"work of {source} per step (J)", partial(source_work, name), written)


def state_at(place: int, gait: Mapping[str, Any]) -> float:
    return float(gait["state"][place])


def coordinate(name: str) -> str:
    """Return the label of a coordinate just after heel strike, such as 'θ₁, swing leg (rad)' for 'theta_1'."""
    unit = "rad/s" if name.startswith("d") else "rad"
    match = COORDINATE_NAME.fullmatch(name)
    role = LEG_ROLES.get(match["index"] or "") if match else None
    if match is None or role is None:
        return f"{symbol(name)} ({unit})"
    letter, _, _ = symbol(name).partition(",")
    return f"{letter}, {role} {match['body'] or 'leg'} ({unit})"


def symbol(name: str) -> str:
    """Return symbol and body of a coordinate, such as 'θ̇₁, shank' for 'dtheta_1_shank'."""
    if (match := COORDINATE_NAME.fullmatch(name)) is None:
        return name
    body = f", {match['body'].replace('_', ' ')}" if match["body"] else ""
    return f"θ{numbers.DOT if match['rate'] else ''}{(match['index'] or '').translate(numbers.SUBSCRIPTS)}{body}"


def multiplier(place: int, gait: Mapping[str, Any]) -> str:
    """Format one multiplier of a gait, or a dash if the gait has fewer multipliers."""
    multipliers = multipliers_of(gait)
    return complex_number(*multipliers[place]) if place < len(multipliers) else numbers.NONE


def complex_number(real: float, imaginary: float) -> str:
    """Format a multiplier, as in 0.3626 + 0.4603i."""
    if imaginary == 0:
        return numbers.fixed(real, 4)
    return f"{numbers.fixed(real, 4)} {'+' if imaginary > 0 else numbers.MINUS} {numbers.fixed(abs(imaginary), 4)}i"


@stage_section("fixedpoint")
def section(results: Results, summary: Mapping[str, Any]) -> Section | None:
    names = summary.get("state_names", COMPASS_STATE)
    set_names = SETS if results.claims else (summary["equations"],)
    sets = summary.get("equation_sets", {summary.get("equations"): summary})
    selected = {name: sets[name] for name in set_names if name in sets}
    gaits = {name: gait for name, gait in selected.items() if gait.get("state")}
    every = {name: gait["gaits"] for name, gait in selected.items() if gait.get("gaits")}
    blocks = (
        Paragraph(words("gait.disturbances", summary)),
        gait_table(gaits, names, note=words("gait.equations") if len(gaits) > 1 else "") if gaits else None,
        tabulate_gaits(every, names) if any(len(gait) > 1 for gait in every.values()) else None,
    )
    return Section.create("gait", "The gait", blocks, words("gait.finding", summary))


def tabulate_gaits(sets: Mapping[str, Sequence[Mapping[str, Any]]], names: Sequence[str]) -> Table:
    """Tabulate all gaits by set of equations. Remarks mark the chosen gait, and say why other gaits are not
    physical."""
    four = partial(numbers.fixed, decimals=4)
    five = partial(numbers.fixed, decimals=5)
    columns = (
        Column("gait", "gait", numeric=True),
        measured("T", "period_s", five),
        measured("S", "step_length_m", five),
        *(Column(symbol(name), partial(state_at, index), four, numeric=True) for index, name in enumerate(names)),
        Column("spectral radius", "spectral_radius", four, numeric=True),
        Column("stable", "stable"),
        Column("remark", lambda gait: "chosen" if gait["chosen"] else gait["objection"]),
    )
    numbered = {name: [{**gait, "gait": index} for index, gait in enumerate(found, 1)] for name, found in sets.items()}
    gaits = {"" if list(sets) == ["corrected"] else SETS[name]: found for name, found in numbered.items()}
    differ = any(legs_differ(gait) for found in sets.values() for gait in found)
    return table(f"All {'gaits of one stride' if differ else 'one-step gaits'} found", columns, gaits)
