"""What a stage has found, for people: a headline in words, then a table with symbols, units and digits that count."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.cli.text import aligned, described_summary, paragraph
from walkerlab.labels import unit_by_name, with_unit
from walkerlab.report.gait_diagram import parameter
from walkerlab.report.numbers import NONE, count, fixed, length, listed, number, quantity, told_apart
from walkerlab.report.outcomes import LOOKED_FORWARD_TO, MODELS, ends, walks
from walkerlab.report.sections.basin import shares
from walkerlab.report.sections.families import findings as families
from walkerlab.report.sections.gaits import STATE, complex_number, heads_of, multiplier, symbol
from walkerlab.report.sections.models import CHANNELS
from walkerlab.report.symbols import in_signs

Summary = Mapping[str, Any]
Rows = Sequence[Sequence[str]]
Answer = Callable[[Summary], list[str | Rows]]
"""Paragraphs, and rows of tables."""

SHOWN = 6
"""So many of a long row of numbers are shown."""


def answer(stage: str, summary: Summary) -> list[str]:
    """The lines for a stage's summary; a stage without words of its own has its keys, long rows cut short.

    No lines for a stage that came to nothing: that is told as an error.
    """
    if not summary:
        return []
    return laid_out(ANSWERS[stage](summary)) if stage in ANSWERS else list(described_summary(summary, short=True))


def laid_out(blocks: Iterable[str | Rows]) -> list[str]:
    """Paragraphs in lines, and tables in columns with an empty line before and after them."""
    lines: list[str] = []
    after_table = False
    for block in blocks:
        table = not isinstance(block, str)
        if block:
            lines += [""] if lines and (table or after_table) else []
            lines += paragraph(block) if isinstance(block, str) else aligned(block)
            after_table = table
    return lines


def fixedpoint(summary: Summary) -> list[str | Rows]:
    """The gait under both sets of equations, side by side."""
    slope = f"{number(summary['slope_rad'])} rad ({number(math.degrees(summary['slope_rad']), 3)}°)"
    if "state" not in summary:
        return [f"No gait on a slope of {slope}: {summary['reason']}."]
    stable = "a stable gait" if summary["stable"] else "an unstable gait"
    head = (
        f"On a slope of {slope} there is {stable}: steps of {fixed(summary['step_length_m'], 4)} m "
        f"in {fixed(summary['period_s'], 4)} s; the largest multiplier is {fixed(summary['spectral_radius'], 3)}."
    )
    others = {name: one for name, one in summary.get("equation_sets", {}).items() if another_gait(one, summary)}
    names = summary.get("state_names", STATE)
    heads = heads_of([summary["equations"], *others])
    rows = [["", *heads, "unit"], *gait_rows(names, [summary, *others.values()])]
    found = f"{count(summary['gaits_found'], 'gait')} of one step found."
    return [head, rows, found]


def another_gait(one: Summary, summary: Summary) -> bool:
    """Whether one set of equations has a gait that is told from another one's by the digits that are shown."""
    if "state" not in one:
        return False
    return any(fixed(a, 6) != fixed(b, 6) for a, b in zip(one["state"], summary["state"], strict=True))


def gait_rows(names: Sequence[str], gaits: Sequence[Summary]) -> list[list[str]]:
    """State, multipliers and measures of gaits, one column each."""
    rows = [
        [symbol(name), *(fixed(gait["state"][place], 6) for gait in gaits), "rad/s" if name.startswith("d") else "rad"]
        for place, name in enumerate(names)
    ]
    most = max(len(gait["multipliers"]) for gait in gaits)
    rows += [[f"multiplier {place + 1}", *(multiplier(gait, place) for gait in gaits), ""] for place in range(most)]
    rows += [
        [words, *("" if gait.get(key) is None else written(gait[key]) for gait in gaits), unit_of(key)]
        for key, words, written in (
            ("period_s", "step period", partial(fixed, decimals=5)),
            ("step_length_m", "step length", partial(fixed, decimals=5)),
            ("energy_J", "mean energy", partial(fixed, decimals=3)),
            ("energy_drift_J", "energy drift", partial(number, digits=2)),
            ("min_normal_force_N", "least normal force", partial(fixed, decimals=1)),
            ("max_friction_ratio", "largest friction ratio", partial(fixed, decimals=4)),
            ("max_scuff_depth_m", "scuffing depth", depth),
        )
        if any(key in gait for gait in gaits)
    ]
    return rows


def depth(value_m: float) -> str:
    """A depth in metres."""
    return number(told_apart(value_m), 4)


def unit_of(key: str) -> str:
    """The unit that a key ends in, as a table shows it: nothing for a pure number."""
    unit = unit_by_name(key)
    return "" if unit == "1" else unit


def walk(model: str, summary: Summary) -> list[str | Rows]:
    """How a model's walk went, step by step."""
    steps, periods, lengths = summary["steps"], summary["step_periods_s"], summary["step_lengths_m"]
    head = f"The {model} {walks(steps, summary['outcome'])}"
    if periods:
        head += f"; the last takes {fixed(periods[-1], 4)} s and is {fixed(lengths[-1], 4)} m long"
    rows = [["step", *map(str, shown_places(steps)), ""]] if steps else []
    for words, values, unit in (("period", periods, "s"), ("length", lengths, "m")):
        if values:
            rows.append([words, *elided([fixed(value, 4) for value in values]), unit])
    if summary.get("slips_m"):
        slips = [fixed(1e3 * value, 2) for value in summary["slips_m"]]
        rows.append(["slip", *elided([*slips, *[NONE] * (steps - len(slips))]), "mm"])
    own = [[words, said] for words, said in walk_measures(summary) if said]
    advised = summary.get("advice") and summary["outcome"] != LOOKED_FORWARD_TO
    return [f"{head}.", rows, own, f"advice: {summary['advice']}" if advised else ""]


def walk_measures(summary: Summary) -> list[tuple[str, str]]:
    """What was measured over a walk as a whole."""
    dissipated = summary.get("dissipated_J") or {}
    lost = listed(
        f"{quantity(value, 'J', 3)} {CHANNELS.get(name, name)}" for name, value in dissipated.items() if value
    )
    return [
        ("mean energy", told(summary, "mean_energy_J", 7)),
        ("energy drift", told(summary, "energy_drift_J", 2)),
        ("energy balance off by", told(summary, "energy_balance_residual_J", 2)),
        ("energy lost", lost),
        ("least normal force", told(summary, "min_normal_force_N")),
        ("largest friction ratio", told(summary, "max_friction_ratio")),
        ("largest penetration", length(summary["max_penetration_m"]) if "max_penetration_m" in summary else ""),
        ("scuffing depth", length(summary["max_scuff_depth_m"]) if "max_scuff_depth_m" in summary else ""),
        ("right-hand sides", told(summary, "rhs_evaluations", 9)),
    ]


def told(summary: Summary, key: str, digits: int = 4) -> str:
    """A number of a summary with its unit; nothing if it is not there."""
    return "" if summary.get(key) is None else quantity(summary[key], unit_by_name(key), digits)


def shown_places(total: int) -> list[Any]:
    """The numbers of the steps that are shown of so many."""
    return elided(list(range(1, total + 1)))


def elided(values: Sequence[Any]) -> list[Any]:
    """The values, or of a long row the first and the last ones."""
    if len(values) <= 2 * SHOWN:
        return list(values)
    return [*values[:SHOWN], "…", *values[-2:]]


def tune(summary: Summary) -> list[str | Rows]:
    """Whether other initial velocities are needed, and what the contact model's own gait is."""
    change, gait, cells = summary["adjustment"], summary["gait"], summary["map"]
    if not change["needed"]:
        head = "The contact model walks from the rigid gait as it stands: no adjustment is needed."
    elif change["found"]:
        swing, stance = number(change["scale_dtheta1"], 4), number(change["scale_dtheta2"], 4)
        head = f"The smallest change that walks: θ̇₁ by a factor of {swing}, θ̇₂ by {stance}."
    else:
        head = f"No start was found that walks: {change['reason']}."
    rows = [["starts on the map that walk", f"{100 * cells['walks_share']:.1f} % of {cells['cells']}"]]
    if gait["found"]:
        rows += [
            ["own gait", "stable" if gait["stable"] else "unstable"],
            ["step period", quantity(gait["period_s"], "s")],
            ["step length", quantity(gait["step_length_m"], "m")],
            ["slip a step", length(gait["slip_m"])],
            ["largest multiplier", multiplier(gait, 0)],
        ]
    else:
        rows.append(["own gait", f"none: {gait['reason']}"])
    for name, margin in change.get("margins", {}).items():
        beyond = f"; beyond: {margin['beyond']}" if margin["beyond"] else ", as far as searched"
        rows.append([in_signs(name), f"walks to a factor of {number(margin['factor'], 4)}{beyond}"])
    return [head, rows]


def compare(summary: Summary) -> list[str | Rows]:
    """What of the paper's numbers comes out, as printed beside corrected; of another walker, how the models differ."""
    if "verdicts" not in summary:
        return models_compared(summary)
    verdicts = summary["verdicts"]
    total = sum(verdicts.values())
    head = f"Of {total} numbers that the paper prints, " + listed(
        f"{number} {'is' if number == 1 else 'are'} {name}" for name, number in verdicts.items()
    )
    columns, about = ("as_printed", "corrected", "contact"), ("where", "quantity", "printed")
    rows = [["where", "quantity", "paper", "as printed", "corrected", "contact", "unit", "verdict"]]
    rows += [
        [*(row[key] for key in about), *(number(row[key]) for key in columns), row["unit"], row["verdict"]]
        for row in summary["paper_numbers"]
    ]
    return [f"{head}.", rows]


def models_compared(summary: Summary) -> list[str | Rows]:
    """The last steps of both models beside the gait's and, with knees, those of both instants of their release."""
    steps, outcomes = summary["steps"], summary["outcomes"]
    rows = [["last step", "period (s)", "length (m)", "outcome"]]
    last_steps = [(name, step, outcomes.get(name, "")) for name, step in steps.items()]
    releases = summary.get("releases", {}).items()
    last_steps += [(f"knee released at {name}", walk, walk["outcome"]) for name, walk in releases]
    rows += [[name, number(step["period_s"]), number(step["length_m"]), outcome] for name, step, outcome in last_steps]
    rigid, contact = (ends(outcomes[model]) for model in ("rigid", "contact"))
    head = f"The rigid model {rigid}, " + (
        "and so does the contact model" if contact == rigid else f"the contact model {contact}"
    )
    return [f"{head}.", rows]


def accuracy(summary: Summary) -> list[str | Rows]:
    """Which method is fastest at which error, a line a scene."""
    rows = [["scene", *(f"at {level}" for level in levels(summary["best"]))]]
    rows += [
        [scene, *(best.get(level, "no method") for level in levels(summary["best"]))]
        for scene, best in summary["best"].items()
    ]
    head = f"{len(summary['rows'])} runs measured; the fastest method by the error that is asked for:"
    return [head, rows, *summary["conclusions"].values()]


def levels(best: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Every level of error at which some method was best."""
    return list(dict.fromkeys(level for scene in best.values() for level in scene))


def stability(summary: Summary) -> list[str | Rows]:
    """How many cases ended as they should, and those that did not."""
    total = summary["passed"] + summary["failed"]
    head = f"{summary['passed']} of {total} extreme cases and known problems ended as expected."
    outcomes = Counter((case["family"], case["outcome"]) for case in summary["cases"])
    rows = [["family", "outcome", "cases"], *([family, end, str(n)] for (family, end), n in outcomes.items())]
    failed = [case for case in summary["cases"] if not case["ok"]]
    said = [f"not as expected: {case['name']} ended {case['outcome']}: {case['note']}" for case in failed]
    said += [
        f"not as expected: {known['name']}, off by {number(known['error'], 2)}"
        for known in summary["known"]
        if not known["ok"]
    ]
    return [head, rows, *said]


def continuation(summary: Summary) -> list[str | Rows]:
    """What there is to say of the families, and every bifurcation; branches and exponents are in `show`."""
    over = parameter(summary)
    found = f"{count(len(summary['branches']), 'branch', 'branches')} of gaits over {over}."
    rows = [["bifurcation", "model", "steps", with_unit(over, summary["unit"]), "multiplier"]]
    rows += [
        [one["kind"], one["model"], str(one["period"]), number(one["value"], 9), complex_number(*one["multiplier"])]
        for one in summary["bifurcations"]
    ]
    return [found, *families(summary), rows if len(rows) > 1 else []]


def basin(summary: Summary) -> list[str | Rows]:
    """How much walks, and to what."""
    rows = [["attractor", "cells", "steps to reach it"]]
    rows += [
        [count(row["period"], "step"), str(row["cells"]), number(row.get("median_steps_to_settle"), 3)]
        for row in summary["attractors"]
    ]
    return [in_signs(shares(summary).text), rows if len(rows) > 1 else []]


def engines(summary: Summary) -> list[str | Rows]:
    """What was concluded of each scene; every run is in `show`."""
    told = [
        f"{scene}, {experiment}: {text}"
        for scene, concluded in summary["conclusions"].items()
        for experiment, text in concluded.items()
        if text
    ]
    ran = listed(f"{name} {version}" for name, version in summary["versions"].items())
    return [f"{count(len(summary['rows']), 'run')} in {ran}.", *told]


def plot(summary: Summary) -> list[str | Rows]:
    """The figures."""
    figures = summary["figures"]
    return [f"{count(len(figures), 'figure')} drawn.", [[one["svg"], one["title"]] for one in figures]]


def report(summary: Summary) -> list[str | Rows]:
    """What is on the page."""
    return [f"The page has {count(len(summary['figures']), 'figure')} and {count(len(summary['tables']), 'table')}."]


ANSWERS: dict[str, Answer] = {
    "fixedpoint": fixedpoint,
    **{stage: partial(walk, model.lower()) for stage, model in MODELS.items()},
    "tune": tune,
    "compare": compare,
    "accuracy": accuracy,
    "stability": stability,
    "continuation": continuation,
    "basin": basin,
    "engines": engines,
    "plot": plot,
    "report": report,
}


def verdict(results: Mapping[str, Summary]) -> list[str]:
    """What a whole run has found, in three paragraphs at most: the gait, both walks, and what of the paper holds."""
    walked = [(model.lower(), results[stage]) for stage, model in MODELS.items() if stage in results]
    said = "; the ".join(f"{model} {walks(one['steps'], one['outcome'])}" for model, one in walked)
    of_the_paper = "verdicts" in results.get("compare", {})
    judged = [*(["compare"] if of_the_paper else []), *(["stability"] if "stability" in results else [])]
    gait = headline("fixedpoint", results) if "fixedpoint" in results else ""
    return laid_out([gait, f"The {said}." if said else "", " ".join(headline(stage, results) for stage in judged)])


def headline(stage: str, results: Mapping[str, Summary]) -> str:
    """What the answer of a stage begins with."""
    return str(ANSWERS[stage](results[stage])[0])
