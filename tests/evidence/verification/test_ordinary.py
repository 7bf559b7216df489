"""Tests of the comparison with ordinary methods: which failures count, and which do not."""

import numpy as np
import pytest

from walkerlab.evidence.verification.catalogue import config_of, package_cases
from walkerlab.evidence.verification.judge import MAX_ORDINARY_EVALUATIONS, Arrival, choices

PAPER = next(case for case in package_cases() if case.name == "paper")
ARRIVAL = Arrival("c", 1.0, np.zeros(8), np.ones(8))


def test_scipy_radau_solves_the_papers_walk_and_euler_does_not():
    found = {choice.method: choice for choice in choices(PAPER, config_of(PAPER))}
    assert found["SciPy Radau"].verdict == "fine"
    assert found["semi-implicit Euler, 0.001 s"].verdict != "fine"
    assert all(choice.rhs_evaluations <= MAX_ORDINARY_EVALUATIONS for choice in found.values())


def test_ordinary_methods_solve_the_rigid_walk():
    case = next(case for case in package_cases() if case.name == "rigid-single-stride")
    found = choices(case, config_of(case))
    assert [choice.method for choice in found] == ["SciPy RK45", "SciPy LSODA", "SciPy Radau"]
    assert all(0.0 < choice.error < 1e-2 and choice.verdict == "fine" for choice in found)


def test_walk_without_steps_is_not_compared_with_ordinary_methods():
    for name in ("split", "rigid-split", "rigid-standing-still", "rigid-slope-minus-1-deg"):
        case = next(case for case in package_cases() if case.name == name)
        assert choices(case, config_of(case)) == ()


def test_errors_of_ordinary_methods_do_not_depend_on_the_tolerance_of_the_case():
    loosest = next(case for case in package_cases() if case.name == "loosest")
    one, other = (choices(case, config_of(case)) for case in (PAPER, loosest))
    assert [choice.error for choice in one] == [choice.error for choice in other]


@pytest.mark.parametrize(
    ("off", "verdict"), [(1e-3, "fine"), (0.1, "wrong silently"), (100.0, "diverges"), (np.nan, "diverges")]
)
def test_verdict_on_an_end_state_depends_on_the_size_of_its_error(off, verdict):
    assert ARRIVAL.judge_end("m", np.full(8, off), 1, 0.0).verdict == verdict


def test_method_that_gives_up_has_no_error_value():
    choice = ARRIVAL.judge_end("m", None, MAX_ORDINARY_EVALUATIONS, 0.0)
    assert (choice.verdict, choice.error) == ("gives up", None)
