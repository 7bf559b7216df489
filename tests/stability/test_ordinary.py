"""Ordinary methods are shown as they are: what they say, and what they do not."""

import numpy as np
import pytest

from walkerlab.stability.catalogue import config_of, shipped
from walkerlab.stability.ordinary import CAP, choices, judged

PAPER = next(case for case in shipped() if case.name == "paper")
UNITS = np.ones(8)


def test_ordinary_methods_on_the_paper_walker():
    found = {choice.method: choice for choice in choices(PAPER, config_of(PAPER))}
    assert found["SciPy Radau"].verdict == "fine"
    assert found["semi-implicit Euler, 0.001 s"].verdict != "fine"
    assert all(choice.rhs_evaluations <= CAP for choice in found.values())


@pytest.mark.parametrize(
    ("off", "verdict"), [(1e-3, "fine"), (0.1, "wrong silently"), (100.0, "diverges"), (np.nan, "diverges")]
)
def test_verdict_follows_from_the_error(off, verdict):
    assert judged("c", "m", np.full(8, off), np.zeros(8), UNITS, 1, 0.0).verdict == verdict


def test_what_did_not_arrive_has_no_error():
    choice = judged("c", "m", None, np.zeros(8), UNITS, CAP, 0.0)
    assert (choice.verdict, choice.error) == ("gives up", None)
