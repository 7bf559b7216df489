"""Tests of answers on stdout: headlines in words, symbols and units, significant digits, and shortened rows."""

import csv

import pytest
from synthetic_results import paper_row

from walkerlab.outcome import Outcome
from walkerlab.views.report.answers import ANSWERS, answer, elide, verdict
from walkerlab.views.report.gaits import gait_table
from walkerlab.views.report.numbers import number
from walkerlab.views.report.tables import (
    PARAGRAPH_WIDTH,
    Column,
    aligned,
    as_csv,
    csv_text,
    describe_summary,
    measured,
    side_by_side,
    table,
    table_lines,
    width,
)
from walkerlab.views.report.tex import as_tex

GAIT = {
    "state": [-0.2042, 0.1694, -0.6058, -0.861],
    "multipliers": [[0.36331, 0.45959], [0.36331, -0.45959], [0.216, 0.0]],
    "period_s": 0.70360123456789,
    "step_length_m": 0.37143,
    "spectral_radius": 0.58586,
    "stable": True,
    "equations": "corrected",
    "slope_rad": 0.0174,
    "gaits_found": 2,
}
WALK = {
    "outcome": "walked",
    "advice": "",
    "steps": 20_000,
    "step_periods_s": [0.7] * 20_000,
    "step_lengths_m": [0.37] * 20_000,
    "rhs_evaluations": 123,
}


def row(lines, head):
    """Return the cells of a row of a table, without the row head."""
    (found,) = (line for line in lines if line.startswith(f"{head}  "))
    return found.removeprefix(head).split()


def said(lines):
    """Join the lines, with ordinary spaces."""
    return " ".join(" ".join(lines).split())


def cells(lines):
    """Return the words of each line."""
    return [line.split() for line in lines]


def test_multipliers_are_written_as_complex_numbers():
    lines = answer("fixedpoint", GAIT)
    assert row(lines, "multipliers λ₁") == ["0.3633", "+", "0.4596i"]
    assert row(lines, "λ₂") == ["0.3633", "−", "0.4596i"]
    assert row(lines, "λ₃") == ["0.2160"]


def test_answer_mentions_a_spring_but_does_not_call_the_gait_driven_by_it():
    spring = {"driven_by": [], "springs": ["a hip spring of 10 N m/rad"]}
    head = said(answer("fixedpoint", {**GAIT, **spring}))
    assert ", with a hip spring of 10 N m/rad, there is a stable gait" in head
    assert "driven" not in head
    head = said(answer("fixedpoint", {**GAIT, **spring, "driven_by": ["a push-off of 4 N s"]}))
    assert ", driven by a push-off of 4 N s, with a hip spring of 10 N m/rad, there is" in head


def test_corrected_column_is_labelled_only_next_to_the_printed_one():
    assert ["quantity", "value"] in cells(answer("fixedpoint", {**GAIT, "equation_sets": {"corrected": GAIT}}))
    printed = {**GAIT, "equations": "as-printed"}
    assert ["quantity", "as", "printed"] in cells(answer("fixedpoint", printed))


def test_gait_is_reported_in_a_sentence_and_a_table_of_both_sets_of_equations():
    printed = {**GAIT, "equations": "as-printed", "state": [-0.2022, 0.1674, -0.6006, -0.8466]}
    lines = answer("fixedpoint", {**GAIT, "equation_sets": {"as-printed": printed, "corrected": GAIT}})
    assert lines[0].startswith("On a slope of 0.0174 rad (0.997°) there is a stable gait")
    assert ["quantity", "corrected", "as", "printed"] in cells(lines)
    assert row(lines, "θ₁, swing leg (rad)") == ["−0.204200", "−0.202200"]
    assert "0.70360123456789" not in "\n".join(lines)


def test_misprint_without_effect_has_no_column():
    printed = {**GAIT, "equations": "as-printed", "energy_drift_J": 1e-15}
    lines = answer("fixedpoint", {**GAIT, "equation_sets": {"as-printed": printed, "corrected": GAIT}})
    assert ["quantity", "value"] in cells(lines)


def test_state_of_a_walker_with_three_angles_is_listed_by_name():
    gait = {**GAIT, "state": [0.1, 0.2, 0.3, 1.0, 1.1, 1.2]}
    names = ["theta_1", "theta_2", "theta_1_shank", "dtheta_1", "dtheta_2", "dtheta_1_shank"]
    lines = answer("fixedpoint", {**gait, "state_names": names, "equation_sets": {"corrected": gait}})
    assert row(lines, "θ₁, swing shank (rad)") == ["0.300000"]
    assert row(lines, "θ̇₁, swing leg (rad/s)") == ["1.000000"]
    assert row(lines, "θ̇₁, swing shank (rad/s)") == ["1.200000"]


def test_missing_gait_shows_the_reason():
    lines = answer("fixedpoint", {"slope_rad": 0.3, "reason": "the steepest gait is at 0.09 rad"})
    assert lines == ["No gait on a slope of 0.3 rad (17.2°): the steepest gait is at 0.09 rad."]


@pytest.mark.parametrize("stage", ["simulate", "contact-sim"])
def test_long_walk_is_summarised_in_a_few_lines(stage):
    lines = answer(stage, WALK)
    assert lines[0].endswith("walks all 20000 steps; the last takes 0.7000 s and is 0.3700 m long.")
    assert max(map(len, lines)) <= 120
    assert len(lines) < 12
    assert row(lines, "period (s)") == [*["0.7000"] * 4, "…", *["0.7000"] * 6]


def test_periods_and_lengths_are_printed_to_their_numerical_error():
    changed = {"step_period_s": 4e-6, "step_length_m": 3e-3, "end_time_s": 1e-5}
    numbers = {"step_periods_s": [0.8061234], "step_lengths_m": [0.3712345], "steps": 1}
    lines = answer("contact-sim", WALK | numbers | {"numerical_error": changed})
    assert lines[0].endswith("the last takes 0.80612 s and is 0.37 m long.")
    assert row(lines, "period (s)") == ["0.80612"]
    assert "numerical error: 4 × 10⁻⁶ s in period, 0.003 m in step length and 10⁻⁵ s in end time, by" in said(lines)
    exact = dict.fromkeys(changed, 0.0)
    assert "takes 0.806123 s" in answer("simulate", WALK | numbers | {"numerical_error": exact})[0]
    other = {**changed, "by": "another method, radau5"}
    assert "another method, radau5." in said(answer("simulate", WALK | numbers | {"numerical_error": other}))


def test_unknown_numerical_error_is_reported_with_the_reason():
    unknown = {"reason": "with a hundred times tighter tolerances the walk ends differently: fell after 1 step"}
    lines = answer("contact-sim", WALK | {"numerical_error": unknown})
    assert lines[0].endswith("takes 0.7000 s and is 0.3700 m long.")
    assert "numerical error: unknown: with a hundred times tighter tolerances the walk ends differently" in " ".join(
        lines
    )


def test_compared_walks_are_printed_to_their_numerical_error():
    step = {"period_s": 0.8061234, "length_m": 0.3712345}
    errors = {"contact": {"step_period_s": 4e-3, "step_length_m": 4e-6, "end_time_s": 1e-3}}
    summary = {
        "steps": {"rigid": step, "contact": step, "gait": step},
        "outcomes": {"rigid": "walked", "contact": "walked"},
        "numerical_error": errors,
    }
    lines = answer("compare", summary)
    assert row(lines, "rigid") == ["0.80612", "0.37123", "walked"]
    assert row(lines, "contact") == ["0.81", "0.37123", "walked"]
    assert "numerical error of the contact walk: 0.004 s in period" in said(lines)


def test_fall_is_reported_with_advice():
    fall = {"outcome": "fell", "steps": 1, "step_periods_s": [0.7], "step_lengths_m": [0.4], "advice": "Start slower."}
    lines = answer("contact-sim", WALK | fall)
    assert lines[0].startswith("The contact model walks 1 step and then falls; the last takes 0.7000 s")
    assert lines[-1] == "advice: Start slower."
    at_once = {"steps": 0, "step_periods_s": [], "step_lengths_m": []}
    assert answer("simulate", WALK | fall | at_once)[0] == "The rigid model falls in its first step."


@pytest.mark.parametrize("outcome", [outcome.label for outcome in Outcome])
def test_every_outcome_of_a_walk_has_a_text(outcome):
    said = answer("simulate", WALK | {"outcome": outcome, "advice": "Try again."})[0]
    assert outcome not in said.split("; ")[0].split()
    at_once = {"outcome": outcome, "steps": 0, "step_periods_s": [], "step_lengths_m": [], "advice": "Try again."}
    assert "further" not in answer("simulate", WALK | at_once)[0]


def test_channels_without_losses_are_omitted():
    lost = {"damping": 4.0, "friction": 0.0, "edges": 0.0, "knee_strikes": 0.274, "knee_stop": 0.0}
    told = " ".join(row(answer("contact-sim", WALK | {"dissipated_J": lost}), "energy lost"))
    assert told == "4 J in the ground's damping and 0.274 J in knee strikes"


@pytest.mark.parametrize("outcome", ["walked", "fell"])
def test_answer_compares_the_outcomes_of_both_models_for_walkers_not_in_the_paper(outcome):
    step = {"period_s": 0.7, "length_m": 0.4}
    summary = {"steps": {"rigid": step, "contact": step}, "outcomes": {"rigid": "walked", "contact": outcome}}
    head = answer("compare", summary)[0]
    rest = "and so does the contact model" if outcome == "walked" else "the contact model falls"
    assert head == f"The rigid model walks to the end, {rest}."


@pytest.mark.parametrize("stage", ANSWERS)
def test_empty_summary_gives_an_empty_answer(stage):
    assert answer(stage, {}) == []


def test_families_are_described_with_their_bifurcations():
    branch = {"model": "rigid", "period": 1, "stable_ranges": [[1.0, 4.0]]}
    flip = {"kind": "flip", "model": "rigid", "period": 1, "value": 4.0, "multiplier": [-1.0, 0.0]}
    none = {"cascades": [], "attractors": [], "lyapunov": []}
    found = {"branches": [branch, branch], "bifurcations": [flip], "first_doubling": {"rigid": 4.0}, **none}
    lines = answer("continuation", found | {"over": "slope_deg", "unit": "deg"})
    assert lines[0] == "2 branches of gaits over slope."
    assert lines[1].replace("\u00a0", " ") == "The rigid model's one-step gait is stable from 1 deg to 4 deg."
    assert lines[-1].split() == ["flip", "rigid", "1", "4", "−1.0000"]


def test_answer_about_engines_shows_the_conclusions():
    summary = {
        "rows": [{}],
        "versions": {"drake": "1.5"},
        "conclusions": {"kneed": {"own-law": "Closest.", "same-law": ""}},
    }
    assert answer("engines", summary) == ["1 run in drake 1.5.", "kneed, own-law: Closest."]


def test_margins_of_a_start_use_mathematical_symbols():
    margins = {
        "dtheta_1 down": {"factor": 0.0, "beyond": ""},
        "both up": {"factor": 1.10664, "beyond": "off-pad"},
    }
    change = {"needed": False, "found": True, "margins": margins}
    cells = {"walks_share": 0.296, "cells": 3721}
    lines = answer("tune", {"adjustment": change, "gait": {"found": False, "reason": "none was sought"}, "map": cells})
    assert " ".join(row(lines, "θ̇₁ down")) == "0 no failure in the search range"
    assert " ".join(row(lines, "both up")) == "1.1066 off-pad"


def test_long_rows_of_values_are_shortened_in_the_middle():
    assert elide(list(range(11))) == list(range(11))
    assert elide(list(range(100))) == [0, 1, 2, 3, "…", 94, 95, 96, 97, 98, 99]
    (line,) = describe_summary({"values": list(range(1000))}, short=True)
    assert line.split()[:5] == ["values", "0", "1", "2", "3"]
    assert "(1000 values" in line


def test_columns_stay_aligned_if_letters_carry_dots_above():
    first, second = aligned([["θ̇₁", "1"], ["ab", "2"]])
    assert width(first) == width(second) == 5


def test_verdict_of_a_run_has_three_paragraphs():
    rows = [paper_row("Table 1", "m", "5", verdict, "") for verdict in ("input", *("reproduced",) * 3)]
    numbers = {"verdicts": {}, "paper_numbers": rows}
    cases = {"passed": 5, "failed": 0, "cases": [], "known": []}
    judged = "5 of 5 extreme cases and problems with known answers ended as expected."
    of_the_paper = "Of 4 values that the paper prints, 1 is an input, 3 are reproduced,"
    begun = ("On a slope of 0.0174", "The rigid model walks all 20000 steps.", of_the_paper)
    said = verdict({"fixedpoint": GAIT, "simulate": WALK, "compare": numbers, "stability": cases})
    assert [head for line in said for head in begun if line.startswith(head)] == [*begun]
    assert " ".join(said).endswith(f"0 not reproduced. {judged}")
    assert verdict({"compare": {"steps": {}, "outcomes": {}}, "stability": cases}) == [judged]


LONG = "word " * 60
SAYS_MUCH = {
    "fixedpoint": {"slope_rad": 0.3, "reason": LONG},
    "simulate": WALK | {"outcome": "fell", "advice": LONG},
    "tune": {
        "adjustment": {"needed": True, "found": False, "reason": LONG},
        "gait": {"found": False, "reason": "none"},
        "map": {"walks_share": 0.0, "cells": 4},
    },
    "accuracy": {"rows": [], "best": {"rigid": {"1e-6": "dop853"}}, "conclusions": {"rigid": LONG}},
    "stability": {
        "passed": 0,
        "failed": 1,
        "cases": [
            {"family": "start", "name": "slow", "outcome": "fell", "ok": False, "note": LONG, "reason": "it walks"}
        ],
        "known": [],
    },
    "engines": {"rows": [], "versions": {"drake": "1.5"}, "conclusions": {"kneed": {"own-law": LONG}}},
}


@pytest.mark.parametrize("stage", SAYS_MUCH)
def test_answers_of_every_stage_are_wrapped_at_the_same_width(stage):
    lines = answer(stage, SAYS_MUCH[stage])
    assert sum(line.count("word") for line in lines) == 60
    assert max(map(len, lines)) <= PARAGRAPH_WIDTH


def test_page_and_terminal_show_the_same_gait_table():
    gaits = {"as-printed": {**GAIT, "equations": "as-printed"}, "corrected": GAIT}
    shown = gait_table(gaits, ["theta_1", "theta_2", "dtheta_1", "dtheta_2"])
    lines = table_lines(shown)
    for cells in (row for rows in shown.groups.values() for row in rows):
        assert " ".join(row(lines, cells[0].text)) == " ".join(cell.text for cell in cells[1:])
    assert cells_of_head(lines) == " ".join(column.title for column in shown.columns)


def cells_of_head(lines):
    return " ".join(lines[0].split())


def test_terminal_tables_omit_sentences_and_add_a_group_column():
    columns = [Column("case", "name"), Column("error", "error", number, numeric=True), Column("why", "why", wide=True)]
    record = {"name": "slow", "error": 0.5, "why": LONG}
    shown = table("Cases", columns, {"start": [record], "ground": [record]}, by="family")
    assert [line.split() for line in table_lines(shown)] == [
        ["family", "case", "error"],
        ["start", "slow", "0.5"],
        ["ground", "slow", "0.5"],
    ]
    assert as_csv(shown).decode().splitlines()[:2] == ["family,case,error,why", f"start,slow,0.5,{LONG}"]


@pytest.mark.parametrize(
    ("value", "cell"),
    [
        ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"), ("@SUM(A1)", "'@SUM(A1)"), ("+x", "'+x"),
        ("-b ahead", "'-b ahead"), ("-2.5e-3", "-2.5e-3"), (-2.5, "-2.5"), ("fell", "fell"), (None, ""),
    ],
)  # fmt: skip
def test_spreadsheet_formulas_are_escaped_in_csv(value, cell):
    lines = list(csv.reader(csv_text(["case", str(value)], [["a", value]]).decode().splitlines()))
    assert lines[1] == ["a", cell]
    assert lines[0] == ["case", cell or "None"]


def test_side_by_side_table_includes_rows_of_either_record():
    lines = [measured("period", "period_s"), measured("slip", "slip_m", prefix="m"), measured("torque", "torque_N")]
    shown = side_by_side("", lines, {"rigid": {"period_s": 0.7}, "contact": {"period_s": 0.71, "slip_m": 5e-4}})
    assert [[cell.text for cell in row] for row in next(iter(shown.groups.values()))] == [
        ["period (s)", "0.7", "0.71"],
        ["slip (mm)", "", "0.5"],
    ]


def test_cell_is_rounded_for_readers_and_exact_in_files():
    shown = table("", [measured("period", "period_s", lambda value: number(value, 2))], [{"period_s": 0.7036}])
    assert table_lines(shown) == ["period (s)", "0.7"]
    assert as_csv(shown) == b"period (s)\n0.7036\n"
    assert rb"0.70360 \\" in as_tex(shown)
