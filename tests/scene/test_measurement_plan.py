"""Tests of planned measurements: expected errors are compared with a dense normal distribution, and measures that
reduce them.
"""

from pathlib import Path

import numpy as np
import pytest

from walkerlab.api.memory import run_in_memory
from walkerlab.config.analyses import Plan
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.errors import NoAnswer
from walkerlab.physics.estimation.measurements import LEG_ANGLE, STEP_LENGTH, STEP_PERIOD
from walkerlab.pipeline.stages.plan import ANGLES, plan_measurements, predict_measured, walk_of
from walkerlab.scene.subject import find_model_gait

KEYS = ("slope_deg", "walker.leg_length_m")
QUESTION = Identify(fit=dict.fromkeys(KEYS))
PLAN = Plan(steps=6, max_steps=8, errors={"slope_deg": 0.01})


def subject_of(name, model):
    config = load(Path(name)).config
    return find_model_gait(model, config, run_in_memory("fixedpoint", config).summary, print)


@pytest.fixture(scope="module")
def subject():
    return subject_of("slope-3deg", "rigid")


@pytest.fixture(scope="module")
def options(subject):
    return plan_measurements(subject, QUESTION, PLAN)


def errors(options, measurement, start="at the gait"):
    return next(o for o in options if (o.measurement, o.start) == (measurement, start))


def test_expected_errors_equal_a_dense_gaussian_computation(subject, options):
    walk = walk_of(subject, predict_measured(subject, QUESTION, PLAN)[0], QUESTION)
    noise = {STEP_PERIOD: PLAN.period_noise_s, STEP_LENGTH: PLAN.length_noise_m, LEG_ANGLE: PLAN.angle_noise_rad}
    deviations = np.array([noise[walk.forecast.quantities[q]] for q in walk.data.quantity])
    used = (walk.step < PLAN.steps) & (walk.data.quantity != walk.forecast.quantities.index(LEG_ANGLE))
    J, G = walk.data.J[used], walk.data.G[used]
    covariance = np.diag(deviations[used] ** 2) + PLAN.roughness_m**2 * G @ G.T
    dense = np.linalg.inv(J.T @ np.linalg.solve(covariance, J))[: len(KEYS), : len(KEYS)]
    expected = np.sqrt(np.diag(dense)) * walk.forecast.scales
    np.testing.assert_allclose(list(errors(options, "periods and lengths").errors.values()), expected, rtol=1e-6)


def test_more_steps_and_quantities_reduce_the_errors(options):
    for option in options:
        values = [curve["slope_deg"] for curve in option.curve.values() if curve["slope_deg"] is not None]
        assert values == sorted(values, reverse=True)
    few = errors(options, "periods and lengths").errors
    many = errors(options, "periods, lengths and touch angles").errors
    assert all(many[key] < few[key] for key in KEYS)
    assert all(errors(options, ANGLES).errors[key] < few[key] for key in KEYS)


def test_periods_of_a_steady_gait_do_not_determine_the_slope(options):
    periods = errors(options, "periods")
    assert periods.errors["slope_deg"] is None
    assert "slope_deg" in periods.not_identifiable[0].combination
    assert periods.steps_needed == {"slope_deg": None}


def test_plan_needs_the_fewest_steps_for_the_requested_error(subject, options):
    needed = errors(options, ANGLES).steps_needed["slope_deg"]
    plan = PLAN.model_copy(update={"steps": needed})
    enough = plan_measurements(subject, QUESTION, plan)
    assert errors(enough, ANGLES).errors["slope_deg"] <= 0.01
    fewer = plan_measurements(subject, QUESTION, plan.model_copy(update={"steps": needed - 1}))
    assert errors(fewer, ANGLES).errors["slope_deg"] > 0.01


def test_prior_determines_a_slope_that_periods_do_not_determine(subject):
    weighed = Identify(fit=dict.fromkeys(KEYS), prior={"slope_deg": [3.0, 0.01]})
    error = errors(plan_measurements(subject, weighed, PLAN), "periods").errors["slope_deg"]
    assert error == pytest.approx(0.01, rel=0.05)


def test_start_too_far_from_the_gait_has_no_plan(subject):
    with pytest.raises(NoAnswer, match=r"takes only \d+ of 9 steps"):
        plan_measurements(subject, QUESTION, PLAN.model_copy(update={"start_change": 0.5}))


@pytest.mark.parametrize("model", ["rigid", "contact"])
def test_planned_error_of_the_mass_of_leg_2_is_a_fraction_of_a_kilogram(model):
    """The compass has equal legs. The predicted error agrees with that from a measured limp, 0.008 kg after 20
    steps.
    """
    question = Identify(fit={"walker.leg_2.leg_mass_kg": None}, model=model)
    options = plan_measurements(subject_of("paper", model), question, Plan(steps=4, max_steps=4))
    (error,) = errors(options, "periods and lengths").errors.values()
    assert 0.005 < error < 0.1
