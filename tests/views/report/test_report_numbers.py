"""Tests of the numbers in the report."""

import math

import pytest

from walkerlab.labels import join_words
from walkerlab.views.report.numbers import count, fixed, length, number, power_of_ten, quantity, span


def plain(text):
    return text.replace("\u00a0", " ")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0, "0"),
        (150.24127, "150.24"),
        (-0.2041996, "−0.2042"),
        (1e-9, "10⁻⁹"),
        (-2.5e-7, "−2.5 × 10⁻⁷"),
        (3.98107e11, "3.98 × 10¹¹"),
        (90000.0, "90000"),
        (123456.0, "123456"),
        (None, "–"),
        (math.inf, "–"),
    ],
)
def test_numbers_are_rounded_and_typeset(value, text):
    assert plain(number(value)) == text


def test_fixed_decimals_never_print_minus_zero():
    assert fixed(-1e-12, 3) == "0.000"
    assert fixed(-0.0005, 3) in ("−0.001", "0.000")
    assert fixed(None, 3) == "–"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.37143, "0.3714 m"), (0.00037, "0.37 mm"), (5.88e-5, "58.8 µm"), (1.11e-16, "0 m"), (0.0, "0 m")],
)
def test_lengths_are_shown_in_a_readable_unit(value, text):
    assert plain(length(value)) == text


def test_range_of_equal_numbers_is_one_number():
    assert plain(span([0.7, 0.7], "s")) == "0.7 s"
    assert plain(span([0.7, 0.8], "s")) == "0.7 to 0.8 s"
    assert span([], "s") == "–"


def test_counts_and_lists_are_worded_correctly():
    assert count(1, "step") == "1 step"
    assert count(2, "step") == "2 steps"
    assert join_words(["a", "b", "c"]) == "a, b and c"
    assert quantity(3.0, "1") == "3"
    assert plain(power_of_ten(9.96e-10, 2)) == "10⁻⁹"


def test_number_and_unit_are_not_separated_by_a_line_break():
    assert " " not in quantity(1e-9, "N/m") + length(0.001) + span([1.0], "s")
