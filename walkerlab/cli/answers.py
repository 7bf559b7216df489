"""What a stage has found, for people: a headline in words, then a table with symbols, units and digits that count."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.cli.text import described_summary, paragraph
from walkerlab.labels import unit_by_name
from walkerlab.report.numbers import count, decimals_left, fixed, length, listed, number, quantity
from walkerlab.report.outcomes import MODELS, WALKED, ends
from walkerlab.report.outcomes import walks as comes
from walkerlab.report.sections import adjustment, families, gaits, stability, walks
from walkerlab.report.sections.families import parameter
from walkerlab.report.sections.models import CHANNELS
from walkerlab.report.sections.paper import numbers_table
from walkerlab.report.symbols import in_signs
from walkerlab.report.tables import Cell, Column, Table, in_lines, measured, side_by_side, table

Summary = Mapping[str, Any]
Answer = Callable[[Summary], Sequence[str | Table]]
"""Paragraphs, and tables."""

SHOWN = 6
"""So many of a long row of numbers are shown."""


def answer(stage: str, summary: Summary) -> list[str]:
    """The lines for a stage's summary; a stage without words of its own has its keys, long rows cut short.

    No lines for a stage that came to nothing: that is told as an error.
    """
    if not summary:
        return []
    return laid_out(ANSWERS[stage](summary)) if stage in ANSWERS else list(described_summary(summary, short=True))


def laid_out(blocks: Iterable[str | Table]) -> list[str]:
    """Paragraphs in lines, and tables with an empty line before and after them."""
    lines: list[str] = []
    after_table = False
    for block in blocks:
        is_table = isinstance(block, Table)
        laid = in_lines(block) if isinstance(block, Table) else paragraph(block)
        if laid:
            lines += [""] if lines and (is_table or after_table) else []
            lines += laid
            after_table = is_table
    return lines


def fixedpoint(summary: Summary) -> list[str | Table]:
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
    found = gaits.gait_table({summary["equations"]: summary, **others}, summary.get("state_names", gaits.STATE))
    return [head, found, f"{count(summary['gaits_found'], 'gait')} of one step found."]


def another_gait(one: Summary, summary: Summary) -> bool:
    """Whether one set of equations has a gait that is told from another one's by the digits that are shown."""
    if "state" not in one:
        return False
    return any(fixed(a, 6) != fixed(b, 6) for a, b in zip(one["state"], summary["state"], strict=True))


def told(words: str, key: str, digits: int = 4) -> Column:
    """A number of a walk as a whole, with its unit."""
    return Column(words, key, lambda value: quantity(value, unit_by_name(key), digits))


def energy_lost(summary: Summary) -> str | None:
    """Where a walk dissipated its energy; None if nowhere."""
    lost = (summary.get("dissipated_J") or {}).items()
    return listed(f"{quantity(value, 'J', 3)} {CHANNELS.get(name, name)}" for name, value in lost if value) or None


OF_EACH_STEP = {"step_periods_s": "period (s)", "step_lengths_m": "length (m)", "slips_m": "slip (mm)"}
OF_THE_WALK = (
    told("mean energy", "mean_energy_J", 7),
    told("energy drift", "energy_drift_J", 2),
    told("energy balance off by", "energy_balance_residual_J", 2),
    Column("energy lost", energy_lost),
    told("least normal force", "min_normal_force_N"),
    told("largest friction ratio", "max_friction_ratio"),
    Column("largest penetration", "max_penetration_m", length),
    Column("scuffing depth", "max_scuff_depth_m", length),
    told("right-hand sides", "rhs_evaluations", 9),
)


def walk(model: str, summary: Summary) -> list[str | Table]:
    """How a model's walk went, step by step."""
    steps, periods, lengths = summary["steps"], summary["step_periods_s"], summary["step_lengths_m"]
    head = f"The {model} {comes(steps, summary['outcome'])}"
    if periods:
        period = walks.of_step(periods[-1], "step_periods_s", summary)
        head += f"; the last takes {period} s and is {walks.of_step(lengths[-1], 'step_lengths_m', summary)} m long"
    columns = [Column(title, key, numeric=True) for key, title in OF_EACH_STEP.items()]
    taken = side_by_side("", columns, each_step(summary), head="step")
    advised = summary.get("advice") and summary["outcome"] != WALKED
    whole = side_by_side("", OF_THE_WALK, {"": summary}, head="")
    error = summary.get("numerical_error")
    told = f"numerical error: {walks.error_in_words(error)}." if error else ""
    return [f"{head}.", taken, whole, told, f"advice: {summary['advice']}" if advised else ""]


def each_step(summary: Summary) -> dict[str, Summary]:
    """What is known of each step that is shown, by its number; an ellipsis stands for the others."""
    every = {key: found for key in OF_EACH_STEP if (found := summary.get(key))}
    return {
        str(place): {
            key: "…" if place == "…" else walks.of_step(values[place - 1], key, summary)
            for key, values in every.items()
            if place == "…" or place <= len(values)
        }
        for place in elided(range(1, summary["steps"] + 1))
    }


def elided(values: Sequence[Any]) -> list[Any]:
    """The values, or of a long row the first and the last ones."""
    if len(values) <= 2 * SHOWN:
        return list(values)
    return [*values[:SHOWN], "…", *values[-2:]]


def tune(summary: Summary) -> list[str | Table]:
    """Whether other initial velocities are needed, and what the contact model's own gait is."""
    change, gait, cells = summary["adjustment"], summary["gait"], summary["map"]
    if not change["needed"]:
        head = "The contact model walks from the rigid gait as it stands: no adjustment is needed."
    elif change["found"]:
        swing, stance = number(change["scale_dtheta1"], 4), number(change["scale_dtheta2"], 4)
        head = f"The smallest change that walks: θ̇₁ by a factor of {swing}, θ̇₂ by {stance}."
    else:
        head = f"No start was found that walks: {change['reason']}."
    share = f"Of the {cells['cells']} starts on the map, {100 * cells['walks_share']:.1f} % walk."
    own = (
        side_by_side("", adjustment.GAIT_LINES, {"own gait": gait})
        if gait["found"]
        else f"No own gait: {gait['reason']}."
    )
    margins = [adjustment.margins_table(summary)] if change.get("margins") else []
    return [head, share, *families.grounds(cells), own, *margins]


def compare(summary: Summary) -> list[str | Table]:
    """What of the paper's numbers comes out, as printed beside corrected; of another walker, how the models differ."""
    if "verdicts" not in summary:
        return models_compared(summary)
    verdicts = summary["verdicts"]
    total = sum(verdicts.values())
    head = f"Of {total} numbers that the paper prints, " + listed(
        f"{number} {'is' if number == 1 else 'are'} {name}" for name, number in verdicts.items()
    )
    return [f"{head}.", numbers_table(summary["paper_numbers"]), *errors_of_models(summary)]


def errors_of_models(summary: Summary) -> list[str]:
    """The numerical error of each model's walk."""
    errors = summary.get("numerical_error", {})
    return [f"numerical error of the {model} walk: {walks.error_in_words(error)}." for model, error in errors.items()]


LAST_STEP = (
    Column("last step", "name"),
    measured("period", "period_s"),
    measured("length", "length_m"),
    Column("outcome", "outcome", lambda outcome: outcome or ""),
)


def models_compared(summary: Summary) -> list[str | Table]:
    """The last steps of both models beside the gait's and, with knees, those of both instants of their release."""
    outcomes, errors = summary["outcomes"], summary.get("numerical_error", {})
    steps = [
        {"name": name, "outcome": outcomes.get(name), **(with_digits(step, errors[name]) if name in errors else step)}
        for name, step in summary["steps"].items()
    ]
    steps += [{"name": f"knee released at {name}", **walk} for name, walk in summary.get("releases", {}).items()]
    rigid, contact = (ends(outcomes[model]) for model in ("rigid", "contact"))
    rest = "and so does the contact model" if contact == rigid else f"the contact model {contact}"
    return [f"The rigid model {rigid}, {rest}.", table("", LAST_STEP, steps), *errors_of_models(summary)]


def with_digits(step: Summary, error: Summary) -> Summary:
    """A step whose period and length are written with the decimals that the numerical error of its walk leaves."""
    errors = {"period_s": error.get("step_period_s"), "length_m": error.get("step_length_m")}
    return {**step, **{key: Cell(fixed(step[key], decimals_left(off))) for key, off in errors.items()}}


def accuracy(summary: Summary) -> list[str | Table]:
    """Which method is fastest at which error, a line a scene."""
    levels = dict.fromkeys(level for scene in summary["best"].values() for level in scene)
    columns = [Column(f"at {level}", level, lambda method: method or "no method") for level in levels]
    scenes = [{"scene": scene, **best} for scene, best in summary["best"].items()]
    head = f"{len(summary['rows'])} runs measured; the fastest method by the error that is asked for:"
    return [head, table("", [Column("scene", "scene"), *columns], scenes), *summary["conclusions"].values()]


def extreme_cases(summary: Summary) -> list[str | Table]:
    """How many cases ended as they should, and those that did not."""
    total = summary["passed"] + summary["failed"]
    head = f"{summary['passed']} of {total} extreme cases and known problems ended as expected."
    failed = [case for case in summary["cases"] if not case["ok"]]
    said = [f"not as expected: {case['name']} ended {case['outcome']}: {case['note']}" for case in failed]
    said += [
        f"not as expected: {known['name']}, off by {number(known['error'], 2)}"
        for known in summary["known"]
        if not known["ok"]
    ]
    return [head, stability.family_table(summary["cases"]), *said]


def continuation(summary: Summary) -> list[str | Table]:
    """What there is to say of the families, and every bifurcation; branches and exponents are in `show`."""
    branches = count(len(summary["branches"]), "branch", "branches")
    head = f"{branches} of gaits over {parameter(summary)}."
    return [head, *families.findings(summary), families.bifurcations(summary)]


def starts(summary: Summary) -> list[str | Table]:
    """How much walks, and to what."""
    return [in_signs(families.shares(summary).text), *families.grounds(summary), families.attractors(summary)]


def engines(summary: Summary) -> list[str | Table]:
    """What was concluded of each scene; every run is in `show`."""
    told = [
        f"{scene}, {experiment}: {text}"
        for scene, concluded in summary["conclusions"].items()
        for experiment, text in concluded.items()
        if text
    ]
    ran = listed(f"{name} {version}" for name, version in summary["versions"].items())
    return [f"{count(len(summary['rows']), 'run')} in {ran}.", *told]


def plot(summary: Summary) -> list[str | Table]:
    """The figures."""
    figures = summary["figures"]
    return [f"{count(len(figures), 'figure')} drawn.", table("", [Column("", "svg"), Column("", "title")], figures)]


def report(summary: Summary) -> list[str | Table]:
    """What is on the page."""
    return [f"The page has {count(len(summary['figures']), 'figure')} and {count(len(summary['tables']), 'table')}."]


ANSWERS: dict[str, Answer] = {
    "fixedpoint": fixedpoint,
    **{stage: partial(walk, model.lower()) for stage, model in MODELS.items()},
    "tune": tune,
    "compare": compare,
    "accuracy": accuracy,
    "stability": extreme_cases,
    "continuation": continuation,
    "basin": starts,
    "engines": engines,
    "plot": plot,
    "report": report,
}


def verdict(results: Mapping[str, Summary]) -> list[str]:
    """What a whole run has found, in three paragraphs at most: the gait, both walks, and what of the paper holds."""
    walked = [(model.lower(), results[stage]) for stage, model in MODELS.items() if stage in results]
    said = "; the ".join(f"{model} {comes(one['steps'], one['outcome'])}" for model, one in walked)
    of_the_paper = "verdicts" in results.get("compare", {})
    judged = [*(["compare"] if of_the_paper else []), *(["stability"] if "stability" in results else [])]
    gait = headline("fixedpoint", results) if "fixedpoint" in results else ""
    return laid_out([gait, f"The {said}." if said else "", " ".join(headline(stage, results) for stage in judged)])


def headline(stage: str, results: Mapping[str, Summary]) -> str:
    """What the answer of a stage begins with."""
    return str(ANSWERS[stage](results[stage])[0])
