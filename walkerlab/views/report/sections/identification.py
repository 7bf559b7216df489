"""Sections on parameters identified from a measured walk, and on measurements that would determine them."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from walkerlab.labels import add_unit, axis_label, join_words, unit_by_name
from walkerlab.views.report.blocks import PageBlock, Paragraph, Results, Section, stage_section
from walkerlab.views.report.numbers import fixed, format_integer, number, quantity
from walkerlab.views.report.sections import motion
from walkerlab.views.report.tables import Column, Table, table
from walkerlab.views.report.words import words

NO_EFFECT = 1e-6
"""Fraction of the largest singular value below which a combination of parameters counts as having no effect on
walks."""
CONTRADICTION = 3.0  # distance (standard errors) beyond which a prior and the walk contradict each other
NOTABLE_CHANGE = 0.5  # smallest reported change of an estimate (standard errors) for a 1 % larger fixed parameter
TIME_ORIGINS = {"time_offset_s": " from the first heel strike"}
GAIT_WORDS = {
    "step_length_m": "steps of {}",
    "period_s": "a period of {}",
    "spectral_radius": "a largest multiplier of {}",
    "drop_sensitivity_s_m": "a sensitivity norm (period for a drop of the floor) of {}",
}
BOTH_LEGS = "the legs weigh {} kg each"
ONE_LEG = "leg 1 weighs {} kg"
DIFFERENCES = {"mass of leg 2": ("heavier", "lighter"), "length of leg 2": ("longer", "shorter")}
ESTIMATE_COLUMNS = (
    Column("parameter", "key"),
    Column("estimate", lambda row: rounded(row["value"], row["standard_error"]), numeric=True),
    Column("standard error", "standard_error", lambda value: number(value, 2), numeric=True),
    Column("unit", "unit"),
    Column("start", "start", lambda value: number(value, 6), numeric=True),
    Column("at a bound", "at_bound"),
)
QUALITY_COLUMNS = (
    Column("quantity"),
    Column("residual (r.m.s.)", written=lambda value: number(value, 3), numeric=True),
    Column("measurement noise", written=lambda value: number(value, 3), numeric=True),
    Column("unit"),
    Column("information lost without it", written=lambda value: f"{100.0 * value:.0f} %", numeric=True),
)
FIXED_COLUMNS = (
    Column("held fixed", "to"),
    Column("larger by", lambda row: quantity(row["change"], unit_by_name(row["to"]), 2), numeric=True),
)


@stage_section("identify", "estimates")
def section(results: Results, summary: Mapping[str, Any]) -> Section | None:
    first, *rest = findings(summary)
    blocks: tuple[PageBlock | None, ...] = (Paragraph(" ".join(rest)), *tables(summary), motion.overlay(results))
    return Section.create("identification", "Identified walker", blocks, first)


def findings(summary: Mapping[str, Any]) -> list[str]:
    """Return the answer in sentences: estimates, undetermined combinations, fit, gait and the other model."""
    verdict = verdict_of(summary)
    other = next((row for row in summary["models"] if row["model"] != summary["model"]), None)
    known = [row for row in summary["estimates"] if row["standard_error"] is not None]
    leg = ONE_LEG if summary.get("first_leg") else BOTH_LEGS
    references = [describe_mass(key, number(value), leg) for key, value in summary["reference_masses_kg"].items()]
    masses = [describe_estimate(row, leg) for row in known if row["key"].endswith("mass_kg")]
    others = [describe_estimate(row) for row in known if not row["key"].endswith("mass_kg")]
    condition = f" if {join_words(references)}" if references else ""
    determined = capitalised("; ".join([*([join_words(masses) + condition] if masses else []), *others]))
    keys = [row["key"] for row in summary["estimates"]]
    left_open = [
        (
            capitalised(join_words(axis_label(key) for key in keys if key in row["combination"])),
            label_combination(row["combination"], keys),
            row["reason"],
        )
        for row in summary["not_identifiable"]
    ]
    separable = any(" and " in row["combination"] for row in summary["not_identifiable"])
    singular = summary["singular_values"]
    without_effect = separable and min(singular) < NO_EFFECT * max(singular)
    parameters = (determined, bool(masses and references), left_open, separable, without_effect)
    further = (contradicted_priors(summary["prior"]), describe_nuisances(summary["nuisance"]), is_usable(verdict))
    quality = (other, describe_gait(summary["gait"]), describe_noise(summary), is_usable(verdict))
    measured = summary.get("measured_spectral_radius")
    held = next(iter(sensitive_rows(summary, known)), None)
    return [
        *words.parts("identify.findings", summary, verdict, *parameters, *further),
        *(describe_limp_of_legs(summary) if is_usable(verdict) else []),
        *words.parts("identify.quality", summary, verdict, *quality),
        *([describe_radius(measured)] if measured and is_usable(verdict) else []),
        *([describe_change(held, known)] if held and is_usable(verdict) else []),
    ]


def verdict_of(summary: Mapping[str, Any]) -> Mapping[str, Any]:
    verdict: Mapping[str, Any] = next(row for row in summary["models"] if row["model"] == summary["model"])
    return verdict


def is_usable(verdict: Mapping[str, Any]) -> bool:
    return verdict["fit"] in ("fits", "fits-but")


def tables(summary: Mapping[str, Any]) -> list[Table]:
    noise = summary["noise"]["measurement"]
    quality = [
        (axis_label(name), residual, noise.get(name), unit_by_name(name), summary["contributions"].get(name, 0.0))
        for name, residual in summary["rms_residual"].items()
    ]
    estimates = [row for row in summary["estimates"] if row["standard_error"] is not None]
    moves = sensitive_rows(summary, estimates)
    changes = [Column(add_unit(axis_label(row["key"]), row["unit"]), row["key"], numeric=True) for row in estimates]
    return [
        table("Estimates", ESTIMATE_COLUMNS, summary["estimates"]),
        table("Fit to the measurements", QUALITY_COLUMNS, quality),
        *([table("If a fixed parameter is off", (*FIXED_COLUMNS, *changes), moves)] if moves else []),
    ]


def sensitive_rows(summary: Mapping[str, Any], estimates: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each fixed parameter: how much every estimate changes if the parameter is 1 % larger.

    The most influential parameter comes first. One that changes no estimate by half a standard error is left out.
    """
    rows = dict[str, dict[str, Any]]()
    errors = {row["key"]: row["standard_error"] for row in estimates}
    for entry in summary.get("sensitivity", ()):
        row = rows.setdefault(entry["to"], {"to": entry["to"], "change": entry["change"], "size": 0.0})
        row[entry["estimate"]] = fixed(entry["per_percent"], decimals_of(errors[entry["estimate"]]))
        row["size"] = max(row["size"], abs(entry["per_percent"]) / errors[entry["estimate"]])
    return [row for row in sorted(rows.values(), key=lambda row: -row["size"]) if row["size"] > NOTABLE_CHANGE]


def rounded(value: float, error: float | None) -> str:
    """Format a value with the decimals that its standard error allows."""
    return number(value, 6) if not error else fixed(value, decimals_of(error))


def decimals_of(error: float) -> int:
    """Return the number of decimals that shows one digit of an error, or two digits if the first is 1."""
    mantissa, _, exponent = f"{error:.1e}".partition("e")
    return max(0, -int(exponent) + (mantissa < "2"))


def unit_ending(unit: str) -> str:
    """Return a unit as written after a number in a sentence, including the space if there is one."""
    return {"deg": " degrees", "1": "", "": ""}.get(unit, f" {unit}")


def value_and_error(value: float, error: float | None, unit: str) -> str:
    """Format a value with its standard error, as in 9.8 ± 0.2 kg."""
    ending = unit_ending(unit)
    if not error:
        return f"{number(value, 6)}{ending}"
    if error >= 10.0 or not math.isfinite(error):
        return f"{number(value, 4)} ± {number(error, 2)}{ending}"
    return f"{fixed(value, decimals_of(error))} ± {fixed(error, decimals_of(error))}{ending}"


def describe_mass(key: str, text: str, leg: str = BOTH_LEGS) -> str:
    """Describe a mass in a phrase such as 'the hip weighs 9.8 ± 0.2 kg'. `leg` is the phrase for the mass of leg 1."""
    label = axis_label(key)
    if label == "leg mass":
        return leg.format(text)
    body = "leg 2" if label == "mass of leg 2" else f"the {label.replace(' mass', '')}"
    return f"{body} weighs {text} kg"


def describe_limp_of_legs(summary: Mapping[str, Any]) -> list[str]:
    """Return sentences about differences between the legs, if any is clear, and about the leg that swings first."""
    rows, others = summary.get("leg_differences", []), summary.get("other_leg_differences", [])
    if not any(abs(row["value"]) > CONTRADICTION * row["standard_error"] for row in rows):
        return []
    limp, first = join_words(map(describe_difference, rows)), summary["first_leg"]
    if first["by"] == "guess":
        or_else = f"{limp} if leg {first['leg']} swings first, otherwise {join_words(map(describe_difference, others))}"
        return [f"The legs differ: {or_else}. The data do not say which leg swings first: --first-leg 1 or 2 would."]
    tried = " Both legs were tried as the first to swing: it is leg {leg}, as the walk shows.".format(**first)
    return [f"The legs differ: {limp}.{tried if first['by'] == 'likelihood' else ''}"]


def describe_difference(row: Mapping[str, Any]) -> str:
    """Describe how leg 2 differs, as in 'leg 2 is 0.31 ± 0.02 kg heavier'."""
    label = axis_label(row["key"])
    more, less = DIFFERENCES.get(label, ("larger", "smaller"))
    subject = "leg 2" if label in DIFFERENCES else f"the {label}"
    by = value_and_error(abs(row["value"]), row["standard_error"], row["unit"])
    return f"{subject} is {by} {more if row['value'] > 0.0 else less}"


def describe_estimate(row: Mapping[str, Any], leg: str = BOTH_LEGS) -> str:
    value = value_and_error(row["value"], row["standard_error"], row["unit"])
    bound = " (at its bound)" if row["at_bound"] else ""
    if row["key"].endswith("mass_kg"):
        return describe_mass(row["key"], value.removesuffix(" kg"), leg) + bound
    return f"the {axis_label(row['key'])} is {value}{bound}"


def describe_change(held: Mapping[str, Any], estimates: Sequence[Mapping[str, Any]]) -> str:
    """Describe how estimates change if the fixed parameter with the most influence is off."""
    change = quantity(held["change"], unit_by_name(held["to"]), 2)
    changes = [f"the {axis_label(row['key'])} by {held[row['key']]}{unit_ending(row['unit'])}" for row in estimates]
    return f"If {held['to']}, which is held fixed, were {change} larger, this would change {join_words(changes)}."


def label_combination(combination: str, keys: Sequence[str]) -> str:
    # The longest key is replaced first, because it may contain a shorter one.
    for key in sorted(keys, key=len, reverse=True):
        combination = combination.replace(key, axis_label(key))
    return combination


def contradicted_priors(priors: Sequence[Mapping[str, Any]]) -> list[tuple[str, str, float]]:
    """Return the label and value of each prior that the walk contradicts, and its distance from the estimate based on
    the walk alone, in standard errors."""
    return [
        (axis_label(row["key"]), value_and_error(row["value"], row["standard_deviation"], row["unit"]), row["distance"])
        for row in priors
        if row["distance"] > CONTRADICTION
    ]


def describe_nuisances(nuisances: Mapping[str, Mapping[str, float]]) -> str:
    phrases = (
        f"the {axis_label(name)}{TIME_ORIGINS.get(name, '')} is "
        f"{value_and_error(row['value'], row['standard_error'], unit_by_name(name))}"
        for name, row in nuisances.items()
    )
    return capitalised(join_words(phrases))


def describe_gait(gait: Mapping[str, Mapping[str, float]]) -> str:
    parts = [
        phrase.format(value_and_error(gait[name]["value"], gait[name]["standard_error"], unit_by_name(name)))
        for name, phrase in GAIT_WORDS.items()
        if name in gait
    ]
    return f"The identified gait has {join_words(parts)}" if parts else ""


def describe_radius(radius: Mapping[str, float]) -> str:
    value = value_and_error(radius["value"], radius["standard_error"], "1")
    plain = fixed(radius["plain"], decimals_of(radius["standard_error"]))
    multiplier = f"a largest multiplier of {value} ({plain} before correction for noise)"
    return f"The steps alone, without a model, have {multiplier}."


def describe_noise(summary: Mapping[str, Any]) -> str:
    """Describe the disturbances of the walk and the noise of the measurement."""
    process = summary["noise"]["process"]
    floor, share = (number(value, 2) for value in (1e3 * process["roughness_m"], 100.0 * process["share_of_leg"]))
    parts = [f"floor {floor} mm rough, {share} % of the leg" if process["roughness_m"] else "an even floor"]
    if process["kick"]:
        parts.append(f"rates that change by {number(100.0 * process['kick'], 2)} % at heel strikes")
    parts += [
        f"{axis_label(name)} measured to {quantity(value, unit_by_name(name), 2)}"
        for name, value in summary["noise"]["measurement"].items()
    ]
    return join_words(parts)


def capitalised(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


@stage_section("plan", "measurements")
def plan_section(_results: Results, summary: Mapping[str, Any]) -> Section | None:
    first, *rest = plan_findings(summary)
    return Section.create("plan", "Measurements to make", (Paragraph(" ".join(rest)), *plan_tables(summary)), first)


def plan_findings(summary: Mapping[str, Any]) -> list[str]:
    """Summarise the plan in sentences: the simplest measurement, the number of steps for each target error, and the
    assumptions."""
    rows = summary["measurements"]
    targets = [place for place, entry in enumerate(rows[0]["errors"]) if "wanted" in entry]
    return words.parts("plan.findings", summary, [goal(rows, place, summary["max_steps"]) for place in targets])


def goal(rows: list[Mapping[str, Any]], place: int, most: int) -> str:
    """Return a sentence about a target error, with the fewest steps that reach it."""
    entry = rows[0]["errors"][place]
    wanted = f"{number(entry['wanted'])}{unit_ending(entry['unit'])}"
    purpose = f"To determine the {axis_label(entry['key'])} to ± {wanted}"
    reached = [row for row in rows if row["errors"][place]["steps_needed"]]
    if not reached:
        return f"{purpose}, {format_integer(most)} steps do not suffice."
    best = min(reached, key=lambda row: row["errors"][place]["steps_needed"])
    needed = best["errors"][place]["steps_needed"]
    steps = "1 step" if needed == 1 else f"{format_integer(needed)} steps"
    return f"{purpose}, record {best['measurement']} of {steps}, starting {best['start']}."


def plan_tables(summary: Mapping[str, Any]) -> list[Table]:
    columns = [Column("measurement", "measurement"), Column("start", "start")]
    for index, entry in enumerate(summary["measurements"][0]["errors"]):
        title = f"± {axis_label(entry['key'])} ({entry['unit']})"
        columns.append(Column(title, partial(error_text, index), numeric=True))
        if "wanted" in entry:
            columns.append(Column(f"steps for ± {number(entry['wanted'])}", partial(steps_text, index), numeric=True))
    return [table(f"Standard errors after {summary['steps']} steps", columns, summary["measurements"])]


def error_text(place: int, row: Mapping[str, Any]) -> str:
    error = row["errors"][place]["standard_error"]
    return "open" if error is None else number(error, 2)


def steps_text(place: int, row: Mapping[str, Any]) -> str:
    needed = row["errors"][place]["steps_needed"]
    return "" if needed is None else format_integer(needed)
