"""Check that exactly the known roots of polynomials are found, in order."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from walkerlab.physics.solvers.events import (
    FALLING,
    NO_CROSSING,
    RISING,
    first_crossing,
    new_crossing_finder,
    way_from_zero,
)

DEGREE = 7
EITHER = 0


def finder_on(*event_functions, degree=DEGREE):
    finder = new_crossing_finder(degree, len(event_functions))
    for row, event in enumerate(event_functions):
        finder.values[row] = event(finder.nodes)
    return finder


def crossing(event, direction=EITHER, after=0.0, zero_at_start=False):
    return first_crossing(finder_on(event), 0, direction, after, zero_at_start)


def with_roots(*roots, sign=1.0):
    return sign * Polynomial.fromroots(roots)


def test_single_crossing_is_found():
    assert crossing(with_roots(0.3)) == pytest.approx(0.3, abs=1e-14)


def test_double_crossing_inside_one_step_is_found():
    event = with_roots(0.4, 0.41)
    assert event(0.0) > 0.0
    assert event(1.0) > 0.0
    assert crossing(event) == pytest.approx(0.4, abs=1e-12)
    assert crossing(event, RISING) == pytest.approx(0.41, abs=1e-12)


def test_triple_crossing_inside_one_step_is_found_in_order():
    event = with_roots(0.2, 0.5, 0.50001)
    first = crossing(event)
    second = crossing(event, after=first + 1e-9)
    third = crossing(event, after=second + 1e-9)
    assert (first, second, third) == pytest.approx((0.2, 0.5, 0.50001), abs=1e-9)
    assert crossing(event, after=third + 1e-9) == NO_CROSSING


def test_direction_selects_crossings():
    event = with_roots(0.2, 0.6, sign=-1.0)
    assert crossing(event, RISING) == pytest.approx(0.2, abs=1e-13)
    assert crossing(event, FALLING) == pytest.approx(0.6, abs=1e-13)
    assert crossing(with_roots(0.5), FALLING) == NO_CROSSING


def test_touching_zero_without_sign_change_is_not_a_crossing():
    touching = with_roots(0.3, 0.3) * Polynomial([1.0, 0.5])
    assert crossing(touching + 1e-12) == NO_CROSSING
    assert crossing(-touching - 1e-12) == NO_CROSSING


def test_crossing_at_the_start_is_not_found_twice():
    # The previous event leaves a value that is zero up to rounding, with either sign.
    for rounding in (0.0, 1e-17, -1e-17):
        event = with_roots(0.0, 1.5) + rounding
        assert crossing(event, zero_at_start=True) == NO_CROSSING


def test_zero_at_the_start_does_not_hide_a_crossing_right_after_it():
    for behind in (0.5, 1e-3, 1e-7):
        assert crossing(with_roots(0.0, behind), zero_at_start=True) == pytest.approx(behind, rel=1e-6)


def test_crossing_right_after_the_start_is_found():
    assert crossing(with_roots(1e-9)) == pytest.approx(1e-9, abs=1e-15)


def test_crossing_at_the_end_belongs_to_one_step_only():
    # The last value of a step is the first value of the next step, so a sign change lies in one of the two.
    before, after = with_roots(1.0 - 1e-13), with_roots(-1e-13)
    found = [crossing(before) <= 1.0, crossing(after) <= 1.0]
    assert found == [True, False]


def test_event_functions_are_searched_independently():
    finder = finder_on(with_roots(0.7), with_roots(0.2), with_roots(1.2))
    found = [first_crossing(finder, row, EITHER, 0.0, False) for row in range(3)]
    assert found == pytest.approx([0.7, 0.2, NO_CROSSING], abs=1e-13)


def test_event_function_far_from_zero_has_no_crossing():
    assert crossing(Polynomial([5.0, 0.1, -0.2])) == NO_CROSSING
    assert crossing(Polynomial([-5.0])) == NO_CROSSING


def test_event_function_that_is_always_zero_has_no_crossing():
    assert crossing(Polynomial([0.0])) == NO_CROSSING


@pytest.mark.parametrize("degree", [3, 5, 7])
def test_root_finders_of_every_degree_find_the_same_crossing(degree):
    finder = finder_on(with_roots(0.25, 0.5, 0.75), degree=degree)
    assert first_crossing(finder, 0, RISING, 0.3, False) == pytest.approx(0.75, abs=1e-12)


separate_roots = st.lists(st.integers(1, 999), min_size=0, max_size=DEGREE, unique=True)


@given(separate_roots, st.sampled_from([-1.0, 1.0]), st.sampled_from([FALLING, RISING, EITHER]))
def test_every_crossing_is_found_in_order(thousandths, sign, direction):
    roots = sorted(number / 1000.0 for number in thousandths)
    event = with_roots(*roots, sign=sign) if roots else Polynomial([sign])
    slopes = [np.sign(event.deriv()(root)) for root in roots]
    # Roots at a distance of 0.001 give values of 1e-21, whose sign may depend on rounding, so skip them.
    assume(all(abs(event.deriv()(root)) > 1e-9 for root in roots))
    wanted = [root for root, slope in zip(roots, slopes, strict=True) if direction in (EITHER, slope)]
    found, after = [], 0.0
    while (fraction := crossing(event, direction, after)) <= 1.0:
        found.append(fraction)
        after = fraction + 1e-6
    assert found == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("left", [0.0, 1e-13, -1e-13])
def test_direction_of_an_event_function_after_its_zero_is_found_despite_a_small_offset(left):
    falls_then_rises = left + Polynomial([0.0, -1e-6, 1e-2])
    assert way_from_zero(finder_on(falls_then_rises), 0, 1e-12) == pytest.approx(-1e-6, rel=1e-5)
    assert way_from_zero(finder_on(left + Polynomial([0.0, 0.0, 1e-2])), 0, 1e-12) > 0.0


def test_change_within_rounding_gives_no_direction_away_from_zero():
    assert way_from_zero(finder_on(Polynomial([0.0, 1e-16, -2e-16])), 0, 1e-12) == 0.0
