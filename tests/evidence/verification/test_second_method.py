"""Tests of the second method for a case: which one is chosen, what difference is allowed, and the message if there is
none.
"""

from types import SimpleNamespace

import pytest

from walkerlab.config.analyses import Case
from walkerlab.evidence.verification.catalogue import config_of, package_cases
from walkerlab.evidence.verification.judge import LIBRARY_BUDGET, judge, other_methods, second_walk
from walkerlab.evidence.verification.verdict import allowed_difference
from walkerlab.outcome import Outcome

CASES = {case.name: case for case in package_cases()}


def ending(*outcomes):
    """Return a function that walks and ends with each outcome in turn, and the list of methods and budgets requested of
    it.
    """
    asked, left = [], list(outcomes)

    def walk(method, budget):
        asked.append((method.name, budget))
        return SimpleNamespace(outcome=left.pop(0))

    return walk, asked


def test_second_method_is_never_the_method_itself():
    for name in ("dop853", "radau5", "scipy-bdf"):
        assert name not in [method.name for method in other_methods(name)]


def test_first_method_with_an_answer_is_used():
    walk, asked = ending(Outcome.BUDGET_EXHAUSTED, Outcome.FELL)
    second = second_walk("radau5", 400_000, walk)
    assert (second.method, second.walk.outcome, second.tried) == ("scipy-bdf", Outcome.FELL, "dop853 budget-exhausted")
    assert asked == [("dop853", 400_000), ("scipy-bdf", LIBRARY_BUDGET)]


def test_failure_of_all_second_methods_is_reported():
    walk, _ = ending(Outcome.BUDGET_EXHAUSTED, Outcome.BUDGET_EXHAUSTED, Outcome.SOLVER_FAILED)
    second = second_walk("radau5", 400_000, walk)
    assert (second.method, second.walk) == ("", None)
    assert second.tried == "dop853 budget-exhausted, scipy-bdf budget-exhausted, scipy-radau solver-failed"


def test_multistep_method_simulates_a_walk_on_stiff_ground():
    result = judge(CASES["stiction-1e-4"], config_of(CASES["stiction-1e-4"]))
    assert result.ok
    assert (result.second_method, result.second_tried) == ("scipy-bdf", "dop853 budget-exhausted")
    assert any("from the walk with scipy-bdf" in finding.measure for finding in result.findings)


def test_multistep_method_simulates_the_rigid_model():
    result = judge(CASES["rigid-single-stride"], config_of(CASES["rigid-single-stride"]))
    (finding,) = [finding for finding in result.findings if "from the walk with radau5" in finding.measure]
    assert 0.0 < finding.value < finding.limit < 1e-6


def test_case_without_an_answer_states_why_it_was_not_compared():
    case = CASES["no-budget"]
    result = judge(case, config_of(case))
    assert (result.second_method, result.second_tried) == ("", "the walk itself ended as budget-exhausted")


@pytest.mark.parametrize(("rtol", "limit"), [(1e-10, 1e-7), (1e-3, 1e-4)])
def test_allowed_difference_follows_the_tolerance(rtol, limit):
    case = Case(name="x", expected=("walked",), reason="to be compared")
    assert allowed_difference(case, rtol, 100) == pytest.approx(limit)
