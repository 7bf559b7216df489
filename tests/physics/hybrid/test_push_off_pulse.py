"""Tests of the push-off on compliant ground: known values, derivatives, energy, and the limit of a rigid impulse."""

from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.motion import foot_wrench
from walkerlab.physics.ground.pulse import pulse_force
from walkerlab.physics.ground.walker import BODY_VECTOR, LOCKED, new_progress, place_on_ground
from walkerlab.physics.hybrid.contact_result import sample_feet
from walkerlab.physics.orbits.contact_map import step_from_section
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.scipy_methods import right_hand_side
from walkerlab.physics.solvers.system import jacobian
from walkerlab.scene.contact import contact_scene, gait_off_pads, start_state
from walkerlab.scene.rigid import rigid_walker

WALK = Tolerances("radau5", 1e-8, 1e-10, 10**7)
TIGHT = Tolerances("radau5", 1e-12, 1e-13, 10**7)

ON_THE_LEVEL = ("slope_deg=0", "push_off.impulse_N_s=0.2", "walker.hip.torque_N_m=0.15")
PUSHED = {
    "level": (), "kneed-level": (), "parts": ON_THE_LEVEL, "kneed-round-feet": ON_THE_LEVEL,
    "torso": ("slope_deg=0", "push_off.impulse_N_s=2"), "round-feet": ("slope_deg=0", "push_off.impulse_N_s=0.12"),
}  # fmt: skip


def scene_of(name, *changes):
    config = load(Path(name), changes).config
    gait = find_gaits(rigid_walker(config, config.equations)).gait
    return config, contact_scene(config, gait.step_length, gait.step_length), gait


def walked(name, *changes, steps=10):
    _, scene, gait = scene_of(name, *changes)
    return scene.walk(start_state(scene, gait.state), steps, WALK, 0.01), gait


def test_paper_compass_walks_on_level_ground_with_short_pulses_only():
    """The push-off is 4 N s on the paper's ground. The expected values come from an independent derivation and
    program.
    """
    short, _ = walked("level", "push_off.duration_s=0.005")
    assert short.outcome is Outcome.WALKED
    assert short.periods_s[0] == pytest.approx(0.70, abs=0.005)
    assert short.periods_s.min() == pytest.approx(0.689, abs=0.001)
    assert short.lengths_m[0] == pytest.approx(0.402, abs=0.0005)
    assert short.lengths_m[-1] == pytest.approx(0.397, abs=0.0005)
    assert walked("level", "push_off.duration_s=0.02")[0].outcome is Outcome.WALKED
    long, _ = walked("level", "push_off.duration_s=0.05")
    assert (long.outcome, long.steps) == (Outcome.OFF_PAD, 7)


def test_pulse_has_the_impulse_of_the_push_off_and_smooth_ends():
    _, scene, _ = scene_of("level")
    system = place_on_ground(scene.walker, (True, True), progress=new_progress(steps=1, last_touch=2.0))
    times = 2.0 + np.linspace(-0.001, 0.006, 70_001)
    force = np.array([pulse_force(system, t, 0) for t in times])
    assert np.trapezoid(force, times) == pytest.approx(4.0, rel=1e-6)
    assert not force[(times < 1.99999) | (times > 2.00501)].any()
    assert np.abs(np.diff(force)).max() < 1e-3 * force.max()
    before_any_touch = place_on_ground(scene.walker, (True, True), progress=new_progress(last_touch=2.0))
    assert pulse_force(before_any_touch, 2.002, 0) == 0.0


@pytest.mark.parametrize("name", PUSHED)
def test_derivatives_during_a_pulse_equal_finite_differences(name):
    _, scene, gait = scene_of(name, *PUSHED[name])
    system = place_on_ground(scene.walker, (False, False), progress=new_progress(steps=1))
    y = np.array(start_state(scene, gait.state))
    J, t = np.zeros((y.size, y.size)), 0.3 * scene.walker.whole.push_off_duration
    jacobian(system, t, y, J)

    def rate(y):
        f = np.zeros(y.size)
        right_hand_side(system, t, y, f)
        return f

    for j in range(y.size):
        h = 1e-5 * np.eye(y.size)[j]
        slope = (8.0 * (rate(y + h) - rate(y - h)) - (rate(y + 2 * h) - rate(y - 2 * h))) / 12e-5
        np.testing.assert_allclose(J[:, j], slope, rtol=1e-6, atol=1e-5)


def test_push_off_force_acts_from_foot_to_hip_without_moment_about_the_hip():
    """The force passes through the hip, so about the hip it exerts no torque on the trailing leg."""
    _, scene, gait = scene_of("level")
    system = place_on_ground(scene.walker, (False, False), progress=new_progress(steps=1))
    form, y = scene.walker.whole, np.array(start_state(scene, gait.state))
    n = int(form.bodies)
    s, c, r = np.sin(y[2 : 2 + n]), np.cos(y[2 : 2 + n]), np.zeros(len(BODY_VECTOR))
    trailing = 0
    along, upward = foot_wrench(system, 0.0025, trailing, s, c, y, r)
    hip_F = c * form.hip_x[:n] - s * form.hip_y[:n]
    hip_U = s * form.hip_x[:n] + c * form.hip_y[:n]
    # Moving the force to the hip does not change the torque on the trailing leg.
    assert r[trailing] == pytest.approx(float(-along * hip_U[trailing] + upward * hip_F[trailing]), abs=1e-9)
    assert upward > 0.0


@pytest.mark.parametrize("name", ["level", "kneed-level", "torso"])
def test_step_derivative_includes_the_start_time_of_the_pulse(name):
    config, _, gait = scene_of(name, *PUSHED[name])
    found = gait_off_pads(config, gait.step_length, gait.state)
    assert found.gait is not None, found.reason
    scene = contact_scene(
        config.model_copy(update={"contact": config.contact.model_copy(update={"terrain": "after-mid-swing"})}),
        gait.step_length,
    )
    z = np.array(found.gait.z)

    def step(z, derived=False):
        taken = step_from_section(scene, TIGHT, z, gait.step_length, derived)
        assert taken.outcome is Outcome.WALKED
        return taken

    DP = step(z, derived=True).DP
    for j in range(z.size):
        h = 3e-6 * np.eye(z.size)[j]
        ends = {k: step(z + k * h).z for k in (-2, -1, 1, 2)}
        slope = (8.0 * (ends[1] - ends[-1]) - (ends[2] - ends[-2])) / (12.0 * h[j])
        np.testing.assert_allclose(DP[:, j], slope, rtol=1e-4, atol=2e-4)


@pytest.mark.parametrize("name", PUSHED)
def test_energy_of_a_pushed_walk_balances(name):
    walk, _ = walked(name, *PUSHED[name], steps=4)
    assert walk.steps == 4
    assert walk.energy_balance_residual_J < walk.explained_residual_J
    assert walk.driven.push_off > 0.0


def at(name, times, *changes, steps=2):
    """Return a walk with samples at these times."""
    _, scene, gait = scene_of(name, *changes)
    start = start_state(scene, gait.state)
    first = scene.walk(start, 1, WALK).touch_time_s[0]
    return scene.walk(start, steps, WALK, first + np.asarray(times))


def test_push_does_its_work_within_its_duration():
    walk = at("level", [-1e-3, 0.0, 1e-4, 2.5e-3, 5e-3, 0.1], "push_off.duration_s=0.005")
    done = walk.samples.driven_J[:, 0]
    assert done[0] == done[1] == 0.0
    assert 0.0 < done[2] < 0.02 * done[3] < 0.02 * done[4]
    assert done[5] == done[4]


def test_trailing_knee_is_released_as_its_push_ends():
    changes = ("push_off.duration_s=0.02", "walker.knee.release=touch")
    walk = at("kneed-level", [-1e-3, 1e-3, 0.0199, 0.0201], *changes)
    trailing = 1
    assert (walk.samples.knees[1:3, trailing] == LOCKED).all()
    assert walk.samples.knees[3, trailing] != LOCKED


def test_pinned_foot_pushes_off_after_its_release():
    walk = at("level", [-1e-3, 1e-5, 6e-3], "contact.stance=pinned")
    before, _, after = walk.samples.driven_J[:, 0]
    assert before == 0.0
    assert after > 0.0


def test_touch_during_a_pulse_ends_it_and_starts_the_next():
    _, scene, gait = scene_of("level", "push_off.impulse_N_s=0.5", "push_off.duration_s=2", "slope_deg=3")
    walk = scene.walk(start_state(scene, gait.state), 3, WALK, 1e-3)
    assert walk.outcome is Outcome.WALKED
    assert walk.energy_balance_residual_J < walk.explained_residual_J
    times, done = walk.samples.time_s, walk.samples.driven_J[:, 0]
    second = walk.touch_time_s[1]
    power = np.gradient(done, times)
    just_before, just_after = (np.searchsorted(times, second + late) for late in (-0.01, 0.01))
    assert abs(power[just_after]) < 1e-2 * abs(power[just_before])


def test_short_pulses_converge_to_the_rigid_impulse_as_the_ground_stiffens():
    """Landing and push-off coincide only for a short pulse. During a longer one the leading foot comes to rest."""
    law, off = load(Path("level")).config.contact, {}
    for factor, durations in ((1.0, (1e-6,)), (100.0, (1e-3, 1e-4, 3e-5))):
        changed = {
            "stiffness": law.stiffness * factor, "damping": law.damping * factor**0.5,
            "full_damping_penetration": law.full_damping_penetration / factor ** (1.0 / law.exponent),
            "stiction_velocity": law.stiction_velocity / factor, "friction_velocity": law.friction_velocity / factor,
        }  # fmt: skip
        changes = [f"contact.{key}={value!r}" for key, value in changed.items()]
        for duration in durations:
            pulse = f"push_off.duration_s={duration!r}"
            walk, gait = walked("level", *changes, "contact.terrain=after-mid-swing", pulse, steps=2)
            off[factor, duration] = abs(walk.periods_s[1] - gait.period)
    assert off[100.0, 3e-5] < 0.1 * off[100.0, 1e-4] < 0.1 * off[100.0, 1e-3]
    assert off[100.0, 3e-5] < 1e-2 * off[1.0, 1e-6]


def test_shorter_pulse_is_advised_and_has_a_gait():
    config, _, gait = scene_of("level", "push_off.impulse_N_s=6")
    lost = gait_off_pads(config, gait.step_length, gait.state)
    assert lost.gait is None
    assert "push_off.duration_s" in lost.advice
    config, _, gait = scene_of("level", "push_off.impulse_N_s=6", "push_off.duration_s=0.001")
    assert gait_off_pads(config, gait.step_length, gait.state).gait.stable


def test_pulse_lasting_beyond_mid_swing_has_no_gait():
    config, _, gait = scene_of("slope-3deg", "push_off.impulse_N_s=0.5", "push_off.duration_s=0.5")
    lost = gait_off_pads(config, gait.step_length, gait.state)
    assert lost.gait is None
    assert "its push-off lasts until the feet pass each other, or longer" in lost.reason
    assert "push_off.duration_s" in lost.advice


def test_bounce_of_the_leading_foot_starts_no_second_pulse():
    """Ground with little damping throws the leading foot up again, but the pulse continues as it began at the first
    touch.

    The pulse also continues after the trailing foot has left the ground: its work is that of the stated force along the
    way.
    """
    bouncing = ("contact.damping=0.2", "contact.terrain=after-mid-swing", "push_off.duration_s=0.05")
    _, scene, gait = scene_of("level", *bouncing, "push_off.impulse_N_s=1")
    start = start_state(scene, gait.state)
    touch = float(scene.walk(start, 1, WALK).touch_time_s[0])
    seen = scene.walk(start, 2, WALK, touch + np.linspace(1e-9, 0.05, 4001)).samples
    leading, trailing = 0, 1
    feet = sample_feet(scene.walker, seen)
    heights, t = feet[:, :, 1], seen.time_s - touch
    assert np.count_nonzero((heights[:-1, leading] > 0.0) & (heights[1:, leading] < 0.0)) >= 1
    assert (heights[:, trailing] > 0.0).mean() > 0.5
    theta, (leg, radius) = seen.states[:, 2 + trailing], (0.999, 0.001)
    line = np.array([-leg * np.sin(theta), radius + leg * np.cos(theta)])
    velocity = np.array([feet[:, trailing, 4], np.gradient(heights[:, trailing], t)])
    u = t / 0.05
    power = 30.0 * (u * (1.0 - u)) ** 2 / 0.05 * (line * velocity).sum(0) / np.linalg.norm(line, axis=0)
    work = np.append(0.0, np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(t)))
    np.testing.assert_allclose(seen.driven_J[:, 0], work, atol=1e-3 * work[-1])


def test_passive_walk_does_not_depend_on_the_pulse_duration():
    (one, _), (other, _) = (walked("slope-3deg", f"push_off.duration_s={d}", steps=2) for d in (0.005, 0.02))
    np.testing.assert_array_equal(one.samples.states, other.samples.states)
