"""The periodic gait: its fixed point and multipliers under both sets of equations, and all gaits that were found."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.report.blocks import PageBlock, Paragraph, Section
from walkerlab.report.numbers import MINUS, NONE, fixed, number, power_of_ten, quantity, told_apart
from walkerlab.report.results import Results
from walkerlab.report.symbols import DOT, SUBSCRIPTS, in_signs
from walkerlab.report.tables import Column, Table, measured, plainly, side_by_side, table
from walkerlab.store.content import Group

COORDINATE = re.compile(r"(?P<rate>d)?theta(?:_(?P<index>\d+))?(?:_(?P<body>[a-z]\w*))?")
STATE = ("theta_1", "theta_2", "dtheta_1", "dtheta_2")
"""The coordinates of a compass; results of other walkers name theirs."""
SETS = {"as-printed": "as printed", "corrected": "corrected"}
"""The sets of equations, as they are stored and as they are called."""


def section(results: Results) -> Section | None:
    """The gait of this walker on this slope."""
    summary = results.summary("fixedpoint")
    if summary is None:
        return None
    names = summary.get("state_names", STATE)
    shown = SETS if results.of_the_paper else (summary["equations"],)
    sets = {name: found for name in shown if (found := set_of(summary, name)) is not None}
    way = "die out" if summary["stable"] else "grow"
    said = (
        f"Small disturbances {way} by the largest multiplier a step. "
        "A state is given just after the heel strike, angles absolute, from the vertical."
    )
    blocks: list[PageBlock] = [Paragraph(said)]
    if sets:
        blocks.append(gait_table(sets, names))
    every = found_gaits(results, shown, names)
    if every is not None:
        blocks.append(every)
    return Section("gait", "The gait", tuple(blocks), finding(summary))


def set_of(summary: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    """The gait under one set of equations; None if it has none."""
    sets = summary.get("equation_sets", {summary.get("equations"): summary})
    found: Mapping[str, Any] | None = sets.get(name)
    return found if found and found.get("state") else None


def finding(summary: Mapping[str, Any]) -> str:
    """The gait in a sentence."""
    size = f"{quantity(summary['period_s'], 's', 6)} over {quantity(summary['step_length_m'], 'm', 6)}"
    way = "stable" if summary["stable"] else "unstable"
    return f"A step takes {size}; it is {way}, the largest multiplier being {number(summary['spectral_radius'], 4)}."


CHECKS = (
    Column("spectral radius", "spectral_radius", partial(fixed, decimals=5)),
    Column("stable", "stable"),
    measured("energy from the stance foot", "energy_J", partial(fixed, decimals=3)),
    measured("energy drift", "energy_drift_J", partial(number, digits=2)),
    measured("least normal force", "min_normal_force_N", partial(number, digits=4)),
    Column("largest friction ratio", "max_friction_ratio", partial(fixed, decimals=4)),
    measured("scuffing depth", "max_scuff_depth_m", lambda depth: number(told_apart(depth), 4)),
    Column("residual of the step map", "residual", partial(power_of_ten, digits=2)),
)
"""What else a gait is known by."""


def gait_table(sets: Mapping[str, Mapping[str, Any]], names: Sequence[str]) -> Table:
    """Fixed point and multipliers, the sets of equations side by side.

    names  of the coordinates of a state
    """
    multipliers = range(max(len(gait["multipliers"]) for gait in sets.values()))
    lines = [
        *(
            Column(coordinate(name), partial(state_at, place), partial(fixed, decimals=6))
            for place, name in enumerate(names)
        ),
        measured("step period T", "period_s", partial(fixed, decimals=6)),
        measured("step length S", "step_length_m", partial(fixed, decimals=6)),
        *(
            Column(in_signs(f"{'' if place else 'multipliers '}lambda_{place + 1}"), partial(multiplier, place=place))
            for place in multipliers
        ),
        *CHECKS,
    ]
    note = "As printed: Appendix A with its misprint in eq. A.5, as the paper's own code; corrected: without it."
    beside = ", under both sets of equations" if len(sets) > 1 else ""
    return side_by_side(
        f"Fixed point of the step map and its multipliers{beside}",
        lines,
        # the corrected set is labelled only beside the printed one
        {"value" if list(sets) == ["corrected"] else SETS[name]: gait for name, gait in sets.items()},
        note=note if len(sets) > 1 else "",
    )


def state_at(place: int, gait: Mapping[str, Any]) -> float:
    """A coordinate of a gait's fixed point."""
    return float(gait["state"][place])


def coordinate(name: str) -> str:
    """A coordinate with its unit."""
    return f"{symbol(name)} ({'rad/s' if name.startswith('d') else 'rad'})"


def symbol(name: str) -> str:
    """A coordinate's sign, and the body that it is of: 'dtheta_1_shank' becomes 'θ̇₁, shank'."""
    found = COORDINATE.fullmatch(name)
    if found is None:
        return name
    dot = DOT if found["rate"] else ""
    body = f", {found['body'].replace('_', ' ')}" if found["body"] else ""
    return f"θ{dot}{(found['index'] or '').translate(SUBSCRIPTS)}{body}"


def multiplier(gait: Mapping[str, Any], place: int) -> str:
    """A multiplier of a gait; a dash if it has fewer."""
    found = gait["multipliers"]
    return complex_number(*found[place]) if place < len(found) else NONE


def complex_number(real: float, imaginary: float) -> str:
    """A multiplier, as 0.3626 + 0.4603i."""
    if imaginary == 0:
        return fixed(real, 4)
    return f"{fixed(real, 4)} {'+' if imaginary > 0 else MINUS} {fixed(abs(imaginary), 4)}i"


def found_gaits(results: Results, sets: Iterable[str], names: Sequence[str]) -> Table | None:
    """All gaits that the search found, if it was more than one of a set."""
    found = {name: results.group("fixedpoint", f"{name}/gaits") for name in sets}
    groups = {name: gaits_in(group) for name, group in found.items() if group is not None}
    if all(len(gaits) < 2 for gaits in groups.values()):
        return None
    columns = (
        Column("gait", "gait", numeric=True),
        Column("T (s)", "period_s", partial(fixed, decimals=5), numeric=True),
        Column("S (m)", "step_length_m", partial(fixed, decimals=5), numeric=True),
        *(
            Column(symbol(name), partial(state_at, place), partial(fixed, decimals=4), numeric=True)
            for place, name in enumerate(names)
        ),
        Column("spectral radius", "spectral_radius", partial(fixed, decimals=4), numeric=True),
        Column("stable", "stable", lambda stable: plainly(bool(stable))),
        Column("remark", "remark"),
    )
    gaits = {"" if list(groups) == ["corrected"] else SETS[name]: found for name, found in groups.items()}
    return table("Every gait of one step that was found", columns, gaits)


def gaits_in(group: Group) -> list[dict[str, Any]]:
    """The gaits of one set of equations, numbered, each with why it is chosen or cannot be walked."""
    count = group["period_s"].size
    objections = group["objections"].tolist() if "objections" in group.variables else [""] * count
    stored = ("period_s", "step_length_m", "state", "spectral_radius", "stable")
    return [
        {name: group[name][place].tolist() for name in stored}
        | {"gait": place + 1, "remark": "chosen" if place == group.attrs.get("chosen") else objections[place]}
        for place in range(count)
    ]
