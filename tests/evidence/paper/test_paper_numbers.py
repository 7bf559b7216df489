"""Tests of printed numbers: how they are read, when a value agrees with one, and which verdicts follow."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from walkerlab.config.schema import Contact
from walkerlab.evidence.check.printed import Verdict
from walkerlab.evidence.paper.appendix_a import CORRECTED, assembled
from walkerlab.evidence.paper.measured import (
    Characteristics,
    ContactMeasurements,
    Departures,
    EnergyRecord,
    Measured,
    characteristics,
    mean_over_last_steps,
)
from walkerlab.evidence.paper.printed import (
    CYCLES_WALKED,
    DAMPING,
    DYNAMIC_FRICTION,
    E_AVG,
    FOOT_RADIUS,
    LARGEST_ERROR,
    LEG_INERTIA,
    LOST_BALANCE,
    STATIC_FRICTION,
    STEP_LENGTH,
    STIFFNESS,
    T_CYCLE,
    T_LEFT,
    T_RIGHT,
    TABLE_1,
    TABLE_2,
    TABLE_3,
    V_COM,
    X_P,
    Printed,
    adams_start_as_printed,
    fixed_point_as_printed,
    slope_of,
    walker_of_the_paper,
)
from walkerlab.evidence.paper.prose import prose
from walkerlab.evidence.paper.rows import paper_rows
from walkerlab.evidence.paper.study import study_the_paper
from walkerlab.physics.hybrid.comparison import WalkDifference
from walkerlab.physics.mechanics.rigid_model import BENT, Mode
from walkerlab.physics.solvers.scipy_methods import right_hand_side


def printed(text):
    return Printed("here", "it", "m", text)


@pytest.mark.parametrize(
    ("text", "value", "last_digit"),
    [("-0.60", -0.6, 0.01), ("+0.15%", 0.15, 0.01), ("10^5", 1e5, 1e5), ("10^-4", 1e-4, 1e-4), ("five", 5, 1)],
)
def test_value_and_last_digit_of_a_printed_number_are_parsed(text, value, last_digit):
    assert printed(text).value == pytest.approx(value, rel=1e-15)
    assert printed(text).digits.unit == pytest.approx(last_digit)


def test_comparisons_in_words_are_read_as_numbers():
    assert printed("less than 1%").value == printed("less than one").value == 1


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
def test_agreement_is_judged_by_the_printed_digits(text, value, found):
    assert printed(text).agreement(value) == found


def test_both_feet_of_x_p_are_on_the_slope_of_the_paper():
    slope, rounding = slope_of(*X_P[:2])
    assert slope == pytest.approx(0.0174)
    assert rounding == pytest.approx(5e-5)
    assert sum(fixed_point_as_printed()[:2]) == pytest.approx(-2 * walker_of_the_paper(CORRECTED).slope)


def test_table_3_of_a_limping_walk_uses_the_last_complete_stride():
    table = characteristics([0.5, 0.6, 0.7, 0.8, 0.9], [0.1, 0.2, 0.3, 0.4, 0.5], 150.0)
    assert (table.t_left, table.t_right) == (0.7, 0.8)
    assert table.t_cycle == pytest.approx(1.5)
    assert table.v_com == pytest.approx(0.7 / 1.5)


def test_single_step_has_no_cycle_values_for_table_3():
    assert characteristics([0.5], [0.1], None) == Characteristics(0.5, None, None, None, None)
    assert characteristics([], [], None) == Characteristics(None, None, None, None, None)


def test_energy_is_time_averaged_over_the_last_five_steps():
    time = [0.0, 1.0, 1.5, 2.0, 5.0, 7.0]
    energy = [9.0, 9.0, 2.0, 2.0, 2.0, 9.0]
    record = mean_over_last_steps(*map(np.array, (time, energy, [1.0, 1.5, 2.0, 3.0, 4.0, 5.0])))
    assert record.mean == pytest.approx((0.5 * (9 + 2) * 0.5 + 3.5 * 2) / 4.0)
    assert (record.least, record.most) == (2.0, 9.0)
    assert mean_over_last_steps(*map(np.array, (time, energy, []))) is None


@pytest.fixture(scope="module")
def study():
    return study_the_paper()


def measure_contact_model(**changed):
    walk = {"outcome": "walked", "steps": 10, "static_penetration_m": 5.88e-5, "damping_ratio": 3.71}
    model = ContactMeasurements(
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
    def measured(departures=PAPERS_OWN, errors=NO_ERRORS, models=None, **changed):
        gaits = {"as-printed": study.as_printed, "corrected": study.corrected} if models is None else models
        return Measured(
            walker=walker_of_the_paper(CORRECTED),
            equations="corrected",
            models=gaits,
            spectral_radii=dict.fromkeys(gaits, 0.6),
            contact=measure_contact_model(**changed),
            errors=errors,
            departures=departures,
        )

    def judged(*scene, **changed):
        made = paper_rows(measured(*scene, **changed), study)
        return {each.number: each for each in made}

    judged.measured = measured
    return judged


def test_every_printed_value_of_tables_and_eq_11_has_a_row(rows):
    found = rows()
    tables = [entry for row in TABLE_2 for entry in (row.matlab, row.adams, row.percent)]
    tables += [entry for row in TABLE_3 for entry in (row.matlab, row.adams)]
    assert {*TABLE_1, *X_P, *tables} <= found.keys()
    assert all(row.evidence for row in found.values())


def test_x_p_is_reproduced_by_the_equations_as_printed(rows):
    for entry in X_P:
        assert rows()[entry].verdict == Verdict.REPRODUCED
        assert entry.agreement(rows()[entry].values["as_printed"])


INPUTS = (*TABLE_1, LEG_INERTIA, FOOT_RADIUS, STIFFNESS, DAMPING, STATIC_FRICTION, DYNAMIC_FRICTION, CYCLES_WALKED)
OWN_CONTRADICTIONS = (
    *(row.percent for row in TABLE_2[1:]),
    LARGEST_ERROR,
    STEP_LENGTH,
    T_LEFT.matlab,
    T_RIGHT.matlab,
    T_CYCLE.adams,
    V_COM.matlab,
    V_COM.adams,
)


def test_each_printed_value_is_counted_once(rows, study):
    every = list(paper_rows(rows.measured(), study))
    assert len({(row.number.where, row.number.quantity) for row in every}) == len(every) == 38
    # Eq. 11 and the MATLAB column of Table 2 print the same four values. Table 2 and section 4 print the same two
    # percentages.
    printed_twice = [row for row in every if re.match("(eq.|Table).*,", row.number.where)]
    assert len(printed_twice) == 4 + 2


def test_printed_values_used_unchanged_count_as_inputs(rows):
    assert {entry for entry, row in rows().items() if row.verdict == Verdict.INPUT} == {*INPUTS}


def test_contradicted_values_show_the_computation(rows):
    found = {entry: row for entry, row in rows().items() if row.verdict == Verdict.CONTRADICTED}
    assert found.keys() == {*OWN_CONTRADICTIONS}
    step, adams_step = (2 * np.sin((stance - swing) / 2) for swing, stance in ((-0.2022, 0.1674), (-0.2021, 0.1670)))
    for entry, computed in {
        TABLE_2[1].percent: "(-0.30 to -0.18%, given the rounding)",
        TABLE_2[2].percent: f"{100 * (1.02 / 0.60 - 1):+.3g}% of the MATLAB value",
        TABLE_2[3].percent: f"{100 * (3.20 / 0.84 - 1):+.3g}% of the MATLAB value",
        LARGEST_ERROR: f"{0.1674 - 0.1670:.4f} rad and {3.20 - 0.84:.2f} rad/s",
        STEP_LENGTH: f"{step:.4f} m apart (x_p and Table 1)",
        V_COM.matlab: f"one step is {step / 1.39:.3f} m/s and two are {2 * step / 1.39:.3f} m/s",
        V_COM.adams: f"one step is {adams_step / 1.38:.3f} m/s and two are {2 * adams_step / 1.38:.3f} m/s",
        T_LEFT.matlab: "its steps are equal: not 0.60 and 0.79 s",
        T_CYCLE.adams: f"0.59 + 0.77 s is {0.59 + 0.77:.2f} s",
    }.items():
        assert computed in found[entry].evidence


def test_evidence_consists_of_capitalised_sentences(rows):
    for row in rows().values():
        assert not re.search(r"[a-z)]\. [a-z]", row.evidence), row.evidence


def test_value_counts_as_contradicted_only_if_rounding_cannot_explain_it(rows):
    row = rows()[TABLE_2[0].percent]  # Unrounded, -0.2022 and -0.2021 may differ by up to 0.1 %.
    assert (row.verdict, "a change of -0.10 to +0.00%, given the rounding" in row.evidence) == (
        Verdict.EXPLAINED,
        True,
    )


def test_adams_values_without_a_contradiction_are_not_reproduced(rows):
    adams = [row.adams for row in (*TABLE_2, *TABLE_3)]
    found = rows()
    verdicts = {entry: found[entry].verdict for entry in (*adams, LOST_BALANCE)}
    contradicted = {entry for entry, verdict in verdicts.items() if verdict == Verdict.CONTRADICTED}
    assert contradicted == {T_CYCLE.adams, V_COM.adams}
    assert {verdicts[entry] for entry in verdicts.keys() - contradicted} == {Verdict.NOT_REPRODUCED}


def test_cycle_that_is_the_sum_of_its_steps_is_not_contradicted(rows):
    assert rows()[T_CYCLE.matlab].verdict == Verdict.NOT_REPRODUCED


def test_printed_adams_values_count_as_inputs_if_the_contact_walk_starts_from_them(rows):
    found = rows(start=adams_start_as_printed())
    assert {found[row.adams].verdict for row in TABLE_2} == {Verdict.INPUT}


def test_matlab_energy_is_explained_and_adams_energy_is_not_reproduced(rows):
    found = rows()
    assert "(5 steps)" in E_AVG.matlab.quantity
    assert found[E_AVG.matlab].verdict == Verdict.EXPLAINED
    for said in ("150.110 J over five steps", "150.127 J over ten", "its value matches the mean over ten"):
        assert said in found[E_AVG.matlab].evidence
    # The mean is 150.03 J. Samples lie on either side of the printed value, which lies between the means of all models.
    assert found[E_AVG.adams].verdict == Verdict.NOT_REPRODUCED
    assert "-0.110 J off the printed value" in found[E_AVG.adams].evidence


def test_fall_in_the_paper_is_not_reproduced_if_our_walk_from_its_start_goes_on(rows):
    row = rows()[LOST_BALANCE]
    assert (row.verdict, row.values["contact"]) == (Verdict.NOT_REPRODUCED, 10.0)
    assert "takes 10 of 10 steps (walked)" in row.evidence
    assert rows(from_x_p=(1, "fell"))[LOST_BALANCE].verdict == Verdict.REPRODUCED


def test_adams_start_leads_to_a_fall_at_the_time_found_by_an_independent_integration(study):
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
    told = prose("adams_start.velocities", study.adams)
    assert "in the rigid model, whose stance foot is pinned to an even slope" in told
    assert "the walk ends (fell) at 0.347 s" in told


def test_in_other_scenes_only_internal_contradictions_count_against_the_paper(rows):
    elsewhere = ("slope_rad 0.05 instead of 0.0174",)
    found = rows(Departures(elsewhere, elsewhere))
    of_the_walk = {entry for row in TABLE_3 for entry in (row.matlab, row.adams)} - {*OWN_CONTRADICTIONS}
    assert {found[entry].verdict for entry in of_the_walk} == {Verdict.EXPLAINED}
    assert all("Not the paper's scene" in found[entry].evidence for entry in of_the_walk)
    assert {found[entry].verdict for entry in OWN_CONTRADICTIONS} == {Verdict.CONTRADICTED}


def test_printed_largest_error_is_contradicted_if_the_models_differ_much_less(rows):
    small = WalkDifference(np.array([(9e-5, 1e-4)]), np.array([(1e-4, 1e-4)]))
    row = rows(errors={"raw": small, "aligned": small})[LARGEST_ERROR]
    assert (row.verdict, row.values["contact"]) == (Verdict.CONTRADICTED, 1e-4)


def test_immediate_fall_leaves_missing_values(rows):
    nothing = Characteristics(None, None, None, None, None)
    gone = {"steps": 0, "outcome": "fell", "table_3": nothing, "step_length": None, "start": None}
    found = rows(**gone, energy=None)
    assert all(found[row.adams].values["contact"] is None for row in TABLE_3)
    assert all("None" not in row.evidence for row in found.values())


def test_slope_without_gaits_has_no_rigid_columns(rows):
    found = rows(Departures(("slope_rad -0.1 instead of 0.0174",), ()), models={})
    assert all(found[entry].values["as_printed"] is found[entry].values["corrected"] is None for entry in X_P)
    assert "no gait" in found[E_AVG.matlab].evidence


def test_verdict_in_another_scene_says_that_it_is_about_the_paper_alone(rows):
    elsewhere = Departures(("slope_rad 0.05 instead of 0.0174",), ("slope_rad 0.05 instead of 0.0174",))
    about_itself = "about the paper's own numbers, not this scene"
    for row in rows(elsewhere).values():
        assert row.verdict != Verdict.CONTRADICTED or about_itself in row.evidence
        assert row.verdict in (Verdict.INPUT, Verdict.REPRODUCED) or "slope_rad 0.05" in row.evidence
    assert not any("this scene" in row.evidence for row in rows().values())


def test_missing_step_is_not_reported_as_zero_length(rows):
    row = next(row for printed, row in rows(models={}, step_length=None).items() if printed == STEP_LENGTH)
    assert "No model takes a step" in row.evidence
    assert "times the printed length" not in row.evidence
