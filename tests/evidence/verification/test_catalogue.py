"""Tests of the catalogue of cases: its range, its validity, and how some cases of each family end."""

import pytest

from walkerlab.config.analyses import Case
from walkerlab.errors import ConfigError
from walkerlab.evidence.verification.catalogue import check_unique_names, config_of, package_cases
from walkerlab.evidence.verification.judge import CaseCell, judge
from walkerlab.evidence.verification.starts import CENTRE_HEIGHT, prepare_start

CASES = {case.name: case for case in package_cases()}
QUICK = (
    "paper",
    "si-linear",
    "k-1e14-linear",
    "undamped",
    "friction-0.05",
    "leg-1-mm",
    "moon",
    "rigid-1-km",
    "rigid-simplest",
    "after-mid-swing-hinged",
    "slope-0",
    "rigid-slope-5.2-deg",
    "rigid-slope-minus-1-deg",
    "adams-start",
    "deep-1-cm",
    "velocities-10",
    "velocities-1e3",
    "rigid-split",
    "loosest",
    "no-budget",
)


def test_case_families_have_the_expected_sizes():
    families = {case.family for case in CASES.values()}
    assert families == {"stiffness", "walkers", "terrain", "slopes", "starts", "numerics"}
    assert len(CASES) >= 60


def test_every_case_has_a_reason_and_a_valid_config():
    for case in CASES.values():
        assert len(case.reason) > 5
        assert config_of(case).name == "paper"


@pytest.mark.parametrize("name", QUICK)
def test_case_ends_as_expected_and_passes_every_check(name):
    result = CaseCell(CASES[name]).run()[0]
    assert result.failures == ()


def test_errors_of_a_long_rigid_walk_do_not_accumulate():
    case = CASES["rigid-1000-strides"]
    assert case.steps == case.compared_steps == 2000
    result = judge(case.model_copy(update={"steps": 300, "compared_steps": 300}), config_of(case))
    assert result.failures == ()


def test_unexpected_outcome_is_reported():
    case = Case(name="wrong", expected=("fell",), reason="to be wrong", steps=2)
    result = judge(case, config_of(case))
    assert not result.ok
    assert "ended as walked, not fell" in result.failures


def test_exhausted_budget_is_reported_with_its_size():
    case = Case(name="small", expected=("walked",), reason="to be cut short", steps=4, budget=10_000)
    result = judge(case, config_of(case))
    assert result.outcome == "budget-exhausted"
    assert 10_000 <= result.rhs_evaluations < 10_100
    assert 0 < result.steps < 4


def test_rigid_case_also_ends_at_its_budget():
    needed = judge(CASES["rigid-single-stride"], config_of(CASES["rigid-single-stride"])).rhs_evaluations
    case = CASES["rigid-single-stride"].model_copy(update={"budget": needed // 2, "expected": ("budget-exhausted",)})
    result = judge(case, config_of(case))
    assert result.failures == ()
    assert result.outcome == "budget-exhausted"
    assert case.budget <= result.rhs_evaluations < needed


def test_start_is_lowered_by_metres_whatever_the_leg_length():
    short = Case(name="x", expected=("walked",), reason="x", config={"walker": {"leg_length_m": 1.0}}, lowered_m=-0.01)
    long = short.model_copy(update={"config": {"walker": {"leg_length_m": 10.0}}})
    for case in (short, long):
        there = prepare_start(config_of(case), case).start
        on_ground = prepare_start(config_of(case), case.model_copy(update={"lowered_m": 0.0})).start
        assert there[CENTRE_HEIGHT] - on_ground[CENTRE_HEIGHT] == pytest.approx(0.01, rel=1e-12)


def test_disagreement_with_a_tighter_tolerance_is_reported():
    case = Case(name="sharp", expected=("walked",), reason="to be inexact", steps=2, agreement=1e-15)
    result = judge(case, config_of(case))
    assert any("ten times tighter" in failure for failure in result.failures)
    assert any("dop853" in failure for failure in result.failures)


def test_invalid_config_lines_are_rejected():
    case = Case(name="bad", expected=("walked",), reason="none", config={"slope_degg": 1.0})
    with pytest.raises(ConfigError, match="slope_deg"):
        config_of(case)


def test_cases_of_equal_name_are_rejected():
    with pytest.raises(ConfigError, match="paper"):
        check_unique_names([CASES["paper"], CASES["paper"]])


def test_contact_block_in_si_gives_the_same_quantities():
    si = config_of(Case(name="si", expected=("walked",), reason="none", config={"contact": {"units": "si"}}))
    paper = config_of(CASES["paper"])
    assert si.contact.to_si().stiffness == pytest.approx(paper.contact.to_si().stiffness)
    assert si.contact.to_si().stiction_velocity == pytest.approx(paper.contact.to_si().stiction_velocity)
