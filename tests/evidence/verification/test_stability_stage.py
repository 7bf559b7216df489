"""Tests of the stage `stability`: its results with one and two processes, and a user's own cases."""

from dataclasses import asdict, replace
from types import SimpleNamespace

import pytest

from walkerlab.config.analyses import Case
from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.evidence.verification.catalogue import config_of, package_cases
from walkerlab.evidence.verification.judge import CaseCell, judge, run_cells
from walkerlab.evidence.verification.known_problems import Known
from walkerlab.evidence.verification.section import section
from walkerlab.evidence.verification.stability import summarise
from walkerlab.evidence.verification.starts import prepare_start
from walkerlab.evidence.verification.verdict import BUDGET_USED, CaseResult, Measure, NotMeasured
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.sections import verdict as verdict_section
from walkerlab.views.report.tables import Table

GOOD = CaseResult(
    "good", "own", "contact", "because", ("walked",), "walked", 4, 1e-9, 100, 0.1, (Measure("x", 0.5, 1.0),)
)
BAD = replace(GOOD, name="bad", outcome="fell")


def known(name, value):
    """Return a problem with a known answer as the stage prints it."""
    answer = Known(name, "time, s", value, 1.0, "closed form", 1e-6, "tolerance", 0.1)
    return {**asdict(answer), "error": answer.error, "ok": answer.ok}


RIGHT, WRONG = known("ball", 1.0), known("block", 2.0)


MAPS = {
    "outcomes": {"walked": 5, "slid": 4},
    "ends_otherwise_sharper": 1,
    "median_error": 1e-7,
    "largest_error": 1e-3,
    "fixed_step": {"fine": 3, "diverges": 6},
}


def report_of(summary, **others):
    stored = {name: SimpleNamespace(summary=value, groups={}) for name, value in others.items()}
    if summary is not None:
        stored["stability"] = SimpleNamespace(summary=summary, groups={})
    return section(Results(None, stored))


def test_stage_gives_a_result_if_every_case_passes():
    summary = summarise([GOOD], [RIGHT], [])
    assert "no_answer" not in summary
    assert (summary["passed"], summary["failed"]) == (2, 0)


def test_failed_checks_are_named():
    summary = summarise([GOOD, BAD], [RIGHT, WRONG], [])
    assert summary["no_answer"]["message"] == "2 of 4 did not end as expected: bad, block"
    assert (summary["passed"], summary["failed"]) == (2, 2)
    assert summary["cases"][1]["note"] == "ended as fell, not walked"


def test_report_shows_failures_in_red():
    shown = report_of(summarise([GOOD, BAD], [RIGHT, WRONG], []))
    red = [block.text for block in shown.blocks if getattr(block, "tone", "") == "bad"]
    assert len(red) == 2
    assert "ended as fell, not walked" in red[0]
    assert report_of(None) is None


def test_expected_failure_is_counted_separately_and_not_green():
    gave_up = replace(GOOD, name="rings", expected=("budget-exhausted",), outcome="budget-exhausted")
    summary = summarise([GOOD, gave_up], [RIGHT], [])
    shown = report_of(summary)
    counted = "3 of 3 extreme cases and problems with known answers ended as expected, 1 of them without an answer."
    assert shown.finding == counted
    (table,) = [block for block in shown.blocks if getattr(block, "caption", "") == "Extreme cases"]
    assert [row[1].tone for row in next(iter(table.groups.values()))] == ["good", "fair"]
    assert report_of(summarise([GOOD], [RIGHT], [])).finding.endswith("ended as expected.")


def test_page_lists_what_no_case_covers():
    gaps = [item.about for block in report_of(summarise([GOOD], [], [])).blocks for item in getattr(block, "items", ())]
    assert {"Very stiff linear springs:", "The loosest tolerances:", "ADAMS:"} <= {*gaps}


def test_worst_value_of_a_check_excludes_counts_of_work():
    busy = replace(GOOD, findings=(Measure(BUDGET_USED, 0.9, 1.0), Measure("x", 0.25, 1.0)))
    table = next(block for block in report_of(summarise([busy], [], [])).blocks if isinstance(block, Table))
    place = [column.title for column in table.columns].index("worst measure / limit")
    assert next(iter(table.groups.values()))[0][place].text == "0.25"


def test_report_names_the_second_method_or_why_it_is_missing():
    alone = replace(GOOD, name="alone", second_tried="dop853 budget-exhausted")
    shown = report_of(summarise([replace(GOOD, second_method="dop853"), alone], [RIGHT], []))
    (table,) = [block for block in shown.blocks if getattr(block, "caption", "") == "Extreme cases"]
    assert [row[3].text for row in next(iter(table.groups.values()))] == ["dop853", "none"]
    assert "dop853 budget-exhausted (alone)" in table.note


def test_report_shows_the_maps_or_how_to_make_them():
    summary = summarise([GOOD], [RIGHT], [])
    assert "walkerlab stability --full" in report_of(summary).blocks[-1].text
    said = report_of(summary, **{"stability-maps": MAPS}).blocks[-1].text
    assert "5 walked and 4 slid. At a ten times tighter tolerance 1 of them change" in said
    assert "3 fine and 6 diverges" in said


def test_one_and_two_processes_give_the_same_result():
    cases = [
        case for case in package_cases() if case.name in ("moon", "friction-0.05", "rigid-single-stride", "rigid-split")
    ]
    one, two = (
        [replace(item, wall_s=0.0) for found in run_cells([*map(CaseCell, cases)], jobs) for item in found]
        for jobs in (1, 2)
    )
    assert one == two


def test_user_cases_are_read_from_a_file(tmp_path):
    (tmp_path / "cases.yaml").write_text("- {name: mine, expected: [walked], reason: mine, config: {slope_deg: 2}}\n")
    (tmp_path / "own.yaml").write_text("extends: paper\nstability: {cases: cases.yaml}\n")
    (case,) = load(tmp_path / "own.yaml").config.stability.cases
    assert (case.name, case.config) == ("mine", {"slope_deg": 2})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("- {name: mine, expected: [walkedd], reason: mine}\n", "cases.yaml:1:.*did you mean walked"),
        ("name: mine\n", "does not hold a list"),
        ("- {expected: [walked], reason: mine}\n", "cases.yaml:1:3: stability.cases.name: is missing; allowed: text"),
        ("- {name: x, expected: [], reason: mine}\n", "cases.yaml:1:23: .*must name an outcome"),
        (
            "- name: x\n  expected: [walked]\n  reason: mine\n  config: {slope_rad: 0, start: [null, 0, 0, 0]}\n",
            "cases.yaml:4:26: start: case x starts with its feet together",
        ),
        ("- {name: ../x, expected: [walked], reason: mine}\n", "name"),
        ("- {name: x, expected: [walked], reason: mine, budgett: 3}\n", "cases.yaml:1:47: .*cases.budgett: .*mean"),
        (
            "- name: x\n  expected: [walked]\n  reason: mine\n  config:\n    walker: {leg_mas_kg: 3}\n",
            "cases.yaml:5:14: walker.leg_mas_kg: unknown key .3.; did you mean walker.leg_mass_kg",
        ),
        (
            "- name: x\n  expected: [walked]\n  reason: mine\n  config: {contact: {stiffness: -3}}\n",
            "cases.yaml:4:33: contact.stiffness: -3 is out of bounds",
        ),
        (
            "- name: x\n  expected: [walked]\n  reason: mine\n  config:\n    slope_deg: 1\n    slope_rad: 0.1\n",
            "cases.yaml:6:5: slope_rad: slope already set by slope_deg at .*cases.yaml:5:5",
        ),
        (
            "- name: x\n  expected: [walked]\n  reason: mine\n  config:\n    contact: null\n",
            "cases.yaml:5:5: contact: case x needs a contact block but has none",
        ),
        (
            "- {name: x, expected: [walked], reason: mine}\n- {name: x, expected: [walked], reason: mine}\n",
            "cases.yaml:2:4: name: x is already used at .*cases.yaml:1:4",
        ),
    ],
)
def test_bad_case_file_is_reported_with_position(tmp_path, text, said):
    (tmp_path / "cases.yaml").write_text(text)
    (tmp_path / "own.yaml").write_text("extends: paper\nstability: {cases: cases.yaml}\n")
    with pytest.raises(ConfigError, match=said):
        load(tmp_path / "own.yaml")


def test_missing_case_file_is_not_mistaken_for_a_config(tmp_path):
    (tmp_path / "own.yaml").write_text("extends: paper\nstability: {cases: cases.yaml}\n")
    with pytest.raises(ConfigError, match=r"own.yaml:2:20: there is no file .*Allowed: a file that holds a list"):
        load(tmp_path / "own.yaml")


def test_errors_in_case_lines_of_the_config_have_a_position(tmp_path):
    (tmp_path / "own.yaml").write_text(
        "extends: paper\nstability:\n  cases:\n  - {name: x, expected: [walked], reason: y, config: {gravity: 3}}\n"
    )
    with pytest.raises(ConfigError, match=r"own.yaml:4:\d+: gravity: unknown key .3.; did you mean gravity_m_s2"):
        load(tmp_path / "own.yaml")


def test_extreme_case_may_use_pads_at_the_pitch_of_the_contact_gait():
    case = Case(name="own", expected=("walked",), reason="r", steps=2, config={"contact": {"pad_pitch": "own"}})
    assert judge(case, config_of(case)).failures == ()


@pytest.mark.parametrize("lines", [{"stance": "pinned"}, {"terrain": "after-mid-swing"}])
def test_scene_with_mode_changes_is_not_tried_with_ordinary_methods(lines):
    case = Case(name="own", expected=("walked",), reason="r", steps=2, config={"contact": lines})
    verdict, *shown = CaseCell(case).run()
    assert verdict.failures == ()
    assert shown == []


def test_verdict_names_the_failed_checks():
    summary = summarise([BAD], [], [])
    results = Results(load().config, {"stability": SimpleNamespace(summary=summary, groups={})})
    first = verdict_section.section(results).blocks[0]
    assert (first.tone, first.text) == ("bad", "stability: 1 of 1 did not end as expected: bad.")


def test_extreme_case_ignores_the_pad_pitch_on_plain_ground():
    ground = {"terrain": "after-mid-swing", "pad_pitch": "own"}
    case = Case(name="x", expected=("walked",), reason="r", steps=2, config={"slope_deg": 4.0, "contact": ground})
    plain = case.model_copy(update={"config": {"slope_deg": 4.0, "contact": {"terrain": "after-mid-swing"}}})
    own, rigid = (prepare_start(config_of(one), one) for one in (case, plain))
    assert own.start == rigid.start
    assert own.scene.ground == rigid.scene.ground


def test_unmeasured_checks_are_reported_with_the_reason():
    missed = replace(GOOD, not_measured=(NotMeasured("momentum", "the pin transmits forces as well"),))
    summary = summarise([missed], [], [])
    assert summary["cases"][0]["not_measured"] == [{"measure": "momentum", "why": "the pin transmits forces as well"}]
    table = next(block for block in report_of(summary).blocks if isinstance(block, Table))
    assert "Not measured: momentum: the pin transmits forces as well (good)." in table.note
