"""Tests of the models that engines get, and of the way their walks are judged. No engine is needed."""

from pathlib import Path

import numpy as np
import pytest
from engine_scenes import compass, kneed

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.evidence.benchmarks.engines.experiments import simulate
from walkerlab.evidence.benchmarks.engines.follow import RuleFollower, crossing
from walkerlab.evidence.benchmarks.engines.runs import pinned_model
from walkerlab.evidence.benchmarks.engines.stage import supported_scene
from walkerlab.exchange.engine_scene import CREEP_LOAD, contact_target
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.friction import friction_coefficient
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import BENT, LOCKED
from walkerlab.physics.hybrid.contact_result import walk_contact
from walkerlab.physics.mechanics.hinges import HIP_ROW, hinge_law
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.run.executor import answer_in_memory


@pytest.fixture(params=[(), ("contact.terrain=after-mid-swing",)], ids=["pads", "after-mid-swing"])
def scene(request):
    return compass(*request.param)


def our_samples(scene, interval_s, steps):
    """Return our walk, sampled as by an engine with a time step of `interval_s`."""
    result = simulate(scene, "radau5", 1e-9, steps, interval_s)
    return result, result.samples


def test_engine_coordinates_survive_a_round_trip(scene):
    q, v = scene.from_base(scene.start)
    assert scene.about_centre(q, v) == pytest.approx(scene.start, abs=1e-14)


def test_total_mass_and_its_centre_are_preserved(scene):
    model = scene.model
    assert sum(link.mass_kg for link in model.links) == pytest.approx(20.0)
    hip_leg = model.links[0]
    # The 10 kg are at the hip, and 5 kg half a metre below it.
    assert hip_leg.centre_m == pytest.approx((0.0, -0.5 * 5.0 / 15.0))
    assert hip_leg.inertia_kg_m2 == pytest.approx(5.0 * 10.0 / 15.0 * 0.25)


def test_locked_leg_is_one_body_and_released_leg_is_two():
    scene = kneed()
    stance, *swing = scene.model.links
    assert [link.name for link in swing] == ["thigh 1", "shank 1"]
    assert scene.knee_indices == (4, -1)
    # The hip has 0.5 kg. Below it are the thigh (0.5 kg, at 0.325 m) and the shank (0.05 kg, at 0.625 m).
    centre = -(0.5 * 0.325 + 0.05 * 0.625) / 1.05
    about_hip = 0.5 * 0.325**2 + 0.05 * 0.625**2
    assert stance.mass_kg == pytest.approx(1.05)
    assert stance.centre_m == pytest.approx((0.0, centre))
    assert stance.inertia_kg_m2 == pytest.approx(about_hip - 1.05 * centre**2)
    assert scene.model.balls[1].centre_m[1] == pytest.approx(-1.0)


def test_feet_ahead_of_the_shanks_keep_their_offset_in_an_engine():
    config = load(Path("kneed"), ["walker.foot_centre_ahead_m=0.03", "walker.foot_radius_m=0.2"]).config
    gait = answer_in_memory(config, "fixedpoint", MemoryResults()).summary
    scene = supported_scene(config, gait["step_length_m"], tuple(gait["state"]))
    bent, straight = (scene.model.balls[foot] for foot in (0, 1))
    # The foot is given in the frame of the shank for the swing leg, and of the thigh for the stance leg, which is one
    # link.
    assert bent.centre_m == pytest.approx((0.03, 0.2 - 0.5))
    assert straight.centre_m == pytest.approx((0.03, 0.2 - 1.0))
    assert {ball.radius_m for ball in (bent, straight)} == {0.2}


def test_point_foot_next_to_a_round_one_is_refused_with_a_radius_that_works():
    """Engines have one floor for both feet, but a point foot would need a lower one."""
    point = load(None, ("walker.foot_radius_m=0.02", "walker.leg_2={foot_radius_m: 0}")).config
    with pytest.raises(ConfigError, match="small ball replaces the point foot") as caught:
        supported_scene(point, 0.37, (-0.2042, 0.1694, -0.6058, -0.861))
    assert "0.0005 m" in caught.value.advice
    small = load(None, ("walker.foot_radius_m=0.02", "walker.leg_2={foot_radius_m: 0.0005}")).config
    scene = supported_scene(small, 0.37, (-0.2042, 0.1694, -0.6058, -0.861))
    assert [ball.ground_m for ball in scene.model.balls] == [0.0, 0.0]


@pytest.mark.parametrize("doing", [(BENT, BENT), (LOCKED, BENT), (LOCKED, LOCKED)])
def test_engine_coordinates_of_a_kneed_walker_survive_a_round_trip(doing):
    scene = kneed().lock_knees(np.array(doing, np.int8))
    y = np.array(scene.start)
    for knee in scene.locked:
        shank, thigh = (scene.assembly.index(body) for body in (knee.shank, knee.thigh))
        for first in (2, 8):
            y[first + shank] = y[first + thigh]
    q, v = scene.from_base(tuple(y))
    assert len(q) == scene.model.size == 6 - len(scene.locked)
    assert scene.about_centre(q, v) == pytest.approx(y, abs=1e-14)


def knees_seen(scene):
    """Return our walk of two steps, what the rules record of it, and each change of a knee: its time, and the
    coordinates before and after.
    """
    result, samples = our_samples(scene, 1e-4, 2)
    rules, changes = RuleFollower(scene, 2, *scene.from_base(scene.start)), []
    for time_s, y in zip(samples.time_s[1:].tolist(), samples.states[1:], strict=True):
        q, v = rules.scene.from_base(tuple(y))
        q[np.abs(q) < 1e-12] = 0.0  # A knee that has just locked is straight up to rounding.
        before = rules.scene.knee_indices
        rules.follow(time_s, q, v)
        if rules.turn is not None:
            rules.watches = False
            rules.follow(time_s, q, v)
            rules.watches = True
        if rules.turn is not None or rules.is_outdated:
            rules.go_on(q, v)
        if rules.scene.knee_indices != before:
            changes.append((time_s, before, rules.scene.knee_indices))
    return result, rules, changes


def test_knees_lock_and_release_in_engines_as_in_the_contact_walk():
    result, rules, changes = knees_seen(kneed())
    # The swing knee locks. Then the trailing knee is released, and later it locks.
    assert [places for _, _, places in changes] == [(-1, -1), (-1, 4), (-1, -1)]
    assert changes[0][0] == pytest.approx(result.knee_strike_time_s[0], abs=1e-4)
    assert 0.0 < changes[1][0] - result.touch_time_s[0] < 2e-3
    assert changes[2][0] == pytest.approx(result.knee_strike_time_s[1], abs=1e-4)
    # Within the step that the cubic spans, the ground stops the foot: it decelerates from 0.4 m/s at about 2000 m/s^2.
    assert rules.walk_state.touch_time[:1] == pytest.approx(result.touch_time_s[:1], abs=1e-5)


def test_knee_released_by_a_touch_is_free_from_the_next_solver_step():
    result, _, changes = knees_seen(kneed("walker.knee={release: touch}"))
    time_s, before, after = changes[1]
    assert 0.0 <= time_s - result.touch_time_s[0] < 1e-4
    assert (before, after) == ((-1, -1), (-1, 4))


def test_knee_held_during_a_push_is_released_at_its_end():
    push = ("push_off.impulse_N_s=0.05", "push_off.duration_s=0.02")
    for rule in ("touch", "compression"):
        result, _, changes = knees_seen(kneed(*push, f"walker.knee={{release: {rule}}}"))
        time_s, before, after = changes[1]
        assert time_s - result.touch_time_s[0] == pytest.approx(0.02, abs=1.5e-4)
        assert (before, after) == ((-1, -1), (-1, 4))


DRIVEN = ("push_off.impulse_N_s=1", "walker.hip.spring_N_m_per_rad=2", "walker.hip.torque_N_m=0.3")


def test_drive_forces_do_the_same_work_as_in_the_contact_walk():
    """Compare the work over the first twentieth of a second after the first touch."""
    scene = compass(*DRIVEN)
    tight = Tolerances("radau5", 1e-9, 1e-11, 10**6)
    result = walk_contact(scene.ours, scene.ground, False, STANCE_FOOT, scene.start, tight, 2, 1e-5)
    samples = result.samples
    rules = RuleFollower(scene, 2, *scene.from_base(scene.start), carries=False)
    begin, end = (int(np.searchsorted(samples.time_s, result.touch_time_s[0] + late)) for late in (1e-4, 0.05))
    progress = rules.walk_state.progress
    progress.stance, progress.steps, progress.last_touch = 0, 1, result.touch_time_s[0]
    powers = []
    for i in range(begin, end + 1):
        q, v = scene.from_base(tuple(samples.states[i]))
        powers.append(float(rules.probe.forces(float(samples.time_s[i]), q, v) @ v))
    elastic = 0.5 * hinge_law(scene.ours.whole, HIP_ROW).stiffness * (samples.states[:, 3] - samples.states[:, 2]) ** 2
    given = samples.driven_J[end].sum() - samples.driven_J[begin].sum() + elastic[begin] - elastic[end]
    assert np.trapezoid(powers, samples.time_s[begin : end + 1]) == pytest.approx(given, rel=1e-5)


def test_torso_and_compliant_knee_stop_are_rejected():
    with pytest.raises(ConfigError, match="compliant stop"):
        kneed("walker.knee={lock: compliant}")
    with pytest.raises(ConfigError, match="torso"):
        kneed("walker.torso={mass_kg: 1.0, above_hip_m: 0.1}")


def test_pinned_walker_hangs_from_its_stance_foot(scene):
    model = pinned_model(scene)
    assert model.freedoms == ("turn",)
    assert model.links[0].point_m == scene.assembly.feet[STANCE_FOOT].centre_m
    assert model.chain.tolist() == [[1.0, 1.0], [1.0, 0.0]]


def test_ground_forces_do_the_work_measured_at_the_feet(scene):
    """Compare the power of the generalised forces with that of the contact forces at the points where they act."""
    _, samples = our_samples(scene, 0.05, 3)
    for i in range(1, 20):
        q, v = scene.from_base(tuple(samples.states[i]))
        rules = RuleFollower(scene, 3, *scene.from_base(scene.start))
        rules.walk_state.has_ground[:] = samples.has_ground[i]
        forces = rules.probe.forces(0.0, q, v).copy()
        law, friction = scene.ours.normal, scene.ours.friction
        power = 0.0
        for foot, (_, height, slip, vertical_velocity) in enumerate(rules.probe.feet(q, v)):
            if height < 0.0 and samples.has_ground[i, foot]:
                depth = -height
                share = min(1.0, depth / law.full_damping_penetration)
                damping = law.damping * share**2 * (3.0 - 2.0 * share)
                normal = max(0.0, law.stiffness * depth**law.exponent - damping * vertical_velocity)
                power += normal * (vertical_velocity + friction_coefficient(friction, slip)[0] * slip)
        assert forces @ v == pytest.approx(power, rel=1e-9, abs=1e-9)


def test_touches_and_slip_in_engines_are_judged_as_in_the_contact_walk(scene):
    result, samples = our_samples(scene, 1e-4, 4)
    rules = RuleFollower(scene, 4, *scene.from_base(scene.start))
    for time_s, y in zip(samples.time_s[1:], samples.states[1:], strict=True):
        rules.follow(float(time_s), *scene.from_base(tuple(y)))
    seen = rules.walk_state.touch_time[:3]
    # Within the step that the cubic spans, the ground stops the foot: it decelerates from 0.27 m/s at about 700 m/s^2.
    bound = 700.0 * 1e-4**2 / (8.0 * 0.27)
    assert seen == pytest.approx(result.touch_time_s[:3], abs=bound)
    assert rules.walk_state.touch_along[:3] == pytest.approx(result.touch_along_m[:3], abs=bound)
    assert rules.walk_state.slip[:3] == pytest.approx(result.slip_m[:3], abs=bound)


def test_walk_with_nan_states_counts_as_solver_failure(scene):
    q, v = scene.from_base(scene.start)
    rules = RuleFollower(scene, 4, q, v)
    rules.follow(1e-3, np.full_like(q, np.nan), v)
    assert rules.outcome is Outcome.SOLVER_FAILED


def test_walker_whose_hip_is_too_low_counts_as_fallen(scene):
    q, v = scene.from_base(scene.start)
    rules = RuleFollower(scene, 4, q, v)
    rules.follow(1e-3, q - np.array((0.0, 0.6, 0.0, 0.0)), v)
    assert rules.outcome is Outcome.FELL


def test_touch_time_is_interpolated_by_a_cubic_between_solver_steps():
    h, touch = 0.1, 0.037

    def height(t):
        return (touch - t) * (1.0 + t + 3.0 * t * t)

    def velocity(t):
        return -(1.0 + t + 3.0 * t * t) + (touch - t) * (1.0 + 6.0 * t)

    assert h * crossing(height(0.0), velocity(0.0), height(h), velocity(h), h) == pytest.approx(touch, abs=1e-15)


def test_engine_contact_is_tuned_to_match_our_force_law_at_the_weight_of_the_walker():
    scene = compass()
    target = contact_target(scene)
    law = scene.ours.normal
    assert law.stiffness * target.penetration**law.exponent == pytest.approx(20.0 * scene.ours.gravity_down)
    assert target.damping_ratio == pytest.approx(3.714, abs=1e-3)
    assert -friction_coefficient(scene.ours.friction, target.creep_velocity)[0] == pytest.approx(CREEP_LOAD)


def test_frictionless_ground_needs_no_tuning():
    assert contact_target(compass("contact.friction=none")) is None
