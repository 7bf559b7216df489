"""Terminal answers: for each stage a headline, then tables with symbols, units and significant digits.

A section of the page is imported by the answer that shows a part of it: the others are printed sooner.
"""

import math
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.labels import join_words, unit_by_name
from walkerlab.physics.energy_channels import CHANNELS
from walkerlab.registration import later
from walkerlab.views.report import gaits
from walkerlab.views.report.numbers import count, decimals_left, fixed, length, number, quantity
from walkerlab.views.report.outcomes import MODELS, WALKED, off_by
from walkerlab.views.report.outcomes import walks as comes
from walkerlab.views.report.tables import Cell, Column, Table, in_lines, measured, side_by_side, table
from walkerlab.views.report.text import described_summary, paragraph
from walkerlab.views.report.words import words

Summary = Mapping[str, Any]
Answer = Callable[[Summary], Sequence[str | Table]]
"""Paragraphs and tables."""

SHOWN = 6
"""Values shown at the start of a long row."""


def answer(stage: str, summary: Summary) -> list[str]:
    """Return the lines that summarise a stage's result; stages without a text of their own list their keys.

    No lines for a stage without a result: that is told as an error.
    """
    if not summary:
        return []
    return laid_out(ANSWERS[stage](summary)) if stage in ANSWERS else list(described_summary(summary, short=True))


def laid_out(blocks: Iterable[str | Table]) -> list[str]:
    """Wrap paragraphs, and set tables off by empty lines."""
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
    """Describe the gait, with both sets of equations side by side where the digits shown differ."""
    slope = f"{number(summary['slope_rad'])} rad ({number(math.degrees(summary['slope_rad']), 3)}°)"
    if "state" not in summary:
        return [f"No gait on a slope of {slope}: {summary['reason']}."]
    driven = f", driven by {join_words(summary['driven_by'])}," if summary.get("driven_by") else ""
    driven += f"{'' if driven else ','} with {join_words(summary['springs'])}," if summary.get("springs") else ""
    head = (
        f"On a slope of {slope}{driven} there is {'a stable' if summary['stable'] else 'an unstable'} gait: steps of "
        f"{fixed(summary['step_length_m'], 4)} m in {fixed(summary['period_s'], 4)} s; "
        f"the largest multiplier is {fixed(summary['spectral_radius'], 3)}."
    )
    shown = [fixed(value, 6) for value in summary["state"]]
    others = {
        name: one
        for name, one in summary.get("equation_sets", {}).items()
        if "state" in one and [fixed(value, 6) for value in one["state"]] != shown
    }
    found = gaits.gait_table({summary["equations"]: summary, **others}, summary.get("state_names", gaits.STATE))
    many, sought = f"{count(summary['gaits_found'], 'gait')} of one step found.", summary.get("sought")
    return [head, found, f"{many} Sought: {sought}; very unstable ones may be missed." if sought else many]


def told(title: str, key: str, digits: int = 4) -> Column:
    """Column for a quantity of the whole walk, with its unit."""
    return Column(title, key, lambda value: quantity(value, unit_by_name(key), digits))


def energy_lost(dissipated: Mapping[str, float]) -> str:
    """List the energy losses of a walk by cause; empty if there are none."""
    return join_words(
        f"{quantity(lost, 'J', 3)} {CHANNELS.get(name, name)}" for name, lost in dissipated.items() if lost
    )


OF_EACH_STEP = {"step_periods_s": "period (s)", "step_lengths_m": "length (m)", "slips_m": "slip (mm)"}
OF_THE_WALK = (
    *gaits.works(partial(number, digits=4)),
    told("speed", "speed_m_s"),
    told("Froude number", "froude"),
    told("cost of transport", "cost_of_transport"),
    told("mean energy", "mean_energy_J", 7),
    told("energy drift", "energy_drift_J", 2),
    told("energy balance error", "energy_balance_residual_J", 2),
    Column("energy lost", lambda walk: energy_lost(walk.get("dissipated_J") or {}) or None),
    told("minimum normal force", "min_normal_force_N"),
    told("largest friction ratio", "max_friction_ratio"),
    Column("largest penetration", "max_penetration_m", length),
    Column("scuffing depth", "max_scuff_depth_m", length),
    told("right-hand sides", "rhs_evaluations", 9),
)


def walk(model: str, summary: Summary) -> list[str | Table]:
    """Describe a model's walk, step by step."""
    columns = [Column(title, key, numeric=True) for key, title in OF_EACH_STEP.items()]
    head, taken = f"The {model} {comes(summary['steps'], summary['outcome'])}", each_step(summary)
    if summary["step_periods_s"]:
        last = list(taken.values())[-1]
        head += f"; the last takes {last['step_periods_s']} s and is {last['step_lengths_m']} m long"
    error, advised = summary.get("numerical_error"), summary.get("advice") and summary["outcome"] != WALKED
    return [
        f"{head}.",
        side_by_side("", columns, taken, head="step"),
        side_by_side("", OF_THE_WALK, {"": summary}, head=""),
        f"numerical error: {off_by(error)}." if error else "",
        f"Not possible on real ground: {'; '.join(objections)}." if (objections := summary.get("objections")) else "",
        f"advice: {summary['advice']}" if advised else "",
    ]


def each_step(summary: Summary) -> dict[str, Summary]:
    """Format the steps to be shown, by number; an ellipsis replaces the middle of a long walk."""
    from walkerlab.views.report.sections.walks import of_step

    every = {key: found for key in OF_EACH_STEP if (found := summary.get(key))}
    return {
        str(place): {
            key: "…" if place == "…" else of_step(values[place - 1], key, summary)
            for key, values in every.items()
            if place == "…" or place <= len(values)
        }
        for place in elided(range(1, summary["steps"] + 1))
    }


def elided(values: Sequence[Any]) -> list[Any]:
    """Return the values with '…' for the middle of a long row."""
    if len(values) <= 2 * SHOWN:
        return list(values)
    return [*values[:SHOWN], "…", *values[-2:]]


def tune(summary: Summary) -> list[str | Table]:
    """Say whether the start needs an adjustment, and describe the contact model's own gait."""
    from walkerlab.views.report.sections import adjustment

    gait = summary["gait"]
    own = (
        side_by_side("", adjustment.GAIT_LINES, {"own gait": gait})
        if gait["found"]
        else f"No own gait: {gait['reason']}."
    )
    told = (*words.parts("adjustment.answer", summary), *words.parts("basin.grounds", summary["map"]))
    return [*told, own, adjustment.margins_table(summary)]


LAST_STEP = (
    Column("last step", "name"),
    measured("period", "period_s"),
    measured("length", "length_m"),
    Column("outcome", "outcome", lambda outcome: outcome or ""),
)


def last_steps(summary: Summary, errors: Mapping[str, Summary]) -> Table:
    """Compare both models' last steps with the gait's and, with knees, with those for each release instant.

    errors  numerical errors of the models' walks, by model: they leave so many digits
    """
    steps = []
    for name, step in summary["steps"].items():
        known = {key: errors[name].get(f"step_{key}") for key in ("period_s", "length_m") if name in errors}
        left = {key: Cell(fixed(step[key], decimals_left(error))) for key, error in known.items()}
        steps.append({"name": name, "outcome": summary["outcomes"].get(name), **step, **left})
    steps += [{"name": f"knee released at {name}", **walk} for name, walk in summary.get("releases", {}).items()]
    return table("", LAST_STEP, steps)


def accuracy(summary: Summary) -> list[str | Table]:
    """Name the fastest method for each error level, a row per scene."""
    levels = dict.fromkeys(level for scene in summary["best"].values() for level in scene)
    columns = [Column(f"at {level}", level, lambda method: method or "no method") for level in levels]
    scenes = [{"scene": scene, **best} for scene, best in summary["best"].items()]
    head = f"{len(summary['rows'])} runs measured; the fastest method at each error level:"
    return [head, table("", [Column("scene", "scene"), *columns], scenes), *summary["conclusions"].values()]


def continuation(summary: Summary) -> list[str | Table]:
    """Summarise the families and list every bifurcation; `show` has branches and exponents."""
    from walkerlab.views.report.sections import families

    branches = count(len(summary["branches"]), "branch", "branches")
    head = f"{branches} of gaits over {families.parameter(summary)}."
    return [head, *families.findings(summary), families.bifurcations(summary)]


def starts(summary: Summary) -> list[str | Table]:
    """Report the share of starts that walk, and the attractors."""
    from walkerlab.views.report.sections.families import attractors

    told = (words("basin.shares", summary), *words.parts("basin.grounds", summary))
    return [*told, attractors(summary)]


def stood(summary: Summary) -> list[str | Table]:
    from walkerlab.views.report.sections import robustness

    return [*robustness.findings(summary), *robustness.tables(summary)]


def best_walker(summary: Summary) -> list[str | Table]:
    """Describe the optimum, and name its config file."""
    from walkerlab.views.report.sections.robustness import designed

    file = summary.get("config")
    told = [] if file is None else [f"config: {file}", f"next: `walkerlab report -c {shlex.quote(file)}`."]
    return [*designed(summary), *told]


def engines(summary: Summary) -> list[str | Table]:
    """Report the conclusions for each scene; `show` has every run."""
    told = [
        f"{scene}, {experiment}: {text}"
        for scene, concluded in summary["conclusions"].items()
        for experiment, text in concluded.items()
        if text
    ]
    ran = join_words(f"{name} {version}" for name, version in summary["versions"].items())
    return [f"{count(len(summary['rows']), 'run')} in {ran}.", *told]


def plot(summary: Summary) -> list[str | Table]:
    figures = summary["figures"]
    return [f"{count(len(figures), 'figure')} drawn.", table("", [Column("", "svg"), Column("", "title")], figures)]


def report(summary: Summary) -> list[str | Table]:
    return [f"The page has {count(len(summary['figures']), 'figure')} and {count(len(summary['tables']), 'table')}."]


paper_table = later("walkerlab.evidence.paper.sections", "table_of")
"""Draw a table of the paper's values as its page has it."""

ANSWERS: dict[str, Answer] = {
    "fixedpoint": fixedpoint,
    **{stage: partial(walk, model.lower()) for stage, model in MODELS.items()},
    "tune": tune,
    "compare": later("walkerlab.evidence.paper.sections", "answer"),
    "accuracy": accuracy,
    "stability": later("walkerlab.evidence.verification.section", "answer"),
    "continuation": continuation,
    "basin": starts,
    "robustness": stood,
    "design": best_walker,
    "engines": engines,
    "plot": plot,
    "report": report,
}


def verdict(results: Mapping[str, Summary]) -> list[str]:
    """Summarise a whole run in three paragraphs at most: gait, walks, and verdicts on the paper."""
    walked = [(model.lower(), results[stage]) for stage, model in MODELS.items() if stage in results]
    said = "; the ".join(f"{model} {comes(one['steps'], one['outcome'])}" for model, one in walked)
    judged = ("compare",) if "verdicts" in results.get("compare", {}) else ()
    told = [stage for stage in ("fixedpoint", *judged, "stability") if stage in results]
    heads = {stage: str(ANSWERS[stage](results[stage])[0]) for stage in told}
    return laid_out([heads.pop("fixedpoint", ""), f"The {said}." if said else "", " ".join(heads.values())])
