"""Build the answer that a terminal shows for each stage: a headline, then tables with symbols, units and digits.

Each answer imports the page sections that it needs, so that other commands start faster.
"""

import math
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from markupsafe import escape

from walkerlab.extensions import code_by_word, lazy_function
from walkerlab.labels import join_words, unit_by_name
from walkerlab.physics.energy_channels import CHANNELS
from walkerlab.views.report import gaits
from walkerlab.views.report.numbers import count, decimals_left, fixed, length, number, quantity
from walkerlab.views.report.tables import Cell, Column, Table, describe_summary, lay_out, measured, side_by_side, table
from walkerlab.views.report.words import MODEL_NAMES, WALKED_LABEL, describe_error, describe_limp, legs_differ, words
from walkerlab.views.report.words import walks as walk_text

Summary = Mapping[str, Any]
Answer = Callable[[Summary], Sequence[str | Table]]
"""Function that returns the paragraphs and tables of an answer."""

FIRST_VALUES = 4
"""Number of values shown at the start of a long row."""
LAST_VALUES = 6
"""Number of values shown at the end of a long row."""
MAX_CYCLE = 12
"""Longest cycle (steps) whose step periods are listed in a sentence."""


def answer(stage: str, summary: Summary) -> list[str]:
    """Return lines that summarise the result of a stage. If the stage is not in `ANSWERS`, they list the summary's
    keys."""
    if not summary:
        return []
    return lay_out(ANSWERS[stage](summary)) if stage in ANSWERS else list(describe_summary(summary, short=True))


def answer_html(stage: str, summary: Summary) -> str:
    """Return the answer as HTML. If the stage is not in `ANSWERS`, show its lines as they are."""
    # Imported here, because answers in a terminal need no templates.
    from walkerlab.views.report.page import environment, to_markup

    if stage not in ANSWERS:
        return f"<pre>{escape(chr(10).join(answer(stage, summary)))}</pre>"
    template = environment().get_template("blocks/table.html.j2")
    blocks = (block for block in ANSWERS[stage](summary) if block)
    return "\n".join(
        template.render(block=block, anchor=f"{stage}-{index}")
        if isinstance(block, Table)
        else f"<p>{to_markup(block)}</p>"
        for index, block in enumerate(blocks)
    )


def further_tables(stage: str, summary: Summary) -> list[str]:
    """Return the lines that `--verbose` adds to an answer, or [] if the answer is complete without it."""
    if stage != "robustness" or not summary:
        return []
    from walkerlab.views.report.sections import robustness

    return ["", *lay_out(robustness.filled_tables(summary)[robustness.FIRST_TABLES :])]


def fixedpoint(summary: Summary) -> list[str | Table]:
    """Describe the gait, with both sets of equations side by side if their displayed digits differ."""
    slope = f"{number(summary['slope_rad'])} rad ({number(math.degrees(summary['slope_rad']), 3)}°)"
    if "state" not in summary:
        return [f"No gait on a slope of {slope}: {summary['reason']}."] if "reason" in summary else []
    driven = f", driven by {join_words(summary['driven_by'])}," if summary.get("driven_by") else ""
    driven += f"{'' if driven else ','} with {join_words(summary['springs'])}," if summary.get("springs") else ""
    head = (
        f"On a slope of {slope}{driven} there is {'a stable' if summary['stable'] else 'an unstable'} gait: steps of "
        f"{fixed(summary['step_length_m'], 4)} m in {fixed(summary['period_s'], 4)} s; "
        f"the largest multiplier is {fixed(summary['spectral_radius'], 3)}{describe_limp(summary)}."
    )
    state = [fixed(value, 6) for value in summary["state"]]
    different = {
        name: gait
        for name, gait in summary.get("equation_sets", {}).items()
        if "state" in gait and [fixed(value, 6) for value in gait["state"]] != state
    }
    sets = {summary["equations"]: summary, **different}
    names = summary.get("state_names", gaits.COMPASS_STATE)
    search = f" Method: {summary['sought']}; very unstable gaits may be missed." if summary.get("sought") else ""
    steps = "one stride" if legs_differ(summary) else "one step"
    return [head, gaits.gait_table(sets, names), f"{count(summary['gaits_found'], 'gait')} of {steps} found.{search}"]


def walk_row(title: str, key: str, digits: int = 4) -> Column:
    return Column(title, key, lambda value: quantity(value, unit_by_name(key), digits))


def energy_lost(dissipated: Mapping[str, float]) -> str:
    """List the energy losses of a walk by cause, or return '' if nothing was lost."""
    losses = {name: quantity(lost, "J", 3) for name, lost in dissipated.items() if lost}
    return join_words(f"{lost} {CHANNELS.get(name, name)}" for name, lost in losses.items())


STEP_HEADS = {"step_periods_s": "period (s)", "step_lengths_m": "length (m)", "slips_m": "slip (mm)"}
WALK_ROWS = (
    *gaits.work_columns(partial(number, digits=4)),
    walk_row("speed", "speed_m_s"),
    walk_row("Froude number", "froude"),
    walk_row("cost of transport", "cost_of_transport"),
    walk_row("mean energy", "mean_energy_J", 7),
    walk_row("energy drift", "energy_drift_J", 2),
    walk_row("energy balance error", "energy_balance_residual_J", 2),
    Column("energy lost", lambda walk: energy_lost(walk.get("dissipated_J") or {}) or None),
    walk_row("minimum normal force", "min_normal_force_N"),
    walk_row("largest friction ratio", "max_friction_ratio"),
    Column("largest penetration", "max_penetration_m", length),
    Column("scuffing depth", "max_scuff_depth_m", length),
    walk_row("right-hand sides", "rhs_evaluations", 9),
)


def walk(model: str, summary: Summary) -> list[str | Table]:
    columns = [Column(title, key, numeric=True) for key, title in STEP_HEADS.items()]
    head = f"The {model} {walk_text(summary['steps'], summary['outcome'])}"
    step_rows = each_step(summary)
    if summary["step_periods_s"]:
        last = list(step_rows.values())[-1]
        head += f"; the last takes {last['step_periods_s']} s and is {last['step_lengths_m']} m long"
    error = summary.get("numerical_error")
    advised = summary.get("advice") and summary["outcome"] != WALKED_LABEL
    return [
        f"{head}.",
        " ".join(settling_sentences(summary)),
        side_by_side("", columns, step_rows, head="step"),
        side_by_side("", WALK_ROWS, {"": summary}, head=""),
        f"numerical error: {describe_error(error)}." if error else "",
        f"Not possible on real ground: {'; '.join(objections)}." if (objections := summary.get("objections")) else "",
        f"advice: {summary['advice']}" if advised else "",
    ]


def each_step(summary: Summary) -> dict[str, Summary]:
    """Format the quantities of each step, by step number. The key '…' stands for the middle steps of a long walk."""
    from walkerlab.views.report.sections.walks import format_step

    every = {key: values for key in STEP_HEADS if (values := summary.get(key))}
    return {
        str(place): {
            key: "…" if place == "…" else format_step(place - 1, key, summary)
            for key, values in every.items()
            if place == "…" or place <= len(values)
        }
        for place in elide(range(1, summary["steps"] + 1))
    }


def settling_sentences(summary: Summary) -> Iterator[str]:
    """Yield sentences about the unstable gait from which a walk departs, and about the cycle of steps it ends in."""
    from walkerlab.views.report.sections.walks import format_step

    steps = summary["steps"]
    period = summary.get("repeats_after") or 0
    first = summary.get("leaves_gait_at")
    if first:
        yield f"It begins on an unstable gait and leaves it: step {first} is the first that differs by more than 1 %."
    if 1 < period <= MAX_CYCLE:
        cycle = join_words(format_step(index, "step_periods_s", summary) for index in range(steps - period, steps))
        repeats = "alternates between steps" if period == 2 else f"repeats every {period} steps,"
        yield f"In the end it {repeats} of {cycle} s."
    elif first and summary["outcome"] == WALKED_LABEL:
        yield (
            "In the end all its steps are equal." if period == 1 else "Its last steps do not repeat; a longer walk may."
        )


def elide(values: Sequence[Any]) -> list[Any]:
    """Replace the middle of a long row by '…'."""
    if len(values) <= FIRST_VALUES + LAST_VALUES + 1:
        return list(values)
    return [*values[:FIRST_VALUES], "…", *values[-LAST_VALUES:]]


def tune(summary: Summary) -> list[str | Table]:
    """Describe whether the start needs an adjustment, and the contact model's own gait."""
    from walkerlab.views.report.sections import adjustment

    gait = summary["gait"]
    missing = "" if gait["found"] else f"The contact model has no gait of its own: {gait['reason']}."
    gait_table = missing or side_by_side("", adjustment.GAIT_LINES, {"own gait": gait})
    sentences = (*words.parts("adjustment.answer", summary), *words.parts("basin.grounds", summary["map"]))
    return [*sentences, gait_table, adjustment.margins_table(summary)]


LAST_STEP = (
    Column("last step", "name"),
    measured("period", "period_s"),
    measured("length", "length_m"),
    Column("outcome", "outcome", lambda outcome: outcome or ""),
)


def last_steps(summary: Summary, errors: Mapping[str, Summary]) -> Table:
    """Tabulate the last step of each model, the step of the gait and, if there are knees, the last step for each
    instant at which the knee may be released."""
    steps = []
    for name, step in summary["steps"].items():
        known_errors = {key: errors[name].get(f"step_{key}") for key in ("period_s", "length_m") if name in errors}
        rounded = {key: Cell(fixed(step[key], decimals_left(error))) for key, error in known_errors.items()}
        steps.append({"name": name, "outcome": summary["outcomes"].get(name), **step, **rounded})
    steps += [{"name": f"knee released at {name}", **walk} for name, walk in summary.get("releases", {}).items()]
    return table("", LAST_STEP, steps)


def accuracy(summary: Summary) -> list[str | Table]:
    levels = dict.fromkeys(level for scene in summary["best"].values() for level in scene)
    columns = [Column(f"at {level}", level, lambda method: method or "no method") for level in levels]
    scenes = [{"scene": scene, **best} for scene, best in summary["best"].items()]
    head = f"{len(summary['rows'])} runs measured; the fastest method at each error level:"
    return [head, table("", [Column("scene", "scene"), *columns], scenes), *summary["conclusions"].values()]


def continuation(summary: Summary) -> list[str | Table]:
    """Summarise the families and list every bifurcation. `walkerlab show` lists branches and exponents."""
    from walkerlab.views.report.sections import families

    head = f"{count(len(summary['branches']), 'branch', 'branches')} of gaits over {families.parameter(summary)}."
    return [head, *families.findings(summary), families.bifurcations(summary)]


def starts(summary: Summary) -> list[str | Table]:
    from walkerlab.views.report.sections.families import attractors

    return [words("basin.shares", summary), *words.parts("basin.grounds", summary), attractors(summary)]


def robustness_answer(summary: Summary) -> list[str | Table]:
    from walkerlab.views.report.sections import robustness

    tables = robustness.filled_tables(summary)
    more = len(tables) - robustness.FIRST_TABLES
    tail = f"The option -v shows {count(more, 'more table')}." if more > 0 else ""
    return [*robustness.findings(summary), *tables[: robustness.FIRST_TABLES], tail]


def best_walker(summary: Summary) -> list[str | Table]:
    from walkerlab.views.report.sections.robustness import design_blocks

    return [*design_blocks(summary), *config_lines(summary)]


def config_lines(summary: Summary) -> list[str]:
    """Return lines that name the config file that a stage wrote, and the command to try next."""
    file = summary.get("config")
    return [] if file is None else [f"config: {file}", f"next: `walkerlab report -c {shlex.quote(file)}`."]


def identified_walker(summary: Summary) -> list[str | Table]:
    from walkerlab.views.report.sections import identification

    usable = identification.is_usable(identification.verdict_of(summary))
    lines = config_lines(summary) if usable else config_lines(summary)[:1]
    return [*identification.findings(summary), *identification.tables(summary), *lines]


def measurements_to_make(summary: Summary) -> list[str | Table]:
    from walkerlab.views.report.sections import identification

    return [*identification.plan_findings(summary), *identification.plan_tables(summary)]


def engines(summary: Summary) -> list[str | Table]:
    """Report the conclusions for each scene. `walkerlab show` lists every run."""
    conclusions = [
        f"{scene}, {experiment}: {text}"
        for scene, concluded in summary["conclusions"].items()
        for experiment, text in concluded.items()
        if text
    ]
    engine_names = join_words(f"{name} {version}" for name, version in summary["versions"].items())
    return [f"{count(len(summary['rows']), 'run')} in {engine_names}.", *conclusions]


def plot(summary: Summary) -> list[str | Table]:
    figures = summary["figures"]
    return [f"{count(len(figures), 'figure')} drawn.", table("", [Column("", "svg"), Column("", "title")], figures)]


def report(summary: Summary) -> list[str | Table]:
    return [f"The page has {count(len(summary['figures']), 'figure')} and {count(len(summary['tables']), 'table')}."]


ANSWERS: dict[str, Answer] = {
    "fixedpoint": fixedpoint,
    **{stage: partial(walk, model.lower()) for stage, model in MODEL_NAMES.items()},
    "tune": tune,
    "accuracy": accuracy,
    "continuation": continuation,
    "basin": starts,
    "robustness": robustness_answer,
    "design": best_walker,
    "identify": identified_walker,
    "plan": measurements_to_make,
    "engines": engines,
    "plot": plot,
    "report": report,
    **{stage: lazy_function(code) for stage, code in code_by_word("answers").items()},
}


def verdict(results: Mapping[str, Summary]) -> list[str]:
    """Summarise a whole run in at most three paragraphs: gait, walks, and verdicts on the paper."""
    walks = [(model.lower(), results[stage]) for stage, model in MODEL_NAMES.items() if stage in results]
    outcomes = "; the ".join(f"{model} {walk_text(summary['steps'], summary['outcome'])}" for model, summary in walks)
    judged = ("compare",) if "verdicts" in results.get("compare", {}) else ()
    stages = [stage for stage in ("fixedpoint", *judged, "stability") if stage in results]
    heads = {stage: str(ANSWERS[stage](results[stage])[0]) for stage in stages}
    return lay_out([heads.pop("fixedpoint", ""), f"The {outcomes}." if outcomes else "", " ".join(heads.values())])
