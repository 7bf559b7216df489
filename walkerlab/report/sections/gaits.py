"""The periodic gait: its fixed point and multipliers under both sets of equations, and all gaits that were found."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from walkerlab.report.blocks import Block, Column, Paragraph, Section, Table, body, table
from walkerlab.report.numbers import MINUS, NONE, fixed, number, power_of_ten, quantity
from walkerlab.report.results import Results
from walkerlab.report.symbols import DOT, SUBSCRIPTS, in_signs
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
    blocks: list[Block] = [Paragraph(in_words(summary))]
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


def in_words(summary: Mapping[str, Any]) -> str:
    """What the multipliers say, and how a state is given."""
    way = "die out" if summary["stable"] else "grow"
    return (
        f"Small disturbances {way} by the largest multiplier a step. "
        "A state is given just after the heel strike, angles absolute, from the vertical."
    )


def gait_table(sets: Mapping[str, Mapping[str, Any]], names: Sequence[str]) -> Table:
    """Fixed point and multipliers, the sets side by side."""
    rows = [[coordinate(name), *(fixed(gait["state"][i], 6) for gait in sets.values())] for i, name in enumerate(names)]
    for key, label, digits in (("period_s", "step period T (s)", 6), ("step_length_m", "step length S (m)", 6)):
        rows.append([label, *(fixed(gait[key], digits) for gait in sets.values())])
    for i in range(max(len(gait["multipliers"]) for gait in sets.values())):
        label = in_signs(f"{'multipliers ' if i == 0 else ''}lambda_{i + 1}")
        rows.append([label, *(multiplier(gait, i) for gait in sets.values())])
    rows.append(["spectral radius", *(fixed(gait["spectral_radius"], 5) for gait in sets.values())])
    rows.append(["stable", *("yes" if gait["stable"] else "no" for gait in sets.values())])
    rows.append(["energy from the stance foot (J)", *(fixed(gait["energy_J"], 3) for gait in sets.values())])
    rows.append(["residual of the step map", *(power_of_ten(gait["residual"], 2) for gait in sets.values())])
    columns = [Column("quantity"), *(Column(head, numeric=True) for head in heads_of(list(sets)))]
    if len(sets) < 2:
        return table("Fixed point of the step map and its multipliers", columns, rows)
    note = "As printed: Appendix A with its misprint in eq. A.5, as the paper's own code; corrected: without it."
    return table(
        "Fixed point of the step map and its multipliers, under both sets of equations", columns, rows, note=note
    )


def heads_of(sets: Sequence[str]) -> list[str]:
    """The heads of columns of gaits: what is right needs no name while nothing misprinted stands beside it."""
    return ["value"] if sets == ["corrected"] else [SETS[name] for name in sets]


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


def multiplier(gait: Mapping[str, Any], index: int) -> str:
    """A multiplier of a gait; a dash if it has fewer."""
    found = gait["multipliers"]
    return complex_number(*found[index]) if index < len(found) else NONE


def complex_number(real: float, imaginary: float) -> str:
    """A multiplier, as 0.3626 + 0.4603i."""
    if imaginary == 0:
        return fixed(real, 4)
    return f"{fixed(real, 4)} {'+' if imaginary > 0 else MINUS} {fixed(abs(imaginary), 4)}i"


def found_gaits(results: Results, sets: Iterable[str], names: Sequence[str]) -> Table | None:
    """All gaits that the search found, if it was more than one of a set."""
    found = {name: results.group("fixedpoint", f"{name}/gaits") for name in sets}
    groups = {name: group for name, group in found.items() if group is not None}
    named = list(groups) != ["corrected"]  # what is right needs no name while nothing misprinted stands beside it
    bodies = [body(gait_rows(group), SETS[name] if named else "") for name, group in groups.items()]
    if all(len(one.rows) < 2 for one in bodies):
        return None
    heads = ("gait", "T (s)", "S (m)", *map(symbol, names), "spectral radius")
    columns = (*(Column(head, numeric=True) for head in heads), Column("stable"), Column("remark"))
    return Table("Every gait of one step that was found", columns, tuple(bodies))


def objection(group: Group, index: int) -> str:
    """Why a gait cannot be walked; empty if it can."""
    return str(group["objections"][index]) if "objections" in group.variables else ""


def gait_rows(group: Group) -> list[list[str]]:
    """One row a gait."""
    chosen = group.attrs.get("chosen")
    rows = []
    for index in range(group["period_s"].size):
        state = [fixed(value, 4) for value in group["state"][index]]
        rows.append(
            [
                str(index + 1),
                fixed(group["period_s"][index], 5),
                fixed(group["step_length_m"][index], 5),
                *state,
                fixed(group["spectral_radius"][index], 4),
                "yes" if group["stable"][index] else "no",
                "chosen" if index == chosen else objection(group, index),
            ]
        )
    return rows
