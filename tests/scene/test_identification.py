"""Tests of parameters identified from synthetic walks, and of walks that no walker explains."""

import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from walkerlab.api.memory import run_in_memory
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.errors import NoAnswer
from walkerlab.outcome import Outcome
from walkerlab.physics.estimation.fit import fit, refit
from walkerlab.physics.estimation.judgement import spectral_radius
from walkerlab.physics.estimation.measurements import MeasuredWalk
from walkerlab.physics.estimation.result import USABLE
from walkerlab.physics.orbits.step_map import StepMap
from walkerlab.scene.identification import ConfigFamily, gait_start, identify_walk, problem_of, step_map_of
from walkerlab.scene.subject import find_model_gait

CAMPAIGN = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "identification_coverage.py"))
KEYS = ("slope_deg", "walker.leg_length_m")


@cache
def truth(level="steps", name="slope-3deg", keys=KEYS):
    return CAMPAIGN["Truth"](name, keys, level)


def identify(measured, *sets, keys=KEYS, prior=None, **options):
    config = load(Path("slope-3deg"), sets).config
    question = Identify(fit=dict.fromkeys(keys), prior=prior or {}, **options)
    return identify_walk(config, measured, truth().gait, question)


def verdict(result):
    return result.models[0].fit


def test_confidence_regions_cover_the_truth_and_errors_match_the_scatter():
    """The probability that more than two of twelve walks lie outside is 2 %. scripts/identification_coverage.py checks
    a thousand walks.
    """
    inside, estimates, errors, _ = CAMPAIGN["coverage"](truth(), range(12))
    assert inside.sum() >= 10
    ratio = np.sqrt((errors**2).mean(axis=0)) / np.abs(estimates - truth().values).std(axis=0, ddof=1)
    assert np.all((ratio > 0.4) & (ratio < 3.0))


def test_multipliers_estimated_from_measured_steps_are_corrected_for_noise():
    """By plain least squares they would be a quarter too small."""
    paper = truth("steps", "paper", CAMPAIGN["WALKERS"]["paper"])
    measured = [paper.identify(*paper.walk(seed)).measured_radius for seed in range(8)]
    plain, corrected, errors = np.array([(each.plain, each.value, each.standard_error) for each in measured]).T
    own = paper.gait["spectral_radius"]
    assert own - plain.mean() > 2.0 * plain.std(ddof=1) / np.sqrt(len(plain))
    assert abs(corrected.mean() - own) < 2.5 * errors.mean() / np.sqrt(len(plain))
    assert 0.5 < errors.mean() / corrected.std(ddof=1) < 2.0


def test_quantity_without_variation_does_not_change_the_multiplier():
    lengths = np.array([0.9, -0.5, 0.3, -0.1, 0.08, -0.2, 0.1, 0.05, -0.03, 0.02])[:, None]
    with_periods = np.column_stack((np.full(10, 0.75), lengths))
    assert spectral_radius(with_periods) == pytest.approx(spectral_radius(lengths), rel=1e-12)
    assert 0.3 < spectral_radius(lengths) < 0.8


def test_quick_refit_keeps_the_estimate_of_a_fit_with_a_soft_loss():
    """Without trimming, the outlier would move the estimate."""
    measured, _ = truth().walk(0)
    periods = measured.periods_s.copy()
    periods[7] += 0.02
    own = truth()
    subject = find_model_gait("rigid", own.config, own.gait, lambda _: None)
    question = Identify(fit=dict.fromkeys(KEYS), loss="soft_l1")
    problem = problem_of(subject, replace(measured, periods_s=periods), question)
    fitted = fit(problem, problem.initial_unknowns())
    errors = np.sqrt(np.diag(np.linalg.inv(fitted.evaluation.information)))
    assert np.all(np.abs(refit(problem, fitted.u, fitted).u - fitted.u) < 0.1 * errors)


def test_multipliers_are_not_measured_from_seven_steps():
    measured, _ = truth().walk(0)
    few = replace(measured, periods_s=measured.periods_s[:7], lengths_m=measured.lengths_m[:7])
    assert identify(few).measured_radius is None


def test_angles_determine_the_hip_mass():
    keys = ("walker.hip_mass_kg", *KEYS)
    own = truth("angles", "slope-3deg", keys)
    measured, _ = own.walk(1)
    result = identify(measured, "walker.hip_mass_kg=10.3", "slope_deg=3.05", keys=keys)
    assert verdict(result) == "fits"
    assert result.not_identifiable == ()
    for estimate, value in zip(result.estimates, own.values, strict=True):
        assert abs(estimate.value - value) < 4.0 * estimate.standard_error
        assert estimate.standard_error < 0.01 * value
    assert result.measurement["angle_rad"] == pytest.approx(2e-3, rel=0.05)
    assert result.gait["period_s"].value == pytest.approx(truth().gait["period_s"], abs=2e-3)


@pytest.mark.parametrize("seed", [2, 3])
def test_large_deviations_on_a_rough_floor_are_not_a_misfit(seed):
    """At equal phases of the steps, the floor alone changes the angles of the simplest walker by 5 % of their size."""
    own = truth("angles", "simplest")
    result = own.identify(*own.walk(seed))
    assert verdict(result) in USABLE
    assert CAMPAIGN["region_holds"](result, own.values)


def test_rigid_walk_does_not_determine_the_mass_scale():
    keys = ("walker.hip_mass_kg", "walker.leg_mass_kg", "walker.leg_inertia_kg_m2")
    measured, _ = truth("angles").walk(2)
    result = identify(measured, "walker.leg_inertia_kg_m2=0.01", keys=keys[:2])
    (open_combination,) = result.not_identifiable
    assert sorted(open_combination.combination.removesuffix(" together").split(" and ")) == [
        "walker.hip_mass_kg (0.71)", "walker.leg_mass_kg (0.71)",
    ]  # fmt: skip
    assert [estimate.standard_error for estimate in result.estimates] == [None, None]
    weighed = identify(measured, keys=keys[:2], prior={"walker.leg_mass_kg": [5.0, 0.05]})
    assert weighed.not_identifiable == ()
    hip, _ = weighed.estimates
    assert abs(hip.value - 10.0) < 4.0 * hip.standard_error


def test_every_parameter_that_two_exact_steps_leave_undetermined_is_named():
    own = truth()
    walk = own.walks.take_disturbed_walk(own.z * 1.01, tuple(own.values), np.zeros(3))
    measured = MeasuredWalk(walk.durations_s, walk.lengths_m)
    result = identify_walk(own.config, measured, own.gait, Identify(fit=dict.fromkeys(KEYS)))
    left_open = {estimate.key for estimate in result.estimates if estimate.standard_error is None}
    assert left_open == {key for key in KEYS if any(key in entry.combination for entry in result.not_identifiable)}
    assert len(left_open) > 1


def test_derivatives_equal_finite_differences_of_other_step_sizes():
    own = truth()
    measured, _ = own.walk(3)
    subject = find_model_gait("rigid", own.config, own.gait, lambda _: None)
    forecast = problem_of(subject, measured, Identify(fit=dict.fromkeys(KEYS))).forecast
    u, heights = np.zeros(forecast.unknowns), np.zeros(forecast.heights)
    u[:2] = own.values / forecast.scales
    J, _ = forecast.differentiate(u, heights, exact=True, disturbed=False)
    for place, unit in enumerate(np.eye(u.size)):
        for size in (3e-5, 3e-4):
            ends = [forecast.predict(u + sign * size * unit, heights).values for sign in (-2, -1, 1, 2)]
            column = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * size)
            assert J[:, place] == pytest.approx(column, abs=1e-6 * np.abs(J[:, place]).max())


def test_long_walk_is_predicted_to_its_end():
    own = truth()
    walk = own.walks.take_disturbed_walk(own.z, tuple(own.values), np.zeros(121))
    assert walk.outcome is Outcome.WALKED
    assert walk.durations_s.size == 120


LEGS_DIFFER = {
    "prosthesis": ("prosthesis",),
    "one knee": ("one-knee",),
    "longer leg": ("round-feet", "walker.leg_2={leg_length_m: 0.4003, foot_radius_m: 0.118}"),
}


@cache
def limping(name, model="rigid"):
    own, *sets = LEGS_DIFFER[name]
    config = load(Path(own), sets).config
    gait = run_in_memory("fixedpoint", config).summary
    return find_model_gait(model, config, gait, lambda _: None), ConfigFamily(config, ["walker.leg_2.leg_mass_kg"])


@pytest.mark.parametrize("name", ["round-feet", "kneed", "paper"])
def test_tangents_of_a_walk_equal_difference_quotients(name):
    own = CAMPAIGN["Truth"](name, CAMPAIGN["WALKERS"][name])
    heights, p, steps = np.random.default_rng(3).normal(0.0, 1e-3, 6) * own.leg, tuple(own.values), 5
    along = np.eye(own.z.size + steps + 1)
    times = np.linspace(0.0, 0.999 * own.walks.take_disturbed_walk(own.z, p, heights).durations_s.sum(), 40)
    exact = own.walks.differentiate_walk(own.z, p, heights, along, times)
    differences = StepMap.differentiate_walk(own.walks, own.z, p, heights, along, times)
    for field in ("durations_s", "lengths_m", "angles_rad", "samples_rad"):
        values, others = getattr(exact, field), getattr(differences, field)
        assert values == pytest.approx(others, abs=2e-5 * np.abs(values).max()), field
    assert exact.rates == pytest.approx(differences.rates, abs=1e-4)


@pytest.mark.parametrize("first_leg", [1, 2])
@pytest.mark.parametrize("name", LEGS_DIFFER)
def test_tangents_of_a_limping_walk_equal_difference_quotients(name, first_leg):
    subject, family = limping(name)
    walks, z = step_map_of(subject, family, first_leg), gait_start(subject, family, first_leg)
    heights, steps = np.random.default_rng(3).normal(0.0, 3e-4, 6), 5
    along = np.eye(z.size + steps + 1)
    times = np.linspace(0.0, 0.999 * walks.take_disturbed_walk(z, family.start, heights).durations_s.sum(), 40)
    exact = walks.differentiate_walk(z, family.start, heights, along, times)
    differences = StepMap.differentiate_walk(walks, z, family.start, heights, along, times)
    for field in ("durations_s", "lengths_m", "angles_rad", "samples_rad"):
        values, others = getattr(exact, field), getattr(differences, field)
        assert values == pytest.approx(others, abs=2e-5 * np.abs(values).max()), field
    assert exact.rates == pytest.approx(differences.rates, abs=1e-4)


@pytest.mark.parametrize(("model", "accuracy"), [("rigid", 1e-9), ("contact", 1e-5)])
def test_walk_that_begins_with_leg_2_is_the_same_gait_half_a_stride_later(model, accuracy):
    subject, family = limping("prosthesis", model)
    walks = [step_map_of(subject, family, leg) for leg in (1, 2)]
    first, second = (
        each.take_disturbed_walk(gait_start(subject, family, leg), family.start, np.zeros(7))
        for leg, each in enumerate(walks, 1)
    )
    assert second.durations_s[:5] == pytest.approx(first.durations_s[1:], rel=accuracy)
    assert second.angles_rad[:5] == pytest.approx(first.angles_rad[1:], rel=accuracy)
    # Leg 2 is lighter, so it swings faster.
    assert second.durations_s[0] < 0.95 * first.durations_s[0]


@pytest.mark.parametrize("first_leg", [1, 2])
@pytest.mark.parametrize("name", ["prosthesis", "longer leg"])
def test_touch_angles_equal_the_angles_sampled_at_the_touch(name, first_leg):
    for model, accuracy in (("rigid", 1e-5), ("contact", 5e-4)):
        subject, family = limping(name, model)
        walks, z = step_map_of(subject, family, first_leg), gait_start(subject, family, first_leg)
        walk = walks.take_disturbed_walk(z, family.start, np.zeros(5))
        touches = np.cumsum(walk.durations_s) * (1.0 - 1e-6)
        sampled = walks.sample_legs(z, family.start, np.zeros(5), touches)
        # The legs land in turns, beginning with the leg that swings first.
        assert walk.angles_rad == pytest.approx(sampled[[0, 1, 2, 3], [0, 1, 0, 1]], abs=accuracy)


def test_noise_free_steps_give_the_parameters_to_many_digits():
    own = truth()
    walk = own.walks.take_disturbed_walk(own.z * 1.005, tuple(own.values), np.zeros(21))
    measured = MeasuredWalk(walk.durations_s, walk.lengths_m)
    result = identify(measured, "slope_deg=3.03", "walker.leg_length_m=1.01")
    assert result.process["at_bound"]
    assert [estimate.value for estimate in result.estimates] == pytest.approx(own.values, rel=1e-5)


def wrong_walks():
    measured, _ = truth().walk(4)
    periods, lengths = measured.periods_s, measured.lengths_m
    limp = 1.0 + 0.04 * (-1.0) ** np.arange(periods.size)
    missed = np.concatenate((periods[:7], [periods[7] + periods[8]], periods[9:]))
    missed_lengths = np.concatenate((lengths[:7], [lengths[7] + lengths[8]], lengths[9:]))
    return {
        "limp": MeasuredWalk(periods * limp, lengths / limp),
        "missed step": MeasuredWalk(missed, missed_lengths),
        "mm for m": MeasuredWalk(periods, 1e3 * lengths),
        "ms for s": MeasuredWalk(1e3 * periods, lengths),
    }


@pytest.mark.parametrize("name", ["limp", "missed step", "mm for m", "ms for s"])
def test_model_does_not_fit_limps_or_data_with_missed_steps_or_wrong_units(name):
    try:
        result = identify(wrong_walks()[name])
    except NoAnswer as error:
        assert error.message.startswith("no walk of the model can be fitted")  # noqa: PT017
        return
    assert verdict(result) in ("misfit", "not-converged")
    assert result.models[0].reasons


@pytest.mark.parametrize("change", ["swapped", "mirrored"])
def test_swapped_or_mirrored_angles_do_not_fit(change):
    measured, _ = truth("angles").walk(5)
    angles = measured.angles_rad[:, ::-1] if change == "swapped" else -measured.angles_rad
    result = identify(replace(measured, angles_rad=angles))
    assert verdict(result) in ("misfit", "not-converged")
