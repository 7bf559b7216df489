"""Tests of the stage `simulate`: results by leg, requested outputs, and outcomes."""

import json
import math
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.contact import Footholds
from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.physics.hybrid import recorded_walk
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint, simulate
from walkerlab.scene.rigid import rigid_scene
from walkerlab.views.report.answers import answer

# keys that programs may rely on
FIXED_KEYS = {
    "outcome",
    "steps",
    "step_periods_s",
    "step_lengths_m",
    "final_state",
    "energy_drift_J",
    "min_normal_force_N",
    "max_friction_ratio",
    "max_scuff_depth_m",
    "mean_energy_J",
    "work_per_step_J",
    "cost_of_transport",
}
GIVEN = (-0.2022, 0.1674, -0.60, -0.84)
SLOW = (-0.2022, 0.1674, -0.4, -0.5)


def run(**changes):
    config = Config.model_validate(changes)
    inputs = {}
    if PIPELINE["simulate"].inputs(config):
        inputs["fixedpoint"] = fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())
    return simulate.run(restrict(config, PIPELINE["simulate"].takes), inputs, Silent())


@pytest.fixture(scope="module")
def paper():
    return run()


def test_summary_has_the_expected_keys(paper):
    assert set(paper.summary) >= FIXED_KEYS
    json.dumps(paper.summary, allow_nan=False)


def test_five_strides_from_the_fixed_point_are_ten_equal_steps(paper):
    summary = paper.summary
    assert (summary["outcome"], summary["steps"]) == ("walked", 10)
    assert summary["step_periods_s"] == pytest.approx([0.7035969] * 10, abs=1e-7)
    assert summary["step_lengths_m"] == pytest.approx([0.3714303] * 10, abs=1e-7)
    assert summary["final_state"] == pytest.approx(summary["start_state"], abs=1e-8)
    assert summary["mean_energy_J"] == pytest.approx(150.241, abs=1e-3)
    assert summary["energy_drift_J"] < 1e-8


def test_mean_energy_of_printed_equations_is_that_of_table_3():
    assert run(equations="as-printed").summary["mean_energy_J"] == pytest.approx(150.142, abs=1e-3)


def test_steps_table_agrees_with_the_summary(paper):
    steps, summary = paper["steps"], paper.summary
    assert steps["period_s"].tolist() == summary["step_periods_s"]
    assert steps["length_m"].tolist() == summary["step_lengths_m"]
    assert steps["state_after"][-1].tolist() == summary["final_state"]
    assert steps["touch_time_s"] == pytest.approx(np.cumsum(summary["step_periods_s"]), rel=1e-14)
    assert steps["touch_time_s"].tolist() == summary["touch_times_s"]
    assert steps["touch_along_m"] == pytest.approx(np.cumsum(summary["step_lengths_m"]), rel=1e-14)
    # The legs change roles: the swing leg becomes the stance leg, and the stance leg the swing leg.
    assert (steps["state_before"][:, [1, 0]] == steps["state_after"][:, :2]).all()


def test_leg_angles_are_continuous_through_changes_of_roles(paper):
    trajectory = paper["trajectory"]
    time, angle, velocity = trajectory["time"], trajectory["angle"], trajectory["velocity"]
    assert (np.diff(time) > 0.0).all()
    # The largest rate may occur between samples.
    bound = 1.01 * np.abs(velocity).max() * np.diff(time)[:, None] + 1e-12
    assert (np.abs(np.diff(angle, axis=0)) <= bound).all()


def test_leg_0_swings_first_and_the_legs_take_turns(paper):
    trajectory = paper["trajectory"]
    assert trajectory["stance_leg"][0] == 2
    assert (trajectory["stance_leg"] == 2 - trajectory["step"] % 2).all()
    assert trajectory["angle"][0].tolist() == paper.summary["start_state"][:2]
    assert trajectory["velocity"][0].tolist() == paper.summary["start_state"][2:]


def test_stored_forces_and_energies_agree_with_the_summary(paper):
    trajectory, summary = paper["trajectory"], paper.summary
    stands = trajectory["stance_leg"][:, None] == trajectory["leg"]
    normal, friction = trajectory["normal_force_N"], trajectory["friction_force_N"]
    assert normal[stands].min() == pytest.approx(summary["min_normal_force_N"], rel=1e-4)
    assert (normal[~stands] == 0.0).all()
    assert (friction[~stands] == 0.0).all()
    total = trajectory["kinetic_J"] + trajectory["potential_J"]
    assert trajectory["mechanical_J"] == pytest.approx(total, rel=1e-15)
    assert total == pytest.approx(summary["mean_energy_J"], rel=1e-9)


def test_rolling_distance_is_the_travel_of_the_lowest_foot_point():
    config = load(Path("round-feet"), ["strides=2"]).config
    inputs = {"fixedpoint": fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())}
    walk = simulate.run(restrict(config, PIPELINE["simulate"].takes), inputs, Silent())
    trajectory = walk["trajectory"]
    for step, rolled in enumerate(walk["steps"]["rolling_m"]):
        along = trajectory["foot_along_m"][trajectory["step"] == step, 1 - step % 2]
        assert rolled == pytest.approx(along[-1] - along[0], abs=1e-12)
        assert rolled > 0.01


def test_omitted_outputs_are_listed():
    none = run(outputs=[])
    assert set(none.groups) == {"steps"}
    whys = [entry["why"] for entry in none.summary["left_out"]]
    assert {f"{output} are not in `outputs`" for output in ("states", "energies", "forces")} <= set(whys)
    energies = run(outputs=["energies"])
    assert set(energies["trajectory"].variables) == {
        "time",
        "leg",
        "step",
        "stance_leg",
        "kinetic_J",
        "potential_J",
        "mechanical_J",
    }
    assert none.summary["final_state"] == energies.summary["final_state"]


def test_slope_without_a_gait_can_be_simulated_from_a_given_start():
    result = run(slope_rad=0.0, start=(-0.1674, *SLOW[1:]))
    assert result.summary["outcome"] == "fell"
    assert "hip" in result.summary["advice"]
    assert result.summary["steps"] == 0
    assert result.summary["step_periods_s"] == []
    assert result.summary["final_state"] == [-0.1674, *SLOW[1:]]
    assert set(result.groups) == {"trajectory"}


def test_start_with_the_walker_lying_down_is_rejected():
    result = run(start=(-1.5348, 1.5, 0.0, 0.0))
    assert result.summary["outcome"] == "rejected"
    assert set(result.groups) == set()


def test_pulling_ground_is_reported():
    result = run(slope_rad=float(np.deg2rad(20.0)), strides=1, start=(-0.7935165, 0.0953848, 0.7024719, -1.8681666))
    assert result.summary["outcome"] == "lifted-off"
    assert result.summary["steps"] == 2
    assert result.summary["min_normal_force_N"] < 0.0


def test_walk_reports_forces_that_no_ground_can_give():
    """It reports that the ground would pull, even in a walk that falls, and too much friction. If there is neither, it
    reports nothing.
    """
    fast = run(contact=None, start=(-0.3, 0.25, -1.5, -2.6), strides=1).summary
    assert fast["min_normal_force_N"] < 0.0
    assert f"pull with {-fast['min_normal_force_N']:.3g} N" in fast["objections"][0]
    slippery = [one for one in fast["objections"] if f"coefficient of {fast['max_friction_ratio']:.3g}" in one]
    assert bool(slippery) == (fast["max_friction_ratio"] > 1.0)
    assert any(
        "Not possible on real ground: the ground would have to pull" in line for line in answer("simulate", fast)
    )
    assert run(contact=None, strides=1).summary["objections"] == []


@pytest.mark.parametrize("heights", [(-0.03, 0.05), (0.0, 0.0)])
def test_fall_on_uneven_ground_is_not_blamed_on_the_start(heights):
    uneven = any(heights)
    start = "fixed-point" if uneven else SLOW
    walk = run(contact=None, start=start, ground={"heights_m": heights}, strides=2).summary
    assert walk["outcome"] == "fell"
    assert ("lower the footholds (ground.heights_m" in walk["advice"]) == uneven
    assert ("start nearer to a gait" in walk["advice"]) != uneven


def test_friction_ratio_is_missing_if_the_ground_always_pulls():
    summary = run(start=(-0.2022, 0.1674, -20.0, -20.0), strides=1).summary
    assert summary["min_normal_force_N"] < 0.0
    assert summary["max_friction_ratio"] is None
    json.dumps(summary, allow_nan=False)


def test_exhausted_budget_gives_no_answer_but_keeps_the_partial_walk(monkeypatch):
    monkeypatch.setattr(recorded_walk, "BUDGET_OF_A_STEP", 100)
    with pytest.raises(NoAnswer, match=r"budget-exhausted after [1-9] steps") as caught:
        run(start=GIVEN)
    assert "solver" in caught.value.advice
    assert caught.value.partial.summary["steps"] > 0


def test_another_method_gives_the_same_final_state(paper):
    other = run(solver={"rigid": {"method": "scipy-dop853", "rtol": 1e-10, "atol": 1e-12}})
    assert other.summary["final_state"] == pytest.approx(paper.summary["final_state"], abs=1e-8)


def test_long_walk_needs_memory_only_for_its_steps():
    inputs = {"fixedpoint": fixedpoint.run(restrict(Config(), PIPELINE["fixedpoint"].takes), {}, Silent())}
    config = restrict(Config(strides=2000, outputs=()), PIPELINE["simulate"].takes)
    tracemalloc.start()
    try:
        result = simulate.run(config, inputs, Silent())
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert result.summary["steps"] == 4000
    table = sum(variable.values.nbytes for variable in result["steps"].variables.values())
    # the table, its frozen copy and the lists of the summary, and for the second walk its table and lists
    assert peak < 5 * table


def test_mid_step_start_is_simulated_unchanged():
    summary = run(slope_rad=0.0525, start={"instant": "mid-step", "state": [0.0, 0.0, 2.0, -0.4]}).summary
    assert summary["outcome"] == "walked"
    assert summary["step_periods_s"][:3] == pytest.approx([0.417227, 0.747143, 0.722175], abs=1e-6)
    assert summary["start_state"] == [0.0, 0.0, 2.0, -0.4]


@pytest.mark.parametrize("name", ["paper", "torso", "kneed-round-feet"])
def test_walk_continues_the_same_way_from_any_mid_step_state(name):
    config = load(Path(name), ["strides=2"]).config
    gait = fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent()).summary
    scene = rigid_scene(config, Footholds(), ("states",))
    whole = scene.walk(tuple(gait["state"]), 3, EXACT_STEPS, sampled=True)
    first = np.flatnonzero(whole.samples.time_s < whole.touch_time_s[0] - 1e-9)[1::9]
    for place in (*first, first[-1]):
        rest = scene.walk(tuple(whole.samples.state[place]), 3, EXACT_STEPS)
        begun = whole.samples.time_s[place]
        assert rest.touch_time_s + begun == pytest.approx(whole.touch_time_s, abs=1e-9)
        assert np.diff(rest.touch_along_m) == pytest.approx(np.diff(whole.touch_along_m), abs=1e-9)
        if whole.samples.bent[place]:
            assert rest.knee_strike_time_s[0] + begun == pytest.approx(whole.knee_strike_time_s[0], abs=1e-9)
        elif rest.knee_strike_time_s is not None:
            assert np.isnan(rest.knee_strike_time_s[0])


def test_mid_step_start_on_uneven_ground_is_judged_by_its_first_step():
    midway = {"instant": "mid-step", "state": [0.0, 0.0, 2.0, -0.4]}
    summary = run(slope_rad=0.0525, start=midway, ground={"heights_m": [0.0, -0.001, 0.001]}).summary
    assert summary["outcome"] == "walked"


SIMPLEST = {"type": "compass", "leg_length_m": 1.0, "foot_to_mass_m": 1e-9, "leg_mass_kg": 1e-9, "hip_mass_kg": 1.0}


def test_walk_that_leaves_an_unstable_gait_says_so():
    summary = run(
        walker=SIMPLEST | {"foot_radius_m": 0.0},
        gravity_m_s2=1.0,
        slope_rad=0.018,
        strides=100,
        contact=None,
        outputs=[],
    ).summary
    assert summary["repeats_after"] == 4
    assert 20 < summary["leaves_gait_at"] < 80
    right = [3.66771, 4.04720, 3.75628, 4.06775]
    last = summary["step_periods_s"][-4:]
    assert sorted(last) == pytest.approx(sorted(right), abs=1e-5)
    errors = summary["numerical_error"]["of_steps"]["step_period_s"]
    assert max(errors[-4:]) < 1e-8
    assert max(errors) > 1e-3  # errors of the steps on which the walk leaves the gait
    head = answer("simulate", summary)[0]
    assert f"the last takes {last[-1]:.6f} s" in head
    said = " ".join(answer("simulate", summary)[1:3])
    assert "begins on an unstable gait and leaves it" in said
    assert "In the end it repeats every 4 steps" in said


def test_walk_settling_on_a_two_step_gait_is_reported_as_alternating():
    summary = run(slope_rad=math.radians(4.7), strides=150, outputs=[]).summary
    assert summary["repeats_after"] == 2
    said = " ".join(answer("simulate", summary)[1:3])
    assert re.search(
        r"In the end it alternates between steps of 0\.(787082 and 0\.715713|715713 and 0\.787082) s", said
    )


def test_alternating_walk_shows_both_of_its_steps():
    # At tighter tolerances, the second walk is still leaving the gait.
    summary = run(slope_rad=math.radians(4.7), strides=60, outputs=[]).summary
    assert "between steps of 0.787082 and 0.715713 s" in " ".join(answer("simulate", summary))


def test_walk_on_a_stable_gait_repeats_every_step(paper):
    assert (paper.summary["repeats_after"], paper.summary["leaves_gait_at"]) == (1, None)
    assert "In the end" not in " ".join(answer("simulate", paper.summary))
