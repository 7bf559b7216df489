"""Products and sums rounded once."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from walkerlab.physics.kernels import kernel
from walkerlab.physics.solvers.fused import fused

numbers = st.floats(-1e6, 1e6)


@kernel
def compiled(a, b, c):
    return fused(a, b, c)


@given(numbers, numbers, numbers)
def test_compiled_code_rounds_once(a, b, c):
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    assert compiled(a, b, c) == float(exact)


@given(numbers, numbers, numbers)
def test_python_computes_the_same_to_its_roundings(a, b, c):
    assert abs(fused(a, b, c) - compiled(a, b, c)) <= 2.0 * np.finfo(float).eps * (abs(a * b) + abs(c)) + 1e-300


def test_what_a_product_alone_would_round_away_is_kept():
    x = 1.0 + 2.0**-30
    assert compiled(x, x, -(x * x)) == 2.0**-60
