"""Check the errata of the paper by independent methods."""

from fractions import Fraction

import numpy as np
import numpy_walker
import pytest
from numpy.testing import assert_allclose

from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, impact
from walkerlab.evidence.paper.printed import TABLE_2, X_P, speed_difference, walker_of_the_paper
from walkerlab.evidence.paper.study import (
    MISPRINTED,
    RIGHT,
    errata,
    fixed_point,
    foothold_speed_after_impact,
    height_over_slope,
    inertia_at_impact,
    step,
    study_the_paper,
    swing_foot,
    swing_foot_gradient,
    velocities_after_impact,
)

SLOPE = 0.0174
BEFORE = (0.1674, -0.2022, -1.05, -0.45)


@pytest.fixture(scope="module")
def study():
    return study_the_paper()


@pytest.fixture(scope="module")
def found(study):
    return {erratum.where: erratum for erratum in errata(study)}


@pytest.mark.parametrize(("name", "sign"), [("as_printed", 1.0), ("corrected", -1.0)])
def test_energy_drift_agrees_with_an_independent_integration(study, name, sign):
    model = getattr(study, name)
    swing = numpy_walker.swing(model.state, sign, SLOPE)
    record = np.array([numpy_walker.energy(swing.sol(t)) for t in np.linspace(0.0, swing.t[-1], 400)])
    assert model.energy_drift == pytest.approx(np.ptp(record), abs=1e-5)
    assert (model.energy_least, model.energy_most) == pytest.approx((record.min(), record.max()), abs=1e-5)
    assert swing.t[-1] == pytest.approx(model.table_3.t_left, abs=1e-9)


@pytest.mark.parametrize(("name", "sign"), [("as_printed", 1.0), ("corrected", -1.0)])
def test_fixed_points_return_after_a_step_of_an_independent_integration(study, name, sign):
    model = getattr(study, name)
    before = tuple(numpy_walker.swing(model.state, sign, SLOPE).y[:, -1])
    after = velocities_after_impact(walker_of_the_paper(CORRECTED), before, RIGHT)
    assert_allclose((before[1], before[0], after[1], after[0]), model.state, atol=1e-9)


def test_only_the_printed_sign_of_equation_a_5_gives_x_p():
    def distance(state):
        return max(abs(x - entry.value) / entry.digits.unit for x, entry in zip(state, X_P, strict=True))

    study = study_the_paper()
    assert distance(study.as_printed.state) < 1.0
    assert distance(study.corrected.state) > 10.0


def test_corrected_equation_a_57_gives_the_same_velocities_as_the_impact_in_the_code():
    walker = walker_of_the_paper(CORRECTED)
    after = velocities_after_impact(walker, BEFORE, RIGHT)
    theta_1, theta_2, omega_1, omega_2 = impact(walker, *BEFORE)
    assert (theta_1, theta_2) == (BEFORE[1], BEFORE[0])
    assert_allclose((after[1], after[0]), (omega_1, omega_2), rtol=1e-12)


def test_new_stance_foot_is_at_rest_only_with_the_corrected_row():
    walker = walker_of_the_paper(CORRECTED)
    assert foothold_speed_after_impact(walker, BEFORE, RIGHT) < 1e-14
    assert foothold_speed_after_impact(walker, BEFORE, MISPRINTED) > 0.1


@pytest.mark.parametrize("row_2", [RIGHT, MISPRINTED])
def test_foot_gradient_equals_finite_differences(row_2):
    walker, h = walker_of_the_paper(CORRECTED), 1e-6
    E = swing_foot_gradient(walker, 0.3, -0.2, row_2)
    by_1 = (swing_foot(walker, 0.3 + h, -0.2, row_2) - swing_foot(walker, 0.3 - h, -0.2, row_2)) / (2 * h)
    by_2 = (swing_foot(walker, 0.3, -0.2 + h, row_2) - swing_foot(walker, 0.3, -0.2 - h, row_2)) / (2 * h)
    assert_allclose(E, np.column_stack((by_1, by_2, np.eye(2))), atol=1e-9)


def test_foot_of_x_p_is_on_the_slope_only_with_the_corrected_row():
    walker, (theta_1, theta_2) = walker_of_the_paper(CORRECTED), (X_P[0].value, X_P[1].value)
    assert_allclose(
        swing_foot(walker, theta_1, theta_2, RIGHT), numpy_walker.positions((theta_1, theta_2))[3], atol=1e-15
    )
    assert abs(height_over_slope(walker, theta_1, theta_2, RIGHT)) < 1e-15
    assert abs(height_over_slope(walker, theta_1, theta_2, MISPRINTED)) > 0.01


def test_fixed_point_with_both_misprints_agrees_with_an_independent_program():
    walker = walker_of_the_paper(AS_PRINTED)._replace(slope=np.pi / 180)
    state = fixed_point(walker, study_the_paper().as_printed.state, MISPRINTED)
    assert_allclose(state, (-0.2416, 0.2067, -0.2873, -0.9984), atol=5e-5)
    assert_allclose(step(walker, state, MISPRINTED), state, atol=1e-6)


def test_impact_inertia_matrix_gives_the_kinetic_energy_only_if_angles_precede_the_foot(study):
    walker, rates = walker_of_the_paper(CORRECTED), np.array([-0.6, -0.84, 0.3, -0.2])
    q, h = np.array([-0.2022, 0.1674]), 1e-6
    ahead = numpy_walker.positions(q + h * rates[:2], h * rates[2:])[:3]
    behind = numpy_walker.positions(q - h * rates[:2], -h * rates[2:])[:3]
    kinetic = sum(
        0.5 * m * np.sum(((one - other) / (2 * h)) ** 2)
        for m, one, other in zip((5.0, 10.0, 5.0), ahead, behind, strict=True)
    )
    assert 0.5 * rates @ inertia_at_impact(walker, *q) @ rates == pytest.approx(kinetic, rel=1e-8)
    assert study.kinetic_energy["angles_first"] == pytest.approx(study.kinetic_energy["masses"], rel=1e-12)
    assert study.kinetic_energy["foot_first"] != pytest.approx(study.kinetic_energy["masses"], rel=0.05)


def test_energy_of_the_adams_start_equals_the_sum_over_its_point_masses(study):
    start = [row.adams.value for row in TABLE_2]
    assert study.adams.energy == pytest.approx(numpy_walker.energy(start), rel=1e-8)
    assert study.adams.energy > 1.4 * 150.14


def test_adams_start_would_need_a_ground_that_pulls(study):
    start = [row.adams.value for row in TABLE_2]
    fall, h = numpy_walker.fall(start, -1.0, longest=0.3), 1e-5

    def normal_force(t):
        force = (numpy_walker.momentum(fall.sol(t + h)) - numpy_walker.momentum(fall.sol(t - h))) / (2 * h)
        force += np.array([0.0, 20.0 * 9.81])
        return force @ [np.sin(study.adams.slope), np.cos(study.adams.slope)]

    theta_1, theta_2 = fall.sol(np.linspace(0.01, 0.3, 300))[:2]
    assert (theta_1 + theta_2 + 2 * study.adams.slope < 0.0).all(), "the swing foot never comes above the slope"
    assert normal_force(2 * h) == pytest.approx(study.adams.normal_force, abs=0.05)
    assert normal_force(study.adams.pull_from - 0.002) > 0 > normal_force(study.adams.pull_from + 0.002)


def test_percentages_of_table_2_follow_from_its_values():
    for row in TABLE_2:
        matlab, adams = (abs(Fraction(entry.text)) for entry in (row.matlab, row.adams))
        assert row.percent_of_matlab == pytest.approx(float(100 * (adams - matlab) / matlab), rel=1e-12)
        assert row.percent_of_adams == pytest.approx(float(100 * (adams - matlab) / adams), rel=1e-12)


def test_printed_cycle_is_not_the_sum_of_its_steps():
    assert speed_difference(1.39, 1.38) < 1.0 < speed_difference(0.60 + 0.79, 0.59 + 0.77)


@pytest.mark.parametrize(
    "where",
    [
        "A.5 row 2, A.29",
        "A.55 row 2",
        "eq. 9-2",
        "eq. 5 against A.7 to A.24",
        "Appendix A",
        "slope",
        "eq. 11, x_p",
        "Table 3, energy",
        "Table 2, percentages",
        "Table 2, slope of the ADAMS start",
        "Table 2, ADAMS start",
        "section 4, Fig. 4b",
        "Fig. 8",
        "Table 3, step periods",
        "Table 3, cycle of MSC ADAMS",
        "Table 3, velocity, and the step length of section 5",
    ],
)
def test_every_erratum_has_printed_and_correct_text_and_values(found, where):
    erratum = found[where]
    assert erratum.printed
    assert erratum.right
    assert erratum.evidence
    assert any(letter.isdigit() for letter in erratum.measured)
    assert "None" not in erratum.measured
    assert "nan" not in erratum.measured


def test_errata_quote_the_measured_values(found):
    assert "0.1286 J as printed" in found["A.5 row 2, A.29"].measured
    assert "13 equation numbers" in found["Appendix A"].measured
    assert "1.36 s" in found["Table 3, cycle of MSC ADAMS"].measured
    assert "-0.202216, 0.167416, -0.600581, -0.846575" in found["eq. 11, x_p"].measured
    assert "cut off" in found["eq. 11, x_p"].measured


def test_contact_parameters_can_be_read_in_three_ways(found):
    """In a model in metres, ground of 10^8 N/m^2.2 carries 20 kg at a depth of 2.5 mm. Ground that is 1000^1.2 times
    stiffer carries them at 0.06 mm.
    """
    measured = found["section 4, Fig. 4b"].measured
    weight = 20 * 9.81
    depths = [
        (weight / stiffness) ** (1 / exponent) for stiffness, exponent in ((1e5 * 1000**2.2, 2.2), (1e5, 1), (1e8, 2.2))
    ]
    for depth, digits in zip(depths, (3, 2, 3), strict=True):
        assert f"{1e3 * depth:.{digits}f} mm" in measured
    assert "3981 times lower" in measured
