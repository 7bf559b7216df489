"""Tests of the stage `contact-sim`: its results, and its messages if there is no walk on compliant ground."""

import json
import math

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.walk_record import DrivenWork, WalkRecord, WalkWork
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import contact_sim, simulate
from walkerlab.pipeline.stages.walk import step_columns, summarise_walk
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Identity
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.provenance import begin
from walkerlab.scene import contact

# keys that programs may rely on
FIXED_KEYS = {
    "outcome",
    "steps",
    "step_periods_s",
    "step_lengths_m",
    "max_penetration_m",
    "slip_per_step_m",
    "energy_balance_residual_J",
    "rhs_evaluations",
    "static_penetration_m",
    "damping_ratio",
    "work_per_step_J",
    "cost_of_transport",
}
# the part of a result of `fixedpoint` that `contact-sim` reads: the gait of the corrected equations on the paper's
# slope
GAIT = Content({}, {"state": [-0.204200, 0.169400, -0.605819, -0.861041], "step_length_m": 0.3714303})
SLOPE, RADIUS, WEIGHT = 0.0174, 0.001, 20.0 * 9.81
SHARED = {
    "trajectory": {
        "time", "leg", "stance_leg", "angle", "velocity", "hip_along_m", "hip_height_m", "foot_along_m",
        "foot_height_m", "normal_force_N", "friction_force_N", "kinetic_J", "potential_J", "mechanical_J",
    },
    "steps": {"step", "touch_time_s", "period_s", "length_m", "touch_along_m", "rolling_m"},
}  # fmt: skip
STUMBLE = "start=[-0.2042, 0.1694, 0, 0]"


def run(*sets, inputs=(("fixedpoint", GAIT),)):
    config = load(None, sets).config
    return contact_sim.run(restrict(config, PIPELINE["contact-sim"].takes), dict(inputs), Silent())


@pytest.fixture(scope="module")
def paper():
    return run()


def test_summary_has_the_expected_keys(paper):
    assert set(paper.summary) >= FIXED_KEYS
    json.dumps(paper.summary, allow_nan=False)


def test_five_strides_are_ten_steps_of_the_contact_gait(paper):
    summary = paper.summary
    assert (summary["outcome"], summary["steps"]) == ("walked", 10)
    assert summary["step_periods_s"][-1] == pytest.approx(0.711, abs=5e-4)
    assert summary["step_lengths_m"][-1] == pytest.approx(0.361, abs=5e-4)
    assert summary["static_penetration_m"] == pytest.approx(0.059e-3, abs=5e-7)
    assert summary["damping_ratio"] > 1.0
    assert summary["energy_balance_residual_J"] < 1e-6
    assert 0.0 < summary["slip_per_step_m"] < 2e-3
    assert summary["max_penetration_m"] > summary["static_penetration_m"]


def test_steps_table_agrees_with_the_summary(paper):
    steps, summary = paper["steps"], paper.summary
    assert steps["period_s"].tolist() == summary["step_periods_s"]
    assert steps["length_m"].tolist() == summary["step_lengths_m"]
    assert steps["touch_time_s"] == pytest.approx(np.cumsum(steps["period_s"]), rel=1e-14)
    assert steps["touch_along_m"] == pytest.approx(np.cumsum(steps["length_m"]), rel=1e-14)
    assert summary["slip_per_step_m"] == pytest.approx(np.mean(steps["slip_m"]))


def test_every_touch_is_on_a_pad_of_its_leg(paper):
    pads, touches = paper["terrain"], paper["steps"]["touch_along_m"]
    for step, along in enumerate(touches):
        under = (pads["left_m"] <= along) & (along <= pads["right_m"])
        assert pads["leg"][under].tolist() == [1 + step % 2]


def masses(trajectory):
    """Return (mass, position along the slope, height) of legs and hip, computed from the hip and the angles."""
    hip = np.array([trajectory["hip_along_m"], trajectory["hip_height_m"]])
    yield 10.0, *hip
    for leg in range(2):
        tilted = trajectory["angle"][:, leg] + SLOPE
        yield 5.0, *(hip + 0.5 * np.array([np.sin(tilted), -np.cos(tilted)]))


def test_feet_are_at_the_ends_of_the_legs(paper):
    trajectory = paper["trajectory"]
    for leg in range(2):
        tilted = trajectory["angle"][:, leg] + SLOPE
        along = trajectory["hip_along_m"] + (1.0 - RADIUS) * np.sin(tilted)
        height = trajectory["hip_height_m"] - (1.0 - RADIUS) * np.cos(tilted) - RADIUS
        np.testing.assert_allclose(trajectory["foot_along_m"][:, leg], along, atol=1e-13)
        np.testing.assert_allclose(trajectory["foot_height_m"][:, leg], height, atol=1e-13)


def test_velocities_are_the_rates_of_the_angles(paper):
    trajectory = paper["trajectory"]
    time, angle, velocity = trajectory["time"], trajectory["angle"], trajectory["velocity"]
    mean = 0.5 * (velocity[1:] + velocity[:-1])
    # In the interval with a touch, the velocity jumps, so the mean rate differs.
    off = np.abs(np.diff(angle, axis=0) / np.diff(time)[:, None] - mean)
    assert np.median(off) < 1e-4
    assert off.max() < 2.0


def test_potential_energy_is_measured_from_the_foothold(paper):
    trajectory, steps = paper["trajectory"], paper["steps"]
    step = np.searchsorted(steps["touch_time_s"], trajectory["time"], side="right")
    along = np.append(trajectory["foot_along_m"][0, 1], steps["touch_along_m"])[step]
    expected = sum(
        mass * 9.81 * (h * math.cos(SLOPE) - (a - along) * math.sin(SLOPE)) for mass, a, h in masses(trajectory)
    )
    np.testing.assert_allclose(trajectory["potential_J"], expected, rtol=1e-12)
    elastic = trajectory["mechanical_J"] - trajectory["kinetic_J"] - trajectory["potential_J"]
    # elastic energy k d^(e + 1) / (e + 1) = F d / (e + 1) of the foot that stands at rest
    weight, depth = 20 * 9.81 * math.cos(SLOPE), np.median(trajectory["penetration_m"].max(axis=1))
    assert np.median(elastic) == pytest.approx(weight * depth / 3.2, rel=0.05)
    assert np.median(trajectory["mechanical_J"]) == pytest.approx(150.2, abs=0.5)


def test_kinetic_energy_is_the_sum_over_masses(paper):
    trajectory = paper["trajectory"]
    time = trajectory["time"]
    rates = [(mass, np.gradient(along, time), np.gradient(height, time)) for mass, along, height in masses(trajectory)]
    expected = sum(0.5 * mass * (v_x**2 + v_y**2) for mass, v_x, v_y in rates)
    assert np.median(np.abs(expected - trajectory["kinetic_J"])) < 1e-3


def test_energy_balances_at_every_sample_and_losses_only_grow(paper):
    trajectory = paper["trajectory"]
    channels = ("dissipated_damping_J", "dissipated_friction_J", "lost_at_edges_J")
    lost = sum(trajectory[name] for name in channels)
    for name in channels:
        assert np.diff(trajectory[name]).min() >= -1e-9
    book = trajectory["total_energy_J"]
    np.testing.assert_allclose(trajectory["residual_J"], book + lost - book[0], atol=1e-12)
    # The samples lie between solver steps, so they are less accurate.
    assert np.abs(trajectory["residual_J"]).max() < 1e-4
    total = paper.summary["dissipated_J"]
    assert sum(total.values()) == pytest.approx(lost[-1], abs=0.05)


def test_ground_carries_the_walker_and_never_pulls(paper):
    trajectory = paper["trajectory"]
    normal, friction = trajectory["normal_force_N"], trajectory["friction_force_N"]
    assert normal.min() >= 0.0
    assert np.all(np.abs(friction) <= 0.9 * normal + 1e-12)
    assert np.all(friction * trajectory["slip_velocity_m_s"] <= 0.0)
    assert np.all((trajectory["penetration_m"] > 0.0) | (normal == 0.0))
    assert np.median(normal.sum(axis=1)) == pytest.approx(WEIGHT * math.cos(SLOPE), rel=0.05)
    assert trajectory["penetration_m"].max() <= paper.summary["max_penetration_m"] * (1.0 + 1e-9)


def test_variables_with_the_same_name_mean_the_same_in_both_models(paper):
    rigid = simulate.run(restrict(load().config, PIPELINE["simulate"].takes), {"fixedpoint": GAIT}, Silent())
    for group, expected in SHARED.items():
        ours, theirs = (walk[group].variables for walk in (paper, rigid))
        shared = ours.keys() & theirs
        assert shared >= expected
        for name in shared:
            one, other = ours[name], theirs[name]
            assert (one.dims, one.units, one.long_name) == (other.dims, other.units, other.long_name)
    assert not {"penetration_m", "slip_velocity_m_s"} & rigid["trajectory"].variables.keys()
    assert "slip_m" not in rigid["steps"].variables
    assert {"touch_times_s", "step_periods_s", "step_lengths_m"} <= paper.summary.keys() & rigid.summary


def test_step_without_a_knee_strike_has_a_missing_strike_time():
    kneed = step_columns([0.7, 1.4], knee_strike_time_s=[0.5, np.nan])
    np.testing.assert_array_equal(kneed["knee_strike_time_s"].values, [0.5, np.nan])
    times, along, strikes = np.array([[0.7, 1.4], [0.3, 0.6], [0.5, np.nan]])
    nothing = DrivenWork(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    walk = WalkRecord(Outcome.WALKED, times, along, strikes, 1.4, WalkWork(0, 0, 0, 0), None, nothing)
    assert summarise_walk(walk)["knee_strike_times_s"] == [0.5, None]
    assert walk.knee_strikes_s.tolist() == [0.5]


def test_omitting_outputs_does_not_change_the_walk(paper):
    none, energies = run("outputs=[]"), run("outputs=[energies]")
    assert "trajectory" not in none.groups
    whys = [entry["why"] for entry in none.summary["left_out"]]
    assert all(any(output in why for why in whys) for output in ("states", "energies", "forces"))
    assert none.summary["step_periods_s"] == paper.summary["step_periods_s"]
    names = set(energies["trajectory"].variables)
    assert {"time", "kinetic_J", "residual_J"} <= names
    assert not names & {"angle", "normal_force_N"}


def test_walk_without_a_step_can_be_stored(tmp_path):
    content = run(STUMBLE)
    summary = content.summary
    assert summary["outcome"] != "walked"
    assert summary["steps"] == 0
    assert summary["rolling_per_step_m"] is None
    assert summary["step_periods_s"] == []
    assert summary["slip_per_step_m"] is summary["rolling_per_step_m"] is None
    assert len(summary["advice"]) > 20
    artifact.write(tmp_path / "walk.h5", content, Identity("contact-sim", {}, {}, "code"), begin(Config(), {}))
    back = artifact.read(tmp_path / "walk.h5")
    assert back.summary == summary
    stored = back.groups["trajectory"].variables["angle"].values
    np.testing.assert_array_equal(stored, content["trajectory"]["angle"])


def test_straight_legs_that_scuff_on_a_plane_get_advice():
    content = run("contact.terrain=plane", "outputs=[]")
    assert content.summary["outcome"] != "walked"
    assert "contact.terrain: after-mid-swing" in content.summary["advice"]


def test_massless_hip_is_the_limit_of_a_tiny_hip_mass():
    """On this terrain the passing of the feet is an event. At that instant no mass resists a motion of the hip
    alone.
    """
    asked = "start=[-0.126905, 0.092105, -1.065008, -1.176315]", "contact.terrain=after-mid-swing", "strides=1"
    none, little = (run(f"walker.hip_mass_kg={mass}", *asked, "outputs=[]", inputs=()) for mass in (0, 1e-5))
    assert none.summary["outcome"] == little.summary["outcome"] == "walked"
    np.testing.assert_allclose(none.summary["step_periods_s"], little.summary["step_periods_s"], atol=1e-5)
    np.testing.assert_allclose(none.summary["step_lengths_m"], little.summary["step_lengths_m"], atol=1e-5)


def test_walk_from_a_given_start_needs_a_gait_only_for_its_pads():
    """Without a gait, the length by which pads and steps are judged is that of the first step from the start."""
    content = run("start=[-0.2042, 0.1694, -0.6, -0.86]", "contact.pad_pitch=0.3714", "outputs=[]", inputs=())
    assert content.summary["outcome"] == "walked"
    assert content.summary["pitch_m"] == 0.3714


def test_contact_walk_needs_a_gait_or_a_start():
    with pytest.raises(ValueError, match="neither"):
        run(inputs=())


def test_exhausted_budget_gives_no_answer_but_keeps_the_partial_walk(monkeypatch):
    monkeypatch.setattr(contact, "BUDGET_PER_STEP", 1000)
    with pytest.raises(NoAnswer) as caught:
        run()
    partial = caught.value.partial
    assert partial.summary["outcome"] == "budget-exhausted"
    assert 0 < partial.summary["steps"] < 10
    assert partial["steps"]["period_s"].size == partial.summary["steps"]
    assert "rtol" in caught.value.advice


def test_step_without_a_foot_lift_has_no_slip_value(monkeypatch):
    whole = run("strides=1")
    # This is enough for the last touch, but the lift would take hundreds of right-hand sides more.
    monkeypatch.setattr(contact, "BUDGET_PER_STEP", whole.summary["rhs_evaluations"] // 2 + 5)
    cut = run("strides=1")
    first = whole.summary["slips_m"][0]
    assert cut.summary["outcome"] == "walked"
    assert (cut.summary["slips_m"], cut.summary["slip_per_step_m"]) == ([first], first)
    assert len(cut.summary["rolling_m"]) == 1
    np.testing.assert_array_equal(cut["steps"]["slip_m"], [first, np.nan])
    assert np.isfinite(cut["steps"]["touch_time_s"]).all()


def test_energy_balances_when_a_pinned_walker_scuffs_and_falls():
    """From the rigid gait on 3 degrees, the scuffing foot pulls the walker down before the first step."""
    gait = Content({}, {"state": [-0.3233886, 0.2186688, -0.3773739, -1.0923836], "step_length_m": 0.5354454})
    scuffing = ("contact.stance=pinned", "contact.terrain=plane", "slope_deg=3")
    content = run(*scuffing, inputs=(("fixedpoint", gait),))
    assert (content.summary["outcome"], content.summary["steps"]) == ("fell", 0)
    assert content.summary["end_time_s"] == pytest.approx(1.454326, abs=2e-6)
    assert content.summary["energy_balance_residual_J"] < 1e-6
    assert content["trajectory"]["normal_force_N"][:, 0].max() > 100.0


@pytest.mark.parametrize(("atol", "told"), [("1e-7", True), ("1e-9", False)])
def test_tolerance_too_loose_for_friction_is_reported(atol, told):
    class Listener(Silent):
        def note(self, text):
            notes.append(text)

    notes = []
    sets = ("contact.units=si", "contact.stiction_velocity=1e-7", "contact.friction_velocity=1e-6", "strides=1")
    config = load(None, (*sets, f"solver.contact.atol={atol}")).config
    contact_sim.run(restrict(config, PIPELINE["contact-sim"].takes), {"fixedpoint": GAIT}, Listener())
    assert any("stiction_velocity" in note and "lower solver.contact.atol" in note for note in notes) is told


def test_budget_exhausted_before_the_first_sample_gives_no_answer(monkeypatch):
    monkeypatch.setattr(contact, "BUDGET_PER_STEP", 0)
    with pytest.raises(NoAnswer) as caught:
        run()
    assert caught.value.partial["trajectory"]["time"].size == 0


def test_pinned_first_step_lists_its_omissions():
    content = run("contact.stance=pinned", "solver.contact.method=scipy-radau", "strides=1")
    assert content.summary["outcome"] == "walked"
    assert any("pinned" in entry["why"] for entry in content.summary["left_out"])
    # The legs turn about the centre of the ball and are shorter by the radius, so the step is a little faster than the
    # 0.7036 s of the rigid walker.
    assert content.summary["step_periods_s"][0] == pytest.approx(0.7036, abs=1e-3)
    first = content["trajectory"]["time"] < 0.5
    stance_force = content["trajectory"]["normal_force_N"][first, 1]
    assert stance_force.max() < 1e-9  # The hinge carries the walker, not the ground.


def test_equal_configs_give_bitwise_equal_results(paper):
    again = run()
    assert again.summary == paper.summary
    np.testing.assert_array_equal(again["trajectory"]["angle"], paper["trajectory"]["angle"])


def test_mid_step_start_continues_the_whole_walk():
    free = ("contact.terrain=after-mid-swing", "strides=1", "outputs=[]")
    slope = ("slope_rad=0.0525", *free)
    middle = run("start={instant: mid-step, state: [0, 0, 2.0, -0.4]}", *slope, inputs=()).summary
    late = simulate_from([0.0, 0.0, 2.0, -0.4], 0.3, 0.0525)
    end = run(f"start={{instant: mid-step, state: {late}}}", *slope, inputs=()).summary
    assert (middle["outcome"], end["outcome"]) == ("walked", "walked")
    # Between the two starts the feet sink in and slip a little, unlike in the rigid walk.
    assert end["touch_times_s"][0] + 0.3 == pytest.approx(middle["touch_times_s"][0], abs=0.003)
    assert end["step_lengths_m"][0] == pytest.approx(middle["step_lengths_m"][0], abs=0.005)


def simulate_from(state, time_s, slope_rad):
    """Simulate a rigid walk from a state, and return the state at a later time in its first step."""
    config = load(None, [f"slope_rad={slope_rad}", f"start={{instant: mid-step, state: {state}}}"]).config
    walk = simulate.run(restrict(config, PIPELINE["simulate"].takes), {}, Silent()).groups["trajectory"].variables
    place = int(np.searchsorted(walk["time"].values, time_s))
    samples = [walk[name].values[place - 1 : place + 1] for name in ("angle", "velocity")]
    share = (time_s - walk["time"].values[place - 1]) / np.diff(walk["time"].values[place - 1 : place + 1])[0]
    return [float(x) for rows in samples for x in rows[0] + share * (rows[1] - rows[0])]


def test_pad_pitch_has_no_effect_without_pads():
    start = "start=[-0.2042, 0.1694, -0.605819, -0.861041]"
    walks = [
        run(start, "contact.terrain=after-mid-swing", "strides=1", *pitch, inputs=()).summary["touch_times_s"]
        for pitch in ((), ("contact.pad_pitch=0.3",))
    ]
    assert walks[0] == walks[1]
