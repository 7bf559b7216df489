"""Check that formulas in plain spelling get mathematical symbols, and that prose is not changed."""

import pytest

from walkerlab.views.report.numbers import typeset


@pytest.mark.parametrize(
    ("plain", "signs"),
    [
        ("C_21 = - m L b dtheta_1 sin(theta_2 - theta_1)", "C₂₁ = − m L b θ̇₁ sin(θ₂ − θ₁)"),
        ("y + L (cos theta_1 - cos(-theta_2))", "y + L (cos θ₁ − cos(−θ₂))"),
        ("theta_1 + theta_2 = -2 phi", "θ₁ + θ₂ = −2 φ"),
        ("x_p sums to -0.0348 +- 0.00005 rad", "xₚ sums to −0.0348 ± 0.00005 rad"),
        ("N/mm^e, m/s^2, 10^-4, 1.1e-09 J", "N/mmᵉ, m/s², 10⁻⁴, 1.1 × 10⁻⁹ J"),
    ],
)
def test_formulas_are_shown_with_symbols(plain, signs):
    assert typeset(plain) == signs


@pytest.mark.parametrize(
    "text", ["eq. 9-2", "as-printed", "A.5 row 2, A.29", "t_left, v_com", "--set a.b=1", "less than 1%", "k-1e8-linear"]
)
def test_prose_is_left_unchanged(text):
    assert typeset(text) == text
