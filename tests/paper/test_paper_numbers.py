"""The printed numbers: how they are read, when a value agrees with one, and what verdicts follow."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from walkerlab.config.schema import Contact
from walkerlab.hybrid.comparison import WalkDifference
from walkerlab.mechanics.standing import BENT, Mode
from walkerlab.paper.appendix_a import CORRECTED, assembled
from walkerlab.paper.measured import (
    Characteristics,
    ContactModel,
    Departures,
    EnergyRecord,
    Measured,
    characteristics,
    over_last_steps,
)
from walkerlab.paper.printed import (
    ANGLE_ERROR,
    E_AVG,
    LOST_BALANCE,
    RAISED,
    STEP_LENGTH,
    STRIDES,
    TABLE_1,
    TABLE_2,
    TABLE_3,
    X_P,
    Printed,
    adams_start_as_printed,
    fixed_point_as_printed,
    number,
    slope_of,
    walker_of_the_paper,
)
from walkerlab.paper.prose import prose
from walkerlab.paper.rows import NumberVerdict, paper_rows
from walkerlab.paper.study import study_the_paper
from walkerlab.solvers.scipy_methods import right_hand_side


def printed(text):
    return Printed("here", "it", "m", text)


@pytest.mark.parametrize(
    ("text", "value", "last_digit"),
    [("-0.60", -0.6, 0.01), ("+0.15%", 0.15, 0.01), ("10^5", 1e5, 1e5), ("10^-4", 1e-4, 1e-4), ("five", 5, 1)],
)
def test_a_printed_number_knows_its_value_and_its_last_digit(text, value, last_digit):
    assert printed(text).value == pytest.approx(value, rel=1e-15)
    assert printed(text).last_digit == pytest.approx(last_digit)


def test_comparisons_in_words_are_read_as_their_number():
    assert number("less than 1%") == number("less than one") == 1


@pytest.mark.parametrize(
    ("text", "value", "found"),
    [
        ("-0.2022", -0.202216, "rounded"),
        ("-0.2022", -0.20215, "rounded"),
        ("-0.2022", -0.202149, ""),
        ("-0.84", -0.846575, "cut off"),
        ("-0.84", -0.85, ""),
        ("-0.84", 0.84, ""),
        ("41%", 41.18, "rounded"),
        ("0.60", None, ""),
    ],
)
def test_agreement_goes_by_the_printed_digits(text, value, found):
    assert printed(text).agreement(value) == found


def test_both_feet_of_x_p_stand_on_the_papers_slope():
    slope, rounding = slope_of(*X_P[:2])
    assert slope == pytest.approx(0.0174)
    assert rounding == pytest.approx(5e-5)
    assert sum(fixed_point_as_printed()[:2]) == pytest.approx(-2 * walker_of_the_paper(CORRECTED).slope)


def test_table_3_of_a_limping_walk_takes_the_last_completed_stride():
    table = characteristics([0.5, 0.6, 0.7, 0.8, 0.9], [0.1, 0.2, 0.3, 0.4, 0.5], 150.0)
    assert (table.t_left, table.t_right) == (0.7, 0.8)
    assert table.t_cycle == pytest.approx(1.5)
    assert table.v_com == pytest.approx(0.7 / 1.5)


def test_table_3_of_a_single_step_has_no_cycle():
    assert characteristics([0.5], [0.1], None) == Characteristics(0.5, None, None, None, None)
    assert characteristics([], [], None) == Characteristics(None, None, None, None, None)


def test_energy_is_averaged_over_time_and_the_last_five_steps():
    time = [0.0, 1.0, 1.5, 2.0, 5.0, 7.0]
    energy = [9.0, 9.0, 2.0, 2.0, 2.0, 9.0]
    record = over_last_steps(*map(np.array, (time, energy, [1.0, 1.5, 2.0, 3.0, 4.0, 5.0])))
    assert record.mean == pytest.approx((0.5 * (9 + 2) * 0.5 + 3.5 * 2) / 4.0)
    assert (record.least, record.most) == (2.0, 9.0)
    assert over_last_steps(*map(np.array, (time, energy, []))) is None


@pytest.fixture(scope="module")
def study():
    return study_the_paper()


def contact_model(**changed):
    walk = {"outcome": "walked", "steps": 10, "static_penetration_m": 5.88e-5, "damping_ratio": 3.71}
    model = ContactModel(
        law=Contact(),
        foot_radius=0.001,
        summary=walk | {name: changed.pop(name) for name in ("outcome", "steps") if name in changed},
        start=(-0.2042, 0.1694, -0.6058, -0.8610),
        table_3=Characteristics(0.7111, 0.7110, 1.4221, 0.5075, 150.03),
        step_length=0.3608,
        energy=EnergyRecord(150.03, 149.99, 150.36),
        from_x_p=(10, "walked"),
    )
    return replace(model, **changed)


PAPERS_OWN, NO_ERRORS = Departures((), ()), {}


@pytest.fixture
def rows(study):
    def judged(departures=PAPERS_OWN, errors=NO_ERRORS, models=None, **changed):
        gaits = {"as-printed": study.as_printed, "corrected": study.corrected} if models is None else models
        measured = Measured(
            walker=walker_of_the_paper(CORRECTED),
            equations="corrected",
            models=gaits,
            spectral_radii=dict.fromkeys(gaits, 0.6),
            contact=contact_model(**changed),
            errors=errors,
            departures=departures,
        )
        made = paper_rows(measured, study)
        return {Printed(row.where, row.quantity, row.unit, row.printed): row for row in made}

    return judged


def test_every_number_of_tables_and_of_eq_11_has_a_row(rows):
    found = rows()
    tables = [entry for row in TABLE_2 for entry in (row.matlab, row.adams, row.percent)]
    tables += [entry for row in TABLE_3 for entry in (row.matlab, row.adams)]
    assert {*TABLE_1, *X_P, *tables} <= found.keys()
    assert all(row.evidence for row in found.values())


def test_x_p_is_reproduced_by_the_equations_as_printed(rows):
    for entry in X_P:
        assert rows()[entry].verdict == NumberVerdict.REPRODUCED
        assert entry.agreement(rows()[entry].as_printed)


def test_step_periods_that_differ_are_refuted(rows):
    found = rows()
    for row in TABLE_3:
        if row is not E_AVG:
            assert found[row.matlab].verdict == found[row.adams].verdict == NumberVerdict.REFUTED


def test_the_energy_of_matlab_is_that_of_ten_steps_and_that_of_adams_is_nobodys(rows):
    found = rows()
    assert "(5 steps)" in E_AVG.matlab.quantity
    assert found[E_AVG.matlab].verdict == NumberVerdict.EXPLAINED
    for said in ("150.110 J over five steps", "150.127 J over ten", "its number is that of ten"):
        assert said in found[E_AVG.matlab].evidence
    # 150.03 J, with samples to either side of the printed number, and it between the means of all models
    assert found[E_AVG.adams].verdict == NumberVerdict.REFUTED
    assert "-0.110 J off the printed one" in found[E_AVG.adams].evidence


def test_a_start_that_walks_does_not_explain_a_fall(rows):
    row = rows()[LOST_BALANCE]
    assert (row.verdict, row.contact) == (NumberVerdict.REFUTED, 10.0)
    assert "takes 10 of 10 steps (walked)" in row.evidence
    assert rows(from_x_p=(1, "fell"))[LOST_BALANCE].verdict == NumberVerdict.REPRODUCED


def test_the_adams_start_falls_when_another_integration_says_so(study):
    walker = walker_of_the_paper(CORRECTED)._replace(slope=study.adams.slope)

    def hip(_time, y):
        return np.cos(y[1] + walker.slope) - 0.5

    hip.terminal = True
    start = adams_start_as_printed()
    model = assembled(walker)
    leg = Mode(model, BENT)
    probe = np.zeros(4)

    def rate(t, y):
        right_hand_side(leg, t, y, probe)
        return probe.copy()

    fall = solve_ivp(rate, (0.0, 1.0), start, "DOP853", events=hip, rtol=1e-11, atol=1e-12).t_events[0][0]
    assert study.adams.end_time == pytest.approx(fall, abs=1e-5)
    assert "0.347 s" in prose("adams_start.velocities", study.adams)


def test_another_scene_refutes_only_what_the_paper_itself_contradicts(rows):
    elsewhere = ("slope_rad 0.05 instead of 0.0174",)
    found = rows(Departures(elsewhere, elsewhere))
    of_the_walk = [entry for row in TABLE_3 for entry in (row.matlab, row.adams)]
    assert {found[entry].verdict for entry in of_the_walk} == {NumberVerdict.EXPLAINED}
    assert all("Not the paper's scene" in found[entry].evidence for entry in of_the_walk)
    assert {found[entry].verdict for entry in RAISED} == {NumberVerdict.REFUTED}


def test_percentages_are_refuted_unless_one_of_the_bases_gives_them(rows):
    verdicts = [rows()[row.percent].verdict for row in TABLE_2]
    assert verdicts == [NumberVerdict.REFUTED, NumberVerdict.REFUTED, NumberVerdict.EXPLAINED, NumberVerdict.EXPLAINED]


def test_an_error_as_small_as_the_printed_one_is_no_refutation(rows):

    def differing(angle, velocity):
        return WalkDifference(np.array([angle]), np.array([velocity]))

    small, large = differing((9e-5, 1e-4), (1e-4, 1e-4)), differing((0.1, 0.1), (1.0, 1.0))
    assert rows(errors={"raw": large, "aligned": large})[ANGLE_ERROR].verdict == NumberVerdict.REFUTED
    assert rows(errors={"raw": large, "aligned": small})[ANGLE_ERROR].verdict == NumberVerdict.EXPLAINED
    assert rows(errors={"raw": small, "aligned": small})[ANGLE_ERROR].verdict == NumberVerdict.REPRODUCED


def test_five_gait_cycles_are_refuted_by_a_fall_and_not_by_a_short_request(rows):
    assert rows()[STRIDES].verdict == NumberVerdict.REPRODUCED
    assert rows(steps=3, outcome="fell")[STRIDES].verdict == NumberVerdict.REFUTED
    assert rows(steps=4)[STRIDES].verdict == NumberVerdict.EXPLAINED


def test_a_walk_that_fell_at_once_leaves_gaps(rows):
    nothing = Characteristics(None, None, None, None, None)
    gone = {"steps": 0, "outcome": "fell", "table_3": nothing, "step_length": None, "start": None}
    found = rows(**gone, energy=None)
    assert all(found[row.adams].contact is None for row in TABLE_3)
    assert all("None" not in row.evidence for row in found.values())


def test_a_slope_without_gaits_has_no_columns_of_the_rigid_model(rows):
    found = rows(Departures(("slope_rad -0.1 instead of 0.0174",), ()), models={})
    assert all(found[entry].as_printed is found[entry].corrected is None for entry in X_P)
    assert "no gait" in found[E_AVG.matlab].evidence


def test_a_verdict_about_the_papers_own_numbers_says_so_in_another_scene(rows):
    elsewhere = Departures(("slope_rad 0.05 instead of 0.0174",), ("slope_rad 0.05 instead of 0.0174",))
    for row in rows(elsewhere).values():
        assert (
            row.verdict != NumberVerdict.REFUTED
            or "about the paper's own numbers, not about this scene" in row.evidence
        )
        assert row.verdict == NumberVerdict.REPRODUCED or "slope_rad 0.05" in row.evidence
    assert not any("this scene" in row.evidence for row in rows().values())


def test_no_step_is_not_called_a_step_of_no_length(rows):
    row = next(row for printed, row in rows(models={}, step_length=None).items() if printed == STEP_LENGTH)
    assert "no model has a step" in row.evidence
    assert "times the printed length" not in row.evidence
