"""Mistakes planted into gaits are named; right gaits are reproduced; unknown mistakes stay unexplained."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from mistaken_walks import MISTAKES, UNLISTED, answer_to, gait, gait_with, walkers

SAMPLE = [(words, (6, 10, 4)[place % 3]) for place, words in enumerate([*MISTAKES][::3])]


@pytest.fixture(scope="module")
def walker():
    """A random walker and its right gait."""
    return next(walkers(7))


def test_a_hand_written_walker_has_the_same_gait(walker):
    legs, state = walker
    found, _ = gait(legs, state)
    np.testing.assert_allclose(found, state, rtol=0, atol=1e-11)


@pytest.mark.parametrize(("words", "digits"), SAMPLE)
def test_a_planted_mistake_is_named(words, digits):
    for legs, state in walkers(7):
        mistake = dict(MISTAKES[words])
        mistake |= {"hip": mistake["hip"] * legs.hip} if "hip" in mistake else {}
        found = gait_with(legs, state, mistake)
        if found is not None:  # with some mistakes, some walkers have no gait
            break
    answer = answer_to(legs, *found, digits)
    told = [each["what"] for each in answer["explanations"]]
    assert answer["finding"] == "explained"
    assert any(words in what for what in told)
    assert digits == 4 or len(told) == 1


@pytest.mark.parametrize("digits", [3, 6, 12])
def test_a_right_gait_is_reproduced_without_an_explanation(digits):
    for legs, state in islice(walkers(digits), 2):
        answer = answer_to(legs, *gait(legs, state), digits)
        assert (answer["finding"], answer["explanations"]) == ("reproduced", [])
        assert answer["routes"]["agree"]


@pytest.mark.parametrize(("name", "digits"), [("leak", 4), ("drag", 10)])
def test_a_mistake_that_is_on_no_list_stays_unexplained(walker, name, digits):
    legs, state = walker
    found = gait(replace(legs, **{name: UNLISTED[name]}), state)
    answer = answer_to(legs, *found, digits)
    assert (answer["finding"], answer["explanations"]) == ("different, unexplained", [])
