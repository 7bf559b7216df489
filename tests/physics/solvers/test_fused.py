"""Tests of products and sums that are rounded only once."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers.lanes import fused

numbers = st.floats(-1e6, 1e6)


@kernel
def compiled(a, b, c):
    return fused(a, b, c)


@given(numbers, numbers, numbers)
def test_compiled_fused_multiply_add_rounds_once(a, b, c):
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    assert compiled(a, b, c) == float(exact)


@given(numbers, numbers, numbers)
def test_fused_multiply_add_in_python_agrees_with_compiled_code_to_rounding(a, b, c):
    assert abs(fused(a, b, c) - compiled(a, b, c)) <= 2.0 * np.finfo(float).eps * (abs(a * b) + abs(c)) + 1e-300


def test_fma_keeps_the_rounding_error_of_a_product():
    x = 1.0 + 2.0**-30
    assert compiled(x, x, -(x * x)) == 2.0**-60
