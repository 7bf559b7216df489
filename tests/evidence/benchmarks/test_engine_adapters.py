"""Check every installed engine: its swing converges to ours, and both contact laws carry the right load."""

import importlib
from functools import cache

import numpy as np
import pytest
from engine_scenes import compass, kneed, limping, one_knee

from walkerlab.evidence.benchmarks.engines import runs
from walkerlab.evidence.benchmarks.engines.adapter import Stepping
from walkerlab.evidence.benchmarks.engines.experiments import START_FACTORS, simulate, swing_truth
from walkerlab.evidence.benchmarks.engines.mujoco import model_xml, tune
from walkerlab.evidence.benchmarks.engines.registry import PHYSICS_ENGINES
from walkerlab.evidence.benchmarks.engines.runs import TuningTask, WalkTask, pinned_model
from walkerlab.exchange.engine_scene import contact_target
from walkerlab.exchange.mjcf import inverse_weights
from walkerlab.physics.ground.walker import BENT, LOCKED

SWING_S, COARSE_S = 0.24, 4e-3


@pytest.fixture(params=PHYSICS_ENGINES)
def engine(request):
    entry = PHYSICS_ENGINES[request.param]
    pytest.importorskip(entry.module, reason=f"{entry.name} is not installed: {entry.install_line}")
    return entry


@cache
def free_swing(walker):
    scene = walker()
    n = len(scene.model.chain)
    start = np.array((*scene.start[2 : 2 + n], *scene.start[4 + n :]))
    return scene, start, *swing_truth(scene, start, SWING_S)


def swing(engine, integrator, step_s, tolerance=None, walker=compass):
    scene, start, truth, energy = free_swing(walker)
    stepping = Stepping(integrator, step_s, tolerance)
    end = runs.swing(engine.name, stepping, pinned_model(scene), scene.ours.slope, start, SWING_S, 10_000).end
    return float(np.max(np.abs(end - truth))), abs(energy(end) - energy(start))


@pytest.mark.parametrize("walker", [compass, kneed])
def test_swings_in_an_engine_converge_at_the_stated_order(engine, walker):
    for name, entry in engine.adapter().INTEGRATORS.items():
        if entry.adapts:
            continue
        coarse, fine = (swing(engine, name, h, walker=walker)[0] for h in (COARSE_S, 0.5 * COARSE_S))
        assert np.log2(coarse / fine) == pytest.approx(entry.order, abs=0.2), name


def test_energy_drift_is_bounded_by_the_swing_error(engine):
    for name, entry in engine.adapter().INTEGRATORS.items():
        error, drift = swing(engine, name, 1e-3, 1e-8 if entry.adapts else None)
        # the energy changes by at most 25 kg m^2/s^2 per unit of angle or velocity
        assert drift < 25.0 * error + 1e-12, name


def test_ball_rests_at_the_depth_given_by_the_contact_law(engine):
    target = contact_target(compass())
    for contact in engine.adapter().CONTACTS:
        task = TuningTask(engine.name, contact, target, 1e-4, 1.5)
        assert task.penetration_at_rest() == pytest.approx(target.penetration, rel=2e-3), contact


def test_block_creeps_and_slides_according_to_the_friction_law(engine):
    """Compare with closed forms. The one for a convex friction cone differs, because it lifts a sliding block."""
    target = contact_target(compass())
    for contact in engine.adapter().CONTACTS:
        bench = TuningTask(engine.name, contact, target, 1e-4, 1.5)
        if contact == "sap":
            assert bench.creep(target.penetration) < 1e-3 * target.creep_velocity
            continue
        assert bench.creep(target.penetration) == pytest.approx(target.creep_velocity, rel=1e-3), contact
        assert bench.friction(target.penetration) == pytest.approx(target.friction, rel=1e-2), contact


@pytest.mark.parametrize("locked", [(BENT, BENT), (BENT, LOCKED), (LOCKED, LOCKED)])
def test_mujoco_gives_both_feet_of_a_kneed_walker_the_same_spring(locked):
    mujoco = pytest.importorskip("mujoco")
    scene = kneed().lock_knees(np.array(locked, np.int8))
    own = tune("soft", contact_target(scene))
    model = mujoco.MjModel.from_xml_string(model_xml(scene.model, own))
    assert inverse_weights(scene.model).bodies == pytest.approx(model.body_invweight0[1:, 0], rel=1e-9)
    feet = [model.geom(f"foot {foot}").id for foot in (0, 1)]
    scales = model.body_invweight0[model.geom_bodyid[feet], :1]
    expected = [[-own.settings["stiffness_N_m"], -own.settings["damping_N_s_m"]]] * 2
    assert model.geom_solref[feet] / scales == pytest.approx(np.array(expected), rel=1e-9)
    pairs = [model.pair(f"foot {foot} on floor").id for foot in (0, 1)]
    assert model.pair_solref[pairs] / scales == pytest.approx(np.array(expected), rel=1e-9)


@pytest.mark.parametrize(("walker", "until"), [(kneed, 0.4), (one_knee, 0.6)])
def test_knee_locks_in_an_engine_as_in_walkerlab(engine, walker, until):
    """Compare three parts of the engine's own walk: the swing with a free knee, the lock, and the swing with one body
    less.
    """
    scene = walker()
    truth = simulate(scene, "radau5", 1e-10, 1, until)
    name, entry = max(engine.adapter().INTEGRATORS.items(), key=lambda one: (one[1].adapts, one[1].order))
    stepping = Stepping(name, 5e-3 if entry.adapts else 5e-5, 1e-7 if entry.adapts else None)
    answer = WalkTask(engine.name, stepping, scene, 1, until, None, 50_000).run()
    assert answer.outcome == "walked"
    assert truth.knee_strike_time_s[0] < until < truth.touch_time_s[0]
    shank, thigh = (scene.assembly.index(body) for body in scene.assembly.legs[0][::-1])
    assert answer.end[2 + shank] == answer.end[2 + thigh]
    assert answer.end == pytest.approx(truth.samples.states[1], abs=2e-5)


DRIVES = {
    "nothing": (),
    "a push-off": ("push_off.impulse_N_s=1",),
    "all drives": (
        "push_off.impulse_N_s=1", "push_off.duration_s=0.02", "walker.hip.spring_N_m_per_rad=2",
        "walker.hip.damping_N_m_s_per_rad=0.05", "walker.hip.torque_N_m=0.3",
    ),
}  # fmt: skip


@pytest.mark.parametrize("drives", [*DRIVES, "legs that differ"])
def test_same_contact_law_gives_the_same_walk_in_an_engine(engine, drives):
    """Compare the walk through the first touch. Errors are of first order, with a factor that depends on where in a
    time step the touch falls.
    """
    scene = compass(*DRIVES[drives]) if drives in DRIVES else limping()
    until = 0.8
    truth = simulate(scene, "radau5", 1e-10, 2, until).samples.states[1]
    errors = []
    name = next(name for name, entry in engine.adapter().INTEGRATORS.items() if entry.order > 1)
    # With the coarse step, Drake's method is unstable at the first strike of the limping walker.
    for step in (1.6e-4 if drives in DRIVES else 8e-5, 4e-5):
        task = WalkTask(engine.name, Stepping(name, until / round(until / step)), scene, 2, until, None, 50_000)
        answer = task.run()
        assert answer.outcome == "walked"
        errors.append(float(np.max(np.abs(answer.end - truth))))
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 1e-2


def test_damped_knees_give_the_same_swing_in_an_engine(engine):
    scene = kneed("walker.knee.damping_N_m_s_per_rad=0.02")
    until = 0.2
    truth, undamped = (simulate(each, "radau5", 1e-10, 1, until).samples.states[1] for each in (scene, kneed()))
    name, entry = max(engine.adapter().INTEGRATORS.items(), key=lambda one: (one[1].adapts, one[1].order))
    stepping = Stepping(name, 5e-3 if entry.adapts else 5e-5, 1e-7 if entry.adapts else None)
    end = WalkTask(engine.name, stepping, scene, 1, until, None, 50_000).run().end
    assert end == pytest.approx(truth, abs=2e-5)
    assert np.abs(truth - undamped).max() > 0.01


def test_runs_are_reproducible(engine):
    scene = compass()
    contact, integrator = next(iter(engine.adapter().CONTACTS.items()))
    own = engine.adapter().tune(contact, contact_target(scene))
    ends = []
    for _ in range(2):
        task = WalkTask(
            engine.name, Stepping(integrator, 2e-4), scene.scale_start(START_FACTORS[-1]), 1, 10.0, own, 6_000
        )
        ends.append(task.run())
    assert ends[0].touches_s.tolist() == ends[1].touches_s.tolist()
    assert ends[0].steps == ends[1].steps


def test_adapter_does_not_import_its_engine(engine):
    module = importlib.import_module(f"walkerlab.evidence.benchmarks.engines.{engine.name}")
    assert not any(getattr(value, "__name__", "").split(".")[0] == engine.module for value in vars(module).values())
