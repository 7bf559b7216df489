"""Tests of the report's section on error and run time: every method, failure and reference."""

import pytest
from synthetic_results import config, fixedpoint, stored

from walkerlab.views.report.blocks import Results, Statements
from walkerlab.views.report.sections.accuracy import section
from walkerlab.views.report.tables import Table
from walkerlab.views.report.words import words


def row(method, tolerance, error, wall_s, outcome="walked", scene="rigid"):
    return {
        "scene": scene,
        "method": method,
        "tolerance": tolerance,
        "outcome": outcome,
        "error": error,
        "wall_s": wall_s,
        "least_wall_s": 0.9 * wall_s,
        "largest_wall_s": 1.4 * wall_s,
        "repeats_of_wall_s": 1 if wall_s > 0.1 else 7,
        "rhs_evaluations": 1234,
    }


ROWS = [
    row("dop853", 1e-3, 2e-5, 5e-5),
    row("dop853", 1e-12, 7e-15, 2e-4),
    row("scipy-bdf", 1e-3, None, 0.3, "slid"),
    row("scipy-bdf", 1e-5, 3e-4, 0.2),
    row("radau5", 1e-3, 4e-4, 5e-3, scene="contact"),
    row("radau5", 1e-11, 3e-13, 5e-2, scene="contact"),
]
SUMMARY = {
    "rows": ROWS,
    "repeats": 7,
    "budget": 200_000,
    "library_budget": 20_000,
    "reference": {
        "rigid": {
            "method": "heyoka-taylor",
            "second_method": "dop853",
            "agreement": 9e-16,
            "from_outside": True,
            "tolerance": 0.0,
            "rhs_evaluations": 0,
        },
        "contact": {
            "method": "radau5",
            "second_method": "dop853",
            "agreement": 1e-12,
            "from_outside": False,
            "tolerance": 1e-11,
            "rhs_evaluations": 1_200_000,
        },
    },
    "best": {"rigid": {"1e-3": "dop853", "1e-6": "dop853"}, "contact": {"1e-3": "radau5"}},
    "conclusions": {"rigid": "rigid: at 1e-03, dop853 is fastest.", "contact": "contact: at 1e-03, radau5 is fastest."},
    "not_run": [
        {"scene": "rigid", "method": "scipy-bdf", "tolerance": tolerance, "why": "too much work"}
        for tolerance in (1e-7, 1e-9)
    ],
    "environment": {"processor": "x86_64", "cores": 2, "python": "3.11"},
}


@pytest.fixture
def made():
    return section(Results(config(), {"accuracy": stored("accuracy", {}, SUMMARY)}))


def tables(made):
    return {
        block.caption: {
            (title, line[0].text): [cell.text.replace("\u00a0", " ") for cell in line[1:]]
            for title, lines in block.groups.items()
            for line in lines
        }
        for block in made.blocks
        if isinstance(block, Table)
    }


def test_accuracy_section_is_omitted_without_an_accuracy_result():
    assert section(Results(config(), {"fixedpoint": fixedpoint()})) is None


def test_table_lists_run_times_for_each_error_and_the_smallest_error_of_each_method(made):
    costs = tables(made)["Shortest run time for each error, by method"]
    assert costs["rigid", "dop853"][:4] == ["0.05 (0.045 to 0.07)", "0.2 (0.18 to 0.28)", "7 × 10⁻¹⁵", "1,234"]
    assert costs["rigid", "scipy-bdf"][:3] == ["200", "–", "0.0003"]
    assert costs["contact", "radau5"][:2] == ["5 (4.5 to 7)", "50 (45 to 70)"]


def test_error_below_the_uncertainty_of_the_reference_is_shown_as_a_bound(made):
    costs = tables(made)["Shortest run time for each error, by method"]
    assert costs["contact", "radau5"][2] == "≤ 10⁻¹²"


def test_run_with_a_different_outcome_is_listed_with_that_outcome(made):
    costs = tables(made)["Shortest run time for each error, by method"]
    assert costs["rigid", "scipy-bdf"][-1] == "slid at 10⁻³"


def test_fastest_methods_are_marked(made):
    made_of = next(block for block in made.blocks if isinstance(block, Table)).groups
    assert {line[0].text: line[0].tone for line in next(iter(made_of.values()))} == {
        "dop853": "good",
        "scipy-bdf": None,
    }


def test_conclusions_are_shown_with_their_scenes(made):
    findings = next(block for block in made.blocks if isinstance(block, Statements))
    assert [(item.about, item.text) for item in findings.items] == [
        ("rigid", "At 1e-03, dop853 is fastest."),
        ("contact", "At 1e-03, radau5 is fastest."),
    ]


def test_finding_names_the_fastest_methods(made):
    assert made.finding == "Fastest: dop853 on rigid; radau5 on contact."


def test_references_state_their_accuracy(made):
    assert tables(made)["References"]["", "rigid"] == [
        "heyoka-taylor",
        "heyoka, at machine precision",
        "dop853",
        "9 × 10⁻¹⁶",
    ]
    assert tables(made)["References"]["", "contact"][1] == "ours, at 10⁻¹¹, 1,200,000 right-hand sides"


def test_built_in_reference_is_not_called_independent(made):
    (note,) = [block.note for block in made.blocks if getattr(block, "caption", "") == "References"]
    assert "On rigid heyoka computes the reference: an independent program" in note
    assert "On contact both methods are our own" in note
    assert "scipy-bdf on rigid, with an error of 0.0003." in note


def test_exhausted_budget_is_explained():
    used_up = {**SUMMARY, "rows": [*ROWS, row("dop853", 1e-8, None, 0.1, "budget-exhausted", scene="contact")]}
    made = section(Results(config(), {"accuracy": stored("accuracy", {}, used_up)}))
    costs = next(block for block in made.blocks if isinstance(block, Table))
    assert costs.groups["contact"][-1][-1].text == "budget exhausted at 10⁻⁸"
    assert "Each run is limited to 200,000 right-hand sides" in costs.note
    assert "dop853 exhausts this budget at tight tolerances" in costs.note
    assert "runs of a library to 20,000" in costs.note


def test_skipped_runs_are_grouped_by_reason(made):
    assert tables(made)["Not run"]["", "rigid"] == ["scipy-bdf", "10⁻⁷ and 10⁻⁹", "too much work"]


def test_introduction_says_that_the_rigid_walk_starts_off_its_gait():
    said = words("accuracy.introduction", {"repeats": 7, "rigid_velocity_factor": 0.98})
    assert "starts with angular velocities scaled by 0.98" in said
